// The arm in figures: kinematics against the reference vectors and against itself, tracking of the simulated
// controller by the shipped RAPID module, and the limits as properties of random motions.
// usage: bench_robot [--json] [--plans N]     default 10000; with --plans the random motions alone
#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <random>
#include <sstream>

#include "bench/random_plans.hpp"
#include "bench/rows.hpp"
#include "egm.pb.h"
#include "weldcell/app/robot_runner.hpp"
#include "weldcell/base/units.hpp"
#include "weldcell/plan/scan_plan.hpp"
#include "weldcell/robot/egm_session.hpp"
#include "weldcell/sim/controller.hpp"

namespace weldcell::bench {
namespace {

namespace fs = std::filesystem;
using kinematics::ArmModel;
using kinematics::Joints;

constexpr std::uint64_t kSeed = 2600;
constexpr int kSets = 10000;

std::vector<std::vector<double>> rows_of(const fs::path& path) {
  std::ifstream file(path);
  std::string line, field;
  std::vector<std::vector<double>> out;
  std::getline(file, line);
  while (std::getline(file, line)) {
    std::stringstream fields(line);
    out.emplace_back();
    while (std::getline(fields, field, ',')) out.back().push_back(std::stod(field));
  }
  return out;
}

Joints joints_of(const std::vector<double>& row) {
  Joints q{};
  for (std::size_t i = 0; i < 6; ++i) q[i] = rad(row[i]);
  return q;
}

ArmModel arm_of(const fs::path& path) {
  auto read = files::read_arm_file(path.string());
  if (const auto* faults = std::get_if<files::Faults>(&read)) {
    std::fprintf(stderr, "bench_robot: %s\n", files::text(*faults).c_str());
    std::exit(2);
  }
  return std::get<ArmModel>(read);
}

std::vector<fs::path> files_in(const fs::path& folder, const char* extension) {
  std::vector<fs::path> out;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.path().extension() == extension) out.push_back(entry.path());
  }
  std::sort(out.begin(), out.end());
  return out;
}

double angle_deg(const Eigen::Matrix3d& a, const Eigen::Matrix3d& b) {
  // Through the antisymmetric part: acos would lose half of the digits near zero.
  const Eigen::Matrix3d d = a.transpose() * b;
  const Eigen::Vector3d v(d(2, 1) - d(1, 2), d(0, 2) - d(2, 0), d(1, 0) - d(0, 1));
  return deg(std::atan2(v.norm() / 2, (d.trace() - 1) / 2));
}

void against_references(std::vector<Row>& rows) {
  double worst_mm = 0, worst_deg = 0;
  int vectors = 0, models = 0, wrong_configurations = 0;
  for (const fs::path& path : files_in(WELDCELL_TEST_DATA "/kinematics", ".csv")) {
    const ArmModel arm = arm_of(fs::path(WELDCELL_CONFIG "/robots") / (path.stem().string() + ".yaml"));
    ++models;
    for (const auto& row : rows_of(path)) {
      const auto pose = kinematics::forward(arm, joints_of(row));
      const Eigen::Quaterniond q(row[9], row[10], row[11], row[12]);
      worst_mm = std::max(worst_mm, (pose.position_mm() - Eigen::Vector3d(row[6], row[7], row[8])).norm());
      worst_deg = std::max(worst_deg, angle_deg(pose.rotation(), q.normalized().toRotationMatrix()));
      ++vectors;
    }
    for (const auto& row : rows_of(path.parent_path() / "conf" / path.filename())) {
      const auto own = kinematics::configuration(arm, joints_of(row));
      const kinematics::Configuration expected{static_cast<int>(row[6]), static_cast<int>(row[7]),
                                               static_cast<int>(row[8]), static_cast<int>(row[9])};
      wrong_configurations += own == expected ? 0 : 1;
    }
  }
  rows.push_back({"reference vectors (of " + std::to_string(models) + " models)",
                  static_cast<double>(vectors), "", NAN, NAN, Better::None});
  rows.push_back({"FK against them, worst position", worst_mm, "mm", NAN, 1e-6});
  rows.push_back({"FK against them, worst rotation", worst_deg, "deg", NAN, 1e-6});
  rows.push_back(
      {"configurations unlike the reference", static_cast<double>(wrong_configurations), "", NAN, 0});
}

