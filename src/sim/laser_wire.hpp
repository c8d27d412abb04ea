// What a sensor puts on its wire, in every dialect, written from the protocol descriptions alone. Pure.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "weldcell/wire/laser_dialects.hpp"

namespace weldcell::sim {

enum class Echo : std::uint8_t { Distance, NoPeak, BeforeRange, BehindRange };

/// One exposure as the sensor's own electronics know it.
struct Sample {
  double distance_mm = 0;  ///< from the start of the measuring range
  Echo echo = Echo::Distance;
  std::uint64_t number = 0;     ///< since the sensor was switched on
  std::uint64_t device_ns = 0;  ///< the sensor's own clock
};

class LaserWire {
 public:
  /// The format stands for the sensor's settings: its dialect, selected outputs, range and channel scale.
  explicit LaserWire(const wire::LaserFormat& settings) : settings_(settings) {}

  /// How long the sensor gathers readings before it sends them, and how many fit into one packet.
  double gather_s() const;
  std::size_t most_samples() const;
  /// One block, one piece of a stream or one datagram. Needs 1 to most_samples().
  std::vector<std::byte> encode(std::span<const Sample> samples) const;

 private:
  std::vector<std::byte> meas28(std::span<const Sample> samples) const;
  std::vector<std::byte> data28(std::span<const Sample> samples) const;
  std::vector<std::byte> meas32(std::span<const Sample> samples) const;
  std::vector<std::byte> bytes(std::span<const Sample> samples) const;
  std::vector<std::byte> od5000(std::span<const Sample> samples) const;
  std::size_t frame_bytes() const;

  wire::LaserFormat settings_;
};

}  // namespace weldcell::sim
