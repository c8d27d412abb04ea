// Figures of sensing: throughput, alignment error, edge error against the bound, ours and the paper's
// detector in one run. usage: bench_sensing [--json]
#include <ctime>
#include <random>

#include "bench/rows.hpp"
#include "bench/sensing/parts.hpp"
#include "unit/edges/step_profile.hpp"
#include "unit/wire/laser_streams.hpp"
#include "weldcell/align/clock_map.hpp"
#include "weldcell/base/units.hpp"
#include "weldcell/edges/edges.hpp"

namespace weldcell {
namespace {

using bench::Better;
using bench::Row;
using edges::StepProfile;

constexpr std::uint64_t kSeed = 47001;

edges::EdgeOptions options_for(const StepProfile& p, edges::Method method) {
  edges::EdgeOptions o;
  o.method = method;
  o.height_mm = p.height_mm;
  o.spot_mm = p.spot_mm;
  o.noise_mm = p.noise_mm;
  o.triangulation_rad = p.triangulation_rad;
  o.outline = edges::bar_outline(p);
  return o;
}

double bound_mm(const StepProfile& p) {
  const double blur = p.spot_mm / 4, motion = p.speed_mm_s * p.exposure_s;
  return 1.883 * p.noise_mm / p.height_mm *
         std::sqrt(std::sqrt(blur * blur + motion * motion / 12) * p.speed_mm_s / p.rate_hz);
}

struct EdgeError {
  double rmse_mm = 0, bias_mm = 0, shadow_bias_mm = 0, wrong_share = 0;
  int bars = 0, wrong = 0;
};

/// Bars scanned to and fro; a bar counts as wrong unless exactly its two edges are found.
EdgeError measure(StepProfile p, edges::Method method, int bars, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> uniform;
  EdgeError out;
  double square = 0, sum = 0, shadow = 0;
  int edges_seen = 0, shadowed = 0;
  for (int i = 0; i < bars; ++i) {
    p.phase = uniform(random);
    p.backward = i % 2 == 1;
    const edges::EdgeScan scan = edges::detect(edges::scan_bar(p, random), options_for(p, method));
    if (scan.edges.size() != 2 || scan.edges[0].step != 1 || scan.edges[1].step != -1) {
      ++out.wrong;
      if (scan.edges.size() != 2) continue;
    }
    for (const EdgePoint& e : scan.edges) {
      const double error = e.x_mm < 0.5 * p.width_mm ? -e.x_mm : e.x_mm - p.width_mm;
      square += error * error;
      sum += error;
      ++edges_seen;
      if (e.shadowed) {
        shadow += error;
        ++shadowed;
      }
    }
  }
  out.bars = bars;
  out.rmse_mm = edges_seen > 0 ? std::sqrt(square / edges_seen) : NAN;
  out.bias_mm = edges_seen > 0 ? sum / edges_seen : NAN;
  out.shadow_bias_mm = shadowed > 0 ? shadow / shadowed : NAN;
  out.wrong_share = static_cast<double>(out.wrong) / bars;
  return out;
}

std::string case_name(const char* what, const StepProfile& p) {
  char text[120];
  std::snprintf(text, sizeof text, "%s: h %.0f mm, %.3g kHz, %.0f mm/s", what, p.height_mm, p.rate_hz * 1e-3,
                p.speed_mm_s);
  return text;
}

void edge_rows(std::vector<Row>& rows) {
  int steps = 0, wrong = 0;
  for (const double height : {3.0, 5.0}) {
    for (const double rate : {1500.0, 5000.0, 20000.0}) {
      for (const double speed : {100.0, 300.0, 500.0}) {
        StepProfile p;
        p.height_mm = height;
        p.rate_hz = rate;
        p.speed_mm_s = speed;
        p.noise_mm = 0.15;
        p.exposure_s = std::min(0.2e-3, 1 / rate);
        const EdgeError ours = measure(p, edges::Method::Model, 280, kSeed);
        const EdgeError paper = measure(p, edges::Method::Paper, 60, kSeed);
        steps += 2 * ours.bars;
        wrong += ours.wrong;
        const double bound = bound_mm(p);
        rows.push_back({case_name("edge rmse", p), ours.rmse_mm, "mm", bound, 1.15 * bound});
        rows.push_back(
            {case_name("paper rmse where found", p), paper.rmse_mm, "mm", bound, NAN, Better::None});
        rows.push_back(
            {case_name("paper bars wrong", p), 100 * paper.wrong_share, "%", NAN, NAN, Better::None});
      }
    }
  }
  rows.push_back({"clean steps tried", static_cast<double>(steps), "steps", NAN, 10000, Better::Higher});
  rows.push_back({"clean bars with a missed or invented edge", static_cast<double>(wrong), "bars", NAN, 0});
}

void hard_edge_rows(std::vector<Row>& rows) {
  for (const double rate : {1500.0, 5000.0, 20000.0}) {
    StepProfile p;
    p.height_mm = 3;
    p.rate_hz = rate;
    p.speed_mm_s = 300;
    p.noise_mm = 0.15;
    p.outliers = 0.02;
    const EdgeError ours = measure(p, edges::Method::Model, 400, kSeed + 1);
    const EdgeError paper = measure(p, edges::Method::Paper, 60, kSeed + 1);
    rows.push_back(
        {case_name("edge rmse, 2 % outliers", p), ours.rmse_mm, "mm", bound_mm(p), 1.6 * bound_mm(p)});
    rows.push_back(
        {case_name("bars wrong, 2 % outliers", p), 100 * ours.wrong_share, "%", 100 * paper.wrong_share, 0});
  }
  for (const double radius : {0.0, 4.0}) {
    for (const bool peak : {false, true}) {
      StepProfile p;
      p.radius_mm = radius;
      p.peak = peak;
      const EdgeError e = measure(p, edges::Method::Model, 60, kSeed + 2);
      char name[80];
      std::snprintf(name, sizeof name, "silhouette bias: h 40, r %.0f mm, %s", radius,
                    peak ? "peak switching" : "blended");
      rows.push_back({name, std::abs(e.bias_mm), "mm", NAN, 0.05});
    }
  }
  StepProfile p;
  p.height_mm = 5;
  p.triangulation_rad = rad(20);
  p.receiver = 1;
  const EdgeError shadow = measure(p, edges::Method::Model, 60, kSeed + 3);
  rows.push_back(
      {"shadow bias after correction: h 5, theta 20 deg", std::abs(shadow.shadow_bias_mm), "mm", 0.92, 0.1});
}

void clock_rows(std::vector<Row>& rows) {
  constexpr int kTrials = 100;
  double square = 0;
  int covered = 0;
  for (int trial = 0; trial < kTrials; ++trial) {
    std::mt19937_64 random(kSeed + 100 + static_cast<std::uint64_t>(trial));
    std::exponential_distribution<double> exponential(1);
    std::uniform_real_distribution<double> uniform;
    align::ClockMapBuilder builder;
    const auto device = [](double t) { return static_cast<std::int64_t>(1e6 * t * (1 + 30e-6)) * 1000; };
    double last = 0;
    for (double t = 0; t < 30; t += 4e-3) {
      double arrival = t + 0.25e-3 + 0.5e-3 * exponential(random);
      if (uniform(random) < 0.05) arrival += 5e-3 * exponential(random);
      const double phase = std::fmod(arrival, 1.7);
      if (phase < 0.05) arrival += 0.05 - phase;
      last = std::max(last, arrival);
      builder.add(device(t), HostTime{from_seconds(last)});
    }
    const align::ClockMap map = builder.finish();
    double n = 0, sum = 0, sum2 = 0;
    for (double t = 0; t < 30; t += 0.05) {
      const double e = 1e6 * (seconds(map.to_host(device(t)) - HostTime{0}) - t);
      n += 1, sum += e, sum2 += e * e;
    }
    const double variance = std::max(0.0, sum2 / n - sum / n * sum / n);
    square += variance / kTrials;
    covered += std::sqrt(variance) <= 2 * map.sigma_us() ? 1 : 0;
  }
  rows.push_back(
      {"time error: 30 ppm, 0.25 ms floor, bursts, 50 ms stalls", std::sqrt(square), "us", NAN, 20});
  rows.push_back(
      {"stated time uncertainty (2 sigma) covers", 100.0 * covered / kTrials, "%", NAN, 95, Better::Higher});
}

/// A core's decoding of each dialect; the fastest sensor of all sends 70,000 readings a second.
void dialect_rows(std::vector<Row>& rows) {
  using wire::LaserDialect;
  constexpr std::uint32_t kBlocks = 20000, kFrames = 20;
  for (const auto dialect : {LaserDialect::Data28, LaserDialect::Meas32, LaserDialect::TwoByte,
                             LaserDialect::ThreeByte, LaserDialect::Od5000}) {
    const auto stream = wire::streams::blocks(dialect, 0, kBlocks, kFrames);
    wire::LaserDecoder decoder(wire::streams::format_of(dialect));
    double sum = 0;
    std::uint64_t readings = 0;
    const double start = bench::cpu_seconds();
    wire::streams::feed_blocks(decoder, dialect, stream, stream.size() / kBlocks,
                               [&](const wire::LaserReading& r) {
                                 sum += static_cast<double>(r.distance_mm);
                                 ++readings;
                               });
    const double spent = bench::cpu_seconds() - start;
    if (readings != std::uint64_t{kBlocks} * kFrames || !std::isfinite(sum)) {
      rows.push_back({std::string("decode ") + wire::to_string(dialect), 0, "M/s", NAN, 5, Better::Higher});
      continue;
    }
    rows.push_back({std::string("decode ") + wire::to_string(dialect),
                    static_cast<double>(readings) * 1e-6 / spent, "M/s", NAN, 5, Better::Higher});
  }
}

}  // namespace
}  // namespace weldcell

int main(int argc, char** argv) {
  for (int i = 1; i < argc; ++i) {
    if (std::strcmp(argv[i], "--json") == 0) continue;
    const bool help = std::strcmp(argv[i], "--help") == 0 || std::strcmp(argv[i], "-h") == 0;
    std::fprintf(help ? stdout : stderr,
                 "usage: bench_sensing [--json]\nFigures of decoding, alignment and edge detection.\n");
    return help ? 0 : 2;
  }
  std::vector<weldcell::bench::Row> rows;
  // The hour first: what came before would hide how its memory grows.
  weldcell::bench::hour_rows(rows);
  weldcell::bench::stream_rows(rows);
  weldcell::dialect_rows(rows);
  weldcell::bench::damage_rows(rows);
  weldcell::bench::latency_rows(rows);
  weldcell::clock_rows(rows);
  weldcell::edge_rows(rows);
  weldcell::hard_edge_rows(rows);
  return weldcell::bench::finish("sensing", rows, weldcell::bench::wants_json(argc, argv));
}
