#include "weldcell/adapters/signature_check.hpp"

#include <sodium.h>
#include <sys/stat.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <vector>

#include "spool_files.hpp"

namespace weldcell::adapters {
namespace {

constexpr const char* kSignAgain = "sign it again: minisign -Sm FILE";

bool verified(std::span<const std::uint8_t> message, std::span<const std::uint8_t, 64> signature,
              const wire::MinisignKey& key) {
  return ::crypto_sign_verify_detached(signature.data(), message.data(), message.size(), key.point.data()) ==
         0;
}

std::string names_of(std::span<const wire::MinisignKey> keys) {
  std::string out;
  for (const wire::MinisignKey& key : keys) out += (out.empty() ? "" : ", ") + wire::to_string(key.id);
  return out.empty() ? "none" : out;
}

std::string printable(std::string text) {
  std::ranges::replace_if(
      text, [](char c) { return static_cast<unsigned char>(c) < ' ' || c == 0x7F; }, '?');
  return text;
}

}  // namespace

Result<Signer> check_signature(std::string_view text, std::string_view signature,
                               std::span<const wire::MinisignKey> keys) {
  if (::sodium_init() < 0)
    return Error{"signature.wrong", "", "libsodium does not start", "check that /dev/urandom is there"};
  const auto read = wire::minisign_signature(signature);
  if (!read.ok()) return read.error();
  const std::string name = wire::to_string(read->key);
  const auto key = std::ranges::find(keys, read->key, &wire::MinisignKey::id);
  if (key == keys.end())
    return Error{"signature.key", "", "is signed by the key " + name + ", allowed are: " + names_of(keys),
                 "let one of these sign it, or add the key's public line to jobs.signed_by"};
  std::vector<std::uint8_t> message(text.begin(), text.end());
  if (read->prehashed) {
    std::vector<std::uint8_t> hash(64);
    ::crypto_generichash(hash.data(), hash.size(), message.data(), message.size(), nullptr, 0);
    message = std::move(hash);
  }
  if (!verified(message, read->signature, *key))
    return Error{"signature.wrong", "", "is not what the key " + name + " signed: it was changed since",
                 kSignAgain};
  std::vector<std::uint8_t> whole(read->signature.begin(), read->signature.end());
  whole.insert(whole.end(), read->trusted_comment.begin(), read->trusted_comment.end());
  if (!verified(whole, read->global_signature, *key))
    return Error{"signature.wrong", "",
                 "its signature's trusted comment is not what the key " + name + " signed", kSignAgain};
  return Signer{read->key, printable(read->trusted_comment)};
}

Result<std::optional<std::string>> read_signature_file(const std::string& path) {
  const auto refused = [&](const char* what) {
    return Error{"signature.form", path, what, "put the file itself there, as minisign wrote it"};
  };
  struct stat facts {};
  if (::lstat(path.c_str(), &facts) != 0) {
    if (errno == ENOENT || errno == ENOTDIR) return std::optional<std::string>{};
    return refused(std::strerror(errno));
  }
  if (!S_ISREG(facts.st_mode)) return refused("is no plain file");
  if (facts.st_size > static_cast<off_t>(wire::kMinisignMostBytes))
    return refused("is larger than 10 kB: that is no signature");
  return std::optional(read_text(path, wire::kMinisignMostBytes + 1));
}

}  // namespace weldcell::adapters
