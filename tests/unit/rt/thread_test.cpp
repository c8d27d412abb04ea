#include "weldcell/rt/thread.hpp"

#include <gtest/gtest.h>
#include <pthread.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <vector>

namespace weldcell::rt {
namespace {

TEST(Thread, RunsItsBodyUnderItsName) {
  std::array<char, 32> name{};
  std::size_t stack = 0;
  auto thread = Thread::start({"a-rather-long-name", 0, 0, 512 * 1024}, [&] {
    pthread_getname_np(pthread_self(), name.data(), name.size());
    pthread_attr_t attributes;
    pthread_getattr_np(pthread_self(), &attributes);
    pthread_attr_getstacksize(&attributes, &stack);
    pthread_attr_destroy(&attributes);
  });
  ASSERT_TRUE(thread.ok()) << thread.error().text();
  thread->join();
  thread->join();
  EXPECT_STREQ(name.data(), "a-rather-long-n");
  EXPECT_EQ(thread->name(), "a-rather-long-name");
  EXPECT_GE(stack, 512U * 1024) << "a sanitizer may add to it";
  EXPECT_TRUE(thread->fifo_granted()) << "nothing was asked for";
}

TEST(Thread, SaysWhetherFifoWasGranted) {
  int policy = -1, priority = -1;
  auto thread = Thread::start({"fifo", 20, 0, 256 * 1024}, [&] {
    sched_param parameter{};
    pthread_getschedparam(pthread_self(), &policy, &parameter);
    priority = parameter.sched_priority;
  });
  ASSERT_TRUE(thread.ok());
  thread->join();
  EXPECT_EQ(policy, thread->fifo_granted() ? SCHED_FIFO : SCHED_OTHER);
  EXPECT_EQ(priority, thread->fifo_granted() ? 20 : 0);
}

TEST(Thread, ImpossiblePriorityIsRefusedAndTheBodyStillRuns) {
  std::atomic<bool> ran{false};
  auto thread = Thread::start({"fifo", 1000, 0, 256 * 1024}, [&] { ran = true; });
  ASSERT_TRUE(thread.ok());
  EXPECT_FALSE(thread->fifo_granted());
  thread->join();
  EXPECT_TRUE(ran);
}

TEST(Thread, NiceIsSetForThatThreadOnly) {
  int nice = -1;
  auto thread = Thread::start({"nice", 0, 10, 256 * 1024}, [&] {
    nice = getpriority(PRIO_PROCESS, static_cast<id_t>(syscall(SYS_gettid)));
  });
  ASSERT_TRUE(thread.ok());
  const int before = getpriority(PRIO_PROCESS, static_cast<id_t>(syscall(SYS_gettid)));
  thread->join();
  EXPECT_EQ(nice, std::max(before, 10));
}

TEST(Thread, DestructionJoins) {
  std::atomic<int> ended{0};
  std::atomic<bool> stop{false};
  {
    std::vector<Thread> threads;
    for (int i = 0; i < 4; ++i) {
      auto thread = Thread::start({"worker", 0, 0, 256 * 1024}, [&] {
        while (!stop.load()) usleep(100);
        ++ended;
      });
      ASSERT_TRUE(thread.ok());
      threads.push_back(std::move(*thread));
    }
    stop = true;
  }
  EXPECT_EQ(ended.load(), 4);
}

TEST(LockMemory, GrantsOrNamesTheCause) {
  const Status locked = lock_memory();
  if (!locked.ok()) {
    EXPECT_EQ(locked.error().code, "memory.lock");
    EXPECT_FALSE(locked.error().what.empty());
  }
}

}  // namespace
}  // namespace weldcell::rt
