// YAML text -> a plain tree that knows its lines. Limits on size, depth and nodes; no anchors, aliases or
// tags. No file.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "weldcell/files/fault.hpp"

namespace weldcell::files {

/// Bounds for every file a user gives us; more than any honest cell, job or workpiece needs.
inline constexpr std::size_t kMaxFileBytes = 1'000'000;
inline constexpr int kMaxDepth = 16;
inline constexpr std::size_t kMaxNodes = 200'000;

struct Node {
  enum class Kind { Null, Scalar, Sequence, Map };
  struct Key {
    std::string text;
    int line = 0;
  };

  Kind kind = Kind::Null;
  int line = 0;             ///< 1-based
  bool quoted = false;      ///< Scalar: "..." or '...', hence text and never a number
  std::string text;         ///< Scalar
  std::vector<Key> keys;    ///< Map: keys[i] belongs to items[i], in the file's order
  std::vector<Node> items;  ///< Sequence and Map

  /// The value of a key; nullptr when absent.
  const Node* find(std::string_view key) const;
  /// "a mapping", "a list", "the text 'abc'", "nothing" - for messages.
  std::string describe() const;
};

/// One YAML document whose top is a mapping. Faults: syntax, size, depth, anchors and aliases, tags,
/// duplicate keys (all of them), a second document, an empty file. `name` stands in the faults.
std::variant<Node, Faults> parse_document(std::string_view text, const std::string& name);

/// A whole file of at most kMaxFileBytes. Faults: missing, unreadable, not a file, too big, with a NUL byte.
std::variant<std::string, Faults> read_text_file(const std::string& path);

/// What a YAML file is, by its top keys.
enum class FileKind { Unknown, Cell, Workpiece, Job, Arm, Scene };
FileKind file_kind(const Node& document);

}  // namespace weldcell::files
