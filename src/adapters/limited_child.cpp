#include "adapters/limited_child.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sched.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>

namespace weldcell::adapters {

namespace {

struct Pipe {
  int read_end = -1, write_end = -1;
  ~Pipe() {
    close_read();
    close_write();
  }
  bool open() {
    int ends[2];
    if (::pipe2(ends, O_CLOEXEC) != 0) return false;
    read_end = ends[0];
    write_end = ends[1];
    return true;
  }
  void close_read() {
    if (read_end >= 0) ::close(read_end);
    read_end = -1;
  }
  void close_write() {
    if (write_end >= 0) ::close(write_end);
    write_end = -1;
  }
};

void limit(int resource, unsigned long value) {
  const rlimit both{value, value};
  ::setrlimit(static_cast<__rlimit_resource>(resource), &both);
}

/// Between fork and exec of a process with threads: only calls that are safe there.
[[noreturn]] void become(char* const* arguments, char* const* environment, int out, int err, int report,
                         const ChildLimits& limits) {
  ::setpgid(0, 0);
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  ::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0);
  // No network. The systemd unit's RestrictNamespaces= has to leave these two kinds open.
  int network_errno = 0;
  if (::unshare(CLONE_NEWNET) != 0 && ::unshare(CLONE_NEWUSER | CLONE_NEWNET) != 0) network_errno = errno;
  if (::write(report, &network_errno, sizeof network_errno) != sizeof network_errno) ::_exit(127);
  const int nothing = ::open("/dev/null", O_RDONLY);
  if (nothing < 0 || ::dup2(nothing, 0) < 0 || ::dup2(out, 1) < 0 || ::dup2(err, 2) < 0) ::_exit(127);
  ::close_range(3, ~0U, 0);
  limit(RLIMIT_CORE, 0);
  limit(RLIMIT_AS, limits.memory_bytes);
  limit(RLIMIT_CPU, static_cast<unsigned long>(limits.cpu_s));
  limit(RLIMIT_FSIZE, 0);
  limit(RLIMIT_NOFILE, 64);
  sigset_t none;
  ::sigemptyset(&none);
  ::sigprocmask(SIG_SETMASK, &none, nullptr);
  ::signal(SIGPIPE, SIG_DFL);
  ::execve(arguments[0], arguments, environment);
  ::_exit(127);
}

/// Reads what is there; false at the end. Bytes beyond `most` are dropped and told.
bool drain(int fd, std::string& into, std::size_t most, bool& too_much) {
  std::array<char, 65536> buffer{};
  const ssize_t got = ::read(fd, buffer.data(), buffer.size());
  if (got < 0) return errno == EINTR || errno == EAGAIN;
  if (got == 0) return false;
  const std::size_t room = most - std::min(most, into.size());
  const std::size_t count = static_cast<std::size_t>(got);
  too_much = too_much || count > room;
  into.append(buffer.data(), std::min(room, count));
  return true;
}

}  // namespace

Result<ChildOutcome> run_limited(const std::vector<std::string>& arguments, const ChildLimits& limits) {
  const auto failed = [&](const char* what) {
    return Error{"child.start", arguments[0], std::string(what) + ": " + std::strerror(errno),
                 "see the system's limits"};
  };
  Pipe out, err, report;
  if (!out.open() || !err.open() || !report.open()) return failed("no pipe");
  std::vector<char*> argument_list, environment;
  for (const std::string& argument : arguments) argument_list.push_back(const_cast<char*>(argument.c_str()));
  argument_list.push_back(nullptr);
  static char locale[] = "LC_ALL=C", path[] = "PATH=/usr/bin:/bin";
  environment = {locale, path, nullptr};

  const pid_t child = ::fork();
  if (child < 0) return failed("no process");
  if (child == 0)
    become(argument_list.data(), environment.data(), out.write_end, err.write_end, report.write_end, limits);
  ::setpgid(child, child);
  out.close_write();
  err.close_write();
  report.close_write();

  ChildOutcome outcome;
  // Comes before the program begins, or the child is gone and the pipe at its end.
  ssize_t got = 0;
  while ((got = ::read(report.read_end, &outcome.network_errno, sizeof outcome.network_errno)) < 0 &&
         errno == EINTR) {
  }
  using Clock = std::chrono::steady_clock;
  const auto deadline = Clock::now() + std::chrono::seconds(limits.timeout_s);
  bool ignored = false;
  while (out.read_end >= 0 || err.read_end >= 0) {
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(deadline - Clock::now()).count();
    if (left <= 0 || outcome.too_much_output) break;
    std::array<pollfd, 2> ends{pollfd{out.read_end, POLLIN, 0}, pollfd{err.read_end, POLLIN, 0}};
    ::poll(ends.data(), ends.size(), static_cast<int>(std::min<long long>(left, 1000)));
    if (ends[0].revents != 0 &&
        !drain(out.read_end, outcome.out, limits.output_bytes, outcome.too_much_output)) {
      out.close_read();
    }
    if (ends[1].revents != 0 && !drain(err.read_end, outcome.err, 65536, ignored)) err.close_read();
  }
  int status = 0;
  pid_t ended = 0;
  while ((ended = ::waitpid(child, &status, WNOHANG)) == 0 && !outcome.too_much_output) {
    outcome.timed_out = Clock::now() >= deadline;
    if (outcome.timed_out) break;
    ::usleep(1000);
  }
  if (ended == 0) {
    ::kill(-child, SIGKILL);
    while ((ended = ::waitpid(child, &status, 0)) < 0 && errno == EINTR) {
    }
  }
  if (ended < 0) return failed("the child was lost");
  if (WIFEXITED(status)) outcome.exit_code = WEXITSTATUS(status);
  if (WIFSIGNALED(status)) outcome.signal = WTERMSIG(status);
  return outcome;
}

}  // namespace weldcell::adapters
