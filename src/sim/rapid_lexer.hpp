// RAPID text -> tokens. Pure.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "weldcell/base/result.hpp"

namespace weldcell::sim::rapid {

struct Token {
  enum class Kind { Identifier, Number, Text, Symbol, End };
  Kind kind = Kind::End;
  std::string text;  ///< identifiers as written
  std::string word;  ///< identifiers in lower case; symbols
  double number = 0;
  int line = 1;
};

/// Error "rapid.syntax", where = "line N".
Result<std::vector<Token>> tokenize(std::string_view text);

}  // namespace weldcell::sim::rapid
