// A text as lines that remember where they came from: changes of single lines, and the diff of all of them.
// Line ends stay as they are. Pure, private.
#pragma once

#include <string>
#include <vector>

namespace weldcell::files {

class TextLines {
 public:
  explicit TextLines(const std::string& text);

  /// Lines are counted from 1 in the text as it is now.
  bool starts_with_key(int line, const std::string& key) const;
  std::string indent(int line) const;
  /// The one word before a colon outside comment and quotes; false when it is not there, or twice.
  bool replace_word(int line, const std::string& word, const std::string& with);
  /// The line's indent and comment stay.
  void replace_before_comment(int line, const std::string& with);
  void comment_out(int line, const std::string& why);
  void insert(int before, const std::string& text);
  void append(const std::vector<std::string>& lines);

  std::string text() const;
  /// Unified, two lines of context, no header.
  std::string diff() const;

 private:
  struct Line {
    std::string text;  ///< without its end
    int from = 0;      ///< 1-based in the text as it was; 0: new
  };
  Line& at(int line) { return lines_[static_cast<std::size_t>(line - 1)]; }
  const Line& at(int line) const { return lines_[static_cast<std::size_t>(line - 1)]; }
  std::vector<Line> lines_;
  std::vector<std::string> before_;
  std::string end_ = "\n";
  bool ended_ = true;  ///< the last line has an end
};

/// Where a line's comment begins, quotes regarded; npos without one.
std::size_t comment_at(const std::string& line);

}  // namespace weldcell::files
