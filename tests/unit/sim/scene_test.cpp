// Scenes: placements by seed, strict files, faults, truth; and the simulated worker at the PLC.
#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>

#include "fixture.hpp"
#include "sim/plc_worker.hpp"

namespace weldcell::sim {

namespace {

/// Writes a scene beside the configuration's workpieces and reads it.
std::variant<Scene, files::Faults> read_text(const std::string& text, std::uint64_t seed = 0) {
  const std::string path = testing::TempDir() + "/scene_test.yaml";
  std::ofstream(path) << text;
  return read_scene(path, test_scene().cell, seed);
}

const std::string kWorkpiece = std::string("workpiece: ") + WELDCELL_CONFIG "/workpieces/ladder.yaml\n";

}  // namespace

TEST(Scene, PlacementStaysInItsRangeAndFollowsTheSeed) {
  const Scene scene = test_scene();
  const Vec2 center(200, 20);
  double widest = 0, most_turned = 0;
  for (std::uint64_t seed = 1; seed <= 500; ++seed) {
    const Pose2 pose = placed(scene.workpiece, scene.planned, 15, rad(20), seed);
    const Vec2 moved = pose * center - scene.planned * center;
    EXPECT_LE(moved.cwiseAbs().maxCoeff(), 15 + 1e-9) << "seed " << seed;
    EXPECT_LE(std::abs(pose.theta_rad), rad(20)) << "seed " << seed;
    widest = std::max(widest, moved.cwiseAbs().maxCoeff());
    most_turned = std::max(most_turned, std::abs(pose.theta_rad));
  }
  EXPECT_GT(widest, 14.5);
  EXPECT_GT(most_turned, rad(19));
  const Pose2 a = placed(scene.workpiece, scene.planned, 15, rad(20), 5),
              b = placed(scene.workpiece, scene.planned, 15, rad(20), 5);
  EXPECT_EQ(a.x_mm, b.x_mm);
  EXPECT_EQ(a.theta_rad, b.theta_rad);
}

TEST(Scene, ShippedScenesRead) {
  for (const char* name : {"ladder", "ladder-differs", "ladder-shop-floor", "ladder-tilted", "mitre"}) {
    auto read = read_scene(std::string(WELDCELL_CONFIG) + "/scenes/" + name + ".yaml", test_scene().cell, 3);
    if (const auto* faults = std::get_if<files::Faults>(&read)) FAIL() << files::text(*faults);
    const Scene& scene = std::get<Scene>(read);
    EXPECT_EQ(scene.seed, 3U);
    EXPECT_EQ(scene.laser.latency_ms, 2.7);
    EXPECT_FALSE(scene.controller.modules.empty());
    EXPECT_FALSE(scene.workpiece.welds.empty());
    EXPECT_EQ(true_seams(scene).size(), scene.workpiece.welds.size());
  }
}

TEST(Scene, FaultsAreAllToldWithLines) {
  auto read = read_text("scene: x\n" + kWorkpiece +
                        "planned: {x_mm: 1, y_mm: nonsense, theta_deg: 0}\nlaser: {latency: 3}\nfaults: "
                        "[laser_drop@scan+5:2, fire@3]\n");
  ASSERT_TRUE(std::holds_alternative<files::Faults>(read));
  const std::string text = files::text(std::get<files::Faults>(read));
  EXPECT_NE(text.find(":3:"), std::string::npos) << text;
  EXPECT_NE(text.find("latency"), std::string::npos) << text;
  EXPECT_NE(text.find("'fire' is no fault"), std::string::npos) << text;
  EXPECT_EQ(std::get<files::Faults>(read).size(), 3U) << text;
}

TEST(Scene, FaultSpecs) {
  const auto fault = parse_fault("laser_drop@scan+5:2");
  ASSERT_TRUE(fault);
  EXPECT_EQ(fault->kind, "laser_drop");
  EXPECT_EQ(fault->after, TimedFault::After::Scan);
  EXPECT_EQ(fault->at_s, 5);
  EXPECT_EQ(fault->duration_s, 2);
  EXPECT_EQ(parse_fault("estop@3.5")->at_s, 3.5);
  EXPECT_EQ(parse_fault("egm_silence@scan")->after, TimedFault::After::Scan);
  EXPECT_EQ(parse_fault("collision@weld+2.5")->after, TimedFault::After::Weld);
  EXPECT_EQ(parse_fault("collision@weld+2.5")->at_s, 2.5);
  for (const char* text :
       {"", "fire", "estop@", "estop@x", "estop@1:", "estop@-1", "estop@scan5", "estop@weld5"})
    EXPECT_FALSE(parse_fault(text)) << text;
}

TEST(Scene, TruthTellsPoseSeamsAndTorch) {
  auto read = read_text(
      "scene: x\n" + kWorkpiece +
      "planned: {x_mm: 1250, y_mm: -600, theta_deg: 90}\noffset: {x_mm: 3, y_mm: -2, theta_deg: 1}\n");
  ASSERT_TRUE(std::holds_alternative<Scene>(read)) << files::text(std::get<files::Faults>(read));
  const Scene& scene = std::get<Scene>(read);
  const TrueSeam seam = true_seams(scene)[0];
  WeldTrace trace{"any", {}};
  const Eigen::Vector3d along = (seam.line_mm.back() - seam.line_mm.front()).normalized(),
                        across(-along.y(), along.x(), 0);
  for (const Eigen::Vector3d& p : seam.line_mm) trace.tcp_mm.push_back(p + 0.25 * across);
  trace.tcp_mm.push_back(seam.line_mm.back() + 3 * along);  // past the end is not lateral
  const auto truth = nlohmann::json::parse(truth_json(scene, {trace}));
  EXPECT_NEAR(truth["x_mm"].get<double>(), 1253, 1e-9);
  EXPECT_NEAR(truth["theta_deg"].get<double>(), 91, 1e-9);
  EXPECT_EQ(truth["welded"][0]["seam"], seam.name);
  EXPECT_NEAR(truth["welded"][0]["lateral_error_mm"].get<double>(), 0.25, 1e-6);
  EXPECT_EQ(truth["latency_ms"], 2.7);
}

TEST(Scene, ATiltedTableTakesItsSeamsAlongAndTellsTheTorchsHeight) {
  const std::string level = "scene: x\n" + kWorkpiece + "planned: {x_mm: 1250, y_mm: -600, theta_deg: 90}\n";
  auto flat = read_text(level),
       tilted = read_text(level + "table: {lift_mm: 1.5, roll_deg: 0.4, pitch_deg: -0.3}\n");
  ASSERT_TRUE(std::holds_alternative<Scene>(flat)) << files::text(std::get<files::Faults>(flat));
  ASSERT_TRUE(std::holds_alternative<Scene>(tilted)) << files::text(std::get<files::Faults>(tilted));
  const auto before = true_seams(std::get<Scene>(flat)), after = true_seams(std::get<Scene>(tilted));
  ASSERT_EQ(before.size(), after.size());
  // By the slopes alone: z rises by tan(roll) along y and by -tan(pitch) along x.
  const Vec2 middle = std::get<Scene>(flat).planned * Vec2(597.679, 300);  // centroid of the members
  for (std::size_t i = 0; i < before.size(); ++i) {
    for (std::size_t k = 0; k < before[i].line_mm.size(); ++k) {
      const Eigen::Vector3d &a = before[i].line_mm[k], &b = after[i].line_mm[k];
      EXPECT_LT((b - a).head<2>().norm(), 0.04) << "tops keep their place to second order";
      const double rise =
          1.5 + std::tan(rad(0.4)) * (a.y() - middle.y()) + std::tan(rad(0.3)) * (a.x() - middle.x());
      EXPECT_NEAR(b.z() - a.z(), rise, 0.02);
    }
  }
  // A torch that welds as if the table were level.
  const auto welded = welded_seams(std::get<Scene>(tilted), {{before[0].name, before[0].line_mm}});
  ASSERT_EQ(welded.size(), 1u);
  EXPECT_LT(welded[0].lateral_error_mm, 0.02);
  double worst = 0;
  for (std::size_t k = 0; k < before[0].line_mm.size(); ++k)
    worst = std::max(worst, std::abs(after[0].line_mm[k].z() - before[0].line_mm[k].z()));
  EXPECT_NEAR(welded[0].height_error_mm, worst, 0.02);
}

TEST(PlcWorker, LeadsAJobToItsEnd) {
  PlcWorker worker(0.3, false);
  wire::PlcStatus cell;
  cell.command_ack = 40;
  cell.state = wire::PackState::Idle;
  double now = 0;
  std::vector<wire::PlcCommand> sent;
  std::uint16_t heartbeat = 0;
  const auto cycle = [&](int times) {
    for (int i = 0; i < times; ++i) {
      now += 0.1;
      const wire::PlcOrder order = worker.step(cell, now);
      EXPECT_NE(order.heartbeat, heartbeat);
      heartbeat = order.heartbeat;
      if (order.command_sequence == cell.command_ack) continue;
      sent.push_back(order.command);
      cell.command_ack = order.command_sequence;
      if (order.command == wire::PlcCommand::Arm) cell.armed = 1;
      if (order.command == wire::PlcCommand::Start) cell.state = wire::PackState::Execute;
    }
  };
  using wire::PlcCommand;
  cycle(5);
  EXPECT_TRUE(sent.empty()) << "no job waits";
  cell.job_number = 7;
  cycle(5);
  EXPECT_EQ(sent, (std::vector{PlcCommand::Arm, PlcCommand::Start}));
  for (std::uint16_t step = 1; step <= 3; ++step) {
    cell.guide_step = step;
    cycle(2);
    EXPECT_EQ(sent.size(), 1U + step) << "the worker takes his time";
    cycle(8);
    EXPECT_EQ(sent.size(), 2U + step) << "one Confirm a step";
  }
  cell.guide_step = 0;
  cycle(20);
  cell.state = wire::PackState::Complete;
  cycle(2);
  EXPECT_EQ(sent.back(), PlcCommand::Reset);
  const std::size_t before = sent.size();
  cell.state = wire::PackState::Aborted;
  cell.armed = 0;
  cycle(50);
  EXPECT_EQ(sent.size(), before) << "a fault is a person's matter";
}

TEST(PlcWorker, RearmsOnlyWhenTold) {
  PlcWorker worker(0.3, true);
  wire::PlcStatus cell;
  cell.state = wire::PackState::Aborted;
  std::vector<wire::PlcCommand> sent;
  for (int i = 1; i < 40 && cell.state != wire::PackState::Execute; ++i) {
    const wire::PlcOrder order = worker.step(cell, i * 0.1);
    if (order.command_sequence == cell.command_ack) continue;
    sent.push_back(order.command);
    cell.command_ack = order.command_sequence;
    if (order.command == wire::PlcCommand::Clear) cell.state = wire::PackState::Stopped, cell.phase = 14;
    if (order.command == wire::PlcCommand::Arm) cell.armed = 1;
    if (order.command == wire::PlcCommand::Resume) cell.state = wire::PackState::Execute;
  }
  using wire::PlcCommand;
  EXPECT_EQ(sent, (std::vector{PlcCommand::Clear, PlcCommand::Arm, PlcCommand::Resume}));
}

}  // namespace weldcell::sim
