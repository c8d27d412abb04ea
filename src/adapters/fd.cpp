#include "weldcell/adapters/fd.hpp"

#include <unistd.h>

namespace weldcell::adapters {

void Fd::reset() noexcept {
  if (fd_ >= 0) ::close(std::exchange(fd_, -1));
}

}  // namespace weldcell::adapters