double since_us(std::chrono::steady_clock::time_point begin) {
  return std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - begin).count();
}

void against_itself(std::vector<Row>& rows) {
  int missing = 0, sets = 0, models = 0;
  double worst_pose_mm = 0, fk_us = 0, ik_us = 0;
  for (const fs::path& path : files_in(WELDCELL_CONFIG "/robots", ".yaml")) {
    const ArmModel arm = arm_of(path);
    ++models;
    std::mt19937_64 random(kSeed);
    std::vector<Joints> q(kSets);
    for (Joints& joints : q) {
      for (std::size_t i = 0; i < 6; ++i)
        joints[i] = std::uniform_real_distribution<double>(arm.lower[i], arm.upper[i])(random);
    }
    std::vector<Transform<Base, Flange>> poses(q.size());
    auto begin = std::chrono::steady_clock::now();
    for (std::size_t n = 0; n < q.size(); ++n) poses[n] = kinematics::forward(arm, q[n]);
    fk_us += since_us(begin);
    begin = std::chrono::steady_clock::now();
    kinematics::Branches branches;
    double sum = 0;
    for (std::size_t n = 0; n < q.size(); ++n) {
      kinematics::inverse_branches(arm, poses[n], q[n], branches);
      sum += branches.joints[0][0];
    }
    ik_us += since_us(begin);
    if (!std::isfinite(sum)) std::fprintf(stderr, "%s: inverse gave no number\n", arm.name.c_str());
    for (std::size_t n = 0; n < q.size(); ++n) {
      bool contained = false;
      for (const Joints& s : kinematics::inverse(arm, poses[n], q[n])) {
        double worst = 0;
        for (std::size_t i = 0; i < 6; ++i) worst = std::max(worst, std::abs(s[i] - q[n][i]));
        contained = contained || worst < 1e-6;
        worst_pose_mm = std::max(worst_pose_mm,
                                 (kinematics::forward(arm, s).position_mm() - poses[n].position_mm()).norm());
      }
      missing += contained ? 0 : 1;
      ++sets;
    }
  }
  rows.push_back(
      {"random joint sets (of " + std::to_string(models) + " models, seed " + std::to_string(kSeed) + ")",
       static_cast<double>(sets), "", NAN, NAN, Better::None});
  rows.push_back({"IK(FK(q)) contains q", 100.0 * (sets - missing) / sets, "%", NAN, 100, Better::Higher});
  rows.push_back({"FK of any IK solution off its pose, worst", worst_pose_mm, "mm", NAN, 1e-6});
  rows.push_back({"FK time", fk_us / sets, "us", NAN, NAN, Better::None});
  rows.push_back({"IK time, all branches", ik_us / sets, "us", NAN, NAN, Better::None});
}

/// Differences of the references as they were sent, as shares of the cell's limits.
class Judge {
 public:
  explicit Judge(const cell::CellSetup& cell) : cell_(cell) {}
  void see(const std::array<double, 6>& reference_deg, double dt_s) {
    ++seen_;
    for (std::size_t i = 0; i < 6; ++i) {
      const double q = rad(reference_deg[i]);
      const double v = seen_ > 1 ? (q - q_[i]) / dt_s : 0;
      const double a = seen_ > 2 ? (v - v_[i]) / dt_s : 0;
      const double j = seen_ > 3 ? (a - a_[i]) / dt_s : 0;
      speed = std::max(speed, std::abs(v) / (cell_.arm.max_speed[i] * cell_.limits.joint_speed_fraction));
      acceleration = std::max(acceleration, std::abs(a) / cell_.limits.joint_acceleration[i]);
      jerk = std::max(jerk, std::abs(j) / cell_.limits.joint_jerk[i]);
      const double middle = (cell_.arm.upper[i] + cell_.arm.lower[i]) / 2;
      const double half = (cell_.arm.upper[i] - cell_.arm.lower[i]) / 2 - cell_.limits.limit_margin_rad;
      range = std::max(range, std::abs(q - middle) / half);
      q_[i] = q, v_[i] = v, a_[i] = a;
    }
  }
  double speed = 0, acceleration = 0, jerk = 0, range = 0;

