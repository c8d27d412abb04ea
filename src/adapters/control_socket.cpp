#include "weldcell/adapters/control_socket.hpp"

#include <poll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <nlohmann/json.hpp>
#include <vector>

#include "weldcell/adapters/fd.hpp"
#include "weldcell/adapters/host_clock.hpp"

namespace weldcell::adapters {
namespace {

using nlohmann::json;

constexpr Nanoseconds kSilentClient = 60 * kSecond;
constexpr Nanoseconds kAnswerTimeout = kSecond;

struct Client {
  Fd fd;
  std::string line;
  int uid = -1;
  HostTime heard;
};

Error fault(const char* code, const std::filesystem::path& path, const std::string& what, const char* mend) {
  return {code, path.string(), what, mend};
}

bool fill(sockaddr_un& address, const std::filesystem::path& path) {
  address = {};
  address.sun_family = AF_UNIX;
  const std::string& text = path.native();
  if (text.empty() || text.size() >= sizeof address.sun_path) return false;
  std::ranges::copy(text, address.sun_path);
  return true;
}

/// Waits for `events` until the deadline.
bool ready(int fd, short events, HostTime deadline) {
  for (;;) {
    const Nanoseconds left = std::max<Nanoseconds>(deadline - now(), 0);
    const std::timespec limit{left / kSecond, left % kSecond};
    pollfd wanted{fd, events, 0};
    const int got = ::ppoll(&wanted, 1, &limit, nullptr);
    if (got >= 0) return got > 0;
    if (errno != EINTR) return false;
  }
}

bool send_all(int fd, std::string_view text, HostTime deadline) {
  while (!text.empty()) {
    const ssize_t sent = ::send(fd, text.data(), text.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
    if (sent >= 0) {
      text.remove_prefix(static_cast<std::size_t>(sent));
    } else if (errno == EAGAIN || errno == EINTR) {
      if (!ready(fd, POLLOUT, deadline)) return false;
    } else {
      return false;
    }
  }
  return true;
}

int peer_uid(int fd) {
  ucred who{};
  socklen_t bytes = sizeof who;
  return ::getsockopt(fd, SOL_SOCKET, SO_PEERCRED, &who, &bytes) == 0 ? static_cast<int>(who.uid) : -1;
}

std::string refusal(const char* what) { return json{{"ok", false}, {"error", what}}.dump(); }

std::string answer(const ControlSocket::Handler& handler, const std::string& line, int uid) {
  const json request = json::parse(line, nullptr, false);
  if (!request.is_object()) return refusal("a request is one JSON object on one line");
  const auto command = request.find("command");
  if (command == request.end() || !command->is_string())
    return refusal("a request needs \"command\": \"name\"");
  std::string text = handler({command->get<std::string>(), line, uid});
  std::ranges::replace_if(
      text, [](char c) { return c == '\n' || c == '\r'; }, ' ');
  return text;
}

}  // namespace

struct ControlSocket::State {
  std::filesystem::path path;
  Handler handler;
  Fd listener;
  std::vector<Client> clients;

