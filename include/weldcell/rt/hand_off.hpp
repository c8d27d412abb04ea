// Lends an object from its owner to a real-time thread and back: the owner makes and frees, the other only
// reads. Lock-free; take() and give_back() are real-time safe.
#pragma once

#include <atomic>
#include <cstddef>
#include <memory>

#include "weldcell/rt/spsc_ring.hpp"

namespace weldcell::rt {

/// At most one object waits to be taken and at most kLent are out or on their way back.
template <typename T>
class HandOff {
 public:
  static constexpr std::size_t kLent = 8;

  HandOff() = default;
  HandOff(const HandOff&) = delete;
  HandOff& operator=(const HandOff&) = delete;
  /// Frees what was not taken and what came back. Both threads must be done with it.
  ~HandOff() {
    delete waiting_.load(std::memory_order_acquire);
    while (reclaim()) {
    }
  }

  /// Owner's side: offers an object; one offered before and not taken yet comes back at once. Refused (and
  /// handed back) while kLent objects are out.
  std::unique_ptr<T> offer(std::unique_ptr<T> object) noexcept {
    if (lent_.load(std::memory_order_acquire) >= kLent) return object;
    return std::unique_ptr<T>(waiting_.exchange(object.release(), std::memory_order_acq_rel));
  }
  /// Owner's side: withdraws what was offered and not taken; null when it is too late.
  std::unique_ptr<T> withdraw() noexcept {
    return std::unique_ptr<T>(waiting_.exchange(nullptr, std::memory_order_acq_rel));
  }
  /// Owner's side: an object that came back, to be freed or used again; null when there is none.
  std::unique_ptr<T> reclaim() noexcept {
    T* object = nullptr;
    if (!back_.pop(object)) return nullptr;
    lent_.fetch_sub(1, std::memory_order_acq_rel);
    return std::unique_ptr<T>(object);
  }

  /// Real-time side: the object offered, or null. It must be given back.
  T* take() noexcept {
    if (waiting_.load(std::memory_order_relaxed) == nullptr) return nullptr;
    T* object = waiting_.exchange(nullptr, std::memory_order_acq_rel);
    if (object != nullptr) lent_.fetch_add(1, std::memory_order_acq_rel);
    return object;
  }
  /// Real-time side: done with an object that take() gave. There is always room for it.
  void give_back(T* object) noexcept {
    if (object != nullptr) back_.push(object);
  }

 private:
  std::atomic<T*> waiting_{nullptr};
  std::atomic<std::size_t> lent_{0};
  SpscRing<T*, 2 * kLent> back_;
};

}  // namespace weldcell::rt
