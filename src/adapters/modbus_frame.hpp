// Modbus TCP framing: how long a frame is, and whether a request may be answered from the PLC's two blocks.
// Private, pure.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace weldcell::adapters {

inline constexpr std::size_t kModbusHeaderBytes = 7;  ///< transaction, protocol, length, unit
inline constexpr std::size_t kModbusFrameBytes = 260;

/// Size of the frame that begins here: 0 = not yet known, -1 = this is no Modbus TCP.
int modbus_frame_size(std::span<const std::uint8_t> bytes) noexcept;

/// Exception code that a whole frame earns (1, 2 or 3), 0 when it may be carried out. `writes` tells whether
/// it would write.
int modbus_refusal(std::span<const std::uint8_t> frame, bool& writes) noexcept;

}  // namespace weldcell::adapters
