#include "app/command_line.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "weldcell/files/schema.hpp"

namespace weldcell::app {

CommandLine::CommandLine(Arguments arguments, std::string usage, std::vector<std::string> valued,
                         std::vector<std::string> flags)
    : usage_(std::move(usage)) {
  const auto knows = [](const std::vector<std::string>& names, const std::string& name) {
    return std::find(names.begin(), names.end(), name) != names.end();
  };
  for (std::size_t i = 0; i < arguments.size(); ++i) {
    const std::string argument = arguments[i];
    if (argument == "--help" || argument == "-h") {
      std::fputs(usage_.c_str(), stdout);
      exit_code_ = 0;
      return;
    }
    if (!argument.starts_with("--")) {
      plain_.push_back(argument);
    } else if (knows(flags, argument.substr(2))) {
      values_.emplace(argument.substr(2), "");
    } else if (knows(valued, argument.substr(2))) {
      if (i + 1 >= arguments.size()) {
        exit_code_ = refuse(argument + " wants a value");
        return;
      }
      values_.emplace(argument.substr(2), arguments[++i]);
    } else {
      std::vector<std::string> known = valued;
      known.insert(known.end(), flags.begin(), flags.end());
      const std::string near = files::nearest_word(argument.substr(2), known);
      exit_code_ = refuse("unknown option '" + argument + "'" +
                          (near.empty() ? "" : ": did you mean '--" + near + "'?"));
      return;
    }
  }
}

std::string CommandLine::value(const std::string& name, const std::string& otherwise) const {
  const auto it = values_.find(name);
  return it == values_.end() ? otherwise : it->second;
}

std::vector<std::string> CommandLine::all(const std::string& name) const {
  std::vector<std::string> out;
  const auto [first, last] = values_.equal_range(name);
  for (auto it = first; it != last; ++it) out.push_back(it->second);
  return out;
}

std::optional<double> CommandLine::number(const std::string& name, double otherwise) {
  if (!has(name)) return otherwise;
  const std::string text = value(name);
  char* end = nullptr;
  const double number = std::strtod(text.c_str(), &end);
  if (end == text.c_str() || *end != '\0' || !std::isfinite(number)) {
    exit_code_ = refuse("--" + name + " wants a number, not '" + text + "'");
    return std::nullopt;
  }
  return number;
}

int CommandLine::refuse(const std::string& what) const {
  std::fprintf(stderr, "%s; try --help\n", what.c_str());
  return 2;
}

}  // namespace weldcell::app
