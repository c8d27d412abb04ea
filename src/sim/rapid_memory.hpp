// What is loaded in a RAPID task: modules, their data and routines, and the predefined data; expressions over
// it. Pure.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "sim/rapid_syntax.hpp"

namespace weldcell::sim::rapid {

/// ERRNO values that programs handle by name.
inline constexpr int kErrUdpUcComm = 1120;
inline constexpr int kErrDivZero = 1021;
inline constexpr int kErrOutOfBounds = 1115;
inline constexpr int kErrReferenceUnknown = 1052;
inline constexpr int kErrArgument = 1097;
inline constexpr int kErrWaitTimeOut = 1087;
inline constexpr int kErrNotHandled = 0;  ///< cannot be handled in RAPID: the program stops

/// Thrown while a statement runs; becomes an ERROR handler's ERRNO or an event.
struct RapidError {
  int number = kErrNotHandled;
  std::string what;
  int event = 40199;  ///< event number when nobody handles it
};

struct Datum {
  Storage storage = Storage::Variable;
  std::string type, display, module;
  std::vector<int> dimensions;
  bool local = false;
  Value value;
};

using DataMap = std::map<std::string, Datum>;

/// Where a statement runs: names are looked up in the routine, its module, then everywhere.
struct Scope {
  DataMap* locals = nullptr;
  std::string module;
};

class Memory {
 public:
  /// Functions of the machine: CJointT(), OpMode() and so on. Returns nothing when the name is unknown.
  using MachineFunction =
      std::function<std::optional<Value>(const std::string& name, const std::vector<Value>& arguments)>;

  Memory();

  /// Errors: "rapid.syntax" (where = line), "rapid.exists" when the module is loaded and not to be replaced.
  Result<std::string> load(std::string_view text, bool replace);
  bool unload(const std::string& module);
  const std::map<std::string, std::shared_ptr<const Module>>& modules() const { return modules_; }
  std::shared_ptr<const Module> module(const std::string& name) const;

  Datum* find(const Scope& scope, const std::string& name);
  /// Data by module and name as RWS addresses it; an empty module finds predefined data.
  Datum* symbol(const std::string& module, const std::string& name);
  /// Data of a module, or of all modules when it is empty, in the order of their names.
  std::vector<std::pair<std::string, const Datum*>> data_of(const std::string& module) const;
  const Routine* routine(const std::string& module, const std::string& name) const;
  void define(const std::string& display, const std::string& type, Value value,
              Storage storage = Storage::Constant);
  void set_machine_function(MachineFunction function) { machine_ = std::move(function); }
  const TypeTable& types() const { return types_; }

  Value evaluate(const Expression& expression, const Scope& scope);
  /// The storage that a reference names. Throws RapidError for unknown names, bad indices.
  Value* resolve(const Expression& reference, const Scope& scope, Datum** owner = nullptr,
                 std::string* type = nullptr);
  /// A datum as declared, its initial value evaluated in `scope`.
  Datum make_datum(const Declaration& declaration, const Scope& scope);

 private:
  Value unary(const Expression& expression, const Scope& scope);
  Value binary(const Expression& expression, const Scope& scope);
  Value function(const Expression& expression, const Scope& scope);
  void define_standard();

  TypeTable types_;
  std::map<std::string, std::shared_ptr<const Module>> modules_;
  std::map<std::string, DataMap> data_;
  DataMap predefined_;
  MachineFunction machine_;
};

}  // namespace weldcell::sim::rapid
