// The talks of the dialects, and what their texts have in common. Private to wire.
#pragma once

#include <charconv>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "weldcell/wire/laser_setup.hpp"

namespace weldcell::wire {

/// Micro-Epsilon's commands with the prompt "->": optoNCDT 2300 and 1220/1320/1420, confocalDT, C-Box.
std::unique_ptr<LaserSetup> prompt_talk(const LaserWanted& wanted);
/// "$XXX" commands: capaNCDT, combiSENSOR, IF1032/ETH.
std::unique_ptr<LaserSetup> dollar_talk(const LaserWanted& wanted);
/// "+++ CR ILD1" words of the optoNCDT 1402, in the stream of readings.
std::unique_ptr<LaserSetup> ild1402_talk(const LaserWanted& wanted);
/// UDP reads and writes of the OD5000.
std::unique_ptr<LaserSetup> od5000_talk(const LaserWanted& wanted);

/// Without what cannot stand in a message, and no longer than one.
std::string readable(const std::string& text);
/// As a message shows it.
std::string number_text(double value);

inline std::string_view trimmed(std::string_view text) {
  const auto blank = [](char c) { return c == ' ' || c == '\r' || c == '\n' || c == '\t' || c == '\0'; };
  while (!text.empty() && blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && blank(text.back())) text.remove_suffix(1);
  return text;
}

/// The number at the beginning of the text, blanks before it skipped.
inline std::optional<double> number_at(std::string_view text) {
  text = trimmed(text);
  double out = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), out);
  if (error != std::errc{} || end == text.data() || !(out > -1e12 && out < 1e12)) return std::nullopt;
  return out;
}

/// What stands behind `label` on its line; nothing where no line begins with it.
inline std::optional<std::string> line_after(const std::string& text, std::string_view label) {
  for (std::size_t at = 0; at < text.size();) {
    std::size_t end = text.find('\n', at);
    if (end == std::string::npos) end = text.size();
    const std::string_view line = trimmed(std::string_view(text).substr(at, end - at));
    if (line.substr(0, label.size()) == label) return std::string(trimmed(line.substr(label.size())));
    at = end + 1;
  }
  return std::nullopt;
}

}  // namespace weldcell::wire
