#include "sim/rapid_lexer.hpp"

#include <cctype>
#include <cstdlib>

#include "sim/rapid_value.hpp"

namespace weldcell::sim::rapid {

namespace {

class Lexer {
 public:
  explicit Lexer(std::string_view text) : text_(text) {}

  Result<std::vector<Token>> run() {
    skip_file_header();
    for (;;) {
      skip_blank();
      if (at_ >= text_.size()) break;
      if (!one()) return Error{"rapid.syntax", "line " + std::to_string(line_), fault_, ""};
    }
    push(Token::Kind::End, "");
    return std::move(out_);
  }

 private:
  char peek(std::size_t ahead = 0) const { return at_ + ahead < text_.size() ? text_[at_ + ahead] : '\0'; }
  void push(Token::Kind kind, std::string text) {
    Token token;
    token.kind = kind;
    token.word = kind == Token::Kind::Identifier ? lower(text) : text;
    token.text = std::move(text);
    token.line = line_;
    out_.push_back(std::move(token));
  }

  /// Files saved by a controller begin with "%%% VERSION:1 LANGUAGE:ENGLISH %%%".
  void skip_file_header() {
    skip_blank();
    if (text_.substr(at_, 3) != "%%%") return;
    const std::size_t end = text_.find("%%%", at_ + 3);
    const std::size_t stop = end == std::string_view::npos ? text_.size() : end + 3;
    for (; at_ < stop; ++at_) line_ += text_[at_] == '\n';
  }

  void skip_blank() {
    while (at_ < text_.size()) {
      const char c = text_[at_];
      if (c == '\n') ++line_;
      if (std::isspace(static_cast<unsigned char>(c))) {
        ++at_;
      } else if (c == '!') {
        while (at_ < text_.size() && text_[at_] != '\n') ++at_;
      } else {
        return;
      }
    }
  }

  bool one() {
    const char c = peek();
    if (std::isalpha(static_cast<unsigned char>(c))) {
      const std::size_t begin = at_;
      while (std::isalnum(static_cast<unsigned char>(peek())) || peek() == '_') ++at_;
      if (at_ - begin > 32) return fault_ = "identifier longer than 32 characters", false;
      push(Token::Kind::Identifier, std::string(text_.substr(begin, at_ - begin)));
      return true;
    }
    if (std::isdigit(static_cast<unsigned char>(c)) ||
        (c == '.' && std::isdigit(static_cast<unsigned char>(peek(1))))) {
      return number();
    }
    if (c == '"') return string();
    for (const char* pair : {":=", "<>", "<=", ">="}) {
      if (c == pair[0] && peek(1) == pair[1]) {
        at_ += 2;
        push(Token::Kind::Symbol, pair);
        return true;
      }
    }
    if (std::string_view("[](){},;:.\\+-*/=<>%?").find(c) == std::string_view::npos) {
      return fault_ = std::string("unexpected character '") + c + "'", false;
    }
    ++at_;
    push(Token::Kind::Symbol, std::string(1, c));
    return true;
  }

  bool number() {
    const std::size_t begin = at_;
    while (std::isdigit(static_cast<unsigned char>(peek()))) ++at_;
    if (peek() == '.') {
      ++at_;
      while (std::isdigit(static_cast<unsigned char>(peek()))) ++at_;
    }
    if ((peek() == 'e' || peek() == 'E') &&
        (std::isdigit(static_cast<unsigned char>(peek(1))) ||
         ((peek(1) == '+' || peek(1) == '-') && std::isdigit(static_cast<unsigned char>(peek(2)))))) {
      at_ += 2;
      while (std::isdigit(static_cast<unsigned char>(peek()))) ++at_;
    }
    push(Token::Kind::Number, std::string(text_.substr(begin, at_ - begin)));
    out_.back().number = std::strtod(out_.back().text.c_str(), nullptr);
    return true;
  }

  bool string() {
    std::string value;
    for (++at_; at_ < text_.size() && text_[at_] != '\n'; ++at_) {
      if (text_[at_] == '"') {
        if (peek(1) != '"') {
          ++at_;
          push(Token::Kind::Text, value);
          return true;
        }
        ++at_;
      }
      value += text_[at_];
      if (value.size() > 80) return fault_ = "string longer than 80 characters", false;
    }
    return fault_ = "string without an end", false;
  }

  std::string_view text_;
  std::size_t at_ = 0;
  int line_ = 1;
  std::string fault_;
  std::vector<Token> out_;
};

}  // namespace

Result<std::vector<Token>> tokenize(std::string_view text) { return Lexer(text).run(); }

}  // namespace weldcell::sim::rapid
