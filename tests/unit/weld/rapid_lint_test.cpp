#include "rapid_lint.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <regex>
#include <set>
#include <sstream>

namespace weldcell::weld::test {
namespace {

/// Shapes: n number, b TRUE/FALSE, s "text", q four numbers of unit norm, digits repeat, brackets nest.
const std::map<std::string, std::string> kShapes{
    {"num", "n"},
    {"bool", "b"},
    {"string", "s"},
    {"egm_minmax", "[nn]"},
    {"robtarget", "[[nnn]q[nnnn][nnnnnn]]"},
    {"jointtarget", "[[nnnnnn][nnnnnn]]"},
    {"tooldata", "[b[[nnn]q][n[nnn]qnnn]]"},
    {"wobjdata", "[bbs[[nnn]q][[nnn]q]]"},
    {"welddata", "[nn[nnnnnnnnn][nnnnnnnnn]]"},
    {"seamdata", "[nn[nnnnnnnnn]nnnnn[nnnnnnnnn]nn[nnnnnnnnn]nn[nnnnnnnnn]n]"}};

class LiteralReader {
 public:
  explicit LiteralReader(const std::string& text) : text_(text) {}
  bool read(Literal& out) { return one(out) && at_ == text_.size(); }

 private:
  bool one(Literal& out) {
    if (at_ >= text_.size()) return false;
    if (text_[at_] == '[') {
      ++at_;
      out.list = true;
      do {
        out.items.emplace_back();
        if (!one(out.items.back())) return false;
      } while (at_ < text_.size() && text_[at_] == ',' && ++at_);
      return at_ < text_.size() && text_[at_++] == ']';
    }
    if (text_[at_] == '"') {
      const auto end = text_.find('"', at_ + 1);
      if (end == std::string::npos) return false;
      out.word = text_.substr(at_, end + 1 - at_);
      at_ = end + 1;
      return true;
    }
    const auto end = std::min(text_.find_first_of(",]", at_), text_.size());
    out.word = text_.substr(at_, end - at_);
    at_ = end;
    static const std::regex kNumber("-?[0-9]+(\\.[0-9]+)?(E[+-]?[0-9]+)?");
    out.numeric = std::regex_match(out.word, kNumber);
    if (out.numeric) out.number = std::stod(out.word);
    return !out.word.empty();
  }
  const std::string& text_;
  std::size_t at_ = 0;
};

bool unit(const Literal& q) {
  if (!q.list || q.items.size() != 4) return false;
  double sum = 0;
  for (const Literal& n : q.items) {
    if (!n.numeric) return false;
    sum += n.number * n.number;
  }
  return std::abs(std::sqrt(sum) - 1) < 1e-6;
}

bool fits(const Literal& value, const std::string& shape, std::size_t& at) {
  switch (shape[at++]) {
    case 'n':
      return value.numeric;
    case 'b':
      return value.word == "TRUE" || value.word == "FALSE";
    case 's':
      return value.word.size() >= 2 && value.word.front() == '"';
    case 'q':
      return unit(value);
    default:
      break;
  }
  if (!value.list) return false;
  for (const Literal& item : value.items) {
    if (at >= shape.size() || shape[at] == ']' || !fits(item, shape, at)) return false;
  }
  return shape[at++] == ']';
}

std::string trimmed(const std::string& line) {
  const auto first = line.find_first_not_of(' ');
  return first == std::string::npos ? "" : line.substr(first);
}

class Linter {
 public:
  explicit Linter(const std::string& text) : text_(text) {}

  Module run() {
    std::istringstream lines(text_);
    for (std::string line; std::getline(lines, line);) read(++number_, line);
    if (!blocks_.empty()) fault("'" + blocks_.back() + "' is not closed");
    if (!ended_) fault("ENDMODULE is missing");
    for (const Instruction& i : out_.instructions) check_names(i);
    return std::move(out_);
  }

 private:
  void fault(const std::string& what) {
    out_.faults.push_back("line " + std::to_string(number_) + ": " + what);
  }

