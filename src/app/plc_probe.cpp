#include "app/plc_probe.hpp"

#include <arpa/inet.h>
#include <fcntl.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>

#include <cerrno>
#include <cstring>

#include "weldcell/adapters/host_clock.hpp"

namespace weldcell::app {

namespace {

constexpr Nanoseconds kPatience = kSecond;
constexpr std::size_t kHeader = 7, kMostPdu = 253;

std::uint8_t high(unsigned word) { return static_cast<std::uint8_t>(word >> 8); }
std::uint8_t low(unsigned word) { return static_cast<std::uint8_t>(word & 0xFF); }

bool wait_for(int fd, short events, HostTime deadline) {
  const Nanoseconds left = deadline - adapters::now();
  if (left <= 0) return false;
  pollfd wanted{fd, events, 0};
  const std::timespec limit{left / kSecond, left % kSecond};
  return ::ppoll(&wanted, 1, &limit, nullptr) > 0;
}

}  // namespace

std::string ProbeReply::describe() const {
  if (closed) return "a closed connection";
  if (!came()) return "no answer";
  if (exception() != 0) return "exception " + std::to_string(exception());
  return "an answer of " + std::to_string(pdu.size()) + " bytes with function " + std::to_string(pdu[0]);
}

Result<PlcProbe> PlcProbe::connect(const std::string& host, int port, Nanoseconds timeout) {
  const std::string where = host + ":" + std::to_string(port);
  addrinfo hints{};
  hints.ai_family = AF_INET;
  hints.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  if (::getaddrinfo(host.c_str(), std::to_string(port).c_str(), &hints, &found) != 0)
    return Error{"plc.connect", where, "no such host", "write HOST or HOST:PORT"};
  PlcProbe probe;
  probe.fd_ = adapters::Fd(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  int reason = ::connect(probe.fd_.get(), found->ai_addr, found->ai_addrlen) == 0 ? 0 : errno;
  ::freeaddrinfo(found);
  if (reason == EINPROGRESS) {
    socklen_t size = sizeof reason;
    if (!wait_for(probe.fd_.get(), POLLOUT, adapters::now() + timeout))
      reason = ETIMEDOUT;
    else
      ::getsockopt(probe.fd_.get(), SOL_SOCKET, SO_ERROR, &reason, &size);
  }
  if (reason != 0)
    return Error{"plc.connect", where, std::strerror(reason),
                 "start the server, name its port, and have this address in its list of clients"};
  const int on = 1;
  ::setsockopt(probe.fd_.get(), IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
  return probe;
}

PlcBytes PlcProbe::frame(std::span<const std::uint8_t> pdu, std::uint8_t unit) {
  ++transaction_;
  const auto size = static_cast<unsigned>(pdu.size() + 1);
  PlcBytes out;
  out.reserve(kHeader + pdu.size());
  for (const std::uint8_t byte :
       {high(transaction_), low(transaction_), std::uint8_t{0}, std::uint8_t{0}, high(size), low(size), unit})
    out.push_back(byte);
  for (const std::uint8_t byte : pdu) out.push_back(byte);
  return out;
}

bool PlcProbe::send(std::span<const std::uint8_t> bytes) {
  const HostTime deadline = adapters::now() + kPatience;
  while (!bytes.empty()) {
    const ssize_t sent = ::send(fd_.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (sent > 0) {
      bytes = bytes.subspan(static_cast<std::size_t>(sent));
    } else if (errno != EAGAIN || !wait_for(fd_.get(), POLLOUT, deadline)) {
      return false;
    }
  }
  return true;
}

bool PlcProbe::fill(std::span<std::uint8_t> into, HostTime deadline, bool& closed) {
  while (!into.empty()) {
    const ssize_t got = ::recv(fd_.get(), into.data(), into.size(), 0);
    if (got > 0) {
      into = into.subspan(static_cast<std::size_t>(got));
    } else if (got == 0 || (errno != EAGAIN && errno != EINTR)) {
      closed = true;
      return false;
    } else if (!wait_for(fd_.get(), POLLIN, deadline)) {
      return false;
    }
  }
  return true;
}

ProbeReply PlcProbe::receive(Nanoseconds timeout) {
  ProbeReply out;
  const HostTime deadline = adapters::now() + timeout;
  PlcBytes header(kHeader);
  if (!fill(header, deadline, out.closed)) return out;
  out.transaction = static_cast<std::uint16_t>(header[0] << 8 | header[1]);
  out.protocol = static_cast<std::uint16_t>(header[2] << 8 | header[3]);
  out.unit = header[6];
  const std::size_t size = static_cast<std::size_t>(header[4] << 8 | header[5]);
  if (size < 2 || size > kMostPdu + 1) return out;
  out.pdu.resize(size - 1);
  if (!fill(out.pdu, deadline, out.closed)) out.pdu.clear();
  return out;
}

ProbeReply PlcProbe::ask(std::span<const std::uint8_t> pdu, std::uint8_t unit, Nanoseconds timeout) {
  if (!send(frame(pdu, unit))) {
    ProbeReply out;
    out.closed = true;
    return out;
  }
  return receive(timeout);
}

std::vector<std::uint16_t> PlcProbe::read_words(std::uint16_t address, std::uint16_t count) {
  const PlcBytes pdu{3, high(address), low(address), high(count), low(count)};
  const ProbeReply reply = ask(pdu, 1, kPatience);
  if (reply.pdu.size() != 2U + 2U * count || reply.pdu[0] != 3) return {};
  std::vector<std::uint16_t> out;
  for (std::size_t i = 0; i < count; ++i)
    out.push_back(static_cast<std::uint16_t>(reply.pdu[2 + 2 * i] << 8 | reply.pdu[3 + 2 * i]));
  return out;
}

bool PlcProbe::write_words(std::uint16_t address, std::span<const std::uint16_t> words) {
  const auto count = static_cast<unsigned>(words.size());
  PlcBytes pdu{16,          high(address), low(address),
               high(count), low(count),    static_cast<std::uint8_t>(2 * count)};
  for (const std::uint16_t word : words) {
    pdu.push_back(high(word));
    pdu.push_back(low(word));
  }
  const ProbeReply reply = ask(pdu, 1, kPatience);
  return reply.pdu.size() == 5 && reply.pdu[0] == 16;
}

}  // namespace weldcell::app
