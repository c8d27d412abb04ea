#include "sim/laser_server.hpp"

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <system_error>

namespace weldcell::sim {

namespace {
constexpr std::size_t kMaxBacklog = 1'000'000;
constexpr std::size_t kMaxClients = 16;

[[noreturn]] void fail(const char* what) { throw std::system_error(errno, std::generic_category(), what); }

/// A listening socket; `port` 0 becomes the one taken.
int listen_at(const std::string& host, int& port) {
  const int out = ::socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  if (out < 0) fail("laser socket");
  const int on = 1;
  ::setsockopt(out, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  if (::inet_pton(AF_INET, host.c_str(), &address.sin_addr) != 1) {
    ::close(out);
    throw std::system_error(EINVAL, std::generic_category(), "laser address " + host);
  }
  socklen_t size = sizeof address;
  if (::bind(out, reinterpret_cast<sockaddr*>(&address), size) != 0 || ::listen(out, 8) != 0 ||
      ::getsockname(out, reinterpret_cast<sockaddr*>(&address), &size) != 0) {
    const int error = errno;
    ::close(out);
    throw std::system_error(error, std::generic_category(),
                            "laser address " + host + ":" + std::to_string(port));
  }
  port = ntohs(address.sin_port);
  return out;
}

}  // namespace

LaserServer::LaserServer(const files::CellConfig& cell)
    : commands_in_stream_(cell.laser_commands == files::LaserCommands::InStream) {
  port_ = cell.laser.port;
  listener_ = listen_at(cell.laser.host, port_);
  if (cell.laser_commands == files::LaserCommands::Port) {
    command_port_ = cell.laser_command_port;
    try {
      command_listener_ = listen_at(cell.laser.host, command_port_);
    } catch (...) {
      ::close(listener_);
      throw;
    }
  }
  interpreter_ = make_interpreter(cell.laser_format, port_);
}

LaserServer::~LaserServer() {
  drop_clients();
  ::close(listener_);
  if (command_listener_ >= 0) ::close(command_listener_);
}

void LaserServer::welcome(int listener, bool readings, bool commands) {
  for (;;) {
    const int socket = ::accept4(listener, nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC);
    if (socket < 0) return;
    if (clients_.size() >= kMaxClients) {
      ::close(socket);
      continue;
    }
    const int on = 1;
    ::setsockopt(socket, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    if (commands) interpreter_->hang_up();
    clients_.push_back({socket, readings, commands, {}});
  }
}

bool LaserServer::hear(Client& client) {
  std::array<char, 512> buffer;
  for (;;) {
    const ssize_t n = ::recv(client.socket, buffer.data(), buffer.size(), 0);
    if (n == 0) return false;
    if (n < 0) return errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR;
    if (!client.commands) continue;
    const std::string answer = interpreter_->hear({buffer.data(), static_cast<std::size_t>(n)});
    const auto* bytes = reinterpret_cast<const std::byte*>(answer.data());
    client.backlog.insert(client.backlog.end(), bytes, bytes + answer.size());
  }
}

void LaserServer::serve() {
  welcome(listener_, true, commands_in_stream_);
  if (command_listener_ >= 0) welcome(command_listener_, false, true);
  std::erase_if(clients_, [this](Client& client) {
    if (hear(client) && flush(client)) return false;
    ::close(client.socket);
    return true;
  });
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
      if (client.readings && interpreter_->sending())
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
