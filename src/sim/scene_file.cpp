// scene.yaml -> Scene, strictly.
#include <charconv>
#include <filesystem>

#include "weldcell/base/units.hpp"
#include "weldcell/files/schema.hpp"
#include "weldcell/files/workpiece_file.hpp"
#include "weldcell/sim/scene.hpp"

namespace weldcell::sim {

namespace {

using files::Fault;
using files::Faults;
using files::Map;
using files::Need;
using files::Node;

const std::vector<std::string> kKinds{
    "laser_drop",       "laser_stall",      "egm_silence",       "estop",
    "guardstop",        "motors_off",       "motors_on",         "manual",
    "program_stop",     "pp_moved",         "collision",         "singularity",
    "restart",          "rws_503",          "rws_silence",       "laser_clock_step",
    "laser_clock_back", "laser_clock_stop", "laser_clock_reset", "robot_clock_step",
    "robot_clock_back"};

constexpr files::Choice<Finish> kFinishes[] = {{"ideal", Finish::Ideal},
                                               {"mill_scale", Finish::MillScale},
                                               {"ground_steel", Finish::GroundSteel},
                                               {"galvanized", Finish::Galvanized},
                                               {"aluminium", Finish::Aluminium},
                                               {"ceramic", Finish::Ceramic}};

bool take_number(std::string_view text, double& out) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), out);
  return error == std::errc{} && end == text.data() + text.size() && out >= 0;
}

/// 607, 610, 700, 706, 716; 0: none of them.
int egm_shape_of(const std::string& robotware) {
  for (const auto& [text, number] : {std::pair{"6.07", 607}, std::pair{"6.10", 610}, std::pair{"7.0", 700},
                                     std::pair{"7.6", 706}, std::pair{"7.16", 716}}) {
    if (robotware == text) return number;
  }
  return 0;
}

class SceneReader {
 public:
  SceneReader(const std::string& path, const files::CellConfig& cell) : path_(path) { out_.cell = cell; }

  std::variant<Scene, Faults> read(const Node& document, std::uint64_t seed) {
    Map map(document, path_, "", faults_);
    map.text("scene", out_.name, Need::Required);
    int own_seed = 1;
    map.integer("seed", own_seed, {1, 2147483647});
    out_.seed = seed != 0 ? seed : static_cast<std::uint64_t>(own_seed);
    read_workpiece(map);
    section(map, "planned", Need::Required, [&](Map& m) { pose(m, out_.planned); });
    out_.truth = out_.planned;
    read_placement(map);
    read_members(map);
    section(map, "table", Need::Optional, [&](Map& m) {
      m.number("lift_mm", out_.table.lift_mm, {-50, 50});
      m.degrees("roll_deg", out_.table.roll_rad, {-2, 2});
      m.degrees("pitch_deg", out_.table.pitch_rad, {-2, 2});
    });
    section(map, "laser", Need::Optional, [&](Map& m) { laser(m); });
    section(map, "controller", Need::Optional, [&](Map& m) { controller(m); });
    section(map, "plc", Need::Optional, [&](Map& m) {
      m.number("confirm_after_s", out_.plc_confirm_after_s, {0, 3600});
    });
    if (const Node* list = map.sequence("faults")) {
      for (const Node& node : list->items) read_fault(map, node);
    }
    map.finish();
    if (!faults_.empty()) return std::move(faults_);
    return std::move(out_);
  }

 private:
  template <typename Read>
  void section(Map& map, const char* key, Need need, Read read) {
    const Node* node = map.node(key, need);
    if (!node) return;
    Map inner(*node, path_, map.dotted(key), faults_);
    read(inner);
    inner.finish();
  }

  std::string beside(const std::string& name) const {
    const std::filesystem::path path(name);
    return path.is_absolute()
               ? name
               : (std::filesystem::path(path_).parent_path() / path).lexically_normal().string();
  }

