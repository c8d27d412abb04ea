// Facts of the machine, from a made-up /proc and /sys and from this machine's own sockets.
#include "weldcell/adapters/host_facts.hpp"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "weldcell/adapters/fd.hpp"

namespace weldcell::adapters {
namespace {

namespace fs = std::filesystem;

class Host : public ::testing::Test {
 protected:
  void SetUp() override {
    char name[] = "/tmp/weldcell-host-XXXXXX";
    ASSERT_NE(::mkdtemp(name), nullptr);
    folder_ = name;
    places_ = {folder_ / "proc", folder_ / "sys", folder_ / "boot"};
  }
  void TearDown() override { fs::remove_all(folder_); }
  void put(const std::string& path, const std::string& text) {
    fs::create_directories((folder_ / path).parent_path());
    std::ofstream(folder_ / path) << text;
  }
  fs::path folder_;
  HostPlaces places_;
};

TEST_F(Host, ReadsTheKernel) {
  put("proc/sys/kernel/osrelease", "6.1.0-rt\n");
  put("proc/sys/kernel/version", "#1 SMP PREEMPT_RT Debian 6.1\n");
  put("proc/sys/kernel/sched_rt_runtime_us", "950000\n");
  put("proc/sys/kernel/sched_rt_period_us", "1000000\n");
  put("proc/sys/user/max_user_namespaces", "0\n");
  put("boot/config-6.1.0-rt", "CONFIG_HZ_250=y\nCONFIG_HZ=250\n");
  put("sys/devices/system/cpu/isolated", "2-3\n");
  put("sys/devices/system/clocksource/clocksource0/current_clocksource", "tsc\n");
  for (const char* cpu : {"cpu0", "cpu1", "cpu12"})
    put(std::string("sys/devices/system/cpu/") + cpu + "/cpufreq/scaling_governor", "powersave\n");
  put("sys/devices/system/cpu/cpufreq/x", "not a processor\n");
  const KernelFacts facts = kernel_facts(places_);
  EXPECT_EQ(facts.release, "6.1.0-rt");
  EXPECT_TRUE(facts.preempt_rt);
  EXPECT_EQ(facts.hz, 250);
  EXPECT_EQ(facts.isolated_cpus, "2-3");
  EXPECT_EQ(facts.cpus, 3);
  EXPECT_EQ(facts.governors, std::vector<std::string>{"powersave"});
  EXPECT_EQ(facts.clock_source, "tsc");
  EXPECT_EQ(facts.rt_runtime_us, 950000);
  EXPECT_EQ(facts.rt_period_us, 1000000);
  EXPECT_EQ(facts.user_namespaces, 0);
}

TEST_F(Host, AnEmptySystemIsNoFault) {
  const KernelFacts facts = kernel_facts(places_);
  EXPECT_FALSE(facts.preempt_rt);
  EXPECT_FALSE(facts.hz);
  EXPECT_EQ(facts.cpus, 0);
  EXPECT_FALSE(process_named("weldcelld", places_));
  EXPECT_FALSE(port_facts(true, "127.0.0.1", 6511, places_).taken);
}

TEST_F(Host, FindsADaemonsThreads) {
  const std::string tail = " S 1 1 1 0 -1 0 0 0 0 0 0 0 0 0 20 0 1 0 5 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 17 0 ";
  put("proc/41/comm", "other\n");
  put("proc/42/comm", "weldcelld\n");
  put("proc/42/status", "Name:\tweldcelld\nVmLck:\t   51200 kB\n");
  put("proc/42/task/42/stat", "42 (weldcelld)" + tail + "0 0 0 0\n");
  put("proc/42/task/43/stat", "43 (egm) (1)" + tail + "70 1 0 0\n");
  const auto daemon = process_named("weldcelld", places_);
  ASSERT_TRUE(daemon);
  EXPECT_EQ(daemon->pid, 42);
  EXPECT_EQ(daemon->locked_kb, 51200);
  ASSERT_EQ(daemon->threads.size(), 2U);
  const ThreadFacts& egm = daemon->threads[daemon->threads[0].fifo ? 0 : 1];
  EXPECT_EQ(egm.name, "egm) (1");  // as the kernel writes a name with parentheses
  EXPECT_TRUE(egm.fifo);
  EXPECT_EQ(egm.priority, 70);
}

TEST_F(Host, ReadsItsOwnSchedulingAsItIs) {
  std::ifstream in("/proc/self/comm");
  std::string own;
  std::getline(in, own);
  const auto me = process_named(own);
  ASSERT_TRUE(me);
  EXPECT_FALSE(me->threads.empty());
  for (const ThreadFacts& thread : me->threads) {
    EXPECT_FALSE(thread.fifo);
  }
}

/// A socket of this process on a free loopback port.
struct Own {
  explicit Own(int type) : fd(::socket(AF_INET, type, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(::bind(fd.get(), reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
    if (type == SOCK_STREAM) {
      EXPECT_EQ(::listen(fd.get(), 1), 0);
    }
    socklen_t size = sizeof address;
    ::getsockname(fd.get(), reinterpret_cast<sockaddr*>(&address), &size);
    port = ntohs(address.sin_port);
  }
  Fd fd;
  int port = 0;
};

TEST(Ports, NameTheirHolder) {
  for (const int type : {SOCK_DGRAM, SOCK_STREAM}) {
    const bool udp = type == SOCK_DGRAM;
    int port = 0;
    {
      const Own own(type);
      port = own.port;
      const PortFacts facts = port_facts(udp, "127.0.0.1", port);
      EXPECT_TRUE(facts.taken);
      EXPECT_EQ(facts.pid, ::getpid());
      EXPECT_TRUE(port_facts(udp, "0.0.0.0", port).taken) << "every address is wanted";
      EXPECT_FALSE(port_facts(udp, "127.0.0.2", port).taken) << "another address is free";
      EXPECT_NE(port_facts(!udp, "127.0.0.1", port).pid, ::getpid()) << "the other protocol is not ours";
    }
    EXPECT_NE(port_facts(udp, "127.0.0.1", port).pid, ::getpid());
  }
}

TEST(Cards, LoopbackHasEvery127) {
  EXPECT_TRUE(card_of("127.0.0.1").loopback);
  EXPECT_TRUE(card_of("127.4.5.6").loopback);
  EXPECT_TRUE(card_towards("127.0.0.9").loopback);
  EXPECT_EQ(card_of("203.0.113.77").name, "") << "an address of documentation, nobody's";
  EXPECT_EQ(card_of("no address").name, "");
}

TEST(Disks, TellSpaceOrTheReason) {
  EXPECT_TRUE(disk_facts("/tmp").present);
  EXPECT_GT(disk_facts("/tmp").free_bytes, 0U);
  EXPECT_EQ(disk_facts("/nowhere/at/all").why, "No such file or directory");
  EXPECT_FALSE(disk_facts("/etc/passwd").present);
}

TEST(Rights, ATryLeavesNothingBehind) {
  try_real_time(1);
  const auto locked = [] {
    std::ifstream in("/proc/self/status");
    for (std::string line; std::getline(in, line);)
      if (line.starts_with("VmLck:")) return std::atoll(line.c_str() + 6);
    return -1LL;
  };
  EXPECT_EQ(locked(), 0);
}

}  // namespace
}  // namespace weldcell::adapters
