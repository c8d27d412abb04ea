#include <gtest/gtest.h>

#include <cstdlib>
#include <vector>

#include "rt/counting_allocator.hpp"
#include "unit/robot/controller_frames.hpp"
#include "unit/wire/egm_golden.hpp"
#include "unit/wire/laser_streams.hpp"
#include "weldcell/rt/hand_off.hpp"
#include "weldcell/rt/latest.hpp"
#include "weldcell/rt/spsc_ring.hpp"
#include "weldcell/wire/laser_dialects.hpp"

namespace weldcell {
namespace {

using rt::allocation_count;
using rt::AllocationCount;

/// What a piece of work allocates and releases on this thread.
template <typename Work>
AllocationCount counted(Work&& work) {
  const AllocationCount before = allocation_count();
  work();
  const AllocationCount after = allocation_count();
  return {after.allocations - before.allocations, after.releases - before.releases};
}

#define EXPECT_NO_ALLOCATION(work)    \
  do {                                \
    const auto count = counted(work); \
    EXPECT_EQ(count.allocations, 0U); \
    EXPECT_EQ(count.releases, 0U);    \
  } while (false)

TEST(CountingAllocator, SeesNewAndMalloc) {
  const auto by_new = counted([] {
    int* volatile number = new int(3);
    delete number;
  });
  EXPECT_EQ(by_new.allocations, 1U);
  EXPECT_EQ(by_new.releases, 1U);
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
  const auto by_malloc = counted([] {
    void* volatile memory = std::malloc(10);
    std::free(memory);
  });
  EXPECT_EQ(by_malloc.allocations, 1U);
#endif
  std::vector<int> numbers;
  EXPECT_GE(counted([&] { numbers.assign(1000, 1); }).allocations, 1U);
}

/// Frames of a controller that runs, made beforehand.
std::vector<std::string> recorded_frames(std::size_t count) {
  robot::EgmSession unused{robot::small_cell()};
  robot::Frames frames{unused};
  std::vector<std::string> out;
  for (std::size_t k = 0; k < count; ++k) {
    out.push_back(frames.datagram());
    frames.pass(4);
  }
  return out;
}

TEST(NoAllocation, EgmCyclesOfAWholeMotion) {
  const auto frames = recorded_frames(700);
  const auto plan = robot::smooth_plan(1, {10, -20, 30, 0, 60, -90}, {20, 0, -10, 5, 0, 15}, 1.0);
  robot::EgmSession session{robot::small_cell()};
  session.set_armed(true);
  std::array<std::byte, 512> reply{};
  std::size_t answered = 0;
  const auto cycle = [&](std::size_t k) {
    const HostTime now{static_cast<Nanoseconds>(k) * 4 * kMillisecond};
    answered += session.on_datagram(std::as_bytes(std::span(frames[k])), now, reply) > 0 ? 1 : 0;
  };
  cycle(0);
  EXPECT_NO_ALLOCATION([&] {
    for (std::size_t k = 1; k < frames.size(); ++k) {
      if (k == 10) session.offer(&plan);
      if (k == 400) session.offer(&plan);
      if (k == 500) session.request_stop();
      cycle(k);
      if (k == 100) cycle(k);
      if (k == 100) session.on_datagram(std::as_bytes(std::span("garbage")), {}, reply);
    }
  });
  EXPECT_EQ(answered, frames.size());
  EXPECT_EQ(session.report().stale, 1U);
  EXPECT_EQ(session.report().malformed, 1U);
  EXPECT_TRUE(session.report().plan_done);
}

TEST(NoAllocation, FramesOfAnyShapeFromTheFirstOn) {
  wire::EgmCodec codec;
  const std::vector<std::vector<std::byte>> shapes{
      golden::bytes(golden::kPackedHex), golden::bytes(golden::kRw6Hex), golden::bytes(golden::kRw7Hex),
      golden::bytes(golden::kSensorHex)};
  // Fields that nobody knows, as long as a datagram may be: header, then field 99 with 1300 bytes.
  auto unknown = golden::bytes(
      "0a061801"
      "08011001"
      "9a06940a");
  unknown.resize(unknown.size() + 1300);
  wire::EgmFeedback out;
  EXPECT_NO_ALLOCATION([&] {
    for (int k = 0; k < 100; ++k) {
      for (const auto& shape : shapes) codec.decode(shape, out);
      codec.decode(unknown, out);
    }
  });
}

TEST(NoAllocation, LaserStream) {
  std::vector<wire::LaserReading> readings(20);
  for (std::size_t i = 0; i < readings.size(); ++i)
    readings[i] = {100.0F, 0, static_cast<std::uint32_t>(i), 0};
  std::vector<std::byte> block(28 + 20 * 12);
  ASSERT_EQ(wire::encode_meas28({}, readings, 1, 2, block), block.size());
  wire::Meas28Decoder decoder{wire::Meas28Layout{}};
  double sum = 0;
  EXPECT_NO_ALLOCATION([&] {
    for (int k = 0; k < 1000; ++k) {
      block[static_cast<std::size_t>(k) % block.size()] ^= std::byte{1};
      decoder.feed(block, [&](const wire::LaserReading& r) { sum += r.distance_mm; });
    }
  });
  EXPECT_GT(decoder.counters().readings, 1000U);
}

TEST(NoAllocation, EveryLaserDialect) {
  using wire::LaserDialect;
  for (const auto dialect : {LaserDialect::Data28, LaserDialect::Meas32, LaserDialect::TwoByte,
                             LaserDialect::ThreeByte, LaserDialect::Od5000}) {
    auto stream = wire::streams::blocks(dialect, 1000, 400);
    const std::size_t block = stream.size() / 400;
    wire::LaserDecoder decoder{wire::streams::format_of(dialect)};
    double sum = 0;
    const auto sink = [&](const wire::LaserReading& r) { sum += r.distance_mm; };
    EXPECT_NO_ALLOCATION([&] {
      for (std::size_t k = 0; k < 10; ++k) {
        wire::streams::feed_blocks(decoder, dialect, stream, block, sink);
        stream[k * stream.size() / 10] ^= std::byte{0xD5};
        decoder.reset();
      }
    });
    EXPECT_GT(decoder.counters().readings, 10000U) << wire::to_string(dialect);
    EXPECT_GT(decoder.counters().resyncs, 0U) << wire::to_string(dialect);
  }
}

TEST(NoAllocation, Queues) {
  rt::SpscRing<int, 8> ring;
  rt::Latest<int> latest;
  rt::HandOff<int> hand_off;
  hand_off.offer(std::make_unique<int>(4));
  int out = 0;
  EXPECT_NO_ALLOCATION([&] {
    for (int i = 0; i < 100; ++i) {
      ring.push(i);
      if (i % 3 == 0) ring.pop(out);
      latest.write(i);
      latest.read(out);
    }
    hand_off.give_back(hand_off.take());
  });
}

}  // namespace
}  // namespace weldcell
