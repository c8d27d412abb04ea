#include "sim/laser_server.hpp"

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>

namespace weldcell::sim {

namespace {
constexpr std::size_t kMaxBacklog = 1'000'000;
constexpr std::size_t kMaxClients = 16;

[[noreturn]] void fail(const char* what) { throw std::system_error(errno, std::generic_category(), what); }
}  // namespace

LaserServer::LaserServer(const files::Endpoint& endpoint) {
  listener_ = ::socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  if (listener_ < 0) fail("laser socket");
  const int on = 1;
  ::setsockopt(listener_, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(endpoint.port));
  if (::inet_pton(AF_INET, endpoint.host.c_str(), &address.sin_addr) != 1) {
    ::close(listener_);
    throw std::system_error(EINVAL, std::generic_category(), "laser address " + endpoint.host);
  }
  socklen_t size = sizeof address;
  if (::bind(listener_, reinterpret_cast<sockaddr*>(&address), size) != 0 || ::listen(listener_, 8) != 0 ||
      ::getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &size) != 0) {
    const int error = errno;
    ::close(listener_);
    errno = error;
    fail("laser address");
  }
  port_ = ntohs(address.sin_port);
}

LaserServer::~LaserServer() {
  drop_clients();
  ::close(listener_);
}

void LaserServer::serve() {
  for (;;) {
    const int socket = ::accept4(listener_, nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC);
    if (socket < 0) return;
    if (clients_.size() >= kMaxClients) {
      ::close(socket);
      continue;
    }
    const int on = 1;
    ::setsockopt(socket, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    clients_.push_back({socket, {}});
  }
}

bool LaserServer::flush(Client& client) {
  std::size_t sent = 0;
  while (sent < client.backlog.size()) {
    const ssize_t n =
        ::send(client.socket, client.backlog.data() + sent, client.backlog.size() - sent, MSG_NOSIGNAL);
    if (n < 0) {
      if (errno != EAGAIN && errno != EWOULDBLOCK && errno != EINTR) return false;
      break;
    }
    sent += static_cast<std::size_t>(n);
  }
  client.backlog.erase(client.backlog.begin(), client.backlog.begin() + static_cast<std::ptrdiff_t>(sent));
  return client.backlog.size() <= kMaxBacklog;
}

void LaserServer::send_due(std::deque<LaserBlock>& blocks, HostTime now) {
  while (!blocks.empty() && blocks.front().arrival <= now) {
    for (Client& client : clients_) {
      client.backlog.insert(client.backlog.end(), blocks.front().bytes.begin(), blocks.front().bytes.end());
    }
    blocks.pop_front();
  }
  std::erase_if(clients_, [this](Client& client) {
    if (flush(client)) return false;
    ::close(client.socket);
    return true;
  });
}

void LaserServer::drop_clients() {
  serve();
  for (const Client& client : clients_) ::close(client.socket);
  clients_.clear();
}

}  // namespace weldcell::sim