  void read(int number, const std::string& line) {
    number_ = number;
    if (line.size() >= 255) fault("longer than 254 characters");
    for (const char c : line) {
      if (c < 0x20 || c > 0x7E) return fault("a character outside printable ASCII");
    }
    const std::string code = trimmed(line);
    if (code.empty() || code.front() == '!') return;
    check_identifiers(code);
    std::smatch m;
    static const std::regex kModule("MODULE ([A-Za-z][A-Za-z0-9_]*)"),
        kProc("PROC ([A-Za-z][A-Za-z0-9_]*)\\(\\)"), kTrap("TRAP ([A-Za-z][A-Za-z0-9_]*)"),
        kData("(PERS|CONST|VAR) ([a-z_]+) ([A-Za-z][A-Za-z0-9_]*)(:=(.*))?;"), kIf("IF .* THEN"),
        kWhile("WHILE .* DO");
    if (std::regex_match(code, m, kModule)) {
      out_.name = m[1];
    } else if (std::regex_match(code, m, kProc)) {
      open("ENDPROC");
      routine_ = m[1];
      out_.routines.push_back(m[1]);
    } else if (std::regex_match(code, m, kTrap)) {
      open("ENDTRAP");
      routine_ = m[1];
    } else if (std::regex_match(code, m, kData)) {
      data(m[1], m[2], m[3], m[5]);
    } else if (std::regex_match(code, kIf)) {
      open("ENDIF");
    } else if (std::regex_match(code, kWhile)) {
      open("ENDWHILE");
    } else if (code == "ERROR") {
      if (blocks_.empty() || blocks_.back() != "ENDPROC") fault("ERROR outside a routine");
    } else if (code == "ENDPROC" || code == "ENDTRAP" || code == "ENDIF" || code == "ENDWHILE") {
      if (blocks_.empty() || blocks_.back() != code) return fault(code + " without its beginning");
      blocks_.pop_back();
    } else if (code == "ENDMODULE") {
      ended_ = true;
    } else if (code.back() == ';' && code.find(';') == code.size() - 1 && !blocks_.empty()) {
      out_.instructions.push_back({number_, routine_, code.substr(0, code.size() - 1)});
    } else {
      fault("not a statement: " + code);
    }
  }

  void open(const std::string& end) { blocks_.push_back(end); }

  void check_identifiers(const std::string& code) {
    static const std::regex kWord("[A-Za-z_][A-Za-z0-9_]*");
    const std::string bare = std::regex_replace(code, std::regex("\"[^\"]*\""), "");
    for (std::sregex_iterator i(bare.begin(), bare.end(), kWord), end; i != end; ++i) {
      if (i->str().size() > 32) fault("identifier longer than 32 characters: " + i->str());
    }
  }

  void data(const std::string& kind, const std::string& type, const std::string& name,
            const std::string& text) {
    if (!names_.insert(name).second) fault(name + " is declared twice");
    Declared d{kind, type, name, text, {}};
    if (text.empty()) {
      if (kind != "VAR") fault(name + " has no value");
      out_.data.push_back(d);
      return;
    }
    const auto shape = kShapes.find(type);
    std::size_t at = 0;
    if (shape == kShapes.end()) {
      fault("no shape is known for type " + type);
    } else if (!LiteralReader(text).read(d.value) || !fits(d.value, shape->second, at) ||
               at != shape->second.size()) {
      fault(name + " is no " + type + ": " + text);
    } else if (type == "robtarget" || type == "jointtarget") {
      for (const Literal& e : d.value.items.back().items) {
        if (e.word != "9E+09") fault(name + ": an external axis is used: " + e.word);
      }
    }
    out_.data.push_back(std::move(d));
  }

