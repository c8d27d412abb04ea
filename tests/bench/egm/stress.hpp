// Load beside a measurement.
#pragma once

#include <sched.h>
#include <spawn.h>
#include <sys/wait.h>

#include <csignal>
#include <string>

extern char** environ;

namespace weldcell::bench {

/// stress-ng on two CPUs as a child in a group of its own, ended with this object.
class Stress {
 public:
  explicit Stress(double seconds) {
    const std::string limit = std::to_string(static_cast<int>(seconds) + 30) + "s";
    const char* words[] = {"stress-ng", "--cpu", "2", "--quiet", "--timeout", limit.c_str(), nullptr};
    posix_spawnattr_t attributes;
    posix_spawnattr_init(&attributes);
    // Ordinary scheduling: it would inherit ours, which is above what is measured.
    const sched_param ordinary{};
    posix_spawnattr_setschedpolicy(&attributes, SCHED_OTHER);
    posix_spawnattr_setschedparam(&attributes, &ordinary);
    posix_spawnattr_setflags(&attributes,
                             POSIX_SPAWN_SETPGROUP | POSIX_SPAWN_SETSCHEDULER | POSIX_SPAWN_SETSCHEDPARAM);
    if (posix_spawnp(&child_, "stress-ng", nullptr, &attributes, const_cast<char**>(words), environ) != 0)
      child_ = -1;
    posix_spawnattr_destroy(&attributes);
  }
  bool running() const { return child_ > 0 && ::waitpid(child_, nullptr, WNOHANG) == 0; }
  ~Stress() {
    if (child_ <= 0) return;
    ::kill(-child_, SIGTERM);
    ::waitpid(child_, nullptr, 0);
  }

 private:
  pid_t child_ = -1;
};

}  // namespace weldcell::bench
