// What the machine is like, as far as a cell depends on it: read from /proc, /sys and the network cards,
// judged elsewhere. Nothing is changed, no port is taken. Blocks for files only.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace weldcell::adapters {

/// Where the kernel's files lie; another place in tests.
struct HostPlaces {
  std::string proc = "/proc", sys = "/sys", boot = "/boot";
};

struct KernelFacts {
  std::string release;        ///< as of uname -r
  bool preempt_rt = false;    ///< /sys/kernel/realtime, or PREEMPT_RT in the version
  std::optional<int> hz;      ///< CONFIG_HZ where the configuration lies in /boot
  std::string isolated_cpus;  ///< "" none, else a list such as "2-3"
  int cpus = 0;
  std::vector<std::string> governors;  ///< of cpufreq, each once; empty where there is none
  std::string clock_source;            ///< tsc, kvm-clock, hpet ...
  std::optional<std::int64_t> rt_runtime_us,
      rt_period_us;                             ///< share of a CPU that FIFO threads may take; -1 all
  std::optional<std::int64_t> user_namespaces;  ///< most of them; 0: none may be made
};
KernelFacts kernel_facts(const HostPlaces& places = {});

struct ThreadFacts {
  std::string name;
  bool fifo = false;
  int priority = 0;
};
/// A running program.
struct ProcessFacts {
  int pid = 0;
  std::vector<ThreadFacts> threads;
  std::int64_t locked_kb = 0;  ///< memory that stays in RAM
};
/// The first process of that name (15 characters at most, as the kernel keeps it).
std::optional<ProcessFacts> process_named(const std::string& name, const HostPlaces& places = {});

/// What this process may have: the answer of the kernel to a try, undone at once.
struct RealTimeRights {
  bool fifo = false;
  bool memory_lock = false;
};
RealTimeRights try_real_time(int priority);

/// Who has a local port.
struct PortFacts {
  bool taken = false;
  int pid = 0;  ///< 0: unknown (another user's, and we are not root)
  std::string program;
};
/// `udp`: a bound UDP socket counts, otherwise a listening TCP socket. IPv4; 0.0.0.0 holds every address.
PortFacts port_facts(bool udp, const std::string& host, int port, const HostPlaces& places = {});

/// The network card towards an address.
struct CardFacts {
  std::string name;  ///< "" : no card leads there
  bool loopback = false, link = false;
  std::optional<int> speed_mb_s;  ///< nothing where the driver does not tell
  std::optional<bool> full_duplex;
  std::optional<unsigned> rx_delay_us;  ///< interrupt coalescing: how long a datagram may wait in the card
  std::optional<bool> rx_adaptive;
};
/// The card that has `host` as its own address.
CardFacts card_of(const std::string& host);
/// The card that datagrams to `peer` leave by; nothing is sent.
CardFacts card_towards(const std::string& peer);

struct DiskFacts {
  bool present = false, writable = false;  ///< writable for this process
  std::string why;                         ///< errno's words when not present
  std::uint64_t free_bytes = 0, free_inodes = 0, inodes = 0;
};
DiskFacts disk_facts(const std::string& folder);

struct ClockFacts {
  bool synchronized = false;
  std::int64_t error_us = 0;  ///< the kernel's estimate of its largest error
};
ClockFacts clock_facts();

}  // namespace weldcell::adapters
