#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <thread>

#include "weldcell/rt/hand_off.hpp"
#include "weldcell/rt/latest.hpp"
#include "weldcell/rt/spsc_ring.hpp"

namespace weldcell::rt {
namespace {

/// Large enough that a torn copy shows.
struct Item {
  std::uint64_t number = 0;
  std::array<std::uint64_t, 15> copies{};
};

Item item(std::uint64_t number) {
  Item out;
  out.number = number;
  out.copies.fill(number * 7919);
  return out;
}

bool whole(const Item& i) {
  for (const std::uint64_t c : i.copies) {
    if (c != i.number * 7919) return false;
  }
  return true;
}

TEST(SpscRing, FirstInFirstOut) {
  SpscRing<int, 4> ring;
  int out = 0;
  EXPECT_FALSE(ring.pop(out));
  for (int round = 0; round < 10; ++round) {
    EXPECT_TRUE(ring.push(2 * round));
    EXPECT_TRUE(ring.push(2 * round + 1));
    EXPECT_EQ(ring.size(), 2U);
    EXPECT_TRUE(ring.pop(out));
    EXPECT_EQ(out, 2 * round);
    EXPECT_TRUE(ring.pop(out));
    EXPECT_EQ(out, 2 * round + 1);
  }
  EXPECT_EQ(ring.dropped(), 0U);
}

TEST(SpscRing, FullRingDropsTheNewestAndCounts) {
  SpscRing<int, 4> ring;
  for (int i = 0; i < 7; ++i) EXPECT_EQ(ring.push(i), i < 4);
  EXPECT_EQ(ring.dropped(), 3U);
  int out = 0;
  for (int i = 0; i < 4; ++i) {
    ASSERT_TRUE(ring.pop(out));
    EXPECT_EQ(out, i);
  }
  EXPECT_FALSE(ring.pop(out));
  EXPECT_TRUE(ring.push(9));
}

TEST(SpscRing, TwoThreadsLoseNothingUncounted) {
  constexpr std::uint64_t kItems = 300'000;
  SpscRing<Item, 64> ring;
  std::atomic<bool> done{false};
  std::uint64_t accepted = 0;
  std::thread writer([&] {
    for (std::uint64_t i = 1; i <= kItems; ++i) accepted += ring.push(item(i)) ? 1 : 0;
    done.store(true, std::memory_order_release);
  });
  std::uint64_t received = 0, last = 0, torn = 0, disorder = 0;
  Item in;
  for (bool over = false; !over;) {
    over = done.load(std::memory_order_acquire);
    while (ring.pop(in)) {
      ++received;
      torn += whole(in) ? 0 : 1;
      disorder += in.number > last ? 0 : 1;
      last = in.number;
    }
  }
  writer.join();
  EXPECT_EQ(torn, 0U);
  EXPECT_EQ(disorder, 0U);
  EXPECT_EQ(received, accepted);
  EXPECT_EQ(received + ring.dropped(), kItems);
  EXPECT_GT(received, 0U);
}

TEST(Latest, NewestValueOnce) {
  Latest<int> latest;
  int out = -1;
  EXPECT_FALSE(latest.read(out));
  EXPECT_EQ(out, -1);
  latest.write(1);
  latest.write(2);
  EXPECT_TRUE(latest.read(out));
  EXPECT_EQ(out, 2);
  EXPECT_FALSE(latest.read(out));
  for (int i = 3; i < 50; ++i) {
    latest.write(i);
    ASSERT_TRUE(latest.read(out));
    EXPECT_EQ(out, i);
  }
}

TEST(Latest, TwoThreadsSeeNoTornAndNoOlderValue) {
  constexpr std::uint64_t kItems = 300'000;
  Latest<Item> latest;
  std::thread writer([&] {
    for (std::uint64_t i = 1; i <= kItems; ++i) latest.write(item(i));
  });
  std::uint64_t torn = 0, disorder = 0, last = 0;
  Item in;
  while (last < kItems) {
    if (!latest.read(in)) continue;
    torn += whole(in) ? 0 : 1;
    disorder += in.number > last ? 0 : 1;
    last = in.number;
  }
  writer.join();
  EXPECT_EQ(torn, 0U);
  EXPECT_EQ(disorder, 0U);
}

struct Counted {
  explicit Counted(int n) : number(n) { ++alive; }
  Counted(const Counted&) = delete;
  Counted& operator=(const Counted&) = delete;
  ~Counted() { --alive; }
  int number;
  static inline std::atomic<int> alive{0};
};

TEST(HandOff, OwnerFreesWhatComesBack) {
  HandOff<Counted> hand_off;
  EXPECT_EQ(hand_off.take(), nullptr);
  EXPECT_EQ(hand_off.offer(std::make_unique<Counted>(1)), nullptr);
  const auto replaced = hand_off.offer(std::make_unique<Counted>(2));
  ASSERT_TRUE(replaced);
  EXPECT_EQ(replaced->number, 1);
  Counted* taken = hand_off.take();
  ASSERT_NE(taken, nullptr);
  EXPECT_EQ(taken->number, 2);
  EXPECT_FALSE(hand_off.withdraw()) << "too late";
  EXPECT_FALSE(hand_off.reclaim());
  hand_off.give_back(taken);
  const auto back = hand_off.reclaim();
  ASSERT_TRUE(back);
  EXPECT_EQ(back.get(), taken);
  hand_off.offer(std::make_unique<Counted>(3));
  EXPECT_EQ(hand_off.withdraw()->number, 3);
  EXPECT_EQ(hand_off.take(), nullptr);
}

TEST(HandOff, RefusesMoreThanItCanTakeBack) {
  HandOff<Counted> hand_off;
  std::array<Counted*, HandOff<Counted>::kLent> out{};
  for (auto& p : out) {
    EXPECT_FALSE(hand_off.offer(std::make_unique<Counted>(0)));
    p = hand_off.take();
    ASSERT_NE(p, nullptr);
  }
  EXPECT_TRUE(hand_off.offer(std::make_unique<Counted>(9))) << "handed back";
  for (auto* p : out) hand_off.give_back(p);
  while (hand_off.reclaim()) {
  }
  EXPECT_FALSE(hand_off.offer(std::make_unique<Counted>(9)));
}

TEST(HandOff, TwoThreadsLeakNothing) {
  {
    HandOff<Counted> hand_off;
    std::atomic<bool> done{false};
    int seen = 0;
    std::thread reader([&] {
      while (!done.load(std::memory_order_acquire)) {
        if (Counted* p = hand_off.take()) {
          ++seen;
          hand_off.give_back(p);
        }
      }
    });
    int returned = 0, superseded = 0;
    for (int i = 0; i < 20'000; ++i) {
      superseded += hand_off.offer(std::make_unique<Counted>(i)) ? 1 : 0;
      while (hand_off.reclaim()) ++returned;
    }
    done.store(true, std::memory_order_release);
    reader.join();
    while (hand_off.reclaim()) ++returned;
    const int waiting = hand_off.withdraw() ? 1 : 0;
    EXPECT_EQ(seen, returned);
    EXPECT_EQ(returned + superseded + waiting, 20'000);
  }
  EXPECT_EQ(Counted::alive.load(), 0);
}

}  // namespace
}  // namespace weldcell::rt
