#include "weldcell/adapters/host_facts.hpp"

#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/statvfs.h>
#include <sys/timex.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <thread>

namespace weldcell::adapters {
namespace {

namespace fs = std::filesystem;

/// First line of a small file; "" when there is none.
std::string line_of(const fs::path& path) {
  std::ifstream in(path);
  std::string line;
  std::getline(in, line);
  return line;
}

std::optional<std::int64_t> number_of(const fs::path& path) {
  const std::string line = line_of(path);
  char* end = nullptr;
  const std::int64_t value = std::strtoll(line.c_str(), &end, 10);
  if (line.empty() || end == line.c_str()) return std::nullopt;
  return value;
}

/// The number after `key` at the start of a line.
std::optional<std::int64_t> field(const fs::path& path, const std::string& key) {
  std::ifstream in(path);
  for (std::string line; std::getline(in, line);) {
    if (line.starts_with(key)) return std::strtoll(line.c_str() + key.size(), nullptr, 10);
  }
  return std::nullopt;
}

bool all_digits(const std::string& text) {
  return !text.empty() && std::all_of(text.begin(), text.end(), [](char c) { return c >= '0' && c <= '9'; });
}

/// proc_pid_stat(5): name in parentheses, which may hold spaces and parentheses; field 40 is the real-time
/// priority, field 41 the policy.
ThreadFacts thread_facts(const fs::path& folder) {
  ThreadFacts out;
  const std::string stat = line_of(folder / "stat");
  const auto open = stat.find('('), close = stat.rfind(')');
  if (open == std::string::npos || close == std::string::npos || close < open) return out;
  out.name = stat.substr(open + 1, close - open - 1);
  std::istringstream rest(stat.substr(close + 1));
  std::string word;
  for (int number = 3; rest >> word; ++number) {
    if (number == 40) out.priority = std::atoi(word.c_str());
    if (number == 41) out.fifo = std::atoi(word.c_str()) == SCHED_FIFO;
  }
  return out;
}

}  // namespace

KernelFacts kernel_facts(const HostPlaces& places) {
  KernelFacts out;
  const fs::path proc = places.proc, sys = places.sys;
  out.release = line_of(proc / "sys/kernel/osrelease");
  out.preempt_rt = line_of(sys / "kernel/realtime") == "1" ||
                   line_of(proc / "sys/kernel/version").find("PREEMPT_RT") != std::string::npos;
  if (const auto hz = field(fs::path(places.boot) / ("config-" + out.release), "CONFIG_HZ=")) {
    out.hz = static_cast<int>(*hz);
  }
  out.isolated_cpus = line_of(sys / "devices/system/cpu/isolated");
  out.clock_source = line_of(sys / "devices/system/clocksource/clocksource0/current_clocksource");
  out.rt_runtime_us = number_of(proc / "sys/kernel/sched_rt_runtime_us");
  out.rt_period_us = number_of(proc / "sys/kernel/sched_rt_period_us");
  out.user_namespaces = number_of(proc / "sys/user/max_user_namespaces");
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(sys / "devices/system/cpu", error)) {
    const std::string name = entry.path().filename();
    if (!name.starts_with("cpu") || !all_digits(name.substr(3))) continue;
    ++out.cpus;
    const std::string governor = line_of(entry.path() / "cpufreq/scaling_governor");
    if (!governor.empty() &&
        std::find(out.governors.begin(), out.governors.end(), governor) == out.governors.end()) {
      out.governors.push_back(governor);
    }
  }
  return out;
}

std::optional<ProcessFacts> process_named(const std::string& name, const HostPlaces& places) {
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(places.proc, error)) {
    const std::string pid = entry.path().filename();
    if (!all_digits(pid) || line_of(entry.path() / "comm") != name.substr(0, 15)) continue;
    ProcessFacts out;
    out.pid = std::atoi(pid.c_str());
    out.locked_kb = field(entry.path() / "status", "VmLck:").value_or(0);
    for (const auto& task : fs::directory_iterator(entry.path() / "task", error)) {
      out.threads.push_back(thread_facts(task.path()));
    }
    return out;
  }
  return std::nullopt;
}

RealTimeRights try_real_time(int priority) {
  RealTimeRights out;
  // A thread of its own: it ends, and its scheduling with it.
  std::thread([&] {
    sched_param parameter{};
    parameter.sched_priority = priority;
    out.fifo = ::pthread_setschedparam(::pthread_self(), SCHED_FIFO, &parameter) == 0;
  }).join();
  out.memory_lock = ::mlockall(MCL_CURRENT | MCL_FUTURE | MCL_ONFAULT) == 0;
  if (out.memory_lock) ::munlockall();
  return out;
}

DiskFacts disk_facts(const std::string& folder) {
  DiskFacts out;
  struct statvfs facts {};
  std::error_code error;
  if (::statvfs(folder.c_str(), &facts) != 0) {
    out.why = std::strerror(errno);
    return out;
  }
  if (!fs::is_directory(folder, error)) {
    out.why = error ? error.message() : "is no folder";
    return out;
  }
  out.present = true;
  out.writable = ::access(folder.c_str(), W_OK | X_OK) == 0;
  out.free_bytes = static_cast<std::uint64_t>(facts.f_bavail) * facts.f_frsize;
  out.free_inodes = facts.f_favail;
  out.inodes = facts.f_files;
  return out;
}

ClockFacts clock_facts() {
  timex state{};
  const int answer = ::adjtimex(&state);
  return {answer >= 0 && answer != TIME_ERROR && (state.status & STA_UNSYNC) == 0, state.maxerror};
}

}  // namespace weldcell::adapters