  void pose(Map& map, Pose2& pose) {
    map.number("x_mm", pose.x_mm, {-10000, 10000}, Need::Required);
    map.number("y_mm", pose.y_mm, {-10000, 10000}, Need::Required);
    map.degrees("theta_deg", pose.theta_rad, {-360, 360}, Need::Required);
  }

  void read_workpiece(Map& map) {
    std::string name;
    if (!map.text("workpiece", name, Need::Required)) return;
    auto read = files::read_workpiece_file(beside(name));
    if (auto* faults = std::get_if<Faults>(&read)) {
      faults_.insert(faults_.end(), faults->begin(), faults->end());
    } else {
      out_.workpiece = std::move(std::get<workpiece::Workpiece>(read));
    }
  }

  void read_placement(Map& map) {
    if (map.has("placement") && map.has("offset")) {
      map.fault("offset", "placement and offset are both given", "keep one of them");
    }
    section(map, "placement", Need::Optional, [&](Map& m) {
      double xy_mm = 0, theta_rad = 0;
      m.number("xy_mm", xy_mm, {0, 500});
      m.degrees("theta_deg", theta_rad, {0, 180});
      out_.truth = placed(out_.workpiece, out_.planned, xy_mm, theta_rad, out_.seed);
    });
    section(map, "offset", Need::Optional, [&](Map& m) {
      Pose2 offset;
      pose(m, offset);
      out_.truth = {out_.planned.x_mm + offset.x_mm, out_.planned.y_mm + offset.y_mm,
                    wrap_pi(out_.planned.theta_rad + offset.theta_rad)};
    });
  }

  void read_members(Map& map) {
    out_.members.resize(out_.workpiece.members.size());
    section(map, "members", Need::Optional, [&](Map& m) {
      MemberSpread spread;
      m.number("shift_mm", spread.shift_mm, {0, 50});
      m.degrees("angle_deg", spread.angle_rad, {0, 10});
      out_.members = deviated(out_.workpiece, spread, out_.seed);
      if (const Node* list = m.sequence("missing")) {
        for (const Node& node : list->items) lose(m, node);
      }
    });
  }

  void lose(Map& map, const Node& node) {
    for (std::size_t i = 0; i < out_.workpiece.members.size(); ++i) {
      if (out_.workpiece.members[i].name == node.text) {
        out_.members[i].missing = true;
        return;
      }
    }
    map.fault_at(node.line, map.dotted("missing"), "no member '" + node.text + "'",
                 "a member of the workpiece");
  }

  void laser(Map& m) {
    LaserTruth& l = out_.laser;
    m.number("clock_offset_s", l.clock.offset_s, {0, 4000});
    m.number("drift_ppm", l.clock.drift_ppm, {-200, 200});
    m.number("latency_ms", l.latency_ms, {0, 100});
    m.number("exposure_ms", l.exposure_ms, {0, 10});
    m.number("transport_jitter_ms", l.transport_jitter_ms, {0, 100});
    m.number("spot_mm", l.spot_mm, {0.05, 10});
    m.number("noise_mm", l.noise_mm, {0, 5});
    m.number("speckle_mm", l.speckle_mm, {0, 5});
    m.number("outlier_share", l.outlier_share, {0, 0.5});
    m.number("dropout_share", l.dropout_share, {0, 0.9});
    m.degrees("triangulation_deg", l.triangulation_rad, {2, 60});
    m.boolean("shadows", l.shadows);
    m.boolean("beam_spot", l.beam_spot);
    m.choice("part", l.part, kFinishes);
    m.choice("table", l.table, kFinishes);
    m.boolean("exposure_loop", l.exposure_loop);
    m.number("secondary_share", l.secondary_share, {0, 0.5});
    m.number("linearity_share", l.linearity_share, {0, 0.01});
    m.boolean("tilt_error", l.tilt_error);
  }

