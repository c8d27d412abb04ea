// RAPID data: types as component lists, values, literals read and printed. Pure.
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "weldcell/base/result.hpp"

namespace weldcell::sim::rapid {

/// Identifiers are compared without case.
std::string lower(std::string_view text);

/// A value of any RAPID type. Records and arrays keep their parts in `items`.
struct Value {
  enum class Kind { Number, Boolean, Text, Record, Array };
  Kind kind = Kind::Number;
  double number = 0;
  bool flag = false;
  std::string text;
  std::vector<Value> items;

  static Value of(double v);
  static Value of(bool v);
  static Value of(std::string v);
  bool operator==(const Value& other) const;
};

struct Component {
  std::string name, type;
};

/// Which types exist: the built-in ones and the RECORDs of loaded modules.
class TypeTable {
 public:
  TypeTable();
  bool known(const std::string& type) const;
  /// Components of a record type; empty for num, bool, string and their aliases.
  const std::vector<Component>& components(const std::string& type) const;
  void add(const std::string& type, std::vector<Component> components);
  Value initial(const std::string& type) const;
  Value initial(const std::string& type, const std::vector<int>& dimensions, std::size_t level = 0) const;
  /// Checks the shape of `value` against the type; numbers are cut to single precision as the controller
  /// stores `num`. Error "rapid.type" says which component does not fit.
  Status fit(Value& value, const std::string& type, const std::vector<int>& dimensions,
             std::size_t level = 0) const;

 private:
  std::map<std::string, std::vector<Component>> types_;
};

/// A literal as RWS carries it: 1, TRUE, "text", [[1,2],[3,4]]. Error "rapid.literal".
Result<Value> parse_literal(std::string_view text);
std::string print(const Value& value);

}  // namespace weldcell::sim::rapid
