// Older cell files brought to today's form, line by line: comments and everything that need not change stay.
// No file.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "weldcell/base/result.hpp"
#include "weldcell/files/document.hpp"

namespace weldcell::files {

/// Of the cell file's form, its key `version`. Raised when a file of before would be refused or mean
/// something else.
inline constexpr int kCellVersion = 1;

/// What a version changed: one row of the table that migration follows.
struct CellChange {
  enum class Kind {
    Rename,  ///< `key` became `to`, in the same section
    State,   ///< `key` is stated as `to` where it is absent: what its absence meant before
    Drop,    ///< `key` is gone; its line becomes a comment
  };
  int version;  ///< the first that has the change
  Kind kind;
  const char* key;  ///< "key" at the top, or "section.key"
  const char* to;
  const char* why;  ///< stands as a comment behind a stated or dropped key
};
/// Every change so far, by version.
std::span<const CellChange> cell_changes();

/// The version that a cell file states; 0 without the key. Error "cell.version": no whole number.
Result<int> cell_version(const Node& document);

struct MigratedCell {
  int from = kCellVersion;  ///< kCellVersion: there was nothing to do
  std::string text;
  std::vector<std::string> words;  ///< one for each change: "weld.tool is weld.torch_tool now"
  std::string diff;                ///< unified, without file names; "" when there was nothing to do
};

/// Errors: "cell.version" (newer than kCellVersion, or no number), "cell.migrate" (no YAML, no cell file, or
/// written so that a line cannot be changed alone: in braces over several lines).
Result<MigratedCell> migrate_cell(const std::string& text, const std::string& name,
                                  std::span<const CellChange> changes = cell_changes());

}  // namespace weldcell::files