 private:
  const cell::CellSetup& cell_;
  int seen_ = 0;
  Joints q_{}, v_{}, a_{};
};

class DirectTransport final : public ports::HttpTransport {
 public:
  explicit DirectTransport(sim::Controller& controller) : controller_(&controller) {}
  Result<ports::HttpReply> exchange(const ports::HttpRequest& request) override {
    return controller_->handle_rws(request);
  }

 private:
  sim::Controller* controller_;
};

std::string text_of(const std::string& path) {
  std::ifstream file(path);
  std::stringstream text;
  text << file.rdbuf();
  return text.str();
}

/// Where the beam meets the plane of the part's top.
Eigen::Vector3d foot(const cell::CellSetup& cell, const Joints& q, double top_z_mm) {
  const auto laser = kinematics::forward(cell.arm, q).iso * cell.laser.T_flange_laser.iso;
  const Eigen::Vector3d at = laser.translation(), along = laser.linear().col(2);
  return at + (top_z_mm - at.z()) / along.z() * along;
}

struct Law {
  double gain = 20, low_pass_hz = 100, cycle_ms = 4.0;
};

struct Ride {
  bool finished = false;
  double contour_mm = 0;         ///< worst distance of the beam's foot from its planned way, in the passes
  double stop_reference_mm = 0;  ///< way of the beam's foot from the stop's frame to rest, as commanded
  double stop_arm_mm = 0;        ///< the same as the arm did it
  double stop_off_path_mm = 0;   ///< and how far from the planned way that led
  double speed = 0, acceleration = 0, jerk = 0, range = 0;  ///< shares of the limits
  std::uint32_t limited = 0;
};

/// The simulated controller runs the shipped module; the daemon's session streams the plan to it.
class Track {
 public:
  Track(const files::CellConfig& config, const Law& law, double top_z_mm)
      : cell_(setup_of(config, law)),
        top_(top_z_mm),
        scene_(scene_of(config, law)),
        controller_(scene_, cell_.arm),
        transport_(controller_),
        rws_(transport_),
        runner_(rws_, config.rws_task, module_of(law)),
        session_(cell_) {}

  /// Follows the plan; with stop_s >= 0 a stop is asked for at that time of the plan.
  Ride follow(const plan::MotionPlan& plan, double stop_s = -1) {
    for (const auto& sample : plan.samples) way_.push_back(foot(cell_, sample.q, top_));
    job::RobotRequest request;
    request.id = 1;
    request.task = job::RobotTask::OpenScan;
    request.joints = plan.samples.front().q;
    runner_.begin(request, now_);
    while (!controller_.egm_guiding() && seconds(now_.ns) < 120) {
      cycle();
      if (const auto reply = runner_.step(now_); reply && !reply->ok)
        std::fprintf(stderr, "bench_robot: %s\n", reply->text.c_str());
    }
    for (int k = 0; k < 50; ++k) cycle();
    session_.set_armed(true);
    session_.offer(&plan);
    judge_ = std::make_unique<Judge>(cell_);
    Ride out;
    const double end_s = plan.duration_s() + 5, begin_s = seconds(now_.ns);
    bool stopped = false;
    Eigen::Vector3d arm_at_stop = Eigen::Vector3d::Zero();
    while (seconds(now_.ns) - begin_s < end_s) {
      cycle();
      const auto& report = session_.report();
      const Eigen::Vector3d arm = foot(cell_, controller_.joints(), top_);
      const double t = report.plan_time_s;
      if (stop_s >= 0 && !stopped && t >= stop_s) {
        session_.request_stop();
        stopped = true;
        arm_at_stop = arm;
        reference_way_ = 0;
      }
      if (stopped) out.stop_off_path_mm = std::max(out.stop_off_path_mm, off_way(arm, t, plan));
      for (const auto& pass : plan.passes) {
        if (!stopped && t > pass.from_s + 0.1 && t < pass.to_s)
          out.contour_mm = std::max(out.contour_mm, off_way(arm, t, plan));
      }
      if (report.plan_done || (stopped && report.phase == robot::EgmPhase::Holding)) {
        out.finished = report.plan_done;
        break;
      }
    }
    out.stop_reference_mm = reference_way_;
    for (int k = 0; k < 150; ++k) cycle();
    if (stopped) out.stop_arm_mm = (foot(cell_, controller_.joints(), top_) - arm_at_stop).norm();
    out.speed = judge_->speed, out.acceleration = judge_->acceleration;
    out.jerk = judge_->jerk, out.range = judge_->range;
    out.limited = session_.report().limited;
    return out;
  }

