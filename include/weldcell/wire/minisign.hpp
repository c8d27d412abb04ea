// The texts that minisign writes: a public key and a detached signature. What they are worth says who has the
// cryptography; here is only their form. Pure.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "weldcell/base/result.hpp"

namespace weldcell::wire {

/// More than minisign itself writes: comments of 1024 and 8192 bytes.
inline constexpr std::size_t kMinisignMostBytes = 10 * 1024;

using MinisignKeyId = std::array<std::uint8_t, 8>;
/// As minisign prints it: 16 hexadecimal digits.
std::string to_string(const MinisignKeyId& id);

struct MinisignKey {
  MinisignKeyId id{};
  std::array<std::uint8_t, 32> point{};  ///< Ed25519
  bool operator==(const MinisignKey&) const = default;
};
/// The key's line in minisign.pub: 56 characters that begin with RW. Nothing when it is none.
std::optional<MinisignKey> minisign_key(std::string_view text);
/// Begins as the secret key's file of minisign does; such a text must never stand where others read it.
bool looks_like_minisign_secret(std::string_view text);

struct MinisignSignature {
  bool prehashed = true;  ///< "ED": of the BLAKE2b-512 hash; false "Ed": of the file itself
  MinisignKeyId key{};
  std::array<std::uint8_t, 64> signature{};
  std::array<std::uint8_t, 64> global_signature{};  ///< of the signature and the trusted comment behind it
  std::string trusted_comment;
};
/// A whole .minisig file: four lines, with or without carriage returns, and nothing behind them. Error
/// "signature.form".
Result<MinisignSignature> minisign_signature(std::string_view text);

}  // namespace weldcell::wire
