#include "weldcell/sim/scene.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "sim/noise.hpp"
#include "weldcell/base/units.hpp"

namespace weldcell::sim {

namespace {

enum Purpose : std::uint64_t { PlaceX = 101, PlaceY, PlaceTheta, MemberX, MemberY, MemberTheta };

Vec2 center_of(const workpiece::Workpiece& workpiece) {
  Vec2 sum = Vec2::Zero();
  double area = 0;
  for (const workpiece::Member& member : workpiece.members) {
    const double a = std::abs(signed_area(member.outline));
    sum += a * centroid(member.outline);
    area += a;
  }
  return area > 0 ? Vec2(sum / area) : Vec2::Zero();
}

/// A member's own deviation as a map of frame Part: it turns about its centroid.
Pose2 deviation(const Scene& scene, std::size_t i) {
  const MemberTruth off = i < scene.members.size() ? scene.members[i] : MemberTruth{};
  const Vec2 c = centroid(scene.workpiece.members[i].outline);
  const Vec2 shift = c + Vec2(off.dx_mm, off.dy_mm) - Pose2{0, 0, off.dtheta_rad}.rotate(c);
  return {shift.x(), shift.y(), off.dtheta_rad};
}

/// Where p lies against the line: across it in plan (beyond its ends only the part across counts), and over
/// it.
struct Miss {
  double across_mm = 0, over_mm = 0;
};
Miss miss(const Eigen::Vector3d& p, const std::vector<Eigen::Vector3d>& line) {
  double best = std::numeric_limits<double>::infinity();
  Miss out;
  for (std::size_t i = 0; i + 1 < line.size(); ++i) {
    const Segment piece{line[i].head<2>(), line[i + 1].head<2>()};
    if (piece.length() < 1e-9) continue;
    const double d = distance(p.head<2>(), piece);
    if (d >= best) continue;
    best = d;
    const Vec2 along = piece.direction(), from = p.head<2>() - piece.a;
    const double t = along.dot(from);
    const bool before = i == 0 && t < 0, behind = i + 2 == line.size() && t > piece.length();
    out.across_mm = before || behind ? std::abs(along.x() * from.y() - along.y() * from.x()) : d;
    out.over_mm = p.z() - (line[i].z() + (line[i + 1].z() - line[i].z()) * t / piece.length());
  }
  return out;
}

double mean_distance(const WeldTrace& trace, const TrueSeam& seam) {
  double sum = 0;
  for (const Eigen::Vector3d& p : trace.tcp_mm) {
    double nearest = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i + 1 < seam.line_mm.size(); ++i) {
      nearest = std::min(nearest,
                         distance(p.head<2>(), {seam.line_mm[i].head<2>(), seam.line_mm[i + 1].head<2>()}));
    }
    sum += nearest;
  }
  return trace.tcp_mm.empty() ? std::numeric_limits<double>::infinity()
                              : sum / static_cast<double>(trace.tcp_mm.size());
}

}  // namespace

Eigen::Isometry3d from_level(const Scene& scene) {
  const Vec2 middle = scene.planned * center_of(scene.workpiece);
  const Eigen::Vector3d pivot(middle.x(), middle.y(),
                              scene.cell.setup.table.z_mm + scene.workpiece.height_mm);
  Eigen::Isometry3d out = Eigen::Isometry3d::Identity();
  out.translate(pivot + Eigen::Vector3d(0, 0, scene.table.lift_mm));
  out.rotate(Eigen::AngleAxisd(scene.table.pitch_rad, Eigen::Vector3d::UnitY()) *
             Eigen::AngleAxisd(scene.table.roll_rad, Eigen::Vector3d::UnitX()));
  out.translate(-pivot);
  return out;
}

Pose2 placed(const workpiece::Workpiece& workpiece, const Pose2& planned, double xy_mm, double theta_rad,
             std::uint64_t seed) {
  const auto draw = [seed](Purpose purpose) { return 2 * uniform(mixed(seed, 0, purpose)) - 1; };
  const Vec2 c = center_of(workpiece);
  const Vec2 target = planned * c + Vec2(draw(PlaceX), draw(PlaceY)) * xy_mm;
  Pose2 out{0, 0, wrap_pi(planned.theta_rad + draw(PlaceTheta) * theta_rad)};
  const Vec2 shift = target - out.rotate(c);
  out.x_mm = shift.x();
  out.y_mm = shift.y();
  return out;
}

std::vector<MemberTruth> deviated(const workpiece::Workpiece& workpiece, const MemberSpread& spread,
                                  std::uint64_t seed) {
  std::vector<MemberTruth> out(workpiece.members.size());
  for (std::size_t i = 0; i < out.size(); ++i) {
    const auto draw = [seed, i](Purpose purpose) { return normal(mixed(seed, i, purpose)); };
    out[i].dx_mm = spread.shift_mm * draw(MemberX);
    out[i].dy_mm = spread.shift_mm * draw(MemberY);
    out[i].dtheta_rad = spread.angle_rad * draw(MemberTheta);
  }
  return out;
}