 private:
  /// The cell file states the filter that the RAPID module asks for.
  static cell::CellSetup setup_of(const files::CellConfig& config, const Law& law) {
    cell::CellSetup cell = config.setup;
    cell.egm.low_pass_hz = law.low_pass_hz;
    return cell;
  }
  static sim::Scene scene_of(const files::CellConfig& config, const Law& law) {
    sim::Scene scene;
    scene.cell = config;
    scene.controller.position_gain = law.gain;
    scene.controller.low_pass_hz = law.low_pass_hz;
    scene.controller.cycle_ms = law.cycle_ms;
    return scene;
  }
  static std::string module_of(const Law& law) {
    std::string text = text_of(WELDCELL_CONFIG "/rapid/WeldcellEgm.mod");
    const std::string was = "\\LpFilter:=100";
    const auto at = text.find(was);
    if (at == std::string::npos) std::exit(2);
    return text.replace(at, was.size(), "\\LpFilter:=" + number(law.low_pass_hz));
  }

  void cycle() {
    now_ = now_ + from_seconds(scene_.controller.cycle_ms * 1e-3);
    controller_.step(now_);
    const auto datagram = controller_.egm_datagram();
    if (!datagram) return;
    std::array<std::byte, 512> reply{};
    const std::size_t n = session_.on_datagram(*datagram, now_ + 200 * kMicrosecond, reply);
    if (n == 0) return;
    controller_.on_egm_datagram(std::span(reply).first(n));
    abb::egm::EgmSensor sensor;
    if (!sensor.ParseFromArray(reply.data(), static_cast<int>(n))) return;
    std::array<double, 6> q{};
    Joints radians{};
    for (int i = 0; i < 6; ++i) {
      q[static_cast<std::size_t>(i)] = sensor.planned().joints().joints(i);
      radians[static_cast<std::size_t>(i)] = rad(q[static_cast<std::size_t>(i)]);
    }
    if (judge_) judge_->see(q, scene_.controller.cycle_ms * 1e-3);
    const Eigen::Vector3d at = foot(cell_, radians, top_);
    reference_way_ += (at - last_foot_).norm();
    last_foot_ = at;
  }

  /// Distance from the planned way near plan time t: the arm is up to 0.4 s late.
  double off_way(const Eigen::Vector3d& p, double t, const plan::MotionPlan& plan) const {
    const auto at = [&](double s) {
      return static_cast<std::size_t>(
          std::clamp(s / plan.period_s, 0.0, static_cast<double>(way_.size() - 2)));
    };
    double nearest = 1e9;
    for (std::size_t k = at(t - 0.4); k <= at(t + 0.02); ++k) {
      const Eigen::Vector3d d = way_[k + 1] - way_[k];
      const double u = d.squaredNorm() > 0 ? std::clamp((p - way_[k]).dot(d) / d.squaredNorm(), 0.0, 1.0) : 0;
      nearest = std::min(nearest, (way_[k] + u * d - p).norm());
    }
    return nearest;
  }

