// Numbers and verdicts as the page prints them. Pure.
#pragma once

#include <string>

#include "weldcell/base/markup.hpp"
#include "weldcell/localize/localize.hpp"

namespace weldcell::review {

/// Fixed decimals; "-" when not finite, and never a negative zero.
std::string number(double value, int decimals);
/// The same with its sign, "+0.12".
std::string signed_number(double value, int decimals);

/// The verdict in the words of the shop: "Weld", "Scan again", "Do not weld".
const char* in_words(localize::Verdict verdict);
/// Class name of the verdict in the page's style sheet.
const char* css_class(localize::Verdict verdict);

}  // namespace weldcell::review
