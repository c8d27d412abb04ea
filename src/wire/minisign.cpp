#include "weldcell/wire/minisign.hpp"

#include <algorithm>
#include <span>

namespace weldcell::wire {
namespace {

constexpr std::string_view kUntrusted = "untrusted comment: ", kTrusted = "trusted comment: ";

int value_of(char c) {
  if (c >= 'A' && c <= 'Z') return c - 'A';
  if (c >= 'a' && c <= 'z') return c - 'a' + 26;
  if (c >= '0' && c <= '9') return c - '0' + 52;
  return c == '+' ? 62 : c == '/' ? 63 : -1;
}

/// Base64 of exactly so many bytes, padded, without unused bits set; false otherwise.
bool decode(std::string_view text, std::span<std::uint8_t> bytes) {
  if (text.size() != (bytes.size() + 2) / 3 * 4) return false;
  const std::size_t padding = (3 - bytes.size() % 3) % 3;
  std::uint32_t bits = 0;
  int held = 0;
  std::size_t at = 0;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (i + padding >= text.size()) {
      if (text[i] != '=') return false;
      continue;
    }
    const int value = value_of(text[i]);
    if (value < 0) return false;
    bits = (bits << 6 | static_cast<std::uint32_t>(value)) & 0xFFFFFF;
    held += 6;
    if (held < 8) continue;
    held -= 8;
    bytes[at++] = static_cast<std::uint8_t>(bits >> held);
  }
  return (bits & ((1U << held) - 1)) == 0;
}

Error bad_form(std::string what) {
  return {"signature.form", "", std::move(what), "sign it again: minisign -Sm FILE"};
}

std::string_view take_line(std::string_view& text) {
  const std::size_t end = std::min(text.find('\n'), text.size());
  std::string_view line = text.substr(0, end);
  text.remove_prefix(std::min(end + 1, text.size()));
  while (!line.empty() && line.back() == '\r') line.remove_suffix(1);
  return line;
}

}  // namespace

std::string to_string(const MinisignKeyId& id) {
  constexpr char kDigits[] = "0123456789ABCDEF";
  std::string out;
  for (auto byte = id.rbegin(); byte != id.rend(); ++byte) {
    out += kDigits[*byte >> 4];
    out += kDigits[*byte & 15];
  }
  return out;
}

std::optional<MinisignKey> minisign_key(std::string_view text) {
  std::array<std::uint8_t, 42> bytes{};
  if (!decode(text, bytes) || bytes[0] != 'E' || bytes[1] != 'd') return std::nullopt;
  MinisignKey out;
  std::copy_n(bytes.begin() + 2, out.id.size(), out.id.begin());
  std::copy_n(bytes.begin() + 10, out.point.size(), out.point.begin());
  return out;
}

bool looks_like_minisign_secret(std::string_view text) {
  // "Ed", then how its passphrase is stretched: "Sc", or nothing.
  return text.size() > 100 && (text.starts_with("RWRTY0Iy") || text.starts_with("RWQAAEIy"));
}

Result<MinisignSignature> minisign_signature(std::string_view text) {
  if (text.empty()) return bad_form("is empty");
  if (text.size() > kMinisignMostBytes)
    return bad_form("has " + std::to_string(text.size()) + " bytes: no signature is so long");
  MinisignSignature out;
  std::array<std::uint8_t, 74> bytes{};
  if (!take_line(text).starts_with(kUntrusted)) return bad_form("does not begin with an untrusted comment");
  if (!decode(take_line(text), bytes)) return bad_form("its second line is no signature");
  if (bytes[0] != 'E' || (bytes[1] != 'D' && bytes[1] != 'd'))
    return bad_form("is made by an algorithm that is not known here");
  out.prehashed = bytes[1] == 'D';
  std::copy_n(bytes.begin() + 2, out.key.size(), out.key.begin());
  std::copy_n(bytes.begin() + 10, out.signature.size(), out.signature.begin());
  const std::string_view trusted = take_line(text);
  if (!trusted.starts_with(kTrusted)) return bad_form("has no trusted comment");
  out.trusted_comment = trusted.substr(kTrusted.size());
  if (!decode(take_line(text), out.global_signature))
    return bad_form("its fourth line does not sign the trusted comment");
  if (text.find_first_not_of("\r\n") != std::string_view::npos)
    return bad_form("goes on behind its fourth line");
  return out;
}

}  // namespace weldcell::wire
