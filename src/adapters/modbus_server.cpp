#include "weldcell/adapters/modbus_server.hpp"

#include <arpa/inet.h>
#include <fcntl.h>
#include <modbus.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "modbus_frame.hpp"
#include "weldcell/adapters/fd.hpp"
#include "weldcell/adapters/host_clock.hpp"

namespace weldcell::adapters {
namespace {

constexpr int kRegisters = wire::kPlcReadBase + wire::kPlcReadWords;
constexpr std::size_t kQueuedOrders = 16;
constexpr int kBacklog = 32;
constexpr int kLostPeerMilliseconds = 5000;
constexpr Nanoseconds kWindow = 100 * kMillisecond;  ///< in which a client's requests are counted
constexpr Nanoseconds kLongestWait = 3600 * kSecond;
constexpr Nanoseconds kNoDescriptorPause = 100 * kMillisecond;

struct Client {
  Fd fd;
  in_addr_t address = 0;  ///< network order
  std::array<std::uint8_t, 2 * kModbusFrameBytes> buffer{};
  std::size_t filled = 0;
  HostTime frame_begun;
  HostTime heard;
  HostTime window_begun;
  int requests = 0;  ///< since window_begun
};

struct FreeContext {
  void operator()(modbus_t* context) const {
    // libmodbus would close the socket that it answered last; that one is owned by its Client.
    modbus_set_socket(context, -1);
    modbus_free(context);
  }
};
struct FreeMapping {
  void operator()(modbus_mapping_t* mapping) const { modbus_mapping_free(mapping); }
};

Error fault(const char* code, const ModbusOptions& o, const std::string& what, const char* mend) {
  return {code, "modbus " + o.host + ":" + std::to_string(o.port), what, mend};
}

void set_option(int fd, int level, int name, int value) {
  ::setsockopt(fd, level, name, &value, sizeof value);
}

void configure_client(int fd) {
  set_option(fd, SOL_SOCKET, SO_KEEPALIVE, 1);
  set_option(fd, IPPROTO_TCP, TCP_KEEPIDLE, 2);
  set_option(fd, IPPROTO_TCP, TCP_KEEPINTVL, 1);
  set_option(fd, IPPROTO_TCP, TCP_KEEPCNT, 3);
  set_option(fd, IPPROTO_TCP, TCP_USER_TIMEOUT, kLostPeerMilliseconds);
  set_option(fd, IPPROTO_TCP, TCP_NODELAY, 1);
}

}  // namespace

struct ModbusServer::State {
  ModbusOptions options;
  std::vector<in_addr_t> allowed;
  Fd listener;
  int port = 0;
  std::unique_ptr<modbus_t, FreeContext> context;
  std::unique_ptr<modbus_mapping_t, FreeMapping> mapping;
  std::vector<Client> clients;
  std::vector<pollfd> waits;
  std::array<PlcWords, kQueuedOrders> orders{};
  std::size_t first_order = 0, order_count = 0;
  PlcWords last{};
  HostTime accept_from;  ///< no new client before: descriptors had run out
  ModbusCounters counters;

  bool spent(Client& client, HostTime at) noexcept;

