#include "weldcell/files/cell_migration.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>

#include "files/text_lines.hpp"

namespace weldcell::files {
namespace {

constexpr CellChange kChanges[] = {
    {1, CellChange::Kind::State, "jobs.unsigned", "accept", "as before version 1"},
};

Error cannot(const std::string& name, std::string what, std::string mend) {
  return {"cell.migrate", name, std::move(what), std::move(mend)};
}

struct Place {
  std::string section, key;
  explicit Place(const std::string& dotted) {
    const std::size_t dot = dotted.find('.');
    section = dot == std::string::npos ? "" : dotted.substr(0, dot);
    key = dot == std::string::npos ? dotted : dotted.substr(dot + 1);
  }
};

int line_of(const Node& map, const std::string& key) {
  const auto at = std::ranges::find(map.keys, key, &Node::Key::text);
  return at == map.keys.end() ? 0 : at->line;
}

/// The mapping that a key stands in; nullptr when its section is absent.
const Node* map_of(const Node& document, const Place& place) {
  if (place.section.empty()) return &document;
  const Node* section = document.find(place.section);
  return section != nullptr && section->kind == Node::Kind::Map ? section : nullptr;
}

class Migration {
 public:
  Migration(const std::string& text, std::string name) : name_(std::move(name)), lines_(text) {}

  Status read() {
    auto parsed = parse_document(lines_.text(), name_);
    if (const auto* faults = std::get_if<Faults>(&parsed))
      return cannot("", files::text(*faults), "mend it first, then migrate");
    document_ = std::get<Node>(std::move(parsed));
    return Done{};
  }
  const Node& document() const { return document_; }

  /// The top is no mapping in braces.
  Status one_key_a_line() const {
    const int line = line_of(document_, "cell");
    if (!lines_.starts_with_key(line, "cell") || !lines_.indent(line).empty()) return not_alone(line, "cell");
    return Done{};
  }

  Status state_version(int version) {
    const std::string line = fmt::format("version: {}", version);
    if (const int at = line_of(document_, "version"); at > 0) return replace_value(at, "version", line);
    return insert_before(line_of(document_, "cell"), line);
  }

  Status apply(const CellChange& change) {
    const Place from(change.key);
    const Node* map = map_of(document_, from);
    const int line = map == nullptr ? 0 : line_of(*map, from.key);
    if (change.kind == CellChange::Kind::State)
      return line > 0 ? Status(Done{}) : state(from, map, change.to, change.why);
    if (line == 0) return Done{};
    if (change.kind == CellChange::Kind::Drop) return drop(line, from, map->find(from.key), change.why);
    const Place to(change.to);
    if (line_of(*map, to.key) > 0)
      return cannot(fmt::format("{}:{}", name_, line),
                    fmt::format("{} stands beside {}, its new name", change.key, change.to),
                    "remove one of the two");
    if (!lines_.replace_word(line, from.key, to.key)) return not_alone(line, change.key);
    words_.push_back(fmt::format("{} is {} now", change.key, change.to));
    return read();
  }

  const TextLines& lines() const { return lines_; }
  std::vector<std::string> take_words() { return std::move(words_); }

 private:
  Error not_alone(int line, const std::string& key) const {
    return cannot(fmt::format("{}:{}", name_, line), key + " does not stand alone on its line",
                  "write one key a line, then migrate");
  }
  Status replace_value(int line, const char* key, const std::string& with) {
    if (!lines_.starts_with_key(line, key)) return not_alone(line, key);
    lines_.replace_before_comment(line, with);
    words_.push_back(with);
    return read();
  }
  Status insert_before(int line, const std::string& what) {
    lines_.insert(line, what);
    words_.push_back(what);
    return read();
  }
  Status state(const Place& place, const Node* map, const std::string& value, const std::string& why) {
    if (map == nullptr && document_.find(place.section) != nullptr)
      return cannot(name_, place.section + " is no section with keys", "write one key a line, then migrate");
    const std::string key = fmt::format("{}: {}  # {}", place.key, value, why);
    if (map == nullptr) {
      lines_.append({place.section + ":", "  " + key});
    } else {
      const int head = line_of(document_, place.section);
      const int first = map->keys.empty() ? 0 : map->keys.front().line;
      if (first <= head || !lines_.starts_with_key(first, map->keys.front().text))
        return not_alone(head, place.section);
      lines_.insert(head + 1, lines_.indent(first) + key);
    }
    words_.push_back(fmt::format("{}.{}: {}, {}", place.section, place.key, value, why));
    return read();
  }
  Status drop(int line, const Place& place, const Node* value, const std::string& why) {
    const bool plain = value != nullptr && value->kind == Node::Kind::Scalar && value->line == line;
    if (!plain || !lines_.starts_with_key(line, place.key)) return not_alone(line, place.key);
    lines_.comment_out(line, why);
    words_.push_back(fmt::format("{} is gone: {}", place.key, why));
    return read();
  }

  std::string name_;
  TextLines lines_;
  Node document_;
  std::vector<std::string> words_;
};

}  // namespace

std::span<const CellChange> cell_changes() { return kChanges; }

Result<int> cell_version(const Node& document) {
  const Node* node = document.find("version");
  if (node == nullptr) return 0;
  int version = -1;
  const std::string& text = node->text;
  const auto [end, fault] = std::from_chars(text.data(), text.data() + text.size(), version);
  if (node->kind != Node::Kind::Scalar || fault != std::errc{} || end != text.data() + text.size() ||
      version < 0)
    return Error{"cell.version", "version", "is " + node->describe(),
                 fmt::format("write version: {}", kCellVersion)};
  return version;
}

Result<MigratedCell> migrate_cell(const std::string& text, const std::string& name,
                                  std::span<const CellChange> changes) {
  Migration migration(text, name);
  if (auto read = migration.read(); !read.ok()) return read.error();
  if (file_kind(migration.document()) != FileKind::Cell)
    return cannot(name, "is no cell file", "only these have versions");
  const auto version = cell_version(migration.document());
  if (!version.ok()) {
    Error error = version.error();
    error.where = fmt::format("{}:{}: version", name, line_of(migration.document(), "version"));
    return error;
  }
  int newest = kCellVersion;
  for (const CellChange& change : changes) newest = std::max(newest, change.version);
  if (*version > newest)
    return Error{"cell.version",
                 fmt::format("{}:{}: version", name, line_of(migration.document(), "version")),
                 fmt::format("{} is newer than what this weldcell reads, {}", *version, newest),
                 "install the weldcell that wrote it, or take the backup that its migration kept"};
  MigratedCell out;
  out.from = *version;
  out.text = text;
  if (*version == newest) return out;
  if (auto plain = migration.one_key_a_line(); !plain.ok()) return plain.error();
  for (const CellChange& change : changes) {
    if (change.version <= *version) continue;
    if (auto applied = migration.apply(change); !applied.ok()) return applied.error();
  }
  if (auto stated = migration.state_version(newest); !stated.ok()) return stated.error();
  out.text = migration.lines().text();
  out.diff = migration.lines().diff();
  out.words = migration.take_words();
  return out;
}

}  // namespace weldcell::files
