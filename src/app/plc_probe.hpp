// A Modbus TCP client that can also send what no client should: raw frames, halves and garbage. For
// conformance tests. Blocking, caller's thread.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "weldcell/adapters/fd.hpp"
#include "weldcell/base/result.hpp"
#include "weldcell/base/time.hpp"

namespace weldcell::app {

using PlcBytes = std::vector<std::uint8_t>;

/// One answer off the wire. `pdu` is empty when none came in time or the server closed the connection.
struct ProbeReply {
  std::uint16_t transaction = 0, protocol = 0;
  std::uint8_t unit = 0;
  PlcBytes pdu;
  bool closed = false;

  bool came() const { return !pdu.empty(); }
  /// Exception code, 0 when it is none.
  int exception() const { return pdu.size() == 2 && pdu[0] >= 0x80 ? pdu[1] : 0; }
  /// "nothing", "a closed connection", "exception 2", "an answer of 5 bytes".
  std::string describe() const;
};

class PlcProbe {
 public:
  /// Errors: "plc.connect".
  static Result<PlcProbe> connect(const std::string& host, int port, Nanoseconds timeout);

  /// One request and its answer.
  ProbeReply ask(std::span<const std::uint8_t> pdu, std::uint8_t unit, Nanoseconds timeout);
  /// The frame of a request, with the next transaction number.
  PlcBytes frame(std::span<const std::uint8_t> pdu, std::uint8_t unit);
  std::uint16_t transaction() const { return transaction_; }
  bool send(std::span<const std::uint8_t> bytes);
  ProbeReply receive(Nanoseconds timeout);

  /// FC3 of `count` words from `address`; empty when the answer is not that.
  std::vector<std::uint16_t> read_words(std::uint16_t address, std::uint16_t count);
  /// FC16; false when it is not confirmed.
  bool write_words(std::uint16_t address, std::span<const std::uint16_t> words);

 private:
  bool fill(std::span<std::uint8_t> into, HostTime deadline, bool& closed);

  adapters::Fd fd_;
  std::uint16_t transaction_ = 0x1700;
};

}  // namespace weldcell::app
