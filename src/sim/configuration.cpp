#include "sim/configuration.hpp"

#include <algorithm>
#include <cctype>

namespace weldcell::sim {

namespace {

std::string lower_case(std::string_view text) {
  std::string out(text);
  for (char& c : out) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return out;
}

std::string_view trimmed(std::string_view text) {
  const std::size_t begin = text.find_first_not_of(" \t\r");
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(" \t\r") - begin + 1);
}

/// The next word or quoted text, taken off the front.
std::string take_word(std::string_view& text) {
  text = trimmed(text);
  const bool quoted = !text.empty() && text.front() == '"';
  if (quoted) text.remove_prefix(1);
  const std::size_t end = std::min(quoted ? text.find('"') : text.find_first_of(" \t"), text.size());
  std::string out(text.substr(0, end));
  text.remove_prefix(std::min(text.size(), end + (quoted ? 1 : 0)));
  text = trimmed(text);
  return out;
}

bool begins_key(std::string_view text) {
  return text.size() > 1 && text[0] == '-' && std::isalpha(static_cast<unsigned char>(text[1]));
}

Result<ConfigurationRow> row_of(std::string_view text, int line) {
  ConfigurationRow out;
  while (!text.empty()) {
    if (!begins_key(text))
      return Error{"configuration.syntax", "line " + std::to_string(line), "'-Key' expected", "see the row"};
    const std::string key = take_word(text).substr(1);
    out.attributes.emplace_back(key, text.empty() || begins_key(text) ? "TRUE" : take_word(text));
  }
  return out;
}

}  // namespace

std::string ConfigurationRow::value(const std::string& attribute) const {
  for (const auto& [key, text] : attributes) {
    if (lower_case(key) == lower_case(attribute)) return text;
  }
  return "";
}

std::string ConfigurationRow::name() const { return value("name"); }

Result<Configuration> parse_configuration(std::string_view text) {
  Configuration out;
  std::string topic, type, row;
  int number = 0;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    std::string_view line = trimmed(text.substr(0, end));
    text.remove_prefix(std::min(text.size(), end + 1));
    ++number;
    if (line.empty() || line.front() == '#') continue;
    if (topic.empty()) {
      topic = std::string(line.substr(0, line.find(':')));
      if (line.find(":CFG_") != topic.size())
        return Error{"configuration.syntax", "line 1", "no header like SIO:CFG_1.0:6:0::", "see the file"};
      continue;
    }
    const bool goes_on = line.back() == '\\';
    if (goes_on) line.remove_suffix(1);
    if (row.empty() && line.back() == ':' && !begins_key(line)) {
      type = std::string(line.substr(0, line.size() - 1));
      continue;
    }
    row += std::string(row.empty() ? "" : " ") + std::string(line);
    if (goes_on) continue;
    auto read = row_of(row, number);
    if (!read.ok()) return read.error();
    if (type.empty())
      return Error{"configuration.syntax", "line " + std::to_string(number), "a row before its type",
                   "see it"};
    out[topic][type].push_back(std::move(*read));
    row.clear();
  }
  if (!row.empty())
    return Error{"configuration.syntax", "line " + std::to_string(number), "the last row goes on", "end it"};
  return out;
}

void add_rows(Configuration& to, const Configuration& rows) {
  for (const auto& [topic, types] : rows) {
    for (const auto& [type, list] : types) {
      auto& own = to[topic][type];
      for (const ConfigurationRow& row : list) {
        std::erase_if(own, [&row](const ConfigurationRow& old) { return old.name() == row.name(); });
        own.push_back(row);
      }
    }
  }
}

const ConfigurationRow* find_row(const Configuration& in, const std::string& topic, const std::string& type,
                                 const std::string& name) {
  const auto types = in.find(topic);
  if (types == in.end()) return nullptr;
  const auto rows = types->second.find(type);
  if (rows == types->second.end()) return nullptr;
  const auto row =
      std::ranges::find_if(rows->second, [&](const ConfigurationRow& r) { return r.name() == name; });
  return row == rows->second.end() ? nullptr : &*row;
}

Configuration default_configuration(const std::string& egm_address, int egm_port) {
  Configuration out;
  for (const char* name : {"ROB_1", "weldcell"}) {
    out["SIO"]["COM_TRP"].push_back({{{"Name", name},
                                      {"Type", "UDPUC"},
                                      {"RemoteAdress", egm_address},
                                      {"RemotePortNumber", std::to_string(egm_port)}}});
  }
  for (const char* name : {"default", "weldcell"}) {
    out["MOC"]["EXT_MOTION_DATA"].push_back({{{"name", name}, {"ext_motion_level", "0"}}});
  }
  return out;
}

}  // namespace weldcell::sim
