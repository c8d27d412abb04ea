#include "files/text_lines.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace weldcell::files {
namespace {

constexpr std::size_t kContext = 2;

struct DiffLine {
  char mark;  ///< ' ', '-' or '+'
  std::string text;
  int old_line, new_line;  ///< before which it stands, counted from 1
};

bool word_character(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
}

}  // namespace

std::size_t comment_at(const std::string& line) {
  char quote = 0;
  for (std::size_t i = 0; i < line.size(); ++i) {
    if (quote != 0) {
      if (line[i] == quote) quote = 0;
    } else if (line[i] == '"' || line[i] == '\'') {
      quote = line[i];
    } else if (line[i] == '#' && (i == 0 || line[i - 1] == ' ' || line[i - 1] == '\t')) {
      return i;
    }
  }
  return std::string::npos;
}

TextLines::TextLines(const std::string& text) {
  if (const std::size_t first = text.find('\n');
      first != std::string::npos && first > 0 && text[first - 1] == '\r')
    end_ = "\r\n";
  for (std::size_t from = 0; from < text.size();) {
    const std::size_t end = std::min(text.find('\n', from), text.size());
    std::string line = text.substr(from, end - from);
    if (end_.size() == 2 && !line.empty() && line.back() == '\r') line.pop_back();
    before_.push_back(line);
    lines_.push_back({std::move(line), static_cast<int>(before_.size())});
    ended_ = end < text.size();
    from = end + 1;
  }
}

std::string TextLines::indent(int line) const {
  const std::string& text = at(line).text;
  return text.substr(0, std::min(text.find_first_not_of(' '), text.size()));
}

bool TextLines::starts_with_key(int line, const std::string& key) const {
  const std::string& text = at(line).text;
  const std::size_t begin = indent(line).size();
  const std::size_t colon = begin + key.size();
  return text.compare(begin, key.size(), key) == 0 && colon < text.size() && text[colon] == ':';
}

bool TextLines::replace_word(int line, const std::string& word, const std::string& with) {
  std::string& text = at(line).text;
  const std::size_t end = std::min(comment_at(text), text.size());
  std::size_t found = std::string::npos;
  char quote = 0;
  for (std::size_t i = 0; i + word.size() < end; ++i) {
    if (quote != 0 || text[i] == '"' || text[i] == '\'') {
      quote = quote == 0 ? text[i] : quote == text[i] ? '\0' : quote;
      continue;
    }
    const bool begins = i == 0 || !word_character(text[i - 1]);
    if (!begins || text.compare(i, word.size(), word) != 0 || text[i + word.size()] != ':') continue;
    if (found != std::string::npos) return false;
    found = i;
  }
  if (found == std::string::npos) return false;
  text.replace(found, word.size(), with);
  return true;
}

void TextLines::replace_before_comment(int line, const std::string& with) {
  std::string& text = at(line).text;
  const std::size_t comment = comment_at(text);
  std::string out = indent(line) + with;
  if (comment != std::string::npos) {
    out.append(out.size() < comment ? comment - out.size() : 1, ' ');
    out += text.substr(comment);
  }
  text = out;
}

void TextLines::comment_out(int line, const std::string& why) {
  std::string& text = at(line).text;
  text = indent(line) + "# " + text.substr(indent(line).size()) + "  (" + why + ")";
}

void TextLines::insert(int before, const std::string& text) {
  lines_.insert(lines_.begin() + (before - 1), {text, 0});
}

void TextLines::append(const std::vector<std::string>& lines) {
  for (const std::string& line : lines) lines_.push_back({line, 0});
  ended_ = true;
}

std::string TextLines::text() const {
  std::string out;
  for (const Line& line : lines_) out += line.text + end_;
  if (!ended_) out.resize(out.size() - end_.size());
  return out;
}

std::string TextLines::diff() const {
  std::vector<DiffLine> all;
  int old_line = 1, new_line = 1;
  for (const Line& line : lines_) {
    if (line.from == 0) {
      all.push_back({'+', line.text, old_line, new_line++});
      continue;
    }
    const std::string& was = before_[static_cast<std::size_t>(line.from - 1)];
    if (was == line.text) {
      all.push_back({' ', was, old_line++, new_line++});
    } else {
      all.push_back({'-', was, old_line++, new_line});
      all.push_back({'+', line.text, old_line, new_line++});
    }
  }
  std::string out;
  for (std::size_t at = 0; at < all.size();) {
    const auto change = std::find_if(all.begin() + static_cast<std::ptrdiff_t>(at), all.end(),
                                     [](const DiffLine& l) { return l.mark != ' '; });
    if (change == all.end()) break;
    const auto first = static_cast<std::size_t>(change - all.begin());
    const std::size_t begin = std::max(at, first - std::min(first, kContext));
    std::size_t end = first, quiet = 0;
    while (end < all.size() && quiet <= 2 * kContext) quiet = all[end++].mark == ' ' ? quiet + 1 : 0;
    if (quiet > kContext) end -= quiet - kContext;
    std::string body;
    int olds = 0, news = 0;
    for (std::size_t i = begin; i < end; ++i) {
      body += fmt::format("{}{}\n", all[i].mark, all[i].text);
      olds += all[i].mark != '+';
      news += all[i].mark != '-';
    }
    out += fmt::format("@@ -{},{} +{},{} @@\n", all[begin].old_line, olds, all[begin].new_line, news) + body;
    at = end;
  }
  return out;
}

}  // namespace weldcell::files
