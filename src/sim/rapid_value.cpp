#include "sim/rapid_value.hpp"

#include <cctype>
#include <cmath>
#include <cstdio>
#include <cstdlib>

namespace weldcell::sim::rapid {

std::string lower(std::string_view text) {
  std::string out(text);
  for (char& c : out) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return out;
}

Value Value::of(double v) {
  Value out;
  out.number = v;
  return out;
}
Value Value::of(bool v) {
  Value out;
  out.kind = Kind::Boolean;
  out.flag = v;
  return out;
}
Value Value::of(std::string v) {
  Value out;
  out.kind = Kind::Text;
  out.text = std::move(v);
  return out;
}

bool Value::operator==(const Value& other) const {
  if (kind != other.kind) {
    const bool both_aggregates = !items.empty() && !other.items.empty();
    return both_aggregates && items == other.items;
  }
  switch (kind) {
    case Kind::Number:
      return number == other.number;
    case Kind::Boolean:
      return flag == other.flag;
    case Kind::Text:
      return text == other.text;
    case Kind::Record:
    case Kind::Array:
      return items == other.items;
  }
  return false;
}

namespace {
std::vector<Component> numbers(std::initializer_list<const char*> names) {
  std::vector<Component> out;
  for (const char* name : names) out.push_back({name, "num"});
  return out;
}
}  // namespace

TypeTable::TypeTable() {
  for (const char* atomic :
       {"num",      "dnum",        "bool",         "string",   "byte",     "errnum",   "clock",
        "egmstate", "egmstopmode", "egmframetype", "signaldo", "signaldi", "signalao", "signalai",
        "signalgo", "signalgi",    "mecunit",      "identno",  "intnum",   "switch",   "tasks"}) {
    types_[atomic] = {};
  }
  types_["pos"] = numbers({"x", "y", "z"});
  types_["orient"] = numbers({"q1", "q2", "q3", "q4"});
  types_["pose"] = {{"trans", "pos"}, {"rot", "orient"}};
  types_["confdata"] = numbers({"cf1", "cf4", "cf6", "cfx"});
  types_["extjoint"] = numbers({"eax_a", "eax_b", "eax_c", "eax_d", "eax_e", "eax_f"});
  types_["robjoint"] = numbers({"rax_1", "rax_2", "rax_3", "rax_4", "rax_5", "rax_6"});
  types_["robtarget"] = {{"trans", "pos"}, {"rot", "orient"}, {"robconf", "confdata"}, {"extax", "extjoint"}};
  types_["jointtarget"] = {{"robax", "robjoint"}, {"extax", "extjoint"}};
  types_["loaddata"] = {{"mass", "num"}, {"cog", "pos"}, {"aom", "orient"},
                        {"ix", "num"},   {"iy", "num"},  {"iz", "num"}};
  types_["tooldata"] = {{"robhold", "bool"}, {"tframe", "pose"}, {"tload", "loaddata"}};
  types_["wobjdata"] = {
      {"robhold", "bool"}, {"ufprog", "bool"}, {"ufmec", "string"}, {"uframe", "pose"}, {"oframe", "pose"}};
  types_["speeddata"] = numbers({"v_tcp", "v_ori", "v_leax", "v_reax"});
  types_["zonedata"] = {{"finep", "bool"},   {"pzone_tcp", "num"}, {"pzone_ori", "num"}, {"pzone_eax", "num"},
                        {"zone_ori", "num"}, {"zone_leax", "num"}, {"zone_reax", "num"}};
  types_["arcdata"] = numbers(
      {"sched", "mode", "voltage", "wirefeed", "control", "current", "voltage2", "wirefeed2", "control2"});
  types_["welddata"] = {
      {"weld_speed", "num"}, {"org_weld_speed", "num"}, {"main_arc", "arcdata"}, {"org_arc", "arcdata"}};
  types_["seamdata"] = {
      {"purge_time", "num"},   {"preflow_time", "num"}, {"ign_arc", "arcdata"},   {"ign_move_delay", "num"},
      {"scrape_start", "num"}, {"heat_speed", "num"},   {"heat_time", "num"},     {"heat_distance", "num"},
      {"heat_arc", "arcdata"}, {"cool_time", "num"},    {"fill_time", "num"},     {"fill_arc", "arcdata"},
      {"bback_time", "num"},   {"rback_time", "num"},   {"bback_arc", "arcdata"}, {"postflow_time", "num"}};
  types_["weavedata"] =
      numbers({"weave_shape", "weave_type", "weave_length", "weave_width", "weave_height", "dwell_left",
               "dwell_center", "dwell_right", "weave_dir", "weave_tilt", "weave_ori", "weave_bias",
               "org_weave_width", "org_weave_height", "org_weave_bias"});
  types_["trackdata"] = numbers({"track_system", "store_path", "max_corr"});
  types_["egmident"] = numbers({"id"});
  types_["egm_minmax"] = numbers({"min", "max"});
}

bool TypeTable::known(const std::string& type) const { return types_.contains(type); }

const std::vector<Component>& TypeTable::components(const std::string& type) const {
  static const std::vector<Component> kNone;
  const auto found = types_.find(type);
  return found == types_.end() ? kNone : found->second;
}

void TypeTable::add(const std::string& type, std::vector<Component> components) {
  types_[type] = std::move(components);
}

Value TypeTable::initial(const std::string& type) const {
  const auto& parts = components(type);
  if (parts.empty()) {
    if (type == "bool") return Value::of(false);
    if (type == "string" || type == "mecunit") return Value::of(std::string());
    return Value::of(0.0);
  }
  Value out;
  out.kind = Value::Kind::Record;
  for (const Component& part : parts) out.items.push_back(initial(part.type));
  return out;
}

Value TypeTable::initial(const std::string& type, const std::vector<int>& dimensions,
                         std::size_t level) const {
  if (level == dimensions.size()) return initial(type);
  Value out;
  out.kind = Value::Kind::Array;
  for (int i = 0; i < dimensions[level]; ++i) out.items.push_back(initial(type, dimensions, level + 1));
  return out;
}

Status TypeTable::fit(Value& value, const std::string& type, const std::vector<int>& dimensions,
                      std::size_t level) const {
  const bool aggregate = value.kind == Value::Kind::Record || value.kind == Value::Kind::Array;
  if (level < dimensions.size()) {
    if (!aggregate || value.items.size() != static_cast<std::size_t>(dimensions[level])) {
      return Error{"rapid.type", type, "an array of " + std::to_string(dimensions[level]) + " is needed", ""};
    }
    value.kind = Value::Kind::Array;
    for (Value& item : value.items) {
      if (Status inner = fit(item, type, dimensions, level + 1); !inner) return inner;
    }
    return Done{};
  }
  const auto& parts = components(type);
  if (!parts.empty()) {
    if (!aggregate || value.items.size() != parts.size()) {
      return Error{"rapid.type", type, "needs " + std::to_string(parts.size()) + " components", ""};
    }
    value.kind = Value::Kind::Record;
    for (std::size_t i = 0; i < parts.size(); ++i) {
      if (Status inner = fit(value.items[i], parts[i].type, {}); !inner) {
        return Error{"rapid.type", type + "." + parts[i].name, inner.error().what, ""};
      }
    }
    return Done{};
  }
  const auto wanted = type == "bool"                          ? Value::Kind::Boolean
                      : type == "string" || type == "mecunit" ? Value::Kind::Text
                                                              : Value::Kind::Number;
  if (value.kind != wanted) return Error{"rapid.type", type, "value is not of type " + type, ""};
  if (type == "num") value.number = static_cast<double>(static_cast<float>(value.number));
  return Done{};
}

namespace {

class LiteralReader {
 public:
  explicit LiteralReader(std::string_view text) : text_(text) {}

