#include "adapters/limited_child.hpp"

#include <gtest/gtest.h>

#include <linux/filter.h>
#include <linux/seccomp.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstddef>

namespace weldcell::adapters {
namespace {

ChildOutcome run(const std::string& script, ChildLimits limits = {}) {
  auto outcome = run_limited({"/bin/sh", "-c", script}, limits);
  EXPECT_TRUE(outcome.ok());
  return outcome.ok() ? *outcome : ChildOutcome{};
}

TEST(LimitedChild, CollectsOutputAndExitCode) {
  const ChildOutcome o = run("echo out; echo err >&2; exit 7");
  EXPECT_EQ(o.exit_code, 7);
  EXPECT_EQ(o.out, "out\n");
  EXPECT_EQ(o.err, "err\n");
  EXPECT_FALSE(o.timed_out);
}

TEST(LimitedChild, IsKilledWithItsChildrenWhenItsTimeIsOver) {
  ChildLimits limits;
  limits.timeout_s = 1;
  const ChildOutcome o = run("sleep 100 & sleep 100; echo never", limits);
  EXPECT_TRUE(o.timed_out);
  EXPECT_EQ(o.signal, SIGKILL);
  EXPECT_EQ(o.out, "");
}

TEST(LimitedChild, IsKilledWhenItClosesItsOutputAndStays) {
  ChildLimits limits;
  limits.timeout_s = 1;
  const ChildOutcome o = run("exec >&- 2>&-; sleep 100", limits);
  EXPECT_TRUE(o.timed_out);
}

TEST(LimitedChild, TalksNoMoreThanItMay) {
  ChildLimits limits;
  limits.output_bytes = 100'000;
  const ChildOutcome o = run("yes", limits);
  EXPECT_TRUE(o.too_much_output);
  EXPECT_EQ(o.out.size(), 100'000u);
}

TEST(LimitedChild, TellsTheSignalThatEndedIt) { EXPECT_EQ(run("kill -SEGV $$").signal, SIGSEGV); }

TEST(LimitedChild, HasLimitsOnMemoryFilesAndEnvironment) {
  ChildLimits limits;
  limits.memory_bytes = 256UL << 20;
  EXPECT_EQ(run("ulimit -v", limits).out, "262144\n");
  EXPECT_EQ(run("ulimit -c").out, "0\n");
  EXPECT_EQ(run("ulimit -n").out, "64\n");
  EXPECT_NE(run("f=/tmp/weldcell-child-$$; (echo x > $f); r=$?; rm -f $f; exit $r").exit_code, 0);
  EXPECT_EQ(run("cat; echo \"[$HOME]\"").out, "[]\n");
  EXPECT_EQ(run("ls /proc/self/fd | wc -l").out, "4\n");
}

/// From now on this process and its children are refused unshare(2).
void refuse_unshare() {
  sock_filter program[] = {
      BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(seccomp_data, nr)),
      BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, SYS_unshare, 0, 1),
      BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ERRNO | EPERM),
      BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW),
  };
  const sock_fprog all{sizeof program / sizeof program[0], program};
  if (::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0 ||
      ::prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &all) != 0)
    ::_exit(99);
}

TEST(LimitedChild, TellsWhetherItsNetworkWasCut) {
  const ChildOutcome here = run("cat /proc/net/dev | wc -l");
  if (here.network_errno == 0) {
    EXPECT_EQ(here.out, "3\n") << "two lines of heading and lo";
  }
  EXPECT_EXIT(
      {
        refuse_unshare();
        const ChildOutcome o = run("echo read");
        ::_exit(o.out == "read\n" ? o.network_errno : 98);
      },
      ::testing::ExitedWithCode(EPERM), "");
}

TEST(LimitedChild, AProgramThatIsNotThereEndsWith127) {
  auto o = run_limited({"/nowhere/program"}, {});
  ASSERT_TRUE(o.ok());
  EXPECT_EQ(o->exit_code, 127);
}

}  // namespace
}  // namespace weldcell::adapters