  void check_names(const Instruction& i) {
    number_ = i.line;
    static const std::regex kMove("(MoveAbsJ|MoveL|MoveJ|ArcLStart|ArcL|ArcLEnd) (.*)");
    std::smatch m;
    if (!std::regex_match(i.text, m, kMove)) return;
    std::vector<std::string> arguments;
    std::istringstream list(m[2]);
    for (std::string a; std::getline(list, a, ',');) arguments.push_back(a);
    const bool arc = m[1].str().rfind("ArcL", 0) == 0;
    if (arguments.size() != (arc ? 6u : 4u)) return fault("wrong number of arguments: " + i.text);
    const Declared* target = out_.find(arguments[0]);
    if (!target || target->type != (m[1] == "MoveAbsJ" ? "jointtarget" : "robtarget"))
      fault("target of " + i.text);
    if (!std::regex_match(arguments[1], std::regex("v[0-9]+"))) fault("speed of " + i.text);
    if (arc && (!typed(arguments[2], "seamdata") || !typed(arguments[3], "welddata")))
      fault("arc data of " + i.text);
    const std::string& zone = arguments[arc ? 4 : 2];
    if (!std::regex_match(zone, std::regex("fine|z[0-9]+"))) fault("zone of " + i.text);
    if ((m[1] == "ArcLStart" || m[1] == "ArcLEnd") && zone != "fine") fault("not fine: " + i.text);
    const std::string tool = arguments.back().substr(0, arguments.back().find('\\'));
    if (!typed(tool, "tooldata")) fault("tool of " + i.text);
  }

  bool typed(const std::string& name, const std::string& type) const {
    const Declared* d = out_.find(name);
    return d && d->type == type;
  }

  const std::string& text_;
  Module out_;
  std::set<std::string> names_;
  std::vector<std::string> blocks_;
  std::string routine_;
  int number_ = 0;
  bool ended_ = false;
};

}  // namespace

const Declared* Module::find(const std::string& wanted) const {
  for (const Declared& d : data) {
    if (d.name == wanted) return &d;
  }
  return nullptr;
}

Module lint(const std::string& text) { return Linter(text).run(); }

namespace {

using ::testing::IsEmpty;
using ::testing::Not;

std::string with(const std::string& line) { return "MODULE M\n" + line + "\nENDMODULE\n"; }

TEST(RapidLint, CatchesEveryKindOfBrokenText) {
  EXPECT_THAT(lint(with("PERS num n:=0;")).faults, IsEmpty());
  EXPECT_THAT(lint(with("PERS num n:=0")).faults, Not(IsEmpty()));
  EXPECT_THAT(lint(with("PERS num n:=nan;")).faults, Not(IsEmpty()));
  EXPECT_THAT(lint(with("PERS num n:=inf;")).faults, Not(IsEmpty()));
  EXPECT_THAT(lint(with("PERS num n:=1;\nPERS num n:=2;")).faults, Not(IsEmpty()));
  EXPECT_THAT(lint(with("CONST jointtarget j:=[[1,2,3,4,5],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];")).faults,
              Not(IsEmpty()));
  EXPECT_THAT(lint(with("CONST jointtarget j:=[[1,2,3,4,5,6],[9E+09,9E+09,9E+09,9E+09,9E+09,9E9]];")).faults,
              Not(IsEmpty()));
  const std::string externals = "[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]";
  EXPECT_THAT(lint(with("CONST robtarget p:=[[1,2,3],[1,0,0,0],[0,0,0,0]," + externals + "];")).faults,
              IsEmpty());
  EXPECT_THAT(lint(with("CONST robtarget p:=[[1,2,3],[1,0.1,0,0],[0,0,0,0]," + externals + "];")).faults,
              Not(IsEmpty()));
  EXPECT_THAT(lint(with("PROC P()\nMoveL pNone,v100,z1,tNone;\nENDPROC")).faults, Not(IsEmpty()));
  EXPECT_THAT(lint(with("PROC P()")).faults, Not(IsEmpty()));
  EXPECT_THAT(lint(with("! caf\xc3\xa9")).faults, Not(IsEmpty()));
  EXPECT_THAT(lint(with("PERS num nAnIdentifierLongerThanRapidAllows:=0;")).faults, Not(IsEmpty()));
  EXPECT_THAT(lint("MODULE M\n").faults, Not(IsEmpty()));
}

}  // namespace
}  // namespace weldcell::weld::test
