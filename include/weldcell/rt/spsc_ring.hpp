// Bounded queue between one writing and one reading thread. Lock-free; real-time safe on both sides once
// made.
#pragma once

#include <atomic>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <type_traits>

namespace weldcell::rt {

/// Full: the newest item is dropped and counted, so that what the reader has not seen yet stays whole. The
/// memory is taken (and touched) by the constructor.
template <typename T, std::size_t Capacity>
class SpscRing {
  static_assert(std::is_trivially_copyable_v<T>, "an item crosses as plain bytes");
  static_assert(std::has_single_bit(Capacity), "a power of two");
  static_assert(std::atomic<std::uint64_t>::is_always_lock_free);

 public:
  SpscRing() : slots_(std::make_unique<T[]>(Capacity)) {}
  SpscRing(const SpscRing&) = delete;
  SpscRing& operator=(const SpscRing&) = delete;

  /// Writer's side. False when the ring was full and the item is lost.
  bool push(const T& item) noexcept {
    const std::uint64_t at = written_.load(std::memory_order_relaxed);
    if (at - read_.load(std::memory_order_acquire) == Capacity) {
      dropped_.fetch_add(1, std::memory_order_relaxed);
      return false;
    }
    slots_[at % Capacity] = item;
    written_.store(at + 1, std::memory_order_release);
    return true;
  }

  /// Reader's side. False when there is nothing.
  bool pop(T& item) noexcept {
    const std::uint64_t at = read_.load(std::memory_order_relaxed);
    if (at == written_.load(std::memory_order_acquire)) return false;
    item = slots_[at % Capacity];
    read_.store(at + 1, std::memory_order_release);
    return true;
  }

  /// Items lost so far. From any thread.
  std::uint64_t dropped() const noexcept { return dropped_.load(std::memory_order_relaxed); }
  /// How many items wait, as seen from any thread.
  std::size_t size() const noexcept {
    const std::uint64_t read = read_.load(std::memory_order_acquire);
    return static_cast<std::size_t>(written_.load(std::memory_order_acquire) - read);
  }
  static constexpr std::size_t capacity() { return Capacity; }

 private:
  static constexpr std::size_t kCacheLine = 64;
  std::unique_ptr<T[]> slots_;
  alignas(kCacheLine) std::atomic<std::uint64_t> written_{0};
  std::atomic<std::uint64_t> dropped_{0};
  alignas(kCacheLine) std::atomic<std::uint64_t> read_{0};
};

}  // namespace weldcell::rt
