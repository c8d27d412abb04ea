#include "weldcell/base/markup.hpp"

#include <cstdint>

namespace weldcell {

namespace {

constexpr const char* kReplacement = "\xEF\xBF\xBD";

/// Length of the well-formed UTF-8 character at the front, 0 when there is none (RFC 3629: no surrogates, no
/// long forms).
std::size_t character(std::string_view s) {
  const auto byte = [&](std::size_t i) { return i < s.size() ? static_cast<std::uint8_t>(s[i]) : 0; };
  const auto follows = [&](std::size_t i) { return (byte(i) & 0xC0) == 0x80; };
  const std::uint8_t b = static_cast<std::uint8_t>(byte(0));
  if (b < 0x80) return 1;
  if (b >= 0xC2 && b <= 0xDF && follows(1)) return 2;
  if (b >= 0xE0 && b <= 0xEF && follows(1) && follows(2)) {
    const bool long_form = b == 0xE0 && byte(1) < 0xA0, surrogate = b == 0xED && byte(1) > 0x9F;
    return long_form || surrogate ? 0 : 3;
  }
  if (b >= 0xF0 && b <= 0xF4 && follows(1) && follows(2) && follows(3)) {
    const bool long_form = b == 0xF0 && byte(1) < 0x90, beyond = b == 0xF4 && byte(1) > 0x8F;
    return long_form || beyond ? 0 : 4;
  }
  return 0;
}

}  // namespace

std::string escaped(std::string_view text) {
  std::string out;
  out.reserve(text.size() + text.size() / 8);
  while (!text.empty()) {
    const std::size_t n = character(text);
    const char c = text.front();
    if (n == 0) {
      out += kReplacement;
      text.remove_prefix(1);
      continue;
    }
    if (n > 1) {
      out += text.substr(0, n);
    } else if (c == '&') {
      out += "&amp;";
    } else if (c == '<') {
      out += "&lt;";
    } else if (c == '>') {
      out += "&gt;";
    } else if (c == '"') {
      out += "&quot;";
    } else if (c == '\'') {
      out += "&#39;";
    } else if ((static_cast<unsigned char>(c) < 0x20 && c != '\n' && c != '\t') || c == 0x7F) {
      if (c != '\r') out += kReplacement;
    } else {
      out += c;
    }
    text.remove_prefix(n);
  }
  return out;
}

}  // namespace weldcell
