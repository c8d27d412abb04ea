// What the decoders of a stream of headers and frames do alike: keep the last bytes, find the next header, go
// back where a header has been swallowed. Pure, allocation-free.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>

namespace weldcell::wire {

struct LaserReading;

struct LaserCounters {
  std::uint64_t blocks = 0;  ///< headers accepted
  std::uint64_t readings = 0;
  std::uint64_t lost_readings = 0;  ///< numbers that the running count jumped over
  std::uint64_t resyncs = 0;        ///< times that the stream was not what the last header promised
  std::uint64_t skipped_bytes = 0;  ///< bytes searched through for the next header
  std::uint64_t restarts = 0;  ///< times that the sensor's count went backwards or leapt by more than 2^20
};

/// The base of `Decoder` over a window of `kBytes`. The decoder gives header_bytes(), header_here() (is what
/// the window begins with a header?), take_header() and take_frame(reading); each looks at front() and
/// size().
template <typename Decoder, std::size_t kBytes>
class LaserWindow {
 public:
  /// Takes any split of the byte stream and calls sink(const LaserReading&) per reading.
  template <typename Reading = LaserReading, typename Sink>
  void feed(std::span<const std::byte> bytes, Sink&& sink) {
    while (!bytes.empty()) {
      bytes = take(bytes);
      Reading reading;
      while (next(reading)) sink(static_cast<const Reading&>(reading));
    }
  }
  const LaserCounters& counters() const { return counters_; }

 protected:
  enum class Step : std::uint8_t { NeedMore, Again, Reading };

  const std::byte* front() const noexcept { return buffer_.data() + begin_; }
  std::size_t size() const noexcept { return end_ - begin_; }
  /// Where the window's front stands in the stream.
  std::uint64_t place() const noexcept { return moved_ + begin_; }

  /// The header or frame at the front is done with; it stays in reach for going back.
  void consume(std::size_t bytes) noexcept {
    last_item_ = begin_;
    begin_ += bytes;
  }
  /// The front moves on (or back, within the last item), and nothing before it is of use any longer.
  void leave(std::ptrdiff_t bytes) noexcept {
    begin_ = static_cast<std::size_t>(static_cast<std::ptrdiff_t>(begin_) + bytes);
    last_item_ = begin_;
  }
  /// What stands here is not what the last header promised.
  void lose_sync() noexcept {
    ++counters_.resyncs;
    frames_left_ = 0;
    searching_ = true;
    // Missing bytes may have made the last item swallow the beginning of the next header.
    if (last_item_ < begin_) begin_ = last_item_ + 1;
    last_item_ = begin_;
  }

  LaserCounters counters_;
  std::uint32_t frames_left_ = 0;  ///< of the block under way
  bool after_search_ = false;      ///< the header at the front was searched for

 private:
  Decoder& self() noexcept { return static_cast<Decoder&>(*this); }

  /// Copies what fits and returns the rest.
  std::span<const std::byte> take(std::span<const std::byte> bytes) noexcept {
    if (end_ + bytes.size() > buffer_.size()) {
      std::memmove(buffer_.data(), buffer_.data() + last_item_, end_ - last_item_);
      begin_ -= last_item_;
      end_ -= last_item_;
      moved_ += last_item_;
      last_item_ = 0;
    }
    const std::size_t fitting = std::min(bytes.size(), buffer_.size() - end_);
    std::memcpy(buffer_.data() + end_, bytes.data(), fitting);
    end_ += fitting;
    return bytes.subspan(fitting);
  }

  template <typename Reading>
  bool next(Reading& out) noexcept {
    for (;;) {
      const Step step = searching_          ? search()
                        : frames_left_ == 0 ? self().take_header()
                                            : self().take_frame(out);
      if (step != Step::Again) return step == Step::Reading;
    }
  }

  Step search() noexcept {
    while (size() >= self().header_bytes()) {
      if (self().header_here()) {
        searching_ = false;
        after_search_ = true;
        return Step::Again;
      }
      leave(1);
      ++counters_.skipped_bytes;
    }
    return Step::NeedMore;
  }

  std::array<std::byte, kBytes> buffer_{};
  std::size_t begin_ = 0, end_ = 0;
  std::size_t last_item_ = 0;  ///< where the header or frame before the front starts: the way back
  std::uint64_t moved_ = 0;    ///< stream bytes before the buffer
  bool searching_ = false;
};

}  // namespace weldcell::wire