  void controller(Map& m) {
    ControllerTruth& c = out_.controller;
    m.number("clock_offset_s", c.clock.offset_s, {0, 4e6});
    m.number("drift_ppm", c.clock.drift_ppm, {-200, 200});
    m.number("cycle_ms", c.cycle_ms, {1, 24});
    m.number("position_gain", c.position_gain, {0, 20});
    m.number("low_pass_hz", c.low_pass_hz, {0, 100});
    m.number("dead_time_ms", c.dead_time_ms, {0, 200});
    m.number("feedback_latency_ms", c.feedback_latency_ms, {-50, 50});
    m.text("user", c.user);
    m.text("password", c.password);
    m.boolean("auto", c.auto_mode);
    m.integer("rws_generation", c.rws_generation, {1, 2});
    m.boolean("rws_hal", c.rws_hal);
    m.number("rws_requests_per_s", c.rws_requests_per_s, {0, 10'000});
    std::string robotware;
    if (m.text("robotware", robotware)) {
      c.robotware = egm_shape_of(robotware);
      if (c.robotware == 0)
        m.fault("robotware", "'" + robotware + "' has no EGM shape of its own",
                "6.07, 6.10, 7.0, 7.6 or 7.16");
    }
    m.integer("external_axes", c.external_axes, {0, 6});
    m.boolean("egm_seqno_restarts", c.egm_seqno_restarts);
    m.boolean("rapid_state_lost", c.rapid_state_lost);
    m.boolean("remote_start", c.remote_start);
    if (const Node* list = m.sequence("modules")) {
      for (const Node& node : list->items) {
        auto text = files::read_text_file(beside(node.text));
        if (auto* faults = std::get_if<Faults>(&text)) {
          faults_.insert(faults_.end(), faults->begin(), faults->end());
        } else {
          c.modules.push_back(std::get<std::string>(text));
        }
      }
    }
  }

  void read_fault(Map& map, const Node& node) {
    auto fault = parse_fault(node.text);
    if (fault) {
      out_.faults.push_back(*fault);
    } else {
      map.fault_at(node.line, "faults", fault.error().what, fault.error().mend);
    }
  }

  std::string path_;
  Faults faults_;
  Scene out_;
};

}  // namespace

Result<TimedFault> parse_fault(const std::string& text) {
  TimedFault out;
  const std::size_t at = text.find('@');
  out.kind = text.substr(0, at);
  const auto refuse = [&](const std::string& what) {
    return Error{"scene.fault", text, what,
                 "KIND[@[scan+|weld+]SECONDS][:DURATION], e.g. laser_drop@scan+5:2"};
  };
  if (std::find(kKinds.begin(), kKinds.end(), out.kind) == kKinds.end()) {
    std::string words;
    for (const std::string& kind : kKinds) words += (words.empty() ? "" : ", ") + kind;
    return refuse("'" + out.kind + "' is no fault; one of " + words);
  }
  if (at == std::string::npos) return out;
  std::string when = text.substr(at + 1);
  if (const std::size_t colon = when.find(':'); colon != std::string::npos) {
    if (!take_number(std::string_view(when).substr(colon + 1), out.duration_s))
      return refuse("duration is no number");
    when.resize(colon);
  }
  for (const auto& [word, after] :
       {std::pair("scan", TimedFault::After::Scan), std::pair("weld", TimedFault::After::Weld)}) {
    if (!when.starts_with(word)) continue;
    out.after = after;
    when = when.size() > 5 && when[4] == '+' ? when.substr(5) : when == word ? "0" : "?";
    break;
  }
  if (!take_number(when, out.at_s)) return refuse("time is no number");
  return out;
}

std::variant<Scene, Faults> read_scene(const std::string& path, const files::CellConfig& cell,
                                       std::uint64_t seed) {
  auto text = files::read_text_file(path);
  if (auto* faults = std::get_if<Faults>(&text)) return std::move(*faults);
  auto document = files::parse_document(std::get<std::string>(text), path);
  if (auto* faults = std::get_if<Faults>(&document)) return std::move(*faults);
  return SceneReader(path, cell).read(std::get<Node>(document), seed);
}

}  // namespace weldcell::sim
