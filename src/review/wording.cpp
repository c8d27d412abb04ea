#include "wording.hpp"

#include <fmt/format.h>

#include <cmath>

namespace weldcell::review {

std::string number(double value, int decimals) {
  if (!std::isfinite(value)) return "-";
  std::string out = fmt::format("{:.{}f}", value, decimals);
  if (out.front() == '-' && out.find_first_not_of("-0.") == std::string::npos) out.erase(0, 1);
  return out;
}

std::string signed_number(double value, int decimals) {
  const std::string out = number(value, decimals);
  return out.front() == '-' || out.find_first_not_of("0.") == std::string::npos ? out : "+" + out;
}

const char* in_words(localize::Verdict verdict) {
  switch (verdict) {
    case localize::Verdict::Weld:
      return "Weld";
    case localize::Verdict::Rescan:
      return "Scan again";
    case localize::Verdict::Reject:
      return "Do not weld";
  }
  return "Do not weld";
}

const char* css_class(localize::Verdict verdict) {
  switch (verdict) {
    case localize::Verdict::Weld:
      return "weld";
    case localize::Verdict::Rescan:
      return "rescan";
    case localize::Verdict::Reject:
      return "reject";
  }
  return "reject";
}

}  // namespace weldcell::review
