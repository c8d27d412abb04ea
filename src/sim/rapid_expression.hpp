// RAPID tokens -> expressions and arguments; the grammar that statements and declarations build on. Pure.
#pragma once

#include <initializer_list>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "sim/rapid_lexer.hpp"
#include "sim/rapid_syntax.hpp"

namespace weldcell::sim::rapid {

/// Thrown within a parser, never out of parse_module().
struct SyntaxFault {
  int line;
  std::string what;
};

class ExpressionParser {
 protected:
  explicit ExpressionParser(std::vector<Token> tokens) : tokens_(std::move(tokens)) {}

  const Token& here() const { return tokens_[at_]; }
  void next();
  [[noreturn]] void fail(const std::string& what) const { throw SyntaxFault{here().line, what}; }
  std::string shown() const;
  bool is(const char* symbol) const { return here().kind == Token::Kind::Symbol && here().word == symbol; }
  bool is_word(const char* word) const;
  bool take(const char* symbol) { return is(symbol) ? (next(), true) : false; }
  bool take_word(const char* word) { return is_word(word) ? (next(), true) : false; }
  void expect(const char* symbol);
  void expect_word(const char* word);
  std::pair<std::string, std::string> identifier(const char* what);
  bool any_word(std::initializer_list<const char*> words) const;
  std::vector<Argument> arguments(const char* end);
  ExpressionPtr node(Expression::Kind kind, std::string name = "");
  ExpressionPtr expression();
  /// A name with its indices and components, or a call.
  ExpressionPtr reference();

  std::size_t at_ = 0;  ///< of the token here
  int depth_ = 0;       ///< of nested blocks and expressions

 private:
  ExpressionPtr binary(ExpressionPtr left, std::string name, ExpressionPtr right);
  /// The operator here when it is one of this level, consumed.
  std::optional<std::string> operator_of(std::initializer_list<const char*> names);
  ExpressionPtr conjunction();
  ExpressionPtr negation();
  ExpressionPtr relation();
  ExpressionPtr sum();
  ExpressionPtr term();
  ExpressionPtr factor();
  ExpressionPtr primary();

  std::vector<Token> tokens_;
};

}  // namespace weldcell::sim::rapid
