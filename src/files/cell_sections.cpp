#include "files/cell_sections.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>

#include "weldcell/base/units.hpp"

namespace weldcell::files {

bool read_endpoint(Map& map, const char* key, Endpoint& endpoint, bool zero_is_free) {
  std::string text;
  if (!map.text(key, text)) return false;
  const std::size_t colon = text.rfind(':');
  std::string host = colon == std::string::npos ? "" : text.substr(0, colon);
  if (host.size() > 2 && host.front() == '[' && host.back() == ']') {
    host = host.substr(1, host.size() - 2);
  } else if (host.find(':') != std::string::npos) {
    host.clear();
  }
  int port = -1;
  if (colon != std::string::npos) {
    const char* end = text.data() + text.size();
    const auto [rest, error] = std::from_chars(text.data() + colon + 1, end, port);
    if (error != std::errc{} || rest != end) port = -1;
  }
  if (host.empty() || host.find_first_of(" /@") != std::string::npos || port < 0 || port > 65535) {
    return map.fault(key, "'" + text + "' is no address", "write host:port, e.g. 127.0.0.1:6511");
  }
  if (port == 0 && !zero_is_free) return map.fault(key, "port 0 is nobody's", "write the device's port");
  endpoint = {host, port};
  return true;
}

void read_limits(Map& map, cell::MotionLimits& limits) {
  map.number("joint_speed_fraction", limits.joint_speed_fraction, {0.01, 1});
  map.joints_degrees("joint_acceleration_deg_s2", limits.joint_acceleration, {1, 20'000}, Need::Required);
  map.joints_degrees("joint_jerk_deg_s3", limits.joint_jerk, {10, 1'000'000}, Need::Required);
  map.number("natural_frequency_hz", limits.natural_frequency_hz, {0, 100});
  map.number("line_acceleration_mm_s2", limits.line_acceleration_mm_s2, {10, 50'000});
  map.number("line_jerk_mm_s3", limits.line_jerk_mm_s3, {100, 5'000'000});
  map.degrees("margin_deg", limits.limit_margin_rad, {0, 20});
  map.number("min_sin_j5", limits.min_sin_j5, {0.01, 0.9});
  map.finish();
}

void read_egm(Map& map, CellConfig& config) {
  read_endpoint(map, "listen", config.egm, true);
  map.text("peer", config.egm_peer, Need::Optional, true);
  map.number("cycle_ms", config.setup.egm.cycle_ms, {1, 100});
  map.number("comm_timeout_s", config.setup.egm.comm_timeout_s, {0.02, 10});
  map.number("max_speed_deviation_deg_s", config.setup.egm.max_speed_deviation_deg_s, {0.1, 1000});
  map.number("low_pass_hz", config.setup.egm.low_pass_hz, {1, 100});
  map.finish();
}

namespace {

/// "AB:CD:..." or "abcd...", 32 bytes.
void read_fingerprint(Map& map, std::string& fingerprint) {
  const char* const key = "certificate_sha256";
  std::string text, digits;
  if (!map.text(key, text)) return;
  bool good = true;
  for (const char c : text) {
    if (c == ':') continue;
    const char small = c >= 'A' && c <= 'F' ? static_cast<char>(c - 'A' + 'a') : c;
    good = good && ((small >= '0' && small <= '9') || (small >= 'a' && small <= 'f'));
    digits += small;
  }
  if (good && digits.size() == 64) {
    fingerprint = digits;
  } else {
    map.fault(key, "'" + text + "' is no SHA-256 fingerprint",
              "64 hexadecimal digits, with or without colons: openssl x509 -noout -fingerprint -sha256");
  }
}

}  // namespace

void read_rws(Map& map, CellConfig& config) {
  read_endpoint(map, "address", config.rws, true);
  static constexpr Choice<RwsGenerationChoice> kGenerations[] = {
      {"1", RwsGenerationChoice::One}, {"2", RwsGenerationChoice::Two}, {"auto", RwsGenerationChoice::Auto}};
  map.choice("generation", config.rws_generation, kGenerations);
  read_fingerprint(map, config.rws_certificate_sha256);
  if (config.rws_generation == RwsGenerationChoice::Two && !map.has("certificate_sha256")) {
    map.fault("certificate_sha256", "is missing: generation 2 talks TLS with a certificate of its own making",
              "read its fingerprint at the controller and write it here (docs/OPERATING.md)");
  }
  if (config.rws_generation == RwsGenerationChoice::One && map.has("certificate_sha256")) {
    map.fault("certificate_sha256", "stands beside generation 1, which has no TLS",
              "write generation: 2 or auto, or leave it out");
  }
  map.text("user", config.rws_user);
  map.text("password_file", config.rws_password_file);
  map.text("task", config.rws_task);
  for (const char* key : {"password", "passwd", "secret"}) {
    if (!map.has(key)) continue;
    map.node(key);
    map.fault(key, "a password must not stand in a cell file, every record keeps a copy of it",
              "put it alone into a file with mode 0600 and write password_file: <path>");
  }
  map.finish();
}

void read_projector(Map& map, CellConfig& config) {
  cell::ProjectorSetup& projector = config.setup.projector;
  read_mount_of(map, projector.T_flange_projector);
  map.integer("width_px", projector.width_px, {16, 16'384});
  map.integer("height_px", projector.height_px, {16, 16'384});
  map.number("fx_px", projector.fx_px, {1, 100'000});
  map.number("fy_px", projector.fy_px, {1, 100'000});
  map.number("cx_px", projector.cx_px, {-20'000, 20'000});
  map.number("cy_px", projector.cy_px, {-20'000, 20'000});
  map.number("k1", projector.k1, {-2, 2});
  map.number("k2", projector.k2, {-2, 2});
  map.number("distance_mm", projector.distance_mm, {50, 5000});
  map.boolean("window", config.projector_window);
  map.finish();
}

void read_torch(Map& map, cell::TorchSetup& torch) {
  read_mount_of(map, torch.T_flange_torch);
  map.numbers("center_of_mass_mm", torch.center_of_mass_mm.data(), 3, {-2000, 2000});
  map.number("mass_kg", torch.mass_kg, {0.01, 500});
  map.finish();
}

void read_table(Map& map, cell::TableSetup& table) {
  map.number("z_mm", table.z_mm, {-5000, 5000}, Need::Required);
  const Node* node = map.node("area", Need::Required);
  if (node != nullptr) {
    Map area(*node, map.file(), map.dotted("area"), map.faults());
    double x[2] = {0, 0}, y[2] = {0, 0};
    const char* const mend = "write [smallest, greatest]";
    if (area.numbers("x_mm", x, 2, {-10'000, 10'000}, Need::Required) && x[0] >= x[1])
      area.fault("x_mm", "is empty", mend);
    if (area.numbers("y_mm", y, 2, {-10'000, 10'000}, Need::Required) && y[0] >= y[1])
      area.fault("y_mm", "is empty", mend);
    area.finish();
    table.area = {{x[0], y[0]}, {x[1], y[1]}};
  }
  map.finish();
}

void read_weld(Map& map, cell::WeldSetup& weld) {
  map.number("speed_mm_s", weld.speed_mm_s, {0.1, 200});
  map.number("approach_mm", weld.approach_mm, {1, 1000});
  map.number("stick_out_mm", weld.stick_out_mm, {1, 100});
  map.number("air_speed_mm_s", weld.air_speed_mm_s, {1, 5000});
  if (map.text("torch_tool", weld.torch_tool)) {
    bool good = weld.torch_tool.size() <= 32;
    for (const char& c : weld.torch_tool) {
      const bool letter = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
      good = good && (letter || (&c != weld.torch_tool.data() && ((c >= '0' && c <= '9') || c == '_')));
    }
    if (!good)
      map.fault("torch_tool", "is no RAPID name", "a letter, then letters, digits and _; at most 32");
  }
  map.finish();
}

bool is_ipv4(const Node& node) {
  if (node.kind != Node::Kind::Scalar) return false;
  int parts = 0;
  const char* at = node.text.data();
  const char* const end = at + node.text.size();
  for (;; ++parts) {
    int part = -1;
    const auto [rest, error] = std::from_chars(at, end, part);
    if (error != std::errc{} || part < 0 || part > 255 || rest - at > 3) return false;
    if (rest == end) return parts == 3;
    if (*rest != '.' || parts == 3) return false;
    at = rest + 1;
  }
}

void read_modbus(Map& map, CellConfig& config) {
  read_endpoint(map, "listen", config.modbus, true);
  static constexpr Choice<wire::WordOrder> kOrders[] = {{"abcd", wire::WordOrder::Abcd},
                                                        {"cdab", wire::WordOrder::Cdab}};
  map.choice("word_order", config.word_order, kOrders);
  map.integer("max_clients", config.modbus_max_clients, {1, 32});
  if (const Node* allow = map.sequence("allow")) {
    for (const Node& address : allow->items) {
      if (is_ipv4(address)) {
        config.modbus_allow.push_back(address.text);
      } else {
        map.fault_at(address.line, map.dotted("allow"), address.describe() + " is no IPv4 address",
                     "write the PLC's address, e.g. [192.168.126.10]");
      }
    }
  }
  const bool loopback = config.modbus.host.rfind("127.", 0) == 0;
  if (!loopback && config.modbus_allow.empty() && !map.has("allow")) {
    map.fault("listen", "listens on the network and would serve anybody there",
              "name who may connect: allow: [<the PLC's address>]");
  }
  map.finish();
}

void read_plc(Map& map, CellConfig& config) {
  map.boolean("required", config.plc_required);
  map.number("heartbeat_timeout_s", config.plc_heartbeat_timeout_s, {0.1, 60});
  map.finish();
}

namespace {

/// What is no key is not repeated: it could be a secret one.
void read_job_key(Map& map, const Node& item, std::vector<wire::MinisignKey>& keys) {
  const auto fault = [&](const char* what, const char* mend) {
    map.fault_at(item.line, map.dotted("signed_by"), what, mend);
  };
  const auto key = item.kind == Node::Kind::Scalar ? wire::minisign_key(item.text) : std::nullopt;
  if (wire::looks_like_minisign_secret(item.text)) {
    fault("holds a secret key, and every record keeps a copy of this file",
          "remove it, count that pair as known to others and make a new one; the public key is the second "
          "line of "
          "minisign.pub");
  } else if (!key) {
    fault("holds what is no public key of minisign",
          "write the second line of minisign.pub: 56 characters that begin with RW");
  } else if (std::ranges::find(keys, *key) != keys.end()) {
    fault("holds a key twice", "remove one of the two");
  } else {
    keys.push_back(*key);
  }
}

}  // namespace

void read_jobs(Map& map, CellConfig& config) {
  constexpr std::size_t kMostKeys = 32;
  static constexpr Choice<bool> kUnsigned[] = {{"accept", false}, {"refuse", true}};
  map.choice("unsigned", config.unsigned_refused, kUnsigned);
  const Node* list = map.sequence("signed_by");
  if (list != nullptr && list->items.size() > kMostKeys) {
    map.fault("signed_by", fmt::format("has {} keys", list->items.size()),
              fmt::format("at most {}", kMostKeys));
  } else if (list != nullptr) {
    for (const Node& item : list->items) read_job_key(map, item, config.job_keys);
  }
  if (config.unsigned_refused && (list == nullptr || list->items.empty()))
    map.fault("unsigned", "refuses every job: no key is named that could sign one",
              "signed_by: [<second line of minisign.pub>]");
  map.finish();
}

}  // namespace weldcell::files
