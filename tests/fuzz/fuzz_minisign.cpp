// Any bytes as a public key and as a signature of minisign: read whole, or refused in words.
#include "fuzz_target.hpp"
#include "weldcell/wire/minisign.hpp"

using namespace weldcell;

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  if (const auto key = wire::minisign_key(text)) {
    WELDCELL_ASSERT(text.size() == 56 && text.starts_with("RW"));
    WELDCELL_ASSERT(wire::to_string(key->id).size() == 16);
  }
  const auto signature = wire::minisign_signature(text);
  if (signature.ok()) {
    WELDCELL_ASSERT(size <= wire::kMinisignMostBytes);
    WELDCELL_ASSERT(signature->trusted_comment.find('\n') == std::string::npos);
  } else {
    WELDCELL_ASSERT(!signature.error().what.empty() && !signature.error().mend.empty());
  }
  return 0;
}
