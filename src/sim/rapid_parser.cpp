#include <optional>
#include <set>

#include "sim/rapid_expression.hpp"
#include "sim/rapid_lexer.hpp"
#include "sim/rapid_syntax.hpp"

namespace weldcell::sim::rapid {

namespace {

class Parser : ExpressionParser {
 public:
  Parser(std::vector<Token> tokens, const TypeTable& types)
      : ExpressionParser(std::move(tokens)), types_(types) {}

  std::shared_ptr<Module> module() {
    auto out = std::make_shared<Module>();
    module_ = out.get();
    expect_word("module");
    std::tie(out->name, out->display) = identifier("module name");
    if (take("(")) {
      do {
        out->system |= identifier("module attribute").first == "sysmodule";
      } while (take(","));
      expect(")");
    }
    while (!is_word("endmodule")) module_item();
    next();
    if (here().kind != Token::Kind::End) fail("text after ENDMODULE");
    return out;
  }

 private:
  // ---- module level ----
  void module_item() {
    if (here().kind == Token::Kind::End) fail("ENDMODULE expected");
    const bool local = take_word("local");
    if (!local) take_word("task");
    if (any_word({"const", "pers", "var"})) {
      module_->data.push_back(declaration());
      module_->data.back().local = local;
    } else if (take_word("record")) {
      record();
    } else if (any_word({"proc", "trap"})) {
      Routine routine = this->routine();
      routine.local = local;
      const std::string name = routine.name;
      if (!module_->routines.emplace(name, std::move(routine)).second)
        fail("routine '" + name + "' declared twice");
    } else if (is_word("func")) {
      fail(here().text + " is not supported by this simulator");
    } else {
      fail("declaration or PROC expected, not " + shown());
    }
  }

  void record() {
    const std::string name = identifier("record name").first;
    std::vector<Component> parts;
    while (!take_word("endrecord")) {
      const std::string type = type_name();
      parts.push_back({identifier("component name").first, type});
      expect(";");
    }
    if (parts.empty()) fail("RECORD without components");
    module_->records[name] = std::move(parts);
  }

  std::string type_name() {
    const auto [name, display] = identifier("type");
    if (!types_.known(name) && !module_->records.contains(name)) fail("unknown type '" + display + "'");
    return name;
  }

  Declaration declaration() {
    Declaration out;
    out.line = here().line;
    out.storage = is_word("const")  ? Storage::Constant
                  : is_word("pers") ? Storage::Persistent
                                    : Storage::Variable;
    next();
    out.type = type_name();
    std::tie(out.name, out.display) = identifier("data name");
    if (take("{")) {
      do {
        if (here().kind != Token::Kind::Number) fail("array size expected");
        out.dimensions.push_back(static_cast<int>(here().number));
        if (out.dimensions.back() < 1 || out.dimensions.back() > 10000) fail("array size out of range");
        next();
      } while (take(","));
      if (out.dimensions.size() > 3) fail("arrays have at most 3 dimensions");
      expect("}");
    }
    if (take(":=")) out.initial = expression();
    if (!out.initial && out.storage == Storage::Constant) fail("CONST '" + out.display + "' without a value");
    expect(";");
    return out;
  }

  Routine routine() {
    Routine out;
    out.line = here().line;
    out.trap = is_word("trap");
    const char* const end = out.trap ? "endtrap" : "endproc";
    next();
    std::tie(out.name, out.display) = identifier("routine name");
    out.module = module_->name;
    if (!out.trap) expect("(");
    if (!out.trap && !take(")")) {
      do {
        if (is("\\") || any_word({"inout", "var", "pers"}))
          fail("only plain parameters are supported by this simulator");
        const std::string type = type_name();
        out.parameters.push_back({type, identifier("parameter name").first});
      } while (take(","));
      expect(")");
    }
    while (any_word({"const", "pers", "var"})) out.data.push_back(declaration());
    out.body = block({end, "error", "undo", "backward"});
    if (take_word("error")) {
      out.has_error_handler = true;
      out.error_handler = block({end, "undo", "backward"});
    }
    if (any_word({"undo", "backward"})) fail(here().text + " is not supported by this simulator");
    expect_word(end);
    return out;
  }

  // ---- statements ----
  Block block(std::initializer_list<const char*> ends) {
    Block out;
    if (++depth_ > 50) fail("nested too deep");
    while (!any_word(ends)) {
      if (here().kind == Token::Kind::End || any_word({"endmodule", "endproc", "endtrap"})) {
        fail(std::string(*ends.begin()) + " expected, not " + shown());
      }
      if (take(";")) continue;
      out.push_back(statement());
    }
    --depth_;
    return out;
  }

  Statement make(Statement::Kind kind) {
    Statement out;
    out.kind = kind;
    out.line = here().line;
    return out;
  }