  cell::CellSetup cell_;
  double top_;
  sim::Scene scene_;
  sim::Controller controller_;
  DirectTransport transport_;
  adapters::RwsClient rws_;
  app::RobotRunner runner_;
  robot::EgmSession session_;
  std::unique_ptr<Judge> judge_;
  std::vector<Eigen::Vector3d> way_;
  Eigen::Vector3d last_foot_ = Eigen::Vector3d::Zero();
  double reference_way_ = 0;
  HostTime now_;
};

constexpr double kTop_mm = 540;

plan::BeamPath archimedean(double pitch_mm, double from_mm, double to_mm) {
  plan::BeamPath path;
  path.name = "spiral";
  const double b = pitch_mm / (2 * kPi);
  for (double turn = from_mm / b; turn < to_mm / b; turn += 1 / std::max(4.0, b * turn)) {
    path.points.push_back({950 + b * turn * std::cos(turn), b * turn * std::sin(turn)});
  }
  return path;
}

plan::MotionPlan planned(const cell::CellSetup& cell, const std::vector<plan::BeamPath>& paths,
                         double speed_mm_s) {
  auto plan = plan::plan_scan(cell, paths, kTop_mm, speed_mm_s, cell.home);
  if (!plan.ok()) {
    std::fprintf(stderr, "bench_robot: %s\n", plan.error().text().c_str());
    std::exit(2);
  }
  plan->id = 1;
  return std::move(*plan);
}

void tracking(std::vector<Row>& rows, const files::CellConfig& config) {
  const auto spiral = planned(config.setup, {archimedean(5, 10, 100)}, 100);
  const auto wide = planned(config.setup, {archimedean(40, 30, 250)}, 100);
  const struct {
    const char* name;
    const plan::MotionPlan* plan;
  } spirals[] = {{"spiral pitch 5, r 10-100", &spiral}, {"spiral pitch 40, r 30-250", &wide}};
  for (const auto& s : spirals) {
    const Ride stiff = Track(config, {20, 100}, kTop_mm).follow(*s.plan);
    const Ride soft = Track(config, {5, 20}, kTop_mm).follow(*s.plan);
    const std::string at = std::string(s.name) + " at 100 mm/s, ";
    rows.push_back(
        {at + "contour error k 20 LP 100", stiff.finished ? stiff.contour_mm : 1e9, "mm", NAN, 0.05});
    rows.push_back({at + "contour error k 5 LP 20", soft.finished ? soft.contour_mm : 1e9, "mm", NAN, 0.3});
  }
  plan::BeamPath line;
  line.name = "line";
  line.points = {{950, -150}, {950, 150}};
  const auto straight = planned(config.setup, {line}, 200);
  for (const double cycle_ms : {4.0, 4.032}) {
    const Ride ride = Track(config, {20, 100, cycle_ms}, kTop_mm).follow(straight);
    const std::string at = "line 300 mm at 200 mm/s, cycle " + number(cycle_ms) + " ms, ";
    rows.push_back(
        {at + "contour error", ride.finished ? ride.contour_mm : 1e9, "mm", NAN, NAN, Better::None});
    rows.push_back({at + "highest share of a speed limit", ride.speed, "", NAN, 1});
    rows.push_back({at + "of an acceleration limit", ride.acceleration, "", NAN, 1});
    rows.push_back({at + "of a jerk limit", ride.jerk, "", NAN, 1});
    rows.push_back({at + "of a joint's range", ride.range, "", NAN, 1});
    rows.push_back({at + "references cut", static_cast<double>(ride.limited), "", NAN, 0});
  }
  const Ride stop = Track(config, {20, 100}, kTop_mm).follow(straight, straight.duration_s() / 2);
  rows.push_back(
      {"stop at 200 mm/s, way of the reference", stop.stop_reference_mm, "mm", NAN, NAN, Better::None});
  rows.push_back({"stop at 200 mm/s, way of the arm", stop.stop_arm_mm, "mm", NAN, NAN, Better::None});
  rows.push_back({"stop at 200 mm/s, off the planned path", stop.stop_off_path_mm, "mm", NAN, 0.05});
  rows.push_back({"stop at 200 mm/s, highest share of a jerk limit", stop.jerk, "", NAN, NAN, Better::None});
}

