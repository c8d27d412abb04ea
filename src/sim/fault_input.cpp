#include "sim/fault_input.hpp"

#include <poll.h>
#include <unistd.h>

#include <cstdio>

namespace weldcell::sim {

namespace {
constexpr std::size_t kLongestLine = 200;
}

std::vector<TimedFault> FaultInput::take() {
  std::vector<TimedFault> out;
  pollfd ready{fd_, POLLIN, 0};
  char bytes[512];
  while (fd_ >= 0 && ::poll(&ready, 1, 0) > 0) {
    const ssize_t n = ::read(fd_, bytes, sizeof bytes);
    if (n <= 0) {
      fd_ = -1;
      break;
    }
    rest_.append(bytes, static_cast<std::size_t>(n));
    for (std::size_t end = rest_.find('\n'); end != std::string::npos; end = rest_.find('\n')) {
      const std::string line = rest_.substr(0, end);
      rest_.erase(0, end + 1);
      if (line.empty()) continue;
      if (const auto fault = parse_fault(line); fault.ok()) {
        out.push_back(*fault);
      } else {
        std::fprintf(stderr, "weldcell-sim: %s\n", fault.error().text().c_str());
      }
    }
    if (rest_.size() > kLongestLine) rest_.clear();
  }
  return out;
}

}  // namespace weldcell::sim