std::vector<TrueSeam> true_seams(const Scene& scene) {
  const Eigen::Isometry3d level = from_level(scene);
  std::vector<TrueSeam> out;
  for (const workpiece::Weld& weld : scene.workpiece.welds) {
    TrueSeam seam{weld.name, {}};
    std::vector<Pose2> moves;
    for (std::size_t i = 0; i < scene.workpiece.members.size(); ++i) {
      const auto& names = weld.joins;
      if (std::find(names.begin(), names.end(), scene.workpiece.members[i].name) != names.end()) {
        moves.push_back(deviation(scene, i));
      }
    }
    if (moves.empty()) moves.push_back({});
    for (const Eigen::Vector3d& p : workpiece::sample_path(weld, 5.0)) {
      // Between two members the seam lies where both think it is, on the average.
      Vec2 mean = Vec2::Zero();
      for (const Pose2& move : moves) mean += move * p.head<2>() / static_cast<double>(moves.size());
      const Vec2 at = scene.truth * mean;
      seam.line_mm.push_back(level * Eigen::Vector3d(at.x(), at.y(), scene.cell.setup.table.z_mm + p.z()));
    }
    out.push_back(std::move(seam));
  }
  return out;
}

std::vector<WeldedSeam> welded_seams(const Scene& scene, const std::vector<WeldTrace>& traces) {
  const std::vector<TrueSeam> seams = true_seams(scene);
  std::vector<WeldedSeam> out;
  for (const WeldTrace& trace : traces) {
    if (trace.tcp_mm.empty()) continue;
    const TrueSeam* welded = nullptr;
    double nearest = std::numeric_limits<double>::infinity();
    for (const TrueSeam& seam : seams) {
      const double d = mean_distance(trace, seam);
      if (d < nearest) nearest = d, welded = &seam;
    }
    WeldedSeam one{welded ? welded->name : trace.seam};
    for (const Eigen::Vector3d& p : trace.tcp_mm) {
      if (!welded) break;
      const Miss off = miss(p, welded->line_mm);
      one.lateral_error_mm = std::max(one.lateral_error_mm, off.across_mm);
      one.height_error_mm = std::max(one.height_error_mm, std::abs(off.over_mm));
    }
    out.push_back(std::move(one));
  }
  return out;
}

std::string truth_json(const Scene& scene, const std::vector<WeldTrace>& traces,
                       const std::vector<MotionSpan>& motions, const RwsLoad* load) {
  nlohmann::ordered_json out;
  out["scene"] = scene.name;
  out["seed"] = scene.seed;
  out["workpiece"] = scene.workpiece.name;
  out["x_mm"] = scene.truth.x_mm;
  out["y_mm"] = scene.truth.y_mm;
  out["theta_deg"] = deg(scene.truth.theta_rad);
  out["planned"] = {{"x_mm", scene.planned.x_mm},
                    {"y_mm", scene.planned.y_mm},
                    {"theta_deg", deg(scene.planned.theta_rad)}};
  out["table"] = {{"lift_mm", scene.table.lift_mm},
                  {"roll_deg", deg(scene.table.roll_rad)},
                  {"pitch_deg", deg(scene.table.pitch_rad)}};
  out["members"] = nlohmann::ordered_json::array();
  for (std::size_t i = 0; i < scene.workpiece.members.size(); ++i) {
    const MemberTruth off = i < scene.members.size() ? scene.members[i] : MemberTruth{};
    out["members"].push_back({{"name", scene.workpiece.members[i].name},
                              {"dx_mm", off.dx_mm},
                              {"dy_mm", off.dy_mm},
                              {"dtheta_deg", deg(off.dtheta_rad)},
                              {"missing", off.missing}});
  }
  out["seams"] = nlohmann::ordered_json::array();
  for (const TrueSeam& seam : true_seams(scene)) {
    nlohmann::ordered_json line = nlohmann::ordered_json::array();
    for (const Eigen::Vector3d& p : seam.line_mm) line.push_back({p.x(), p.y(), p.z()});
    out["seams"].push_back({{"name", seam.name}, {"line", std::move(line)}});
  }
  out["laser"] = {{"latency_ms", scene.laser.latency_ms},
                  {"clock_offset_s", scene.laser.clock.offset_s},
                  {"drift_ppm", scene.laser.clock.drift_ppm},
                  {"noise_mm", scene.laser.noise_mm},
                  {"spot_mm", scene.laser.spot_mm}};
  out["latency_ms"] = scene.laser.latency_ms;
  out["controller"] = {{"clock_offset_s", scene.controller.clock.offset_s},
                       {"drift_ppm", scene.controller.clock.drift_ppm},
                       {"feedback_latency_ms", scene.controller.feedback_latency_ms}};
  out["welded"] = nlohmann::ordered_json::array();
  for (const WeldedSeam& seam : welded_seams(scene, traces)) {
    out["welded"].push_back({{"seam", seam.seam},
                             {"lateral_error_mm", seam.lateral_error_mm},
                             {"height_error_mm", seam.height_error_mm}});
  }
  out["motions_s"] = nlohmann::ordered_json::array();
  for (const MotionSpan& motion : motions) out["motions_s"].push_back({motion.begin_s, motion.end_s});
  if (load != nullptr) {
    out["rws_requests"] = {{"total", load->total()},
                           {"most_in_a_second", load->most_in_a_second()},
                           {"refused", load->refused()}};
  }
  return out.dump(1);
}

}  // namespace weldcell::sim
