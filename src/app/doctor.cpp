#include "app/doctor.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

namespace weldcell::app {
namespace {

using adapters::CardFacts;
using adapters::KernelFacts;

constexpr int kEgmPriority = 70;         // as in threads.cpp; the unit's LimitRTPRIO= allows 80
constexpr unsigned kMostRxDelayUs = 20;  // of the 4 ms cycle; a daemon's answer takes about as long
constexpr int kLeastSpeedMbS = 100;
constexpr std::uint64_t kMiB = 1024 * 1024;
// A job's record is some ten megabytes, a long scan's a few hundred.
constexpr std::uint64_t kFailBelow = 500 * kMiB, kWarnBelow = 5000 * kMiB;
constexpr std::int64_t kMostClockErrorUs = 1'000'000;

const char* word(Health health) {
  switch (health) {
    case Health::Ok:
      return "ok";
    case Health::Warn:
      return "warn";
    case Health::Fail:
      return "fail";
  }
  return "?";
}

Ailment well(std::string check, std::string seen) {
  return {std::move(check), Health::Ok, std::move(seen), ""};
}
Ailment warn(std::string check, std::string seen, std::string mend) {
  return {std::move(check), Health::Warn, std::move(seen), std::move(mend)};
}
Ailment fail(std::string check, std::string seen, std::string mend) {
  return {std::move(check), Health::Fail, std::move(seen), std::move(mend)};
}

Ailments judge_daemon(const adapters::ProcessFacts& daemon) {
  Ailments out;
  const auto egm = std::find_if(daemon.threads.begin(), daemon.threads.end(),
                                [](const auto& thread) { return thread.name == "egm"; });
  const std::string who = fmt::format("weldcelld (pid {})", daemon.pid);
  if (egm == daemon.threads.end()) {
    out.push_back(
        fail("real time", who + " runs without its thread egm", "read its log: journalctl -u weldcelld"));
  } else if (egm->fifo) {
    out.push_back(
        well("real time", fmt::format("thread egm of {} runs at SCHED_FIFO {}", who, egm->priority)));
  } else {
    out.push_back(
        fail("real time",
             "thread egm of " + who + " has no SCHED_FIFO: any other program delays the robot's cycle",
             "start it by its unit (LimitRTPRIO=80), and set realtime: try or required in the cell file"));
  }
  if (daemon.locked_kb > 0) {
    out.push_back(well("memory lock", fmt::format("{} has locked {} kB", who, daemon.locked_kb)));
  } else {
    out.push_back(fail(
        "memory lock", who + " has locked no memory: a page read from disk stops a cycle",
        "start it by its unit (LimitMEMLOCK=infinity), and set realtime: try or required in the cell file"));
  }
  return out;
}

}  // namespace

Ailments judge_real_time(const KernelFacts& kernel, const std::optional<adapters::ProcessFacts>& daemon,
                         const adapters::RealTimeRights& rights, bool root) {
  Ailments out;
  if (daemon) {
    out = judge_daemon(*daemon);
  } else {
    const auto right = [&](const char* check, bool granted, const char* what) {
      if (granted) return well(check, std::string(what) + " is granted to this user");
      if (root)
        return fail(check, std::string(what) + " is refused even to root",
                    "the container or kernel forbids it: run weldcelld on the machine itself");
      return warn(check,
                  std::string(what) +
                      " is refused to this user, weldcelld does not run: nothing is known of its own rights",
                  "run doctor as root, or start weldcelld by its unit and ask again");
    };
    out.push_back(right("real time", rights.fifo, fmt::format("SCHED_FIFO {}", kEgmPriority).c_str()));
    out.push_back(right("memory lock", rights.memory_lock, "mlockall"));
  }
  if (kernel.rt_runtime_us && kernel.rt_period_us) {
    const std::int64_t runtime = *kernel.rt_runtime_us, period = *kernel.rt_period_us;
    if (runtime < 0 || runtime * 10 >= period * 9) {
      out.push_back(well("real-time share",
                         runtime < 0 ? std::string("FIFO threads may have a whole processor")
                                     : fmt::format("FIFO threads may have {} of {} us", runtime, period)));
    } else {
      out.push_back(fail("real-time share",
                         fmt::format("FIFO threads are stopped after {} of {} us", runtime, period),
                         "sysctl kernel.sched_rt_runtime_us=950000"));
    }
  }
  return out;
}

Ailments judge_kernel(const KernelFacts& kernel) {
  Ailments out;
  const std::string hz =
      kernel.hz ? fmt::format(", HZ {}", *kernel.hz) : std::string(", HZ unknown (no /boot/config of it)");
  if (kernel.preempt_rt) {
    out.push_back(well("kernel", kernel.release + " with PREEMPT_RT" + hz));
  } else {
    out.push_back(
        warn("kernel",
             kernel.release + " without PREEMPT_RT" + hz + ": drivers may hold a cycle up for milliseconds",
             "apt-get install linux-image-rt-amd64, start it, and measure: scripts/bench egm"));
  }
  if (!kernel.isolated_cpus.empty()) {
    out.push_back(well("processors",
                       fmt::format("{}, of them kept for real time: {}", kernel.cpus, kernel.isolated_cpus)));
  } else if (kernel.cpus == 1) {
    out.push_back(warn("processors", "only one: localization and the robot's cycle share it",
                       "give the machine two or more"));
  } else {
    out.push_back(well("processors", fmt::format("{}, none kept for real time (isolcpus= with CPUAffinity= "
                                                 "in the unit, only where scripts/bench egm asks for it)",
                                                 kernel.cpus)));
  }
  const bool slow = std::any_of(kernel.governors.begin(), kernel.governors.end(),
                                [](const std::string& g) { return g != "performance"; });
  if (slow) {
    out.push_back(warn("processor clock",
                       fmt::format("governor {}: the clock is raised only after work has come",
                                   fmt::join(kernel.governors, ", ")),
                       "cpupower frequency-set -g performance (package linux-cpupower), at every start"));
  } else {
    out.push_back(well("processor clock",
                       kernel.governors.empty() ? "not governed by this system" : "governor performance"));
  }
  if (kernel.user_namespaces == 0) {
    out.push_back(
        warn("drawings' child",
             "user.max_user_namespaces is 0: weldcell-cad reads STEP and DXF with the network in reach",
             "sysctl user.max_user_namespaces=1000"));
  }
  return out;
}

Ailment judge_port(const NeededPort& port) {
  const std::string check = "port " + port.name;
  const std::string place = fmt::format("{}:{}/{}", port.host, port.port, port.udp ? "udp" : "tcp");
  if (port.port == 0) return well(check, "a free one is taken at start");
  if (!port.facts.taken) return well(check, place + " is free");
  if (port.facts.program == "weldcelld")
    return well(check, fmt::format("{} is held by weldcelld (pid {})", place, port.facts.pid));
  if (port.facts.pid == 0) {
    return warn(check, place + " is held by a program of another user, or by systemd",
                "run doctor as root: it then names the program");
  }
  if (port.facts.pid == 1) return well(check, place + " is held by systemd for a socket unit");
  return fail(check, fmt::format("{} is held by {} (pid {})", place, port.facts.program, port.facts.pid),
              "end that program, or give the cell file another port");
}

Ailments judge_card(const NeededCard& card) {
  const CardFacts& facts = card.facts;
  const std::string check = "network " + card.name;
  if (facts.name.empty()) {
    if (card.own) {
      return {fail(check, "no network card has " + card.address + ", where weldcelld is to listen",
                   "give a card that address, or change the cell file")};
    }
    return {
        fail(check, "no route leads to " + card.address, "give a network card an address in that network")};
  }
  if (facts.loopback) return {well(check, card.address + " is on this machine (" + facts.name + ")")};
  Ailments out;
  const std::string place = facts.name + " towards " + card.address;
  if (!facts.link)
    return {fail(check, place + " has no link", "cable, switch, or: ip link set " + facts.name + " up")};
  const std::string speed = facts.speed_mb_s ? fmt::format(", {} Mb/s", *facts.speed_mb_s)
                                             : std::string(", speed not told by its driver");
  if ((facts.speed_mb_s && *facts.speed_mb_s < kLeastSpeedMbS) || facts.full_duplex == false) {
    out.push_back(warn(check,
                       place + speed + (facts.full_duplex == false ? ", half duplex" : "") +
                           ": laser data and cycles wait for each other",
                       "cable and switch for 100 Mb/s full duplex or more"));
  } else {
    out.push_back(well(check, place + " has a link" + speed));
  }
  const std::string delay_check = "interrupts " + card.name;
  if (facts.rx_adaptive == true || (facts.rx_delay_us && *facts.rx_delay_us > kMostRxDelayUs)) {
    out.push_back(
        warn(delay_check,
             facts.rx_adaptive == true
                 ? facts.name + " chooses by itself how long datagrams wait in it (adaptive-rx)"
                 : fmt::format("{} keeps datagrams back for up to {} us", facts.name, *facts.rx_delay_us),
             "ethtool -C " + facts.name + " adaptive-rx off rx-usecs 0, at every start"));
  } else if (facts.rx_delay_us) {
    out.push_back(well(
        delay_check, fmt::format("{} keeps datagrams back for up to {} us", facts.name, *facts.rx_delay_us)));
  } else {
    out.push_back(well(delay_check, facts.name + "'s driver has no setting for it"));
  }
  return out;
}

Ailment judge_disk(const NeededDisk& disk) {
  const std::string check = "disk " + disk.name;
  if (!disk.facts.present) {
    return fail(check, disk.folder + ": " + disk.facts.why,
                "systemd-tmpfiles --create weldcell.conf, or start weldcelld once by its unit");
  }
  const std::string seen = fmt::format("{}: {} MB free", disk.folder, disk.facts.free_bytes / kMiB);
  const bool inodes_short = disk.facts.inodes > 0 && disk.facts.free_inodes < 1000;
  if (inodes_short)
    return fail(check, fmt::format("{}: {} files more, then it is full", disk.folder, disk.facts.free_inodes),
                "move old jobs out of done/ and failed/");
  if (disk.facts.free_bytes < kFailBelow)
    return fail(check, seen + ": no room for a job's record", "move old jobs out of done/ and failed/");
  if (disk.facts.free_bytes < kWarnBelow)
    return warn(check, seen + ": room for some jobs' records only", "move old jobs out of done/ and failed/");
  return well(check, seen);
}

Ailments judge_clock(const adapters::ClockFacts& clock, const KernelFacts& kernel) {
  Ailments out;
  if (!clock.synchronized || clock.error_us > kMostClockErrorUs) {
    out.push_back(warn("clock",
                       "not synchronized: reports and records bear a doubtful date (the cell's motion does "
                       "not depend on it)",
                       "apt-get install chrony, with a server that the machine can reach"));
  } else {
    out.push_back(well("clock", fmt::format("synchronized, at most {:.1f} ms off by the kernel's estimate",
                                            static_cast<double>(clock.error_us) / 1000)));
  }
  if (kernel.clock_source.empty() || kernel.clock_source == "tsc" || kernel.clock_source == "kvm-clock" ||
      kernel.clock_source == "arch_sys_counter" || kernel.clock_source.starts_with("hyperv")) {
    out.push_back(well("clock source", kernel.clock_source.empty() ? "not told" : kernel.clock_source));
  } else {
    out.push_back(
        warn("clock source", kernel.clock_source + ": every look at the clock takes a microsecond or more",
             "clocksource=tsc on the kernel's command line, where the processor has a constant one"));
  }
  return out;
}

bool any_failed(const Ailments& ailments) {
  return std::any_of(ailments.begin(), ailments.end(),
                     [](const Ailment& a) { return a.health == Health::Fail; });
}

std::string ailments_text(const Ailments& ailments) {
  std::string out;
  int warned = 0, failed = 0;
  for (const Ailment& a : ailments) {
    out += fmt::format("{:4}  {}: {}\n", word(a.health), a.check, a.seen);
    if (!a.mend.empty()) out += "      mend: " + a.mend + "\n";
    warned += a.health == Health::Warn ? 1 : 0;
    failed += a.health == Health::Fail ? 1 : 0;
  }
  return out + fmt::format("{} checks, {} warned, {} failed\n", ailments.size(), warned, failed);
}

std::string ailments_json(const Ailments& ailments) {
  nlohmann::json checks = nlohmann::json::array();
  int warned = 0, failed = 0;
  for (const Ailment& a : ailments) {
    checks.push_back({{"check", a.check}, {"health", word(a.health)}, {"seen", a.seen}, {"mend", a.mend}});
    warned += a.health == Health::Warn ? 1 : 0;
    failed += a.health == Health::Fail ? 1 : 0;
  }
  return nlohmann::json{{"ok", failed == 0}, {"warned", warned}, {"failed", failed}, {"checks", checks}}
             .dump() +
         "\n";
}

}  // namespace weldcell::app
