// RAPID modules as trees: declarations, routines, statements. The parser names the line of the first fault.
// Pure.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "sim/rapid_value.hpp"

namespace weldcell::sim::rapid {

struct Expression;
using ExpressionPtr = std::unique_ptr<Expression>;

/// `.component` or `{i,j}` behind a name.
struct Accessor {
  std::string component;
  std::vector<ExpressionPtr> indices;
};

/// One argument of an instruction or function: positional (option empty), `\Switch` (no value) or
/// `\Option:=value`.
struct Argument {
  std::string option;
  ExpressionPtr value;
};

struct Expression {
  enum class Kind { Literal, Aggregate, Reference, Function, Unary, Binary };
  Kind kind = Kind::Literal;
  Value literal;
  std::string name;  ///< referenced datum, function or operator; lower case
  std::vector<Accessor> path;
  std::vector<ExpressionPtr> operands;  ///< of operators and aggregates
  std::vector<Argument> arguments;      ///< of functions
};

struct Statement;
using Block = std::vector<Statement>;

/// IF / ELSEIF / CASE arm; no conditions = ELSE or DEFAULT.
struct Branch {
  std::vector<ExpressionPtr> conditions;
  Block body;
};

struct Statement {
  enum class Kind { Assign, Call, LateCall, If, Test, While, For, Return, Exit, Stop, Retry, TryNext, Raise };
  Kind kind = Kind::Call;
  int line = 0;
  std::string name;      ///< instruction or loop variable, lower case
  ExpressionPtr target;  ///< assigned reference; late-bound name; WHILE condition; TEST subject; RAISE number
  ExpressionPtr value, to, step;  ///< assigned value; FOR from, TO, STEP
  std::vector<Argument> arguments;
  std::vector<Branch> branches;  ///< IF, TEST; the body of loops is branches[0]
};

enum class Storage { Constant, Persistent, Variable };

struct Declaration {
  Storage storage = Storage::Variable;
  std::string type, name, display;
  std::vector<int> dimensions;
  ExpressionPtr initial;
  bool local = false;
  int line = 0;
};

struct Parameter {
  std::string type, name;
};

struct Routine {
  std::string name, display, module;
  std::vector<Parameter> parameters;
  std::vector<Declaration> data;
  Block body, error_handler;
  bool has_error_handler = false;
  bool local = false;
  bool trap = false;  ///< TRAP: run by an interrupt only
  int line = 0;
};

struct Module {
  std::string name, display, text;
  bool system = false;
  std::map<std::string, std::vector<Component>> records;
  std::vector<Declaration> data;
  std::map<std::string, Routine> routines;
};

/// Errors "rapid.syntax": where = "module(line)", what = the fault.
Result<std::shared_ptr<const Module>> parse_module(std::string_view text, const TypeTable& types);

}  // namespace weldcell::sim::rapid
