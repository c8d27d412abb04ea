// The EGM socket: one UDP port, kernel receive stamps, one peer. Owned by the egm thread; real-time safe
// after bind().
#pragma once

#include <netinet/in.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "weldcell/adapters/fd.hpp"
#include "weldcell/base/result.hpp"
#include "weldcell/base/time.hpp"

namespace weldcell::adapters {

struct EgmArrival {
  std::size_t bytes = 0;  ///< 0: nothing came before the timeout (or a signal)
  HostTime arrival;       ///< when the kernel had the datagram
  explicit operator bool() const { return bytes != 0; }
};

struct EgmSocketCounters {
  std::uint64_t received = 0;    ///< datagrams handed to the caller
  std::uint64_t superseded = 0;  ///< dropped by receive_newest() for a newer one
  std::uint64_t foreign = 0;     ///< from another sender than the peer; never answered
  std::uint64_t oversize = 0;    ///< longer than kEgmDatagramBytes, or empty
  std::uint64_t sent = 0;
  std::uint64_t send_errors = 0;
  std::uint64_t receive_errors = 0;  ///< includes ICMP refusals of earlier replies
};

/// Largest datagram taken; a buffer of this size receives everything that is valid.
inline constexpr std::size_t kEgmDatagramBytes = 2048;
/// Without a configured peer the first sender is the peer until it has been silent for so long.
inline constexpr Nanoseconds kEgmPeerSilence = kSecond;

class EgmSocket {
 public:
  /// Binds host:port (dotted IPv4; port 0 takes a free one). `peer` is the only source address that is
  /// listened to; "" means the first sender of a session. Errors: "egm.address", "egm.bind" (port taken,
  /// address not of this host).
  static Result<EgmSocket> bind(const std::string& host, int port, const std::string& peer = "");

  int port() const noexcept { return port_; }
  int fd() const noexcept { return fd_.get(); }

  /// Waits at most `timeout` for one datagram of the peer and copies it to `buffer` (kEgmDatagramBytes).
  /// Foreign, empty and oversize ones are counted and skipped; while they keep coming it may take twice the
  /// timeout.
  EgmArrival receive(std::span<std::byte> buffer, Nanoseconds timeout) noexcept;
  /// The same, but what is already queued behind the datagram is read too and only the newest is returned.
  EgmArrival receive_newest(std::span<std::byte> buffer, Nanoseconds timeout) noexcept;
  /// Sends to the sender of the datagram last returned. False: nobody to answer yet, or refused by the
  /// kernel.
  bool reply(std::span<const std::byte> datagram) noexcept;
  /// Ends the session with the peer at hand: the next sender that the address filter admits becomes the peer.
  void forget_peer() noexcept { has_peer_ = false; }

  const EgmSocketCounters& counters() const noexcept { return counters_; }

 private:
  static constexpr unsigned kBatch = 4;
  EgmSocket() = default;
  EgmArrival receive_of(unsigned batch, std::span<std::byte> buffer, Nanoseconds timeout) noexcept;
  /// Reads up to `most` datagrams in one call of the kernel; leaves the newest of the peer in `buffer`.
  /// Returns how many there were of any kind.
  unsigned take(unsigned most, int flags, std::span<std::byte> buffer, EgmArrival& out) noexcept;
  void set_timeout(Nanoseconds timeout) noexcept;
  bool admits(const sockaddr_in& sender, HostTime arrival) noexcept;

  Fd fd_;
  int port_ = 0;
  in_addr peer_filter_{};
  bool filtered_ = false;
  sockaddr_in peer_{};
  bool has_peer_ = false;
  HostTime peer_heard_;
  EgmSocketCounters counters_;
  Nanoseconds timeout_ = 0;  ///< as the kernel has it
  std::array<std::array<std::byte, kEgmDatagramBytes>, kBatch> scratch_{};
};

}  // namespace weldcell::adapters
