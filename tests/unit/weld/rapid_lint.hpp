// Reads a RAPID module again and holds it against the rules that RobotWare 6 has for its text; for tests
// only.
#pragma once

#include <map>
#include <string>
#include <vector>

namespace weldcell::weld::test {

/// A literal: a number, a text or word, or a list of literals.
struct Literal {
  bool list = false, numeric = false;
  double number = 0;
  std::string word;
  std::vector<Literal> items;
};

struct Declared {
  std::string kind, type, name, text;  ///< kind: PERS, CONST, VAR
  Literal value;
};

struct Instruction {
  int line = 0;
  std::string routine, text;
};

struct Module {
  std::string name;
  std::vector<Declared> data;
  std::vector<std::string> routines;
  std::vector<Instruction> instructions;
  std::vector<std::string> faults;  ///< one a broken rule, with its line

  const Declared* find(const std::string& name) const;
};

/// Checks: 7-bit text, lines < 255, identifiers <= 32 and unique, blocks closed, one statement a line ended
/// by ';', each literal of the shape of its type, quaternions of unit norm to 1e-6, names in moves declared,
/// work and external values.
Module lint(const std::string& text);

}  // namespace weldcell::weld::test
