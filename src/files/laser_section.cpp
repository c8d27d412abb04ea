// The laser section of a cell file: geometry and noise, and what its wire carries.
#include <fmt/format.h>

#include <charconv>
#include <cmath>

#include "files/cell_sections.hpp"

namespace weldcell::files {

namespace {

using wire::LaserDialect;

constexpr Choice<LaserDialect> kDialects[] = {
    {"meas28", LaserDialect::Meas28},        {"data28", LaserDialect::Data28},
    {"meas32", LaserDialect::Meas32},        {"two_byte", LaserDialect::TwoByte},
    {"three_byte", LaserDialect::ThreeByte}, {"od5000", LaserDialect::Od5000}};

bool is_bytes(LaserDialect d) { return d == LaserDialect::TwoByte || d == LaserDialect::ThreeByte; }

void read_items(Map& map, const Node& list, wire::Meas28Layout& layout) {
  wire::Meas28Layout read{false, false, false, false, false};
  for (const Node& item : list.items) {
    if (item.text == "exposure")
      read.exposure = true;
    else if (item.text == "counter")
      read.counter = true;
    else if (item.text == "timestamp")
      read.timestamp = true;
    else if (item.text == "intensity")
      read.intensity = true;
    else if (item.text == "status")
      read.status = true;
    else
      map.fault("frame", item.describe() + " is no item of a reading",
                "any of exposure, counter, timestamp, intensity, status");
  }
  layout = read;
}

/// Every word of a frame by name, in the order in which it is sent.
void read_words(Map& map, const Node& list, wire::LaserFormat& format) {
  const bool stamped = format.dialect == LaserDialect::Data28;
  const std::size_t most = format.dialect == LaserDialect::Od5000 ? 4 : 32;
  if (list.items.empty() || list.items.size() > most) {
    map.fault("frame", fmt::format("names {} words", list.items.size()), fmt::format("1 to {}", most));
    return;
  }
  int distances = 0, stamps = 0;
  for (std::size_t i = 0; i < list.items.size(); ++i) {
    const Node& item = list.items[i];
    if (item.text == "distance") {
      format.distance_word = i;
      ++distances;
    } else if (stamped && item.text == "timestamp") {
      format.timestamp_word = static_cast<int>(i);
      ++stamps;
    } else if (item.text != "other") {
      map.fault("frame", item.describe() + " is no word of this dialect's frame",
                stamped ? "distance, timestamp or other, in the order sent"
                        : "distance or other, one for each channel, in the order sent");
      return;
    }
  }
  format.words = list.items.size();
  if (distances != 1 || stamps > 1)
    map.fault("frame", fmt::format("has {} times distance, {} times timestamp", distances, stamps),
              "name the distance once, a timestamp at most once, and every further word other");
}

void read_frame(Map& map, wire::LaserFormat& format) {
  const Node* list = map.sequence("frame");
  if (list == nullptr) return;
  if (format.dialect == LaserDialect::Meas28) {
    read_items(map, *list, format.meas28);
  } else if (is_bytes(format.dialect)) {
    map.fault("frame", "stands beside a dialect that carries the distance alone",
              "leave it out, and switch every further output of the sensor off");
  } else {
    read_words(map, *list, format);
  }
}

/// Refuses keys that the chosen dialect has no use for: they would be believed and do nothing.
void read_wire(Map& map, CellConfig& config) {
  wire::LaserFormat& format = config.laser_format;
  map.choice("dialect", format.dialect, kDialects);
  read_endpoint(map, "address", config.laser, true);
  read_frame(map, format);
  const bool scaled = format.dialect == LaserDialect::Meas32;
  const Need scale = scaled ? Need::Required : Need::Optional;
  for (const auto& [key, value] : {std::pair{"raw_min", &format.raw_min}, {"raw_max", &format.raw_max}}) {
    const bool given = map.number(key, *value, {-2147483648.0, 2147483647.0}, scale);
    if (given && !scaled) map.fault(key, "belongs to the dialect meas32 alone", "leave it out");
  }
  const bool pushed = format.dialect == LaserDialect::Od5000;
  if (read_endpoint(map, "listen", config.laser_listen, true)) {
    if (!pushed) map.fault("listen", "belongs to the dialect od5000 alone", "leave it out");
  } else if (pushed && !map.has("listen")) {
    map.fault(
        "listen", "is missing: an OD5000 sends its readings to an address of this machine",
        "write this machine's address in the sensor's network and a UDP port, e.g. 192.168.125.50:5010");
  }
}

/// Where the sensor's commands are taken: every dialect has a usual place, `none` says that there is none.
void read_commands(Map& map, CellConfig& config) {
  const LaserDialect dialect = config.laser_format.dialect;
  const bool pushed = dialect == LaserDialect::Od5000;
  config.laser_commands = is_bytes(dialect) ? LaserCommands::InStream
                          : pushed          ? LaserCommands::None
                                            : LaserCommands::Port;
  const bool logs_in = dialect == LaserDialect::Meas28 || dialect == LaserDialect::Data28 ||
                       dialect == LaserDialect::ThreeByte;
  if (map.text("password_file", config.laser_password_file) && !logs_in)
    map.fault("password_file", "stands beside a dialect whose sensors know no login", "leave it out");
  std::string word;
  if (!map.text("command_port", word)) return;
  if (pushed) {
    map.fault("command_port", "stands beside dialect od5000, whose address is its command port",
              "leave it out");
    return;
  }
  if (word == "none") {
    config.laser_commands = LaserCommands::None;
    return;
  }
  int port = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), port);
  const bool number = error == std::errc{} && end == word.data() + word.size() && port >= 0 && port <= 65535;
  if (is_bytes(dialect) ? word == "in_stream" : number) {
    config.laser_command_port = port;
    return;
  }
  map.fault("command_port", "'" + word + "' is no way to this sensor's commands",
            is_bytes(dialect) ? "in_stream, where the device server passes bytes on to the sensor, or none"
                              : "its TCP port, usually 23, or none where it cannot be reached");
}

