// Whole jobs in virtual time with lasers and clocks that are not the demonstration's: every dialect, every
// trouble of a clock in the middle of a scan. Each ends at the true place, or is refused in words.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <functional>

#include "weldcell/app/virtual_cell.hpp"
#include "weldcell/files/document.hpp"
#include "weldcell/files/job_file.hpp"
#include "weldcell/weld/resident.hpp"

namespace weldcell::app {
namespace {

using testing::Contains;
using testing::HasSubstr;
using testing::Not;

constexpr std::uint64_t kSeed = 21;

template <typename T>
T must(std::variant<T, files::Faults> read) {
  if (const auto* faults = std::get_if<files::Faults>(&read)) throw std::runtime_error(files::text(*faults));
  return std::get<T>(std::move(read));
}

files::CellConfig demo_cell() {
  return must(files::read_cell_file(std::string(WELDCELL_CONFIG) + "/cell-demo.yaml"));
}

/// A cell whose laser speaks the dialect, at the rate of such a sensor.
files::CellConfig cell_with(wire::LaserDialect dialect, double rate_hz) {
  files::CellConfig cell = demo_cell();
  wire::LaserFormat& format = cell.laser_format;
  format.dialect = dialect;
  format.rate_hz = cell.setup.laser.rate_hz = rate_hz;
  if (dialect == wire::LaserDialect::Meas32)
    format.words = 2, format.distance_word = 1, format.raw_min = 15853, format.raw_max = 3261;
  return cell;
}

/// One job; the scene's devices are those of `real`, the daemon believes `told`.
VirtualOutcome run(const files::CellConfig& told, const files::CellConfig& real,
                   const std::vector<std::string>& faults,
                   const std::function<void(sim::Scene&)>& change = {}) {
  sim::Scene scene = must(sim::read_scene(std::string(WELDCELL_CONFIG) + "/scenes/ladder.yaml", real, kSeed));
  for (const std::string& spec : faults) {
    const auto fault = sim::parse_fault(spec);
    if (!fault.ok()) throw std::runtime_error(spec);
    scene.faults.push_back(*fault);
  }
  if (change) change(scene);
  VirtualJob job;
  job.order = must(files::read_job_file(std::string(WELDCELL_CONFIG) + "/jobs/demo-ladder.yaml"));
  job.order.guidance = false;
  job.workpiece = scene.workpiece;
  const auto resident = weld::fill_resident(
      must(files::read_text_file(std::string(WELDCELL_CONFIG) + "/rapid/WeldcellEgm.mod")), told.setup);
  if (!resident.ok()) throw std::runtime_error(resident.error().text());
  job.resident_module = *resident;
  return run_virtual(told, scene, job);
}

std::string story(const VirtualOutcome& outcome) {
  std::string out = "seed " + std::to_string(kSeed) + "\n";
  for (const std::string& line : outcome.log) out += line + "\n";
  return out;
}

void expect_at_the_true_place(const VirtualOutcome& outcome) {
  ASSERT_TRUE(outcome.finished) << story(outcome);
  EXPECT_TRUE(outcome.accepted) << outcome.reason << "\n" << story(outcome);
  EXPECT_LE(outcome.centroid_error_mm.norm(), 0.25) << story(outcome);
  EXPECT_FALSE(outcome.welded.empty());
  for (const auto& seam : outcome.welded) EXPECT_LE(seam.lateral_error_mm, 0.5);
}

void tell(const char* what, const VirtualOutcome& outcome) {
  std::printf("%-28s %s, centroid %.3f mm, %d passes, %d points\n", what,
              outcome.accepted ? "welded" : outcome.reason.c_str(), outcome.centroid_error_mm.norm(),
              outcome.passes, outcome.points);
}

TEST(LaserJobs, OfTheDialectsThatNoRealTimeTestRuns) {
  for (const auto& [dialect, rate_hz] :
       {std::pair{wire::LaserDialect::Meas32, 2000.0}, {wire::LaserDialect::ThreeByte, 4000.0}}) {
    SCOPED_TRACE(wire::to_string(dialect));
    const files::CellConfig cell = cell_with(dialect, rate_hz);
    const VirtualOutcome outcome = run(cell, cell, {});
    tell(wire::to_string(dialect), outcome);
    expect_at_the_true_place(outcome);
  }
}

struct ClockCase {
  const char* name;
  const char* fault;
  const char* words;  ///< in the log
  bool welds = true;  ///< false: a fault, and a person scans again
};

class ClockTrouble : public testing::TestWithParam<ClockCase> {};

TEST_P(ClockTrouble, InAScanEndsAtTheTruePlaceOrInAFaultInWords) {
  const ClockCase& c = GetParam();
  const files::CellConfig cell = demo_cell();
  const VirtualOutcome outcome = run(cell, cell, {c.fault});
  tell(c.name, outcome);
  EXPECT_THAT(outcome.log, Contains(HasSubstr(c.words))) << story(outcome);
  if (c.welds) {
    expect_at_the_true_place(outcome);
  } else {
    EXPECT_FALSE(outcome.accepted);
    EXPECT_TRUE(outcome.welded.empty());
    EXPECT_THAT(outcome.log, Contains("Scanning -> Faulted"));
  }
}

constexpr const char* kSet = "set or began anew (1), or the laser's stood still (0)";
constexpr const char* kStood = "set or began anew (0), or the laser's stood still (1)";
constexpr const char* kSession = "the EGM session restarted or stopped in the middle of the scan";
INSTANTIATE_TEST_SUITE_P(
    Clocks, ClockTrouble,
    testing::Values(ClockCase{"LaserSteps", "laser_clock_step@scan+20:0.3", kSet},
                    ClockCase{"LaserGoesBack", "laser_clock_back@scan+20:0.05", kSet},
                    ClockCase{"LaserStands", "laser_clock_stop@scan+20:3", kStood},
                    ClockCase{"LaserIsReset", "laser_clock_reset@scan+20", kSet},
                    ClockCase{"RobotSteps", "robot_clock_step@scan+20:0.3", kSession, false},
                    ClockCase{"RobotGoesBack", "robot_clock_back@scan+20:0.05", kSession, false}),
    [](const auto& tested) { return std::string(tested.param.name); });

TEST(LaserJobs, AClockThatWrapsInTheScanIsNotNoticed) {
  const files::CellConfig cell = demo_cell();
  const VirtualOutcome outcome =
      run(cell, cell, {}, [](sim::Scene& scene) { scene.laser.clock.offset_s = 4294.967296 - 60; });
  tell("LaserWraps", outcome);
  expect_at_the_true_place(outcome);
  for (const std::string& line : outcome.log) EXPECT_THAT(line, Not(HasSubstr("began anew")));
}

TEST(LaserJobs, ARateThatIsNotTheCellFilesIsToldAndMovesNoSeam) {
  // Without stamps the rate is the clock: 400 ppm are 10 ms over a pass.
  for (const double off_ppm : {-2000.0, -150.0, 150.0, 400.0, 20'000.0}) {
    SCOPED_TRACE(off_ppm);
    const files::CellConfig told = cell_with(wire::LaserDialect::TwoByte, 1500);
    const files::CellConfig real = cell_with(wire::LaserDialect::TwoByte, 1500 * (1 + 1e-6 * off_ppm));
    const VirtualOutcome outcome = run(told, real, {});
    tell("another rate", outcome);
    EXPECT_THAT(outcome.log, Contains(HasSubstr("laser.rate_hz says 1500"))) << story(outcome);
    if (outcome.accepted) {
      EXPECT_LE(outcome.centroid_error_mm.norm(), 0.25);
    }
    for (const auto& seam : outcome.welded) EXPECT_LE(seam.lateral_error_mm, 0.5);
  }
}

}  // namespace
}  // namespace weldcell::app