  bool allows(in_addr_t address) const noexcept {
    return allowed.empty() || std::ranges::count(allowed, address) != 0;
  }
  void accept_all(HostTime at) noexcept;
  bool make_room(HostTime at) noexcept;
  bool serve(Client& client, HostTime at) noexcept;
  bool answer(Client& client, std::span<const std::uint8_t> frame) noexcept;
  void note_order() noexcept;
};

namespace {

/// Addresses in network order.
Result<std::vector<in_addr_t>> addresses(const std::vector<std::string>& texts,
                                         const ModbusOptions& options) {
  std::vector<in_addr_t> out;
  for (const std::string& text : texts) {
    in_addr address{};
    if (inet_pton(AF_INET, text.c_str(), &address) != 1)
      return fault("modbus.address", options, "allowed client '" + text + "' is not an IPv4 address",
                   "write dotted addresses");
    out.push_back(address.s_addr);
  }
  return out;
}

/// A socket that somebody else made must be one that this server can use.
bool listens_on_ipv4(int fd) {
  int listens = 0, domain = 0;
  socklen_t bytes = sizeof listens;
  if (::getsockopt(fd, SOL_SOCKET, SO_ACCEPTCONN, &listens, &bytes) != 0) return false;
  bytes = sizeof domain;
  return ::getsockopt(fd, SOL_SOCKET, SO_DOMAIN, &domain, &bytes) == 0 && listens != 0 && domain == AF_INET;
}

/// Binds and listens; the port is that of the socket, whoever made it.
std::optional<Error> open_listener(const ModbusOptions& options, Fd& listener, int& port) {
  sockaddr_in local{};
  local.sin_family = AF_INET;
  if (options.listen_fd >= 0) {
    listener = Fd(options.listen_fd);
    if (!listens_on_ipv4(listener.get()))
      return fault("modbus.socket", options, "the socket handed over is no listening IPv4 socket",
                   "ListenStream=0.0.0.0:502 in the socket unit: a port alone makes an IPv6 socket");
  } else {
    if (options.port < 0 || options.port > 65535 ||
        inet_pton(AF_INET, options.host.c_str(), &local.sin_addr) != 1)
      return fault("modbus.address", options, "not an IPv4 address and port",
                   "write a dotted address of this host, or 0.0.0.0, and a port from 0 to 65535");
    local.sin_port = htons(static_cast<std::uint16_t>(options.port));
    listener = Fd(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
    set_option(listener.get(), SOL_SOCKET, SO_REUSEADDR, 1);
    if (::bind(listener.get(), reinterpret_cast<const sockaddr*>(&local), sizeof local) != 0 ||
        ::listen(listener.get(), kBacklog) != 0) {
      const int reason = errno;
      return fault(
          "modbus.bind", options, std::strerror(reason),
          reason == EADDRINUSE ? "another program has this port: stop it or choose another"
          : reason == EACCES
              ? "ports below 1024 need a socket unit of systemd or CAP_NET_BIND_SERVICE: use one, or "
                "choose another port"
              : "use an address of this host");
    }
  }
  // A client that goes away between poll and accept must not block the thread.
  ::fcntl(listener.get(), F_SETFL, ::fcntl(listener.get(), F_GETFL) | O_NONBLOCK);
  socklen_t bytes = sizeof local;
  ::getsockname(listener.get(), reinterpret_cast<sockaddr*>(&local), &bytes);
  port = ntohs(local.sin_port);
  return std::nullopt;
}

}  // namespace

ModbusServer::ModbusServer(std::unique_ptr<State> state) : state_(std::move(state)) {}
ModbusServer::ModbusServer(ModbusServer&&) noexcept = default;
ModbusServer& ModbusServer::operator=(ModbusServer&&) noexcept = default;
ModbusServer::~ModbusServer() = default;

Result<ModbusServer> ModbusServer::listen(const ModbusOptions& options) {
  auto state = std::make_unique<State>();
  state->options = options;
  auto allowed = addresses(options.allowed_clients, options);
  if (!allowed.ok()) return allowed.error();
  state->allowed = std::move(*allowed);
  if (auto error = open_listener(options, state->listener, state->port)) return *error;
  // The address is never used: connections are accepted here and lent to the library one frame at a time.
  state->context.reset(modbus_new_tcp("127.0.0.1", MODBUS_TCP_DEFAULT_PORT));
  state->mapping.reset(modbus_mapping_new(0, 0, kRegisters, 0));
  if (!state->context || !state->mapping)
    return fault("modbus.library", options, modbus_strerror(errno), "free memory");
  const auto places = static_cast<std::size_t>(std::max(options.max_clients, 1));
  state->clients.reserve(places);
  state->waits.reserve(places + 1);
  return ModbusServer(std::move(state));
}

Status ModbusServer::set_access(const std::vector<std::string>& allowed_clients, int max_clients) {
  auto allowed = addresses(allowed_clients, state_->options);
  if (!allowed.ok()) return allowed.error();
  state_->allowed = std::move(*allowed);
  state_->options.max_clients = std::max(max_clients, 1);
  std::erase_if(state_->clients, [&](const Client& client) { return !state_->allows(client.address); });
  const auto places = static_cast<std::size_t>(state_->options.max_clients);
  if (state_->clients.size() > places) state_->clients.resize(places);
  state_->clients.reserve(places);
  state_->waits.reserve(places + 1);
  return Done{};
}

int ModbusServer::port() const noexcept { return state_->port; }
int ModbusServer::clients() const noexcept { return static_cast<int>(state_->clients.size()); }
const ModbusCounters& ModbusServer::counters() const noexcept { return state_->counters; }

void ModbusServer::set_status(const PlcStatusWords& words) noexcept {
  std::ranges::copy(words, state_->mapping->tab_registers + wire::kPlcReadBase);
}

PlcWords ModbusServer::words() const noexcept {
  PlcWords out;
  std::copy_n(state_->mapping->tab_registers + wire::kPlcWriteBase, out.size(), out.begin());
  return out;
}

std::optional<PlcWords> ModbusServer::take_order() noexcept {
  State& s = *state_;
  if (s.order_count == 0) return std::nullopt;
  const PlcWords out = s.orders[s.first_order];
  s.first_order = (s.first_order + 1) % kQueuedOrders;
  --s.order_count;
  return out;
}

void ModbusServer::poll(Nanoseconds timeout) noexcept {
  State& s = *state_;
  s.waits.clear();
  const HostTime begin = now();
  const bool accepts = begin >= s.accept_from;
  s.waits.push_back({s.listener.get(), static_cast<short>(accepts ? POLLIN : 0), 0});
  bool held = !accepts;
  for (Client& client : s.clients) {
    const bool spent = s.spent(client, begin);
    held = held || spent;
    s.waits.push_back({client.fd.get(), static_cast<short>(spent ? 0 : POLLIN), 0});
  }
  const Nanoseconds wait = std::min(std::max<Nanoseconds>(timeout, 0), held ? kWindow / 10 : kLongestWait);
  const std::timespec limit{wait / kSecond, wait % kSecond};
  if (::ppoll(s.waits.data(), s.waits.size(), &limit, nullptr) < 0) return;

  const HostTime at = now();
  for (std::size_t i = 0; i < s.clients.size(); ++i) {
    Client& client = s.clients[i];
    const bool stands = s.waits[i + 1].revents == 0 || s.serve(client, at);
    const bool stuck = client.filled != 0 && at - client.frame_begun > s.options.half_frame_timeout;
    if (stuck) ++s.counters.malformed;
    if (!stands || stuck) client.fd.reset();
  }
  std::erase_if(s.clients, [](const Client& client) { return !client.fd.valid(); });
  if (s.waits[0].revents != 0) s.accept_all(at);
}

void ModbusServer::State::accept_all(HostTime at) noexcept {
  for (int i = 0; i < kBacklog; ++i) {
    sockaddr_in from{};
    socklen_t bytes = sizeof from;
    Fd fd(
        ::accept4(listener.get(), reinterpret_cast<sockaddr*>(&from), &bytes, SOCK_CLOEXEC | SOCK_NONBLOCK));
    if (!fd.valid()) {
      if (errno == EMFILE || errno == ENFILE || errno == ENOBUFS || errno == ENOMEM) {
        ++counters.refused_clients;
        accept_from = at + kNoDescriptorPause;
      }
      return;
    }
    const bool known = allows(from.sin_addr.s_addr);
    // poll() and the library's select() both need small descriptors.
    if (!known || fd.get() >= FD_SETSIZE || !make_room(at)) {
      ++counters.refused_clients;
      continue;
    }
    configure_client(fd.get());
    Client client;
    client.fd = std::move(fd);
    client.address = from.sin_addr.s_addr;
    client.heard = at;
    clients.push_back(std::move(client));
  }
}

bool ModbusServer::State::spent(Client& client, HostTime at) noexcept {
  if (at - client.window_begun >= kWindow) {
    client.window_begun = at;
    client.requests = 0;
  }
  return client.requests >= options.max_requests_per_second * (kWindow / kMillisecond) / 1000;
}

bool ModbusServer::State::make_room(HostTime at) noexcept {
  if (clients.size() < static_cast<std::size_t>(std::max(options.max_clients, 1))) return true;
  const auto idle = std::ranges::min_element(clients, {}, [](const Client& c) { return c.heard; });
  if (at - idle->heard < options.idle_before_eviction) return false;
  clients.erase(idle);
  return true;
}

bool ModbusServer::State::serve(Client& client, HostTime at) noexcept {
  const std::span<std::uint8_t> space = std::span(client.buffer).subspan(client.filled);
  const ssize_t got = ::recv(client.fd.get(), space.data(), space.size(), MSG_DONTWAIT);
  if (got < 0) return errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR;
  if (got == 0) return false;
  if (client.filled == 0) client.frame_begun = at;
  client.filled += static_cast<std::size_t>(got);

  std::size_t begin = 0;
  for (;;) {
    const auto rest = std::span<const std::uint8_t>(client.buffer).subspan(begin, client.filled - begin);
    const int size = modbus_frame_size(rest);
    if (size < 0) {
      ++counters.malformed;
      return false;
    }
    if (size == 0 || rest.size() < static_cast<std::size_t>(size)) break;
    client.heard = at;
    client.frame_begun = at;
    ++client.requests;
    if (!answer(client, rest.first(static_cast<std::size_t>(size)))) return false;
    begin += static_cast<std::size_t>(size);
  }
  std::copy(client.buffer.begin() + static_cast<std::ptrdiff_t>(begin),
            client.buffer.begin() + static_cast<std::ptrdiff_t>(client.filled), client.buffer.begin());
  client.filled -= begin;
  return true;
}

bool ModbusServer::State::answer(Client& client, std::span<const std::uint8_t> frame) noexcept {
  ++counters.requests;
  modbus_set_socket(context.get(), client.fd.get());
  const auto size = static_cast<int>(frame.size());
  const std::uint8_t unit = frame[kModbusHeaderBytes - 1];
  bool writes = false;
  const int refused = std::ranges::count(options.unit_ids, unit) == 0
                          ? static_cast<int>(MODBUS_EXCEPTION_GATEWAY_TARGET)
                          : modbus_refusal(frame, writes);
  if (refused != 0) {
    ++counters.exceptions;
    return modbus_reply_exception(context.get(), frame.data(), static_cast<unsigned>(refused)) > 0;
  }
  const bool sent = modbus_reply(context.get(), frame.data(), size, mapping.get()) > 0;
  if (writes) note_order();
  return sent;
}

void ModbusServer::State::note_order() noexcept {
  PlcWords image;
  std::copy_n(mapping->tab_registers + wire::kPlcWriteBase, image.size(), image.begin());
  if (image == last) return;
  last = image;
  if (order_count == kQueuedOrders) {
    first_order = (first_order + 1) % kQueuedOrders;
    --order_count;
    ++counters.orders_lost;
  }
  orders[(first_order + order_count) % kQueuedOrders] = image;
  ++order_count;
}

}  // namespace weldcell::adapters