void read_latency_conditions(Map& map, CellConfig& config) {
  const Node* node = map.node("latency_measured");
  if (node == nullptr) return;
  Map inner(*node, map.file(), map.dotted("latency_measured"), map.faults());
  if (node->kind != Node::Kind::Map) return;
  LatencyConditions out;
  inner.text("date", out.date, Need::Required);
  inner.number("rate_hz", out.rate_hz, {50, 70'000}, Need::Required);
  inner.text("dialect", out.dialect, Need::Required);
  inner.text("filter", out.filter, Need::Required);
  inner.text("robot", out.robot, Need::Required);
  inner.finish();
  config.latency_measured = out;
}

}  // namespace

void read_laser(Map& map, CellConfig& config) {
  const std::size_t faults_before = map.faults().size();
  cell::LaserSetup& laser = config.setup.laser;
  read_wire(map, config);
  read_commands(map, config);
  read_mount_of(map, laser.T_flange_laser);
  map.number("start_of_range_mm", laser.start_of_range_mm, {0, 5000});
  map.number("range_mm", laser.range_mm, {1, 5000});
  map.number("rate_hz", laser.rate_hz, {50, 70'000});
  map.number("latency_ms", laser.latency_ms, {-100, 500});
  map.number("latency_sigma_ms", laser.latency_sigma_ms, {0, 100});
  map.text("filter", config.laser_filter);
  read_latency_conditions(map, config);
  map.number("spot_mm", laser.spot_mm, {0.001, 20});
  map.degrees("triangulation_deg", laser.triangulation_rad, {1, 80});
  map.number("noise_mm", laser.noise_mm, {0, 10});
  map.number("standoff_mm", laser.standoff_mm, {1, 10'000});
  map.finish();
  config.laser_format.range_mm = laser.range_mm;
  config.laser_format.rate_hz = laser.rate_hz;
  if (map.faults().size() != faults_before) return;
  if (const char* fault = wire::laser_format_fault(config.laser_format)) {
    map.fault(config.laser_format.dialect == LaserDialect::Meas32 ? "raw_min" : "dialect", fault,
              "docs/LASERS.md says what each dialect needs");
  }
  const double near_mm = laser.start_of_range_mm, far_mm = laser.start_of_range_mm + laser.range_mm;
  if (laser.standoff_mm <= near_mm || laser.standoff_mm >= far_mm) {
    map.fault("standoff_mm", fmt::format("{:g} is outside the measuring range", laser.standoff_mm),
              fmt::format("between {:g} and {:g}, the start of the range and its end", near_mm, far_mm));
  }
}

void check_latency_conditions(const Node& document, const CellConfig& config, const std::string& file,
                              Faults& faults) {
  const cell::LaserSetup& laser = config.setup.laser;
  if (!config.latency_measured) return;
  const LatencyConditions& then = *config.latency_measured;
  const Node* section = document.find("laser");
  const Node* measured = section == nullptr ? nullptr : section->find("latency_measured");
  const auto differs = [&](const char* key, const std::string& was, const std::string& is) {
    int line = measured == nullptr ? 0 : measured->line;
    if (measured != nullptr) {
      for (const Node::Key& k : measured->keys) line = k.text == key ? k.line : line;
    }
    faults.push_back({file, line, std::string("laser.latency_measured.") + key,
                      fmt::format("the latency was measured at '{}', the cell runs '{}'", was, is),
                      "measure it again (weldcell calibrate latency), or remove latency_measured and widen "
                      "latency_sigma_ms"});
  };
  if (std::abs(then.rate_hz - laser.rate_hz) > 1e-6 * laser.rate_hz)
    differs("rate_hz", fmt::format("{:g}", then.rate_hz), fmt::format("{:g}", laser.rate_hz));
  const std::string dialect = wire::to_string(config.laser_format.dialect);
  if (then.dialect != dialect) differs("dialect", then.dialect, dialect);
  if (then.filter != config.laser_filter) differs("filter", then.filter, config.laser_filter);
  if (then.robot != config.setup.arm.name) differs("robot", then.robot, config.setup.arm.name);
}

}  // namespace weldcell::files
