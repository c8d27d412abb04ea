// Is this text signed by one of these keys? minisign's signatures, checked with libsodium. Any thread.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "weldcell/base/result.hpp"
#include "weldcell/wire/minisign.hpp"

namespace weldcell::adapters {

struct Signer {
  wire::MinisignKeyId key{};
  std::string comment;  ///< the trusted comment, signed too; control characters shown as '?'
};

/// Errors: "signature.form" (no such signature), "signature.key" (of a key that is not among them),
/// "signature.wrong" (not of this text, or its trusted comment was altered). `what` names the key.
Result<Signer> check_signature(std::string_view text, std::string_view signature,
                               std::span<const wire::MinisignKey> keys);

/// The text of a signature's file; empty where there is none. Error "signature.form": a link, no plain file,
/// too large, or not readable.
Result<std::optional<std::string>> read_signature_file(const std::string& path);

}  // namespace weldcell::adapters