  Result<Value> whole() {
    Result<Value> out = value();
    skip();
    if (out && at_ != text_.size()) return bad("text after the literal");
    return out;
  }

 private:
  Error bad(const std::string& what) const {
    return {"rapid.literal", "column " + std::to_string(at_ + 1), what, ""};
  }
  void skip() {
    while (at_ < text_.size() && std::isspace(static_cast<unsigned char>(text_[at_]))) ++at_;
  }
  bool take(char c) {
    skip();
    if (at_ < text_.size() && text_[at_] == c) return ++at_, true;
    return false;
  }

  Result<Value> value() {
    skip();
    if (at_ >= text_.size()) return bad("value expected");
    if (take('[')) return aggregate();
    if (text_[at_] == '"') return quoted();
    if (std::isalpha(static_cast<unsigned char>(text_[at_]))) {
      const std::size_t begin = at_;
      while (at_ < text_.size() && std::isalpha(static_cast<unsigned char>(text_[at_]))) ++at_;
      const std::string word = lower(text_.substr(begin, at_ - begin));
      if (word == "true") return Value::of(true);
      if (word == "false") return Value::of(false);
      return bad("unknown word '" + word + "'");
    }
    const std::string rest(text_.substr(at_, 64));
    char* end = nullptr;
    const double number = std::strtod(rest.c_str(), &end);
    if (end == rest.c_str() || !std::isfinite(number)) return bad("number expected");
    at_ += static_cast<std::size_t>(end - rest.c_str());
    return Value::of(number);
  }

  Result<Value> aggregate() {
    if (++depth_ > 16) return bad("nested too deep");
    Value out;
    out.kind = Value::Kind::Record;
    if (!take(']')) {
      do {
        Result<Value> item = value();
        if (!item) return item;
        out.items.push_back(std::move(*item));
      } while (take(','));
      if (!take(']')) return bad("']' expected");
    }
    --depth_;
    return out;
  }

  Result<Value> quoted() {
    std::string out;
    for (++at_; at_ < text_.size(); ++at_) {
      if (text_[at_] == '"') {
        if (at_ + 1 < text_.size() && text_[at_ + 1] == '"') {
          ++at_;
        } else {
          ++at_;
          return Value::of(std::move(out));
        }
      }
      out += text_[at_];
    }
    return bad("string without an end");
  }

  std::string_view text_;
  std::size_t at_ = 0;
  int depth_ = 0;
};

}  // namespace

Result<Value> parse_literal(std::string_view text) { return LiteralReader(text).whole(); }

std::string print(const Value& value) {
  switch (value.kind) {
    case Value::Kind::Number: {
      // "Not used" of an external axis, which single precision cannot hold exactly.
      if (value.number == static_cast<double>(9e9F)) return "9E+09";
      char text[40];
      std::snprintf(text, sizeof text, "%.9G", value.number);
      return text;
    }
    case Value::Kind::Boolean:
      return value.flag ? "TRUE" : "FALSE";
    case Value::Kind::Text: {
      std::string out = "\"";
      for (const char c : value.text) out += c == '"' ? std::string("\"\"") : std::string(1, c);
      return out + "\"";
    }
    case Value::Kind::Record:
    case Value::Kind::Array:
      break;
  }
  std::string out = "[";
  for (std::size_t i = 0; i < value.items.size(); ++i) out += (i ? "," : "") + print(value.items[i]);
  return out + "]";
}

}  // namespace weldcell::sim::rapid
