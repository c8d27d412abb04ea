// The newest value from one writing to one reading thread; older ones are overwritten. Lock-free; real-time
// safe.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <type_traits>

namespace weldcell::rt {

/// Three slots: one being written, one being read, one in between. Neither side ever waits and no value is
/// ever torn.
template <typename T>
class Latest {
  static_assert(std::is_trivially_copyable_v<T>, "a value crosses as plain bytes");

 public:
  /// Writer's side.
  void write(const T& value) noexcept {
    slots_[writing_] = value;
    writing_ =
        between_.exchange(static_cast<std::uint8_t>(writing_ | kFresh), std::memory_order_acq_rel) & kIndex;
  }

  /// Reader's side: the newest value into `value`; false, and `value` untouched, when none came since the
  /// last read.
  bool read(T& value) noexcept {
    if ((between_.load(std::memory_order_relaxed) & kFresh) == 0) return false;
    reading_ = between_.exchange(reading_, std::memory_order_acq_rel) & kIndex;
    value = slots_[reading_];
    return true;
  }

 private:
  static constexpr std::uint8_t kIndex = 3, kFresh = 4;
  std::array<T, 3> slots_{};
  std::uint8_t writing_ = 0, reading_ = 1;
  std::atomic<std::uint8_t> between_{2};
};

}  // namespace weldcell::rt
