#include "sim/rapid_expression.hpp"

#include <cctype>
#include <memory>

namespace weldcell::sim::rapid {

void ExpressionParser::next() {
  if (here().kind != Token::Kind::End) ++at_;
}

std::string ExpressionParser::shown() const {
  return here().kind == Token::Kind::End ? "end of file" : "'" + here().text + "'";
}

bool ExpressionParser::is_word(const char* word) const {
  return here().kind == Token::Kind::Identifier && here().word == word;
}

void ExpressionParser::expect(const char* symbol) {
  if (!take(symbol)) fail("'" + std::string(symbol) + "' expected, not " + shown());
}

void ExpressionParser::expect_word(const char* word) {
  if (!take_word(word)) fail(std::string(word) + " expected, not " + shown());
}

std::pair<std::string, std::string> ExpressionParser::identifier(const char* what) {
  if (here().kind != Token::Kind::Identifier) fail(std::string(what) + " expected, not " + shown());
  std::pair<std::string, std::string> out{here().word, here().text};
  next();
  return out;
}

bool ExpressionParser::any_word(std::initializer_list<const char*> words) const {
  for (const char* word : words) {
    if (is_word(word)) return true;
  }
  return false;
}

std::vector<Argument> ExpressionParser::arguments(const char* end) {
  std::vector<Argument> out;
  bool separated = true;
  while (!is(end)) {
    if (take("\\")) {
      Argument argument;
      argument.option = identifier("option").first;
      if (take(":=")) argument.value = expression();
      out.push_back(std::move(argument));
      take(",");
      separated = true;
      continue;
    }
    if (!separated) fail("',' or ';' expected, not " + shown());
    out.push_back({"", expression()});
    separated = take(",");
    if (separated && is(end)) fail("argument expected after ','");
  }
  return out;
}

ExpressionPtr ExpressionParser::node(Expression::Kind kind, std::string name) {
  auto out = std::make_unique<Expression>();
  out->kind = kind;
  out->name = std::move(name);
  return out;
}

ExpressionPtr ExpressionParser::binary(ExpressionPtr left, std::string name, ExpressionPtr right) {
  ExpressionPtr out = node(Expression::Kind::Binary, std::move(name));
  out->operands.push_back(std::move(left));
  out->operands.push_back(std::move(right));
  return out;
}

std::optional<std::string> ExpressionParser::operator_of(std::initializer_list<const char*> names) {
  for (const char* name : names) {
    const bool word = std::isalpha(static_cast<unsigned char>(name[0])) != 0;
    if (word ? is_word(name) : is(name)) {
      next();
      return name;
    }
  }
  return std::nullopt;
}

ExpressionPtr ExpressionParser::expression() {
  if (++depth_ > 50) fail("nested too deep");
  ExpressionPtr left = conjunction();
  while (const auto name = operator_of({"or", "xor"})) left = binary(std::move(left), *name, conjunction());
  --depth_;
  return left;
}

ExpressionPtr ExpressionParser::conjunction() {
  ExpressionPtr left = negation();
  while (operator_of({"and"})) left = binary(std::move(left), "and", negation());
  return left;
}

ExpressionPtr ExpressionParser::negation() {
  if (!take_word("not")) return relation();
  ExpressionPtr out = node(Expression::Kind::Unary, "not");
  out->operands.push_back(negation());
  return out;
}

ExpressionPtr ExpressionParser::relation() {
  ExpressionPtr left = sum();
  if (const auto name = operator_of({"=", "<>", "<=", ">=", "<", ">"}))
    left = binary(std::move(left), *name, sum());
  return left;
}

ExpressionPtr ExpressionParser::sum() {
  ExpressionPtr left = term();
  while (const auto name = operator_of({"+", "-"})) left = binary(std::move(left), *name, term());
  return left;
}

ExpressionPtr ExpressionParser::term() {
  ExpressionPtr left = factor();
  while (const auto name = operator_of({"*", "/", "div", "mod"}))
    left = binary(std::move(left), *name, factor());
  return left;
}

ExpressionPtr ExpressionParser::factor() {
  if (take("-")) {
    ExpressionPtr out = node(Expression::Kind::Unary, "-");
    out->operands.push_back(factor());
    return out;
  }
  if (take("+")) return factor();
  return primary();
}

ExpressionPtr ExpressionParser::primary() {
  if (here().kind == Token::Kind::Number) {
    ExpressionPtr out = node(Expression::Kind::Literal);
    out->literal = Value::of(here().number);
    next();
    return out;
  }
  if (here().kind == Token::Kind::Text) {
    ExpressionPtr out = node(Expression::Kind::Literal);
    out->literal = Value::of(here().text);
    next();
    return out;
  }
  if (any_word({"true", "false"})) {
    ExpressionPtr out = node(Expression::Kind::Literal);
    out->literal = Value::of(is_word("true"));
    next();
    return out;
  }
  if (take("(")) {
    ExpressionPtr out = expression();
    expect(")");
    return out;
  }
  if (take("[")) {
    ExpressionPtr out = node(Expression::Kind::Aggregate);
    do {
      out->operands.push_back(expression());
    } while (take(","));
    expect("]");
    return out;
  }
  return reference();
}

ExpressionPtr ExpressionParser::reference() {
  ExpressionPtr out = node(Expression::Kind::Reference, identifier("expression").first);
  if (take("(")) {
    out->kind = Expression::Kind::Function;
    out->arguments = arguments(")");
    expect(")");
    return out;
  }
  for (;;) {
    Accessor accessor;
    if (take("{")) {
      do {
        accessor.indices.push_back(expression());
      } while (take(","));
      expect("}");
    } else if (take(".")) {
      accessor.component = identifier("component").first;
    } else {
      return out;
    }
    out->path.push_back(std::move(accessor));
  }
}

}  // namespace weldcell::sim::rapid
