// weldcell calibrate latency: the laser's constant latency from passes to and fro, into the cell file.
#include <fmt/format.h>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "app/command_line.hpp"
#include "app/places.hpp"
#include "weldcell/adapters/host_clock.hpp"
#include "weldcell/app/record.hpp"
#include "weldcell/app/replay.hpp"
#include "weldcell/calibrate/latency.hpp"
#include "weldcell/files/cell_edit.hpp"
#include "weldcell/files/cell_file.hpp"
#include "weldcell/files/edge_file.hpp"

namespace weldcell::app {

namespace {

using calibrate::GaugeCrossing;

constexpr double kNearEdge_mm = 5;  // of the localized outline; farther off it belongs to something else
constexpr double kAcross = 0.7;     // |cosine| between travel and normal: an oblique crossing tells little

/// What all data were taken with, and the latency that placed them.
struct Source {
  std::vector<GaugeCrossing> crossings;
  std::optional<double> latency_ms;
  std::optional<files::LatencyConditions> ran;  ///< what the records' cell stated; a CSV does not say
};

/// Every outline edge of the localized part serves as a gauge edge of its own; each record has its own
/// places.
Status take_record(const std::string& path, const std::string& bytes, Source& source, int& next_edge) {
  const auto record = read_record(std::as_bytes(std::span(bytes.data(), bytes.size())));
  if (!record.ok()) return Error{record.error().code, path, record.error().text(), ""};
  const auto outcome = replay(*record, {});
  if (!outcome.ok()) return Error{outcome.error().code, path, outcome.error().text(), ""};
  const auto solution = outcome->cell->solution();
  const auto prepared = outcome->cell->prepared();
  if (!solution || !prepared)
    return Error{"calibrate.record", path, "the job never came to a localization", "take one that did"};
  const cell::LaserSetup& laser = outcome->setup.laser;
  // What the cell file stated; a job may have run on top of it with what earlier jobs had taught.
  if (source.latency_ms && std::abs(*source.latency_ms - laser.latency_ms) > 1e-9)
    return Error{"calibrate.record", path, "the records ran with different latencies", "take them apart"};
  source.latency_ms = laser.latency_ms;
  source.ran = {laser.rate_hz, wire::to_string(outcome->laser_format.dialect), "", outcome->setup.arm.name,
                ""};
  const Pose2& pose = solution->found.pose;
  for (const EdgePoint& e : solution->evidence.edges) {
    if (e.shadowed || e.speed_mm_s <= 0) continue;
    GaugeCrossing c;
    double nearest = kNearEdge_mm;
    int edge = -1;
    for (std::size_t i = 0; i < prepared->outline.edges.size(); ++i) {
      const auto& visible = prepared->outline.edges[i];
      const Segment line{pose * visible.line.a, pose * visible.line.b};
      const Vec2 normal = pose.rotate(visible.outward), p(e.x_mm, e.y_mm);
      const double cosine = normal.x() * e.dir_x + normal.y() * e.dir_y;
      if (std::abs(cosine) < kAcross || (e.step != 0 && (e.step > 0) != (cosine < 0))) continue;
      if (distance(p, line) >= nearest) continue;
      nearest = distance(p, line);
      edge = static_cast<int>(i);
      c.across_mm = normal.dot(p - line.a);
      c.along_mm = line.direction().dot(p - line.a);
      c.direction = cosine;
    }
    if (edge < 0) continue;
    c.edge = next_edge + edge;
    c.speed_mm_s = e.speed_mm_s;
    c.sigma_mm = e.sigma_mm;
    source.crossings.push_back(c);
  }
  next_edge += static_cast<int>(prepared->outline.edges.size());
  return Done{};
}

Status take(const std::string& path, Source& source, int& next_edge) {
  const auto bytes = read_file(path);
  if (!bytes.ok()) return bytes.error();
  if (bytes->rfind("\x89MCAP", 0) == 0) return take_record(path, *bytes, source, next_edge);
  const auto parsed = files::parse_gauge(*bytes, path);
  if (const auto* faults = std::get_if<files::Faults>(&parsed))
    return Error{"calibrate.csv", "", files::text(*faults), ""};
  int most = next_edge;
  for (GaugeCrossing c : std::get<std::vector<GaugeCrossing>>(parsed)) {
    c.edge += next_edge;
    most = std::max(most, c.edge + 1);
    source.crossings.push_back(c);
  }
  next_edge = most;
  return Done{};
}

void print(const calibrate::LatencyFit& fit, const std::vector<GaugeCrossing>& crossings, double base_ms) {
  std::printf("latency  %.4f ms +- %.4f ms (%.4f ms stood in the data, %+.4f ms found)\n",
              base_ms + fit.latency_ms, fit.sigma_ms(), base_ms, fit.latency_ms);
  std::printf("bias along the travel  %+.4f mm +- %.4f mm\n", fit.bias_mm, fit.bias_sigma_mm());
  std::printf("covariance (ms, mm)  [%.3e %.3e; %.3e %.3e], correlation %.3f, condition %.1f\n",
              fit.covariance(0, 0), fit.covariance(0, 1), fit.covariance(1, 0), fit.covariance(1, 1),
              fit.correlation(), fit.condition);
  std::printf("%zu crossings, %d forward, %d backward, %d left out, scatter %.2f sigma\n", crossings.size(),
              fit.forward, fit.backward, fit.rejected, fit.scatter);
  std::printf("\n%6s %10s %10s %12s %s\n", "edge", "direction", "mm/s", "residual mm", "");
  for (std::size_t i = 0; i < crossings.size(); ++i) {
    std::printf("%6d %10.3f %10.1f %+12.4f %s\n", crossings[i].edge, crossings[i].direction,
                crossings[i].speed_mm_s, fit.residual_mm[i], fit.used[i] != 0 ? "" : "left out");
  }
}

void print_json(const calibrate::LatencyFit& fit, double base_ms) {
  using nlohmann::json;
  const json covariance = {{fit.covariance(0, 0), fit.covariance(0, 1)},
                           {fit.covariance(1, 0), fit.covariance(1, 1)}};
  std::vector<bool> used(fit.used.begin(), fit.used.end());
  std::printf("%s\n", json{{"latency_ms", base_ms + fit.latency_ms},
                           {"correction_ms", fit.latency_ms},
                           {"sigma_ms", fit.sigma_ms()},
                           {"bias_mm", fit.bias_mm},
                           {"bias_sigma_mm", fit.bias_sigma_mm()},
                           {"covariance_ms_mm", covariance},
                           {"condition", fit.condition},
                           {"scatter", fit.scatter},
                           {"speeds_mm_s", fit.speeds_mm_s},
                           {"rejected", fit.rejected},
                           {"residuals_mm", fit.residual_mm},
                           {"used", used}}
                          .dump()
                          .c_str());
}

Status apply(const std::string& cell_file, const files::CellConfig& config, double latency_ms,
             double sigma_ms) {
  const cell::LaserSetup& laser = config.setup.laser;
  const std::string conditions =
      fmt::format("{{date: \"{}\", rate_hz: {:g}, dialect: {}, filter: \"{}\", robot: {}}}",
                  adapters::utc_text(adapters::unix_ms()), laser.rate_hz,
                  wire::to_string(config.laser_format.dialect), config.laser_filter, config.setup.arm.name);
  // The clock maps of a single scan add their own few hundredths of a millisecond.
  const auto text = files::with_keys(config.text, "laser",
                                     {{"latency_ms", fmt::format("{:.4f}", latency_ms)},
                                      {"latency_sigma_ms", fmt::format("{:.4f}", std::max(0.05, sigma_ms))},
                                      {"latency_measured", conditions}});
  if (!text.ok()) return text.error();
  const auto folder = std::filesystem::absolute(cell_file).parent_path() / "robots";
  const auto again = files::parse_cell(*text, cell_file, folder.string());
  if (const auto* faults = std::get_if<files::Faults>(&again))
    return Error{"cell.edit", "", files::text(*faults), ""};
  return write_file_durably(cell_file, *text);
}

/// The latency belongs to what the records ran with; in another cell it would be a wrong one.
Status same_conditions(const Source& source, const files::CellConfig& config, const std::string& cell_file) {
  if (!source.ran) return Done{};
  const auto differs = [&](const char* what, const std::string& then, const std::string& now) {
    return Error{"calibrate.conditions", cell_file,
                 fmt::format("the records ran with {} {}, the cell file says {}", what, then, now),
                 "apply it to the cell file that the records ran with, or scan anew"};
  };
  const double rate_hz = config.setup.laser.rate_hz;
  if (std::abs(source.ran->rate_hz - rate_hz) > 1e-6 * rate_hz)
    return differs("rate_hz", fmt::format("{:g}", source.ran->rate_hz), fmt::format("{:g}", rate_hz));
  const std::string dialect = wire::to_string(config.laser_format.dialect);
  if (source.ran->dialect != dialect) return differs("dialect", source.ran->dialect, dialect);
  if (source.ran->robot != config.setup.arm.name)
    return differs("robot", source.ran->robot, config.setup.arm.name);
  return Done{};
}

int tell(const Error& error) {
  std::fprintf(stderr, "%s\n", error.text().c_str());
  return error.code == "calibrate.latency" ? 1 : 2;
}

}  // namespace

int command_calibrate(Arguments arguments) {
  CommandLine line(
      arguments,
      "usage: weldcell calibrate latency DATA... [--cell CELL] [--apply] [--base MS] [--json]\n"
      "The laser's constant latency from passes to and fro over straight edges at three speeds or more. "
      "DATA:\n"
      "records of jobs that scanned at different speeds, or a CSV with the header\n"
      "  pass,direction,speed_mm_s,x_mm[,sigma_mm][,edge][,along_mm]\n"
      "  --cell CELL  the cell file; its latency_ms is what a CSV's crossings were placed with\n"
      "  --base MS    the latency that placed a CSV's crossings, when it is another\n"
      "  --apply      write latency, sigma and conditions into the cell file's laser section, comments kept\n"
      "Exit code 1: the data cannot tell the latency from a bias; the reason is given.\n",
      {"cell", "base"}, {"apply", "json"});
  if (line.exit_code()) return *line.exit_code();
  if (line.plain().size() < 2 || line.plain()[0] != "latency")
    return line.refuse("calibrate wants: latency DATA...");
  if (line.has("apply") && !line.has("cell")) return line.refuse("--apply wants --cell CELL");
  const auto base_given = line.number("base", 0);
  if (!base_given) return 2;
  std::optional<files::CellConfig> config;
  if (line.has("cell")) {
    auto read = files::read_cell_file(line.value("cell"), files::StaleLatency::Taken);
    if (const auto* faults = std::get_if<files::Faults>(&read)) {
      std::fputs(files::text(*faults).c_str(), stderr);
      return 78;
    }
    config = std::get<files::CellConfig>(std::move(read));
  }
  Source source;
  int next_edge = 0;
  for (std::size_t i = 1; i < line.plain().size(); ++i) {
    if (const Status taken = take(line.plain()[i], source, next_edge); !taken.ok())
      return tell(taken.error());
  }
  double base_ms = source.latency_ms.value_or(config ? config->setup.laser.latency_ms : 0);
  if (line.has("base")) base_ms = *base_given;
  const auto fit = calibrate::fit_latency(source.crossings);
  if (!fit.ok()) return tell(fit.error());
  if (line.has("json")) {
    print_json(*fit, base_ms);
  } else {
    print(*fit, source.crossings, base_ms);
  }
  if (!line.has("apply")) return 0;
  if (const Status same = same_conditions(source, *config, line.value("cell")); !same.ok())
    return tell(same.error());
  const Status applied = apply(line.value("cell"), *config, base_ms + fit->latency_ms, fit->sigma_ms());
  if (!applied.ok()) return tell(applied.error());
  std::fprintf(stderr, "%s: latency_ms %.4f written\n", line.value("cell").c_str(),
               base_ms + fit->latency_ms);
  return 0;
}

}  // namespace weldcell::app
