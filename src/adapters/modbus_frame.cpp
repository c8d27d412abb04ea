#include "modbus_frame.hpp"

#include "weldcell/wire/plc_map.hpp"

namespace weldcell::adapters {
namespace {

constexpr int kIllegalFunction = 1, kIllegalAddress = 2, kIllegalValue = 3;
constexpr unsigned kMostRead = 125, kMostWritten = 123, kMostWrittenWhileReading = 121;

unsigned word(std::span<const std::uint8_t> bytes, std::size_t at) noexcept {
  return static_cast<unsigned>(bytes[at] << 8 | bytes[at + 1]);
}

bool inside(unsigned address, unsigned count, unsigned base, unsigned words) noexcept {
  return address >= base && address + count <= base + words;
}
bool writable(unsigned address, unsigned count) noexcept {
  return inside(address, count, wire::kPlcWriteBase, wire::kPlcWriteWords);
}
bool readable(unsigned address, unsigned count) noexcept {
  return writable(address, count) || inside(address, count, wire::kPlcReadBase, wire::kPlcReadWords);
}

int refusal_of_read(std::span<const std::uint8_t> pdu) noexcept {
  if (pdu.size() != 5) return kIllegalValue;
  const unsigned count = word(pdu, 3);
  if (count < 1 || count > kMostRead) return kIllegalValue;
  return readable(word(pdu, 1), count) ? 0 : kIllegalAddress;
}

int refusal_of_single_write(std::span<const std::uint8_t> pdu) noexcept {
  if (pdu.size() != 5) return kIllegalValue;
  return writable(word(pdu, 1), 1) ? 0 : kIllegalAddress;
}

int refusal_of_write(std::span<const std::uint8_t> pdu) noexcept {
  if (pdu.size() < 6) return kIllegalValue;
  const unsigned count = word(pdu, 3);
  if (count < 1 || count > kMostWritten || pdu[5] != 2 * count || pdu.size() != 6 + 2 * count)
    return kIllegalValue;
  return writable(word(pdu, 1), count) ? 0 : kIllegalAddress;
}

int refusal_of_read_write(std::span<const std::uint8_t> pdu) noexcept {
  if (pdu.size() < 10) return kIllegalValue;
  const unsigned reads = word(pdu, 3), writes = word(pdu, 7);
  if (reads < 1 || reads > kMostRead || writes < 1 || writes > kMostWrittenWhileReading ||
      pdu[9] != 2 * writes || pdu.size() != 10 + 2 * writes)
    return kIllegalValue;
  return readable(word(pdu, 1), reads) && writable(word(pdu, 5), writes) ? 0 : kIllegalAddress;
}

}  // namespace

int modbus_frame_size(std::span<const std::uint8_t> bytes) noexcept {
  if (bytes.size() >= 4 && word(bytes, 2) != 0) return -1;
  if (bytes.size() < 6) return 0;
  const std::size_t size = 6 + word(bytes, 4);
  // The shortest request is a unit and a function code.
  if (size < kModbusHeaderBytes + 1 || size > kModbusFrameBytes) return -1;
  // 128 and above are answers. The library would add 128 once more and so confirm what it refuses.
  if (bytes.size() > kModbusHeaderBytes && bytes[kModbusHeaderBytes] >= 0x80) return -1;
  return static_cast<int>(size);
}

int modbus_refusal(std::span<const std::uint8_t> frame, bool& writes) noexcept {
  const auto pdu = frame.subspan(kModbusHeaderBytes);
  writes = pdu[0] == 6 || pdu[0] == 16 || pdu[0] == 23;
  switch (pdu[0]) {
    case 3:
      return refusal_of_read(pdu);
    case 6:
      return refusal_of_single_write(pdu);
    case 16:
      return refusal_of_write(pdu);
    case 23:
      return refusal_of_read_write(pdu);
    default:
      return kIllegalFunction;
  }
}

}  // namespace weldcell::adapters
