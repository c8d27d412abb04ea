// Register images of any content: decoding and encoding again gives the same registers, in both word orders.
#include <algorithm>

#include "fuzz_target.hpp"
#include "weldcell/wire/plc_map.hpp"

using namespace weldcell;

namespace {

template <std::size_t Words>
std::array<std::uint16_t, Words> image(const std::uint8_t* data, std::size_t size) {
  std::array<std::uint16_t, Words> out{};
  for (std::size_t i = 0; i < std::min(Words, size / 2); ++i) {
    out[i] = static_cast<std::uint16_t>(data[2 * i] << 8 | data[2 * i + 1]);
  }
  return out;
}

/// The words that registers of the map cover; reserved ones are not carried.
template <std::size_t Words>
void expect_same(std::span<const wire::PlcRegister> registers, const std::array<std::uint16_t, Words>& a,
                 const std::array<std::uint16_t, Words>& b) {
  for (const auto& reg : registers) {
    const std::string_view name = reg.name;
    if (name == "test_word" || name == "test_real" || name == "map_version") continue;
    WELDCELL_ASSERT(a[reg.offset] == b[reg.offset]);
    if (reg.type != wire::PlcType::Word) WELDCELL_ASSERT(a[reg.offset + 1U] == b[reg.offset + 1U]);
  }
}

}  // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  for (const auto order : {wire::WordOrder::Abcd, wire::WordOrder::Cdab}) {
    const auto orders = image<wire::kPlcWriteWords>(data, size);
    expect_same(wire::plc_write_registers(), orders,
                wire::encode_plc_order(wire::decode_plc_order(orders, order), order));
    const auto status = image<wire::kPlcReadWords>(data, size);
    const auto again = wire::encode_plc_status(wire::decode_plc_status(status, order), order);
    expect_same(wire::plc_read_registers(), status, again);
    WELDCELL_ASSERT(wire::find_word_order(again) == order);
  }
  return 0;
}
