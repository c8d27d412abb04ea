// Result<T>: a value, or an Error that names code, place, cause and mend. Pure.
#pragma once

#include <string>
#include <utility>
#include <variant>

#include "weldcell/base/assert.hpp"

namespace weldcell {

/// What went wrong, in words for the person who can mend it.
struct Error {
  std::string code;   ///< stable short name, e.g. "cad.units"
  std::string where;  ///< file:line: key, device or function; may be empty
  std::string what;   ///< the cause, with the offending value
  std::string mend;   ///< what to do about it; may be empty

  /// "where: what: mend", the form of every message that a user reads.
  std::string text() const {
    std::string out = where;
    if (!what.empty()) out += (out.empty() ? "" : ": ") + what;
    if (!mend.empty()) out += (out.empty() ? "" : ": ") + mend;
    return out;
  }
};

/// Either a value or an Error. Reading the wrong side is a programmer error and aborts.
template <typename T>
class [[nodiscard]] Result {
 public:
  Result(T value) : state_(std::in_place_index<0>, std::move(value)) {}
  Result(Error error) : state_(std::in_place_index<1>, std::move(error)) {}

  bool ok() const { return state_.index() == 0; }
  explicit operator bool() const { return ok(); }

  T& value() & {
    WELDCELL_ASSERT(ok());
    return std::get<0>(state_);
  }
  const T& value() const& {
    WELDCELL_ASSERT(ok());
    return std::get<0>(state_);
  }
  T&& value() && {
    WELDCELL_ASSERT(ok());
    return std::get<0>(std::move(state_));
  }
  const Error& error() const {
    WELDCELL_ASSERT(!ok());
    return std::get<1>(state_);
  }
  T* operator->() { return &value(); }
  const T* operator->() const { return &value(); }
  T& operator*() & { return value(); }
  const T& operator*() const& { return value(); }

 private:
  std::variant<T, Error> state_;
};

struct Done {};
/// The result of an action that has nothing to return.
using Status = Result<Done>;

}  // namespace weldcell
