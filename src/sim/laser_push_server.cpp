#include "sim/laser_push_server.hpp"

#include <arpa/inet.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <system_error>

namespace weldcell::sim {

namespace {

// Commands of the OD5000, operating instructions 8021391, tables 26 to 31 and 46.
constexpr std::uint32_t kPushPort = 0x10E2, kPushIp = 0x10E4, kPushChannels = 0x01E0, kFirmware = 0x0004;
// Sampling rate (7.4.1), filters and hold of channels A to D, 0x80 apart (table 32 of 2017).
constexpr std::uint32_t kSamplingRate = 0x0C10, k100us = 3, kAnotherRate = 4;
constexpr std::uint32_t kMedian = 0x0210, kMovingAverage = 0x0214, kHold = 0x022C, kPerChannel = 0x80;
constexpr std::uint32_t kUnknownCommand = 0xE1;

std::uint32_t number(std::span<const std::byte> bytes) {
  std::uint32_t out = 0;
  for (const std::byte b : bytes) out = out << 8 | static_cast<std::uint32_t>(b);
  return out;
}

void put(std::vector<std::byte>& out, std::uint32_t value, int bytes) {
  for (int shift = 8 * (bytes - 1); shift >= 0; shift -= 8)
    out.push_back(static_cast<std::byte>(value >> shift & 0xFF));
}

int udp_socket() {
  const int out = ::socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  if (out < 0) throw std::system_error(errno, std::generic_category(), "laser socket");
  return out;
}

}  // namespace

LaserPushServer::LaserPushServer(const files::CellConfig& cell)
    : sampling_rate_(cell.setup.laser.rate_hz == 10'000 ? k100us : kAnotherRate) {
  const files::Endpoint& control = cell.laser;
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(control.port));
  if (::inet_pton(AF_INET, control.host.c_str(), &address.sin_addr) != 1)
    throw std::system_error(EINVAL, std::generic_category(), "laser address " + control.host);
  control_ = udp_socket();
  socklen_t size = sizeof address;
  if (::bind(control_, reinterpret_cast<sockaddr*>(&address), size) != 0 ||
      ::getsockname(control_, reinterpret_cast<sockaddr*>(&address), &size) != 0) {
    const int error = errno;
    ::close(control_);
    throw std::system_error(error, std::generic_category(), "laser address " + control.host);
  }
  port_ = ntohs(address.sin_port);
  // The readings leave by a port of their own at the same address.
  data_ = udp_socket();
  address.sin_port = 0;
  ::bind(data_, reinterpret_cast<sockaddr*>(&address), sizeof address);
}

LaserPushServer::~LaserPushServer() {
  ::close(control_);
  ::close(data_);
}

std::uint32_t* LaserPushServer::setting(std::uint32_t command) {
  if (command == kPushPort) return &target_port_;
  if (command == kPushIp) return &target_ip_;
  if (command == kPushChannels) return &channels_;
  if (command == kSamplingRate) return &sampling_rate_;
  for (std::uint32_t i = 0; i < filters_.size(); ++i) {
    if (command == kMedian + i * kPerChannel) return &filters_[i].median;
    if (command == kMovingAverage + i * kPerChannel) return &filters_[i].moving_average;
    if (command == kHold + i * kPerChannel) return &filters_[i].hold;
  }
  return nullptr;
}

std::vector<std::byte> LaserPushServer::answer(std::span<const std::byte> request) {
  std::vector<std::byte> out;
  const std::uint32_t head = request.size() >= 4 ? number(request.first(2)) : 0;
  const std::uint32_t command = request.size() >= 4 ? number(request.subspan(2, 2)) : 0;
  if (head == 0x3002) {
    const std::uint32_t* value = command == kFirmware ? &firmware_ : setting(command);
    put(out, 0xB004, 2);
    put(out, value != nullptr ? *value : kUnknownCommand, 4);
  } else if (head == 0x4002 && request.size() >= 6) {
    const std::size_t length = number(request.subspan(4, 2)) & 0xFFF;
    std::uint32_t* value = setting(command);
    if (value == nullptr || length > 4 || request.size() != 6 + length) {
      put(out, 0xC002, 2);
      put(out, kUnknownCommand, 2);
    } else {
      *value = number(request.subspan(6));
      put(out, 0xC000, 2);
    }
  }
  return out;
}

void LaserPushServer::serve() {
  std::array<std::byte, 1500> buffer;
  for (;;) {
    sockaddr_in from{};
    socklen_t size = sizeof from;
    const ssize_t n =
        ::recvfrom(control_, buffer.data(), buffer.size(), 0, reinterpret_cast<sockaddr*>(&from), &size);
    if (n < 0 && (errno == EINTR || errno == ECONNREFUSED)) continue;
    if (n < 0) return;
    const auto reply = answer(std::span(buffer).first(static_cast<std::size_t>(n)));
    if (!reply.empty())
      ::sendto(control_, reply.data(), reply.size(), 0, reinterpret_cast<sockaddr*>(&from), size);
  }
}

void LaserPushServer::drop_clients() {
  std::byte ignored;
  while (::recv(control_, &ignored, sizeof ignored, 0) >= 0 || errno == EINTR) continue;
  channels_ = 0;
}

void LaserPushServer::send_due(std::deque<LaserBlock>& blocks, HostTime now) {
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = htons(static_cast<std::uint16_t>(target_port_));
  to.sin_addr.s_addr = htonl(target_ip_);
  while (!blocks.empty() && blocks.front().arrival <= now) {
    const auto& bytes = blocks.front().bytes;
    if (channels_ != 0)
      ::sendto(data_, bytes.data(), bytes.size(), 0, reinterpret_cast<sockaddr*>(&to), sizeof to);
    blocks.pop_front();
  }
}

}  // namespace weldcell::sim
