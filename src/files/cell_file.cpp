#include "weldcell/files/cell_file.hpp"

#include <fmt/format.h>

#include <filesystem>

#include "files/cell_sections.hpp"
#include "weldcell/base/units.hpp"
#include "weldcell/files/arm_file.hpp"
#include "weldcell/files/cell_migration.hpp"

namespace weldcell::files {

namespace {

namespace fs = std::filesystem;

std::vector<std::string> models_in(const std::string& robots_dir) {
  std::vector<std::string> names;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(robots_dir, error)) {
    if (entry.path().extension() == ".yaml") names.push_back(entry.path().stem().string());
  }
  return names;
}

void read_model(Map& map, const std::string& robots_dir, kinematics::ArmModel& arm) {
  std::string model;
  if (!map.text("model", model)) return;
  const fs::path path = fs::path(robots_dir) / (model + ".yaml");
  std::error_code error;
  if (model.find('/') != std::string::npos || !fs::exists(path, error)) {
    const std::string near = nearest_word(model, models_in(robots_dir));
    map.fault("model", "no arm model '" + model + "' in " + robots_dir,
              near.empty() ? "add " + model + ".yaml there" : "did you mean '" + near + "'?");
    return;
  }
  auto read = read_arm_file(path.string());
  if (auto* faults = std::get_if<Faults>(&read)) {
    map.faults().insert(map.faults().end(), faults->begin(), faults->end());
  } else {
    arm = std::get<kinematics::ArmModel>(std::move(read));
  }
}

void read_robot(Map& map, const std::string& robots_dir, cell::CellSetup& setup) {
  const std::size_t faults_before = map.faults().size();
  if (const Node* inline_arm = map.node("arm")) {
    Map arm(*inline_arm, map.file(), map.dotted("arm"), map.faults());
    setup.arm = read_arm(arm);
    if (map.has("model")) map.fault("model", "stands beside 'arm'", "keep one of the two");
  } else if (!map.has("model")) {
    map.fault("model", "is missing",
              "name one of the files in " + robots_dir + ", e.g. model: irb2600_12_185");
  }
  read_model(map, robots_dir, setup.arm);
  map.joints_degrees("home_deg", setup.home, {-720, 720}, Need::Required);
  if (const Node* node = map.node("limits", Need::Required)) {
    Map limits(*node, map.file(), map.dotted("limits"), map.faults());
    read_limits(limits, setup.limits);
  }
  map.finish();
  if (map.faults().size() != faults_before) return;
  for (std::size_t i = 0; i < 6; ++i) {
    const double margin = setup.limits.limit_margin_rad;
    if (setup.home[i] < setup.arm.lower[i] + margin || setup.home[i] > setup.arm.upper[i] - margin) {
      map.fault(
          "home_deg",
          fmt::format("axis {} at {:g} deg is outside its limits {:g} to {:g} with a margin of {:g}", i + 1,
                      deg(setup.home[i]), deg(setup.arm.lower[i]), deg(setup.arm.upper[i]), deg(margin)),
          "choose a home inside the limits");
    }
  }
}

template <typename Read, typename... Into>
void section(Map& top, const char* key, Need need, Read read, Into&... into) {
  const Node* node = top.node(key, need);
  if (node == nullptr) return;
  Map map(*node, top.file(), key, top.faults());
  if (node->kind == Node::Kind::Map) read(map, into...);
}

/// Another version is no cell file of today: its other faults would be judged by the wrong rules.
bool of_this_version(Map& top, const Node& document) {
  static_cast<void>(top.has("version") && top.node("version") != nullptr);
  if (!top.has("cell") && !top.has("version")) return true;
  const char* const at = top.has("version") ? "version" : "cell";
  const auto version = cell_version(document);
  if (!version.ok()) return top.fault("version", version.error().what, version.error().mend);
  if (*version == kCellVersion) return true;
  const std::string reads = fmt::format(", this weldcell reads {}", kCellVersion);
  const bool stated = top.has("version");
  return top.fault_at(
      top.line_of(at), "version",
      (stated ? fmt::format("is {}", *version) : std::string("is missing, so the file is of version 0")) +
          reads,
      *version > kCellVersion
          ? std::string("install the weldcell that wrote it, or take the backup that its migration kept")
          : "weldcell migrate " + top.file() +
                " shows what changes, with --write it changes it and keeps a backup");
}

void read_top(Map& top, const std::string& robots_dir, CellConfig& out) {
  top.text("cell", out.setup.name, Need::Required);
  section(
      top, "robot", Need::Required,
      [&](Map& map, cell::CellSetup& setup) { read_robot(map, robots_dir, setup); }, out.setup);
  section(top, "egm", Need::Optional, read_egm, out);
  section(top, "rws", Need::Optional, read_rws, out);
  section(top, "laser", Need::Required, read_laser, out);
  section(top, "projector", Need::Required, read_projector, out);
  section(top, "torch", Need::Required, read_torch, out.setup.torch);
  section(top, "table", Need::Required, read_table, out.setup.table);
  section(top, "weld", Need::Optional, read_weld, out.setup.weld);
  section(top, "modbus", Need::Optional, read_modbus, out);
  section(top, "plc", Need::Optional, read_plc, out);
  section(top, "jobs", Need::Optional, read_jobs, out);
  top.text("spool", out.spool_dir);
  top.text("state", out.state_dir);
  top.text("cad_cache", out.cad_cache_dir);
  static constexpr Choice<RealTime> kRealTime[] = {
      {"off", RealTime::Off}, {"try", RealTime::Try}, {"required", RealTime::Required}};
  top.choice("realtime", out.realtime, kRealTime);
  top.finish();
}

}  // namespace

std::variant<CellConfig, Faults> parse_cell(std::string_view text, const std::string& name,
                                            const std::string& robots_dir, StaleLatency stale) {
  auto document = parse_document(text, name);
  if (auto* faults = std::get_if<Faults>(&document)) return std::move(*faults);
  Faults faults;
  Map top(std::get<Node>(document), name, "", faults);
  CellConfig out;
  out.path = name;
  out.text = text;
  if (of_this_version(top, std::get<Node>(document))) read_top(top, robots_dir, out);
  if (faults.empty() && stale == StaleLatency::Fault)
    check_latency_conditions(std::get<Node>(document), out, name, faults);
  if (!faults.empty()) return in_order(std::move(faults));
  if (out.cad_cache_dir.empty()) out.cad_cache_dir = out.state_dir + "/cad";
  return out;
}

std::variant<CellConfig, Faults> read_cell_file(const std::string& path, StaleLatency stale) {
  auto text = read_text_file(path);
  if (auto* faults = std::get_if<Faults>(&text)) return std::move(*faults);
  const fs::path folder = fs::absolute(path).parent_path();
  auto parsed = parse_cell(std::get<std::string>(text), path, (folder / "robots").string(), stale);
  if (auto* config = std::get_if<CellConfig>(&parsed)) {
    for (std::string* named : {&config->spool_dir, &config->state_dir, &config->cad_cache_dir,
                               &config->rws_password_file, &config->laser_password_file}) {
      if (!named->empty()) *named = (folder / *named).lexically_normal().string();
    }
  }
  return parsed;
}

}  // namespace weldcell::files
