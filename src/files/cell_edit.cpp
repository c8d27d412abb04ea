#include "weldcell/files/cell_edit.hpp"

#include <algorithm>

#include "files/text_lines.hpp"
#include "weldcell/files/document.hpp"

namespace weldcell::files {
namespace {

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::size_t from = 0;
  while (from < text.size()) {
    const std::size_t end = std::min(text.find('\n', from), text.size());
    lines.push_back(text.substr(from, end - from));
    from = end + 1;
  }
  return lines;
}

std::string replaced(const std::string& line, const std::string& key, const std::string& value) {
  const std::size_t comment = comment_at(line);
  std::string out = line.substr(0, line.find(key)) + key + ": " + value;
  if (comment == std::string::npos) return out;
  out.append(out.size() < comment ? comment - out.size() : 1, ' ');
  return out + line.substr(comment);
}

bool one_line(const Node& node, const std::string& line) {
  if (node.kind == Node::Kind::Scalar) return true;
  const std::string body = line.substr(0, comment_at(line));
  return std::count(body.begin(), body.end(), '{') == std::count(body.begin(), body.end(), '}') &&
         body.find('{') != std::string::npos;
}

}  // namespace

Result<std::string> with_keys(const std::string& text, const std::string& section,
                              const std::vector<std::pair<std::string, std::string>>& values) {
  const auto refuse = [&](std::string what, std::string mend) {
    return Error{"cell.edit", section, std::move(what), std::move(mend)};
  };
  const auto parsed = parse_document(text, "cell file");
  if (const auto* faults = std::get_if<Faults>(&parsed)) return refuse(files::text(*faults), "");
  const Node& document = std::get<Node>(parsed);
  const Node* map = document.find(section);
  if (map == nullptr || map->kind != Node::Kind::Map || map->keys.empty())
    return refuse("the section is not there", "write it first");
  std::vector<std::string> lines = lines_of(text);
  const auto first = static_cast<std::size_t>(map->keys.front().line - 1);
  const std::size_t indent = lines[first].find_first_not_of(' ');
  if (indent == std::string::npos ||
      lines[first].compare(indent, map->keys.front().text.size(), map->keys.front().text) != 0) {
    return refuse("the section is written in braces", "write one key a line");
  }
  std::size_t behind = first;
  for (const auto& [key, value] : values) {
    const auto at =
        std::find_if(map->keys.begin(), map->keys.end(), [&](const auto& k) { return k.text == key; });
    if (at == map->keys.end()) continue;
    const auto line = static_cast<std::size_t>(at->line - 1);
    if (!one_line(map->items[static_cast<std::size_t>(at - map->keys.begin())], lines[line]))
      return refuse(key + " goes over several lines", "write it on one line");
    lines[line] = replaced(lines[line], key, value);
    behind = std::max(behind, line);
  }
  for (const auto& [key, value] : values) {
    if (map->find(key) != nullptr) continue;
    lines.insert(lines.begin() + static_cast<std::ptrdiff_t>(++behind),
                 std::string(indent, ' ') + key + ": " + value);
  }
  std::string out;
  for (const std::string& line : lines) out += line + "\n";
  return out;
}

}  // namespace weldcell::files