  ~State() {
    if (listener.valid()) ::unlink(path.c_str());
  }
  void accept_all();
  bool serve(Client& client);
};

ControlSocket::ControlSocket(std::unique_ptr<State> state) : state_(std::move(state)) {}
ControlSocket::ControlSocket(ControlSocket&&) noexcept = default;
ControlSocket& ControlSocket::operator=(ControlSocket&&) noexcept = default;
ControlSocket::~ControlSocket() = default;
int ControlSocket::clients() const { return static_cast<int>(state_->clients.size()); }

Result<ControlSocket> ControlSocket::listen(const std::filesystem::path& path, Handler handler) {
  sockaddr_un address{};
  if (!fill(address, path))
    return fault("control.path", path, "a socket's path has 1 to 107 bytes", "choose a shorter state_dir");
  const auto* generic = reinterpret_cast<const sockaddr*>(&address);
  Fd listener(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  struct stat there {};
  if (::lstat(path.c_str(), &there) == 0) {
    if (!S_ISSOCK(there.st_mode))
      return fault("control.path", path, "is there and no socket", "move it away");
    const Fd probe(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0));
    if (::connect(probe.get(), generic, sizeof address) == 0)
      return fault("control.in_use", path, "another weldcelld answers here",
                   "stop it, or use another state_dir");
    ::unlink(path.c_str());
  }
  if (::bind(listener.get(), generic, sizeof address) != 0 || ::chmod(path.c_str(), 0660) != 0 ||
      ::listen(listener.get(), kControlClients) != 0) {
    const int reason = errno;
    return fault(reason == ENOENT ? "control.path" : "control.bind", path, std::strerror(reason),
                 "check that state_dir exists and may be written");
  }
  auto state = std::make_unique<State>();
  state->path = path;
  state->handler = std::move(handler);
  state->listener = std::move(listener);
  return ControlSocket(std::move(state));
}

void ControlSocket::poll(Nanoseconds timeout) {
  State& s = *state_;
  std::vector<pollfd> waits{{s.listener.get(), POLLIN, 0}};
  for (const Client& client : s.clients) waits.push_back({client.fd.get(), POLLIN, 0});
  const Nanoseconds wait = std::max<Nanoseconds>(timeout, 0);
  const std::timespec limit{wait / kSecond, wait % kSecond};
  if (::ppoll(waits.data(), waits.size(), &limit, nullptr) < 0) return;
  const HostTime at = now();
  for (std::size_t i = 0; i < s.clients.size(); ++i) {
    Client& client = s.clients[i];
    const bool traffic = waits[i + 1].revents != 0;
    if (traffic) client.heard = at;
    if ((traffic && !s.serve(client)) || at - client.heard > kSilentClient) client.fd.reset();
  }
  std::erase_if(s.clients, [](const Client& client) { return !client.fd.valid(); });
  if (waits[0].revents != 0) s.accept_all();
}

void ControlSocket::State::accept_all() {
  for (;;) {
    Fd fd(::accept4(listener.get(), nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK));
    if (!fd.valid()) return;
    if (clients.size() >= static_cast<std::size_t>(kControlClients)) {
      send_all(fd.get(), refusal("too many clients: try again") + "\n", now());
      continue;
    }
    Client client;
    client.uid = peer_uid(fd.get());
    client.heard = now();
    client.fd = std::move(fd);
    clients.push_back(std::move(client));
  }
}

bool ControlSocket::State::serve(Client& client) {
  std::array<char, 4096> piece;
  const ssize_t got = ::recv(client.fd.get(), piece.data(), piece.size(), MSG_DONTWAIT);
  if (got < 0) return errno == EAGAIN || errno == EINTR;
  if (got == 0) return false;
  client.line.append(piece.data(), static_cast<std::size_t>(got));
  for (std::size_t end; (end = client.line.find('\n')) != std::string::npos;) {
    const std::string line = client.line.substr(0, end);
    client.line.erase(0, end + 1);
    if (line.find_first_not_of(" \t\r") == std::string::npos) continue;
    if (line.size() > kControlLineBytes) break;
    if (!send_all(client.fd.get(), answer(handler, line, client.uid) + "\n", now() + kAnswerTimeout))
      return false;
  }
  if (client.line.size() <= kControlLineBytes) return true;
  send_all(client.fd.get(), refusal("the request is longer than 65536 bytes") + "\n", now());
  return false;
}

Result<std::string> control_request(const std::filesystem::path& path, std::string_view json_line,
                                    Nanoseconds timeout) {
  const HostTime deadline = now() + timeout;
  sockaddr_un address{};
  if (!fill(address, path))
    return fault("control.no_daemon", path, "a socket's path has 1 to 107 bytes", "check state_dir");
  const Fd fd(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  while (::connect(fd.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    const int reason = errno;
    if (reason == EACCES || reason == EPERM)
      return fault("control.permission", path, std::strerror(reason),
                   "run as root or as a member of the daemon's group");
    if (reason != EAGAIN)
      return fault("control.no_daemon", path, std::strerror(reason),
                   "start weldcelld, or check --config and state_dir");
    if (now() > deadline)
      return fault("control.timeout", path, "the daemon accepts nobody", "look at its journal");
    ::poll(nullptr, 0, 10);
  }
  if (!send_all(fd.get(), std::string(json_line) + "\n", deadline))
    return fault("control.closed", path, "the daemon closed the connection", "look at its journal");
  std::string text;
  std::array<char, 16384> piece;
  while (ready(fd.get(), POLLIN, deadline)) {
    const ssize_t got = ::recv(fd.get(), piece.data(), piece.size(), 0);
    if (got < 0 && (errno == EAGAIN || errno == EINTR)) continue;
    if (got <= 0)
      return fault("control.closed", path, "the daemon closed the connection", "look at its journal");
    text.append(piece.data(), static_cast<std::size_t>(got));
    if (const std::size_t end = text.find('\n'); end != std::string::npos) return text.substr(0, end);
  }
  return fault("control.timeout", path, "no answer", "look at the daemon's journal");
}

}  // namespace weldcell::adapters
