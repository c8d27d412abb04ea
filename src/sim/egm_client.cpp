#include "sim/egm_client.hpp"

#include <arpa/inet.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>

namespace weldcell::sim {

EgmClient::EgmClient(const files::Endpoint& peer) {
  peer_.sin_family = AF_INET;
  peer_.sin_port = htons(static_cast<std::uint16_t>(peer.port));
  if (::inet_pton(AF_INET, peer.host.c_str(), &peer_.sin_addr) != 1) {
    throw std::system_error(EINVAL, std::generic_category(), "EGM address " + peer.host);
  }
  socket_ = ::socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  if (socket_ < 0) throw std::system_error(errno, std::generic_category(), "EGM socket");
}

EgmClient::~EgmClient() { ::close(socket_); }

bool EgmClient::send(std::span<const std::byte> datagram) {
  return ::sendto(socket_, datagram.data(), datagram.size(), 0, reinterpret_cast<const sockaddr*>(&peer_),
                  sizeof peer_) >= 0;
}

std::optional<std::span<const std::byte>> EgmClient::receive() {
  for (;;) {
    sockaddr_in from{};
    socklen_t size = sizeof from;
    const ssize_t n =
        ::recvfrom(socket_, buffer_.data(), buffer_.size(), 0, reinterpret_cast<sockaddr*>(&from), &size);
    if (n < 0) {
      if (errno == EINTR || errno == ECONNREFUSED) continue;
      return std::nullopt;
    }
    if (from.sin_addr.s_addr == peer_.sin_addr.s_addr && from.sin_port == peer_.sin_port) {
      return std::span<const std::byte>(buffer_).first(static_cast<std::size_t>(n));
    }
  }
}

}  // namespace weldcell::sim
