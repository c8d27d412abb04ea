#include <sys/resource.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <span>

#include "bench/sensing/parts.hpp"
#include "rt/counting_allocator.hpp"
#include "weldcell/align/aligner.hpp"
#include "weldcell/base/units.hpp"
#include "weldcell/edges/edges.hpp"

namespace weldcell::bench {

double cpu_seconds() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

namespace {

constexpr std::uint32_t kRate = 50000, kBlock = 100;
constexpr double kBlock_s = static_cast<double>(kBlock) / kRate;

cell::CellSetup bench_cell() {
  cell::CellSetup cell;
  cell.arm.a1 = 150, cell.arm.a2 = -115, cell.arm.c1 = 445, cell.arm.c2 = 700, cell.arm.c3 = 795,
  cell.arm.c4 = 85;
  cell.arm.offset[2] = rad(-90);
  cell.laser.rate_hz = kRate;
  return cell;
}

/// The sensor: one block after the other. Its clock wraps half an hour after the start.
class Sensor {
 public:
  std::span<const std::byte> next_block() {
    for (std::uint32_t i = 0; i < kBlock; ++i, ++number_) {
      readings_[i].distance_mm = 100.0F + 0.01F * static_cast<float>(number_ % 17);
      readings_[i].counter = number_;
      readings_[i].timestamp_us =
          static_cast<std::uint32_t>((std::uint64_t{1} << 32) - 1'800'000'000U) + number_ * 20;
    }
    ++blocks_;
    return std::span(bytes_).first(wire::encode_meas28(layout_, readings_, 1, 2, bytes_));
  }
  /// When the last block reached the host.
  HostTime arrival() const { return {from_seconds(kBlock_s * static_cast<double>(blocks_))}; }
  const wire::Meas28Layout& layout() const { return layout_; }

 private:
  wire::Meas28Layout layout_;
  std::vector<wire::LaserReading> readings_{kBlock};
  std::vector<std::byte> bytes_ = std::vector<std::byte>(28 + kBlock * wire::Meas28Layout{}.frame_bytes());
  std::uint32_t number_ = 0;
  std::uint64_t blocks_ = 0;
};

/// Poses of the robot from one instant to another.
std::vector<align::StampedFeedback> poses_of(double from_s, double to_s) {
  std::vector<align::StampedFeedback> out;
  for (int k = static_cast<int>(from_s / 4e-3); k * 4e-3 < to_s; ++k) {
    align::StampedFeedback p;
    p.feedback.joints_deg = {10 * std::sin(0.7 * k * 4e-3), 20, 15, 0, 55, 0};
    p.feedback.seqno = static_cast<std::uint32_t>(k);
    p.feedback.time_us = 4000LL * k;
    p.arrival = HostTime{4 * kMillisecond * k};
    out.push_back(p);
  }
  return out;
}

struct Cost {
  double decode_s = 0, align_s = 0, search_s = 0, points = 0, sent = 0;
};

/// A scan of so many seconds, its bytes made beforehand.
Cost cost_of(double duration_s) {
  Sensor sensor;
  std::vector<std::byte> bytes;
  std::vector<std::size_t> block_end;
  const auto blocks = static_cast<std::size_t>(std::lround(duration_s / kBlock_s));
  for (std::size_t b = 0; b < blocks; ++b) {
    const auto block = sensor.next_block();
    bytes.insert(bytes.end(), block.begin(), block.end());
    block_end.push_back(bytes.size());
  }
  const auto poses = poses_of(0, duration_s + 0.1);
  Cost out;
  out.sent = static_cast<double>(blocks) * kBlock;
  const double start = cpu_seconds();
  std::vector<align::StampedReading> readings;
  readings.reserve(blocks * kBlock);
  wire::Meas28Decoder decoder(sensor.layout());
  std::size_t from = 0;
  for (std::size_t b = 0; b < blocks; ++b) {
    const HostTime arrival{from_seconds(kBlock_s * static_cast<double>(b + 1))};
    decoder.feed(std::span(bytes).subspan(from, block_end[b] - from), [&](const wire::LaserReading& r) {
      readings.push_back({arrival, r});
    });
    from = block_end[b];
  }
  const double decoded = cpu_seconds();
  align::AlignSummary summary;
  const auto points = align::align(bench_cell(), readings, poses, summary);
  const double aligned = cpu_seconds();
  edges::EdgeOptions options;
  options.height_mm = 40;
  const edges::EdgeScan scan = edges::detect(points, options);
  out.search_s = cpu_seconds() - aligned;
  out.decode_s = decoded - start;
  out.align_s = aligned - decoded;
  out.points = static_cast<double>(points.size());
  return out;
}

long resident_peak_kb() {
  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  return usage.ru_maxrss;
}

}  // namespace

void stream_rows(std::vector<Row>& rows) {
  const Cost c = cost_of(20);
  const double n = c.points * 1e-6;
  rows.push_back(
      {"readings placed of those sent", 100.0 * c.points / c.sent, "%", NAN, 99.9, Better::Higher});
  rows.push_back({"decode", n / c.decode_s, "M/s", NAN, NAN, Better::None});
  rows.push_back({"align", n / c.align_s, "M/s", NAN, NAN, Better::None});
  rows.push_back(
      {"decode + align + points, one core", n / (c.decode_s + c.align_s), "M/s", NAN, 5, Better::Higher});
  rows.push_back({"edge search", n / c.search_s, "M/s", NAN, NAN, Better::None});
  // The least of three tells the work from what else the machine does.
  const auto each = [](double duration_s) {
    double least = INFINITY;
    for (int i = 0; i < 3; ++i) {
      const Cost one = cost_of(duration_s);
      least = std::min(least, (one.decode_s + one.align_s + one.search_s) / one.points);
    }
    return least;
  };
  // Both beyond what the processor's caches hold.
  const double few = each(20), many = each(80);
  rows.push_back({"cost of a reading, scan of 80 s over one of 20 s", many / few, "", NAN, 1.25});
}

void hour_rows(std::vector<Row>& rows) {
  constexpr double kMinute_s = 60, kScan_s = 30;
  const cell::CellSetup cell = bench_cell();
  Sensor sensor;
  wire::Meas28Decoder decoder(sensor.layout());
  edges::EdgeOptions options;
  options.height_mm = 40;
  const auto blocks = static_cast<std::size_t>(std::lround(kMinute_s / kBlock_s));
  long early_kb = 0;
  std::uint64_t while_decoding = 0, early = 0, late = 0, placed = 0, resets = 0;
  for (int minute = 1; minute <= 60; ++minute) {
    const double begin_s = kMinute_s * (minute - 1);
    const std::uint64_t before = rt::allocation_count().allocations;
    std::vector<align::StampedReading> readings;
    readings.reserve(static_cast<std::size_t>(kScan_s * kRate));
    const std::uint64_t reserved = rt::allocation_count().allocations;
    for (std::size_t b = 0; b < blocks; ++b) {
      const auto block = sensor.next_block();
      const HostTime arrival = sensor.arrival();
      // Between two scans the stream is read and forgotten.
      const bool scanning = static_cast<double>(b) * kBlock_s < kScan_s;
      decoder.feed(block, [&](const wire::LaserReading& r) {
        if (scanning) readings.push_back({arrival, r});
      });
    }
    while_decoding += rt::allocation_count().allocations - reserved;
    align::AlignSummary summary;
    const auto points = align::align(cell, readings, poses_of(begin_s, begin_s + kScan_s + 0.1), summary);
    const edges::EdgeScan scan = edges::detect(points, options);
    placed += points.size();
    resets += summary.clock_resets;
    const std::uint64_t spent = rt::allocation_count().allocations - before;
    if (minute == 5) early_kb = resident_peak_kb(), early = spent;
    if (minute == 60) late = spent;
  }
  const double sent = 60 * kScan_s * kRate;
  rows.push_back({"hour at 50 kHz: readings of its 60 scans placed",
                  100.0 * static_cast<double>(placed) / sent, "%", NAN, 99.9, Better::Higher});
  rows.push_back({"hour at 50 kHz: readings lost or out of step",
                  static_cast<double>(decoder.counters().lost_readings + decoder.counters().resyncs + resets),
                  "readings", NAN, 0});
  rows.push_back({"hour at 50 kHz: peak memory, minute 60 above minute 5",
                  static_cast<double>(resident_peak_kb() - early_kb), "kB", static_cast<double>(early_kb),
                  1024});
  rows.push_back({"hour at 50 kHz: allocations while 180 M readings are decoded",
                  static_cast<double>(while_decoding), "", NAN, 0});
  rows.push_back({"hour at 50 kHz: allocations of a scan, minute 60", static_cast<double>(late), "",
                  static_cast<double>(early), 1.01 * static_cast<double>(early) + 10});
}

}  // namespace weldcell::bench
