// Options of a sub-command: --name value, --flag and plain arguments, refused in words when unknown.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "app/commands.hpp"

namespace weldcell::app {

class CommandLine {
 public:
  /// `usage` is what --help prints. Names in `valued` take a value, those in `flags` none.
  CommandLine(Arguments arguments, std::string usage, std::vector<std::string> valued,
              std::vector<std::string> flags);

  /// Set when the command must end at once: 0 after --help, 2 after a fault (already told on stderr).
  std::optional<int> exit_code() const { return exit_code_; }
  bool has(const std::string& name) const { return values_.count(name) > 0; }
  std::string value(const std::string& name, const std::string& otherwise = {}) const;
  /// Every value of an option given several times.
  std::vector<std::string> all(const std::string& name) const;
  /// Empty, with the fault told and exit_code() set, when the value is no number.
  std::optional<double> number(const std::string& name, double otherwise);
  const std::vector<std::string>& plain() const { return plain_; }
  /// Tells "<what>" and the way to --help; returns 2.
  int refuse(const std::string& what) const;

 private:
  std::string usage_;
  std::multimap<std::string, std::string> values_;
  std::vector<std::string> plain_;
  std::optional<int> exit_code_;
};

}  // namespace weldcell::app