  Statement statement() {
    if (is_word("if")) return if_statement();
    if (is_word("test")) return test_statement();
    if (is_word("while")) {
      Statement out = make(Statement::Kind::While);
      next();
      out.target = expression();
      expect_word("do");
      out.branches.push_back({{}, block({"endwhile"})});
      next();
      return out;
    }
    if (is_word("for")) return for_statement();
    return simple_statement();
  }

  Statement simple_statement() {
    static const std::map<std::string, Statement::Kind> kWords{
        {"return", Statement::Kind::Return},   {"exit", Statement::Kind::Exit},
        {"stop", Statement::Kind::Stop},       {"retry", Statement::Kind::Retry},
        {"trynext", Statement::Kind::TryNext}, {"raise", Statement::Kind::Raise}};
    Statement out = make(Statement::Kind::Call);
    if (take("%")) {
      out.kind = Statement::Kind::LateCall;
      out.target = expression();
      expect("%");
      out.arguments = arguments(";");
      expect(";");
      return out;
    }
    if (here().kind != Token::Kind::Identifier) fail("instruction expected, not " + shown());
    if (const auto word = kWords.find(here().word); word != kWords.end()) {
      out.kind = word->second;
      next();
      if (out.kind == Statement::Kind::Raise && !is(";")) out.target = expression();
      while (take("\\")) identifier("switch");
      expect(";");
      return out;
    }
    if (is_word("connect")) return connect();
    if (is_word("goto")) fail(here().text + " is not supported by this simulator");
    const std::size_t begin = at_;
    out.name = identifier("instruction").first;
    if (is(":=") || is(".") || is("{")) {
      at_ = begin;
      out.kind = Statement::Kind::Assign;
      out.target = reference();
      expect(":=");
      out.value = expression();
    } else if (is(":")) {
      fail("labels are not supported by this simulator");
    } else {
      out.arguments = arguments(";");
    }
    expect(";");
    return out;
  }

  /// CONNECT number WITH trap: an instruction whose second argument is the trap's name.
  Statement connect() {
    Statement out = make(Statement::Kind::Call);
    out.name = identifier("CONNECT").first;
    out.arguments.push_back({"", reference()});
    expect_word("with");
    auto trap = node(Expression::Kind::Literal);
    trap->literal = Value::of(identifier("trap name").first);
    out.arguments.push_back({"", std::move(trap)});
    expect(";");
    return out;
  }

  Statement if_statement() {
    Statement out = make(Statement::Kind::If);
    next();
    Branch first;
    first.conditions.push_back(expression());
    if (!take_word("then")) {
      first.body.push_back(simple_statement());
      out.branches.push_back(std::move(first));
      return out;
    }
    first.body = block({"endif", "elseif", "else"});
    out.branches.push_back(std::move(first));
    while (take_word("elseif")) {
      Branch branch;
      branch.conditions.push_back(expression());
      expect_word("then");
      branch.body = block({"endif", "elseif", "else"});
      out.branches.push_back(std::move(branch));
    }
    if (take_word("else")) out.branches.push_back({{}, block({"endif"})});
    expect_word("endif");
    return out;
  }

  Statement test_statement() {
    Statement out = make(Statement::Kind::Test);
    next();
    out.target = expression();
    while (take_word("case")) {
      Branch branch;
      do {
        branch.conditions.push_back(expression());
      } while (take(","));
      expect(":");
      branch.body = block({"endtest", "case", "default"});
      out.branches.push_back(std::move(branch));
    }
    if (take_word("default")) {
      expect(":");
      out.branches.push_back({{}, block({"endtest"})});
    }
    expect_word("endtest");
    return out;
  }

  Statement for_statement() {
    Statement out = make(Statement::Kind::For);
    next();
    out.name = identifier("loop variable").first;
    expect_word("from");
    out.value = expression();
    expect_word("to");
    out.to = expression();
    if (take_word("step")) out.step = expression();
    expect_word("do");
    out.branches.push_back({{}, block({"endfor"})});
    next();
    return out;
  }

  const TypeTable& types_;
  Module* module_ = nullptr;
};

}  // namespace

Result<std::shared_ptr<const Module>> parse_module(std::string_view text, const TypeTable& types) {
  if (text.size() > 4'000'000) return Error{"rapid.syntax", "", "module larger than 4 MB", ""};
  auto tokens = tokenize(text);
  if (!tokens) return tokens.error();
  try {
    auto module = Parser(std::move(*tokens), types).module();
    module->text = std::string(text);
    return std::shared_ptr<const Module>(std::move(module));
  } catch (const SyntaxFault& fault) {
    return Error{"rapid.syntax", "line " + std::to_string(fault.line), fault.what, ""};
  }
}

}  // namespace weldcell::sim::rapid