/// Every arm in turn in the demo cell: of twenty motions one is a spiral and two are lines, which take
/// longest.
void random_plans(std::vector<Row>& rows, const cell::CellSetup& demo, int count) {
  std::vector<cell::CellSetup> cells;
  for (const fs::path& path : files_in(WELDCELL_CONFIG "/robots", ".yaml")) {
    cells.push_back(demo);
    cells.back().arm = arm_of(path);
  }
  std::mt19937_64 random(kSeed);
  PlanTally tally;
  for (int n = 0; n < count; ++n) {
    const int turn = n % 20;
    const Motion motion = turn == 0 ? Motion::Spiral : turn < 3 ? Motion::Line : Motion::PointToPoint;
    try_plan(cells[static_cast<std::size_t>(n) % cells.size()], motion, random, tally);
  }
  const std::string seed = " (seed " + std::to_string(kSeed) + ")";
  rows.push_back({"random motions asked for" + seed, static_cast<double>(count), "", NAN, NAN, Better::None});
  for (std::size_t k = 0; k < kMotionNames.size(); ++k) {
    rows.push_back({std::string("planned: ") + kMotionNames[k], static_cast<double>(tally.planned[k]), "",
                    NAN, 1, Better::Higher});
  }
  for (const auto& [cause, times] : tally.refused)
    rows.push_back({"refused, " + cause, static_cast<double>(times), "", NAN, NAN, Better::None});
  if (tally.broken > 0) std::fprintf(stderr, "bench_robot: first broken: %s\n", tally.first_broken.c_str());
  rows.push_back({"plans that break a limit", static_cast<double>(tally.broken), "", NAN, 0});
  const Shares& w = tally.worst;
  const double most = 1 + kShareSlack;
  rows.push_back({"worst share of a speed limit, stated", w.stated_speed, "", NAN, most});
  rows.push_back({"worst share of an acceleration limit, stated", w.stated_acceleration, "", NAN, most});
  rows.push_back({"worst share of a jerk limit, stated", w.stated_jerk, "", NAN, most});
  rows.push_back({"worst share of a speed limit, differences", w.speed, "", NAN, most});
  rows.push_back({"worst share of an acceleration limit, differences", w.acceleration, "", NAN, most});
  rows.push_back({"worst share of a jerk limit, differences", w.jerk, "", NAN, most});
  rows.push_back({"closest to a joint's range less margin", deg(w.range_excess_rad), "deg", NAN, 1e-7});
  rows.push_back({"speed at either end, stated", deg(w.end_speed_rad_s), "deg/s", NAN, 1e-4});
}

/// The N of --plans N; `fallback` without it, -1 when it is no positive number.
int plans_of(int argc, char** argv, int fallback) {
  for (int i = 1; i < argc; ++i) {
    if (std::string(argv[i]) != "--plans") continue;
    const int count = i + 1 < argc ? std::atoi(argv[i + 1]) : 0;
    return count > 0 ? count : -1;
  }
  return fallback;
}

}  // namespace
}  // namespace weldcell::bench

int main(int argc, char** argv) {
  using namespace weldcell;
  auto read = files::read_cell_file(WELDCELL_CONFIG "/cell-demo.yaml");
  if (const auto* faults = std::get_if<files::Faults>(&read)) {
    std::fprintf(stderr, "bench_robot: %s\n", files::text(*faults).c_str());
    return 2;
  }
  const auto& config = std::get<files::CellConfig>(read);
  const bool asked =
      std::any_of(argv, argv + argc, [](const char* a) { return std::string(a) == "--plans"; });
  const int plans = bench::plans_of(argc, argv, 10000);
  if (plans < 0) {
    std::fprintf(stderr, "bench_robot: --plans needs a number above 0, e.g. --plans 10000\n");
    return 2;
  }
  std::vector<bench::Row> rows;
  if (!asked) {
    bench::against_references(rows);
    bench::against_itself(rows);
    bench::tracking(rows, config);
  }
  bench::random_plans(rows, config.setup, plans);
  return bench::finish("robot", rows, bench::wants_json(argc, argv));
}
