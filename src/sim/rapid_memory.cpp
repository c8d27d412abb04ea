#include "sim/rapid_memory.hpp"

#include <cmath>

namespace weldcell::sim::rapid {

Memory::Memory() { define_standard(); }

void Memory::define(const std::string& display, const std::string& type, Value value, Storage storage) {
  Datum datum;
  datum.storage = storage;
  datum.type = type;
  datum.display = display;
  datum.value = std::move(value);
  predefined_[lower(display)] = std::move(datum);
}

void Memory::define_standard() {
  const auto literal = [this](const std::string& name, const std::string& type, const std::string& text) {
    Value value = *parse_literal(text);
    (void)types_.fit(value, type, {});
    define(name, type, std::move(value));
  };
  for (const int v : {5,   10,  20,  30,   40,   50,   60,   80,   100,  150,  200,  300, 400,
                      500, 600, 800, 1000, 1500, 2000, 2500, 3000, 4000, 5000, 6000, 7000}) {
    literal("v" + std::to_string(v), "speeddata", "[" + std::to_string(v) + ",500,5000,1000]");
  }
  literal("vmax", "speeddata", "[5000,500,5000,1000]");
  literal("fine", "zonedata", "[TRUE,0,0,0,0,0,0]");
  literal("z0", "zonedata", "[FALSE,0.3,0.3,0.3,0.03,0.3,0.03]");
  for (const int z : {1, 5, 10, 15, 20, 30, 40, 50, 60, 80, 100, 150, 200}) {
    const std::string r = std::to_string(z), wide = z == 1 ? "1" : std::to_string(z * 1.5),
                      turn = std::to_string(z == 1 ? 0.1 : z * 0.15);
    literal("z" + r, "zonedata",
            "[FALSE," + r + "," + wide + "," + wide + "," + turn + "," + wide + "," + turn + "]");
  }
  literal("tool0", "tooldata", "[TRUE,[[0,0,0],[1,0,0,0]],[0.001,[0,0,0.001],[1,0,0,0],0,0,0]]");
  literal("wobj0", "wobjdata", "[FALSE,TRUE,\"\",[[0,0,0],[1,0,0,0]],[[0,0,0],[1,0,0,0]]]");
  literal("load0", "loaddata", "[0.001,[0,0,0.001],[1,0,0,0],0,0,0]");
  define("ROB_1", "mecunit", Value::of(std::string("ROB_1")));
  int frame = 0;
  for (const char* name :
       {"EGM_FRAME_BASE", "EGM_FRAME_TOOL", "EGM_FRAME_WOBJ", "EGM_FRAME_WORLD", "EGM_FRAME_JOINT"})
    define(name, "egmframetype", Value::of(double(frame++)));
  define("EGM_STOP_HOLD", "egmstopmode", Value::of(0.0));
  define("EGM_STOP_RAMP_DOWN", "egmstopmode", Value::of(1.0));
  define("EGM_STATE_DISCONNECTED", "egmstate", Value::of(0.0));
  define("EGM_STATE_CONNECTED", "egmstate", Value::of(1.0));
  define("EGM_STATE_RUNNING", "egmstate", Value::of(2.0));
  define("ERR_UDPUC_COMM", "errnum", Value::of(double(kErrUdpUcComm)));
  define("ERR_DIVZERO", "errnum", Value::of(double(kErrDivZero)));
  define("ERR_OUTOFBND", "errnum", Value::of(double(kErrOutOfBounds)));
  define("ERR_REFUNKDAT", "errnum", Value::of(double(kErrReferenceUnknown)));
  define("ERR_ARGVALERR", "errnum", Value::of(double(kErrArgument)));
  define("ERR_WAIT_MAXTIME", "errnum", Value::of(double(kErrWaitTimeOut)));
  define("ERRNO", "errnum", Value::of(0.0), Storage::Variable);
  define("pi", "num", Value::of(3.14159265358979));
  define("OP_AUTO", "num", Value::of(1.0));
  define("OP_MAN_PROG", "num", Value::of(2.0));
}

Datum Memory::make_datum(const Declaration& declaration, const Scope& scope) {
  Datum out;
  out.storage = declaration.storage;
  out.type = declaration.type;
  out.display = declaration.display;
  out.module = scope.module;
  out.dimensions = declaration.dimensions;
  out.local = declaration.local;
  out.value = types_.initial(declaration.type, declaration.dimensions);
  if (declaration.initial) {
    out.value = evaluate(*declaration.initial, scope);
    if (Status fits = types_.fit(out.value, declaration.type, declaration.dimensions); !fits) {
      throw RapidError{kErrNotHandled, declaration.display + ": " + fits.error().text(), 40199};
    }
  }
  return out;
}

Result<std::string> Memory::load(std::string_view text, bool replace) {
  auto parsed = parse_module(text, types_);
  if (!parsed) return parsed.error();
  const auto& module = *parsed;
  if (modules_.contains(module->name) && !replace) {
    return Error{"rapid.exists", module->display, "module is already loaded", "load it with replace"};
  }
  for (const auto& [name, parts] : module->records) types_.add(name, parts);
  DataMap fresh;
  for (const Declaration& declaration : module->data) {
    if (fresh.contains(declaration.name)) {
      return Error{"rapid.syntax", "line " + std::to_string(declaration.line),
                   "data '" + declaration.display + "' declared twice", ""};
    }
    for (const auto& [other, data] : data_) {
      const auto same = data.find(declaration.name);
      if (other != module->name && !declaration.local && same != data.end() && !same->second.local) {
        return Error{"rapid.syntax", "line " + std::to_string(declaration.line),
                     "data '" + declaration.display + "' is global in module " + other + " already", ""};
      }
    }
    try {
      fresh[declaration.name] = make_datum(declaration, {&fresh, module->name});
    } catch (const RapidError& fault) {
      return Error{"rapid.syntax", "line " + std::to_string(declaration.line), fault.what, ""};
    }
  }
  data_[module->name] = std::move(fresh);
  modules_[module->name] = module;
  return module->display;
}

bool Memory::unload(const std::string& module) {
  data_.erase(module);
  return modules_.erase(module) > 0;
}

std::shared_ptr<const Module> Memory::module(const std::string& name) const {
  const auto found = modules_.find(name);
  return found == modules_.end() ? nullptr : found->second;
}

Datum* Memory::find(const Scope& scope, const std::string& name) {
  if (scope.locals) {
    if (const auto found = scope.locals->find(name); found != scope.locals->end()) return &found->second;
  }
  if (const auto own = data_.find(scope.module); own != data_.end()) {
    if (const auto found = own->second.find(name); found != own->second.end()) return &found->second;
  }
  for (auto& [module, data] : data_) {
    if (const auto found = data.find(name); found != data.end() && !found->second.local)
      return &found->second;
  }
  const auto found = predefined_.find(name);
  return found == predefined_.end() ? nullptr : &found->second;
}

Datum* Memory::symbol(const std::string& module, const std::string& name) {
  if (module.empty()) return find({}, name);
  const auto data = data_.find(module);
  if (data == data_.end()) return nullptr;
  const auto found = data->second.find(name);
  return found == data->second.end() ? nullptr : &found->second;
}

std::vector<std::pair<std::string, const Datum*>> Memory::data_of(const std::string& module) const {
  std::vector<std::pair<std::string, const Datum*>> out;
  for (const auto& [owner, data] : data_) {
    if (!module.empty() && owner != module) continue;
    for (const auto& [name, datum] : data) out.emplace_back(name, &datum);
  }
  return out;
}

const Routine* Memory::routine(const std::string& module, const std::string& name) const {
  if (const auto own = modules_.find(module); own != modules_.end()) {
    if (const auto found = own->second->routines.find(name); found != own->second->routines.end()) {
      return &found->second;
    }
  }
  for (const auto& [other, loaded] : modules_) {
    const auto found = loaded->routines.find(name);
    if (found != loaded->routines.end() && !found->second.local) return &found->second;
  }
  return nullptr;
}

Value* Memory::resolve(const Expression& reference, const Scope& scope, Datum** owner, std::string* type) {
  Datum* datum = find(scope, reference.name);
  if (!datum) throw RapidError{kErrReferenceUnknown, "unknown data '" + reference.name + "'", 40165};
  if (owner) *owner = datum;
  Value* value = &datum->value;
  std::string now = datum->type;
  for (const Accessor& accessor : reference.path) {
    if (!accessor.component.empty()) {
      const auto& parts = types_.components(now);
      std::size_t i = 0;
      while (i < parts.size() && parts[i].name != accessor.component) ++i;
      if (i == parts.size() || i >= value->items.size()) {
        throw RapidError{kErrNotHandled, now + " has no component '" + accessor.component + "'", 40199};
      }
      value = &value->items[i];
      now = parts[i].type;
    }
    for (const ExpressionPtr& index : accessor.indices) {
      const double at = evaluate(*index, scope).number;
      if (value->kind != Value::Kind::Array || at < 1 || at > static_cast<double>(value->items.size())) {
        throw RapidError{kErrOutOfBounds,
                         "index " + print(Value::of(at)) + " out of bounds of " + datum->display, 40194};
      }
      value = &value->items[static_cast<std::size_t>(at) - 1];
    }
  }
  if (type) *type = now;
  return value;
}

Value Memory::evaluate(const Expression& expression, const Scope& scope) {
  switch (expression.kind) {
    case Expression::Kind::Literal:
      return expression.literal;
    case Expression::Kind::Reference:
      return *resolve(expression, scope);
    case Expression::Kind::Aggregate: {
      Value out;
      out.kind = Value::Kind::Record;
      for (const ExpressionPtr& item : expression.operands) out.items.push_back(evaluate(*item, scope));
      return out;
    }
    case Expression::Kind::Unary:
      return unary(expression, scope);
    case Expression::Kind::Binary:
      return binary(expression, scope);
    case Expression::Kind::Function:
      return function(expression, scope);
  }
  return {};
}

Value Memory::unary(const Expression& expression, const Scope& scope) {
  Value value = evaluate(*expression.operands[0], scope);
  if (expression.name == "not") {
    if (value.kind != Value::Kind::Boolean) throw RapidError{kErrNotHandled, "NOT needs a bool", 40199};
    return Value::of(!value.flag);
  }
  if (value.kind == Value::Kind::Number) return Value::of(-value.number);
  for (Value& item : value.items) item.number = -item.number;
  return value;
}

namespace {

[[noreturn]] void type_fault(const std::string& name) {
  throw RapidError{kErrNotHandled, "operands of '" + name + "' do not fit", 40199};
}

Value elementwise(const Value& a, const Value& b, double sign, const std::string& name) {
  if (a.items.size() != b.items.size()) type_fault(name);
  Value out = a;
  for (std::size_t i = 0; i < a.items.size(); ++i) out.items[i].number += sign * b.items[i].number;
  return out;
}

Value arithmetic(const std::string& name, double a, double b) {
  if (name == "+") return Value::of(a + b);
  if (name == "-") return Value::of(a - b);
  if (name == "*") return Value::of(a * b);
  if (b == 0) throw RapidError{kErrDivZero, "division by zero", 40194};
  if (name == "/") return Value::of(a / b);
  if (name == "div") return Value::of(std::trunc(a / b));
  return Value::of(std::fmod(a, b));
}

Value compare(const std::string& name, double a, double b) {
  if (name == "<") return Value::of(a < b);
  if (name == ">") return Value::of(a > b);
  if (name == "<=") return Value::of(a <= b);
  return Value::of(a >= b);
}

}  // namespace

Value Memory::binary(const Expression& expression, const Scope& scope) {
  const std::string& name = expression.name;
  const Value a = evaluate(*expression.operands[0], scope);
  if (name == "and" || name == "or" || name == "xor") {
    const Value b = evaluate(*expression.operands[1], scope);
    if (a.kind != Value::Kind::Boolean || b.kind != Value::Kind::Boolean) type_fault(name);
    return Value::of(name == "and" ? a.flag && b.flag : name == "or" ? a.flag || b.flag : a.flag != b.flag);
  }
  const Value b = evaluate(*expression.operands[1], scope);
  if (name == "=") return Value::of(a == b);
  if (name == "<>") return Value::of(!(a == b));
  const bool numbers = a.kind == Value::Kind::Number && b.kind == Value::Kind::Number;
  if (numbers && (name[0] == '<' || name[0] == '>')) return compare(name, a.number, b.number);
  if (numbers) return arithmetic(name, a.number, b.number);
  if (name == "+" && a.kind == Value::Kind::Text && b.kind == Value::Kind::Text)
    return Value::of(a.text + b.text);
  if (!a.items.empty() && !b.items.empty() && (name == "+" || name == "-")) {
    return elementwise(a, b, name == "+" ? 1 : -1, name);
  }
  if (name == "*" && !a.items.empty() && b.kind == Value::Kind::Number) {
    Value out = a;
    for (Value& item : out.items) item.number *= b.number;
    return out;
  }
  type_fault(name);
}

namespace {

std::optional<Value> numeric_function(const std::string& name, const std::vector<Value>& in) {
  static const std::map<std::string, double (*)(double)> kOfOne{
      {"abs", [](double x) { return std::abs(x); }},
      {"sqrt", [](double x) { return std::sqrt(x); }},
      {"sin", [](double x) { return std::sin(x * M_PI / 180); }},
      {"cos", [](double x) { return std::cos(x * M_PI / 180); }},
      {"tan", [](double x) { return std::tan(x * M_PI / 180); }},
      {"acos", [](double x) { return std::acos(x) * 180 / M_PI; }},
      {"asin", [](double x) { return std::asin(x) * 180 / M_PI; }},
      {"round", [](double x) { return std::round(x); }},
      {"trunc", [](double x) { return std::trunc(x); }}};
  const auto found = kOfOne.find(name);
  if (found == kOfOne.end() || in.size() != 1 || in[0].kind != Value::Kind::Number) return std::nullopt;
  return Value::of(found->second(in[0].number));
}

}  // namespace

Value Memory::function(const Expression& expression, const Scope& scope) {
  std::vector<Value> in;
  for (const Argument& argument : expression.arguments) {
    if (argument.option.empty()) in.push_back(evaluate(*argument.value, scope));
  }
  const std::string& name = expression.name;
  if (const auto out = numeric_function(name, in)) return *out;
  if (name == "atan2" && in.size() == 2)
    return Value::of(std::atan2(in[0].number, in[1].number) * 180 / M_PI);
  if ((name == "valtostr" || name == "numtostr") && !in.empty()) {
    return Value::of(in[0].kind == Value::Kind::Text ? in[0].text : print(in[0]));
  }
  if (name == "strlen" && in.size() == 1) return Value::of(double(in[0].text.size()));
  if (name == "offs" && in.size() == 4 && in[0].items.size() == 4) {
    Value out = in[0];
    for (std::size_t i = 0; i < 3; ++i) out.items[0].items[i].number += in[i + 1].number;
    return out;
  }
  if (machine_) {
    if (const auto out = machine_(name, in)) return *out;
  }
  throw RapidError{kErrReferenceUnknown, "function '" + name + "' is not known to this simulator", 40165};
}

}  // namespace weldcell::sim::rapid
