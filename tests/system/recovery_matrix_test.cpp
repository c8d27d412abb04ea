// docs/RECOVERY.md as a matrix: every loss and stop in virtual time, with the protocols' real bytes. Each
// case ends in the state that the table states, stands there by itself, moves nothing while unarmed by the
// simulator's own record of the arm, refuses to go on before a person has armed, and then goes on by the
// stated step to its end.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <regex>
#include <set>
#include <sstream>

#include "weldcell/app/virtual_cell.hpp"
#include "weldcell/base/units.hpp"
#include "weldcell/files/document.hpp"
#include "weldcell/files/job_file.hpp"
#include "weldcell/weld/resident.hpp"

namespace weldcell::app {
namespace {

using job::FaultCode;
using job::State;
using testing::HasSubstr;
using wire::PlcCommand;

constexpr std::uint64_t kSeed = 21;
constexpr double kSettle_s = 3;     // within which whatever moved must rest
constexpr double kStand_s = 8;      // for which the cell must stay where it is, by itself
constexpr double kSeamEnds_s = 15;  // within which a seam under way ends and the torch is away
constexpr double kGiveUp_s = 900;

/// What the PC's side suffers; the scene's faults are the controller's and the sensor's.
enum class Loss { None, Daemon, Processor, PlcHeartbeat };

struct Case {
  std::string name = {};
  std::vector<std::string> faults = {};  ///< as a scene file has them
  FaultCode fault = FaultCode::None;
  std::string text = {};       ///< in the fault's text
  int event = 0;               ///< in the controller's log
  State in = State::Scanning;  ///< where loss and `befalls` come, `after_s` after the state began
  Loss loss = Loss::None;
  double after_s = 4, down_s = 3;
  std::string still_refused =
      {};  ///< what a resume says before the person did more than wait; "" = it goes on
  bool press_motors_on = false;
  bool mastership_held = false;  ///< by the session of the killed daemon
  bool seam_left_out = false;    ///< a seam was cut: finished by hand
  std::size_t never_welded = 0;  ///< seams whose arc was struck and did not travel
  bool seam_finished = false;    ///< the seam under way is welded to its end, and none begins after it
  State goes_on_at = State::PreparingScan;
  bool guidance = false;
  std::function<void(VirtualCell&)> befalls = {};    ///< what happens to the controller
  std::function<void(VirtualCell&)> meanwhile = {};  ///< while the cell stands there
  std::function<void(VirtualCell&)> mend = {};       ///< by a person, before the cell is armed again
};

std::ostream& operator<<(std::ostream& out, const Case& c) { return out << c.name; }

template <typename T>
T must(std::variant<T, files::Faults> read) {
  if (const auto* faults = std::get_if<files::Faults>(&read)) throw std::runtime_error(files::text(*faults));
  return std::get<T>(std::move(read));
}

ports::HttpReply at_the_pendant(VirtualCell& cell, const std::string& method, const std::string& path,
                                const std::string& body = "") {
  constexpr int kPendant = 77;
  ports::HttpRequest request;
  request.method = method;
  request.path = path;
  request.body = body;
  return cell.controller().handle_rws(request, kPendant);
}

/// Starts the program on the FlexPendant, as far as the controller lets it.
void press_start(VirtualCell& cell) {
  const auto reply = at_the_pendant(
      cell, "POST", "/rw/rapid/execution?action=start",
      "regain=continue&execmode=continue&cycle=once&condition=none&stopatbp=disabled&alltaskbytsp=false");
  EXPECT_EQ(reply.status, 204);
}

/// An axis (0..5) bounded in the controller's configuration to +-half_deg about where it stands.
std::function<void(VirtualCell&)> bounded(std::size_t axis, double half_deg) {
  return [=](VirtualCell& cell) {
    const double at = cell.controller().joints()[axis];
    cell.controller().bound_axis(axis, at - rad(half_deg), at + rad(half_deg));
  };
}
std::function<void(VirtualCell&)> unbounded(std::size_t axis) {
  return [=](VirtualCell& cell) { cell.controller().bound_axis(axis, rad(-180), rad(180)); };
}

/// A target of the weld module changed by hand on the FlexPendant, before the program starts.
std::function<void(VirtualCell&)> edited(const std::string& from, const std::string& to) {
  return [=](VirtualCell& cell) {
    ports::HttpReply file;
    for (int cycle = 0; cycle < 2500 && file.status != 200; ++cycle) {
      cell.advance();
      file = at_the_pendant(cell, "GET", "/fileservice/$HOME/WeldcellJob.mod");
    }
    const std::string changed = std::regex_replace(file.body, std::regex(from), to);
    ASSERT_NE(changed, file.body) << "no " << from << " in\n" << file.body;
    ASSERT_FALSE(cell.controller().program_running()) << "too late";
    ASSERT_TRUE(cell.controller().load_module(changed).ok());
  };
}
const std::string kTarget = R"((robtarget p01_002:=\[\[)[-0-9.]+(,))", kFarAway = "$019000$2";
const std::string kConfiguration = R"((robtarget p02Approach:=\[\[[^\]]*\],\[[^\]]*\],\[[-0-9]+,)[-0-9]+(,))",
                  kOther = "$1-3$2";

/// Another client that asks for mastership is refused.
bool mastership_taken(VirtualCell& cell) {
  if (at_the_pendant(cell, "POST", "/rw/mastership/rapid?action=request").status == 403) return true;
  at_the_pendant(cell, "POST", "/rw/mastership/rapid?action=release");
  return false;
}

class Recovery : public testing::TestWithParam<Case> {
 protected:
  Recovery() : config_(must(files::read_cell_file(std::string(WELDCELL_CONFIG) + "/cell-demo.yaml"))) {}

  void SetUp() override {
    scene_ = must(sim::read_scene(std::string(WELDCELL_CONFIG) + "/scenes/ladder.yaml", config_, kSeed));
    for (const std::string& spec : c_.faults) {
      const auto fault = sim::parse_fault(spec);
      ASSERT_TRUE(fault.ok()) << spec;
      scene_.faults.push_back(*fault);
    }
    job_.order = must(files::read_job_file(std::string(WELDCELL_CONFIG) + "/jobs/demo-ladder.yaml"));
    job_.order.guidance = c_.guidance;
    job_.workpiece = scene_.workpiece;
    const auto resident = weld::fill_resident(
        must(files::read_text_file(std::string(WELDCELL_CONFIG) + "/rapid/WeldcellEgm.mod")), config_.setup);
    ASSERT_TRUE(resident.ok());
    job_.resident_module = *resident;
    job_.plc = c_.loss == Loss::PlcHeartbeat;
    cell_ = std::make_unique<VirtualCell>(config_, scene_, job_);
  }

  std::string story() const {
    std::string out = fmt::format("seed {}, at {:.2f} s\n", kSeed, cell_->now_s());
    for (const std::string& line : cell_->outcome().log) out += line + "\n";
    for (const sim::Event& e : cell_->controller().events()) {
      out += fmt::format("{:9.3f} s  {} {}: {}\n", seconds(e.at.ns), e.code, e.title, e.text);
    }
    return out;
  }

  void run_for(double duration_s) {
    for (const double end_s = cell_->now_s() + duration_s; cell_->now_s() < end_s;) cell_->advance();
  }
  /// Until the condition holds, a person confirming and starting; false when it never did.
  bool run_until(const std::function<bool()>& holds) {
    for (std::uint64_t cycle = 1; cell_->now_s() < kGiveUp_s; ++cycle) {
      cell_->advance();
      if (holds()) return true;
      if (cycle % 50 == 0 && cell_->daemon_runs() && !cell_->finished()) cell_->act_as_person();
    }
    return false;
  }
  bool state_is(State state) const { return cell_->daemon_runs() && cell_->status().state == state; }

  void note_loss() {
    arcs_at_loss_ = cell_->controller().weld_traces().size();
    loss_s_ = cell_->now_s();
  }

  void suffer() {
    if (c_.loss == Loss::None && !c_.befalls) return;
    ASSERT_TRUE(run_until([&] { return state_is(c_.in); })) << story();
    if (c_.in == State::Welding && !c_.befalls) {
      ASSERT_TRUE(run_until([&] { return cell_->controller().arc_on(); })) << story();
    }
    run_for(c_.after_s);
    if (c_.befalls) c_.befalls(*cell_);
    if (c_.loss == Loss::None) return;
    if (c_.loss == Loss::Processor) {
      cell_->stall_daemon(true);
      run_for(c_.down_s);
      cell_->stall_daemon(false);
      return;
    }
    if (c_.loss == Loss::PlcHeartbeat) {
      cell_->set_plc_heartbeat(false);
      return;
    }
    note_loss();
    cell_->kill_daemon(c_.mastership_held);
    EXPECT_EQ(mastership_taken(*cell_), c_.mastership_held);
    run_for(c_.down_s);
    cell_->start_daemon();
  }

  /// The cell is where the table says and stays there, and whatever moved has come to rest.
  void stands() {
    const State state = c_.loss == Loss::Daemon ? State::Interrupted : State::Faulted;
    ASSERT_TRUE(run_until([&] { return state_is(state) || cell_->finished(); })) << story();
    ASSERT_TRUE(state_is(state)) << story();
    EXPECT_FALSE(cell_->status().armed);
    EXPECT_EQ(cell_->status().fault, c_.fault) << cell_->status().fault_text << "\n" << story();
    if (c_.loss != Loss::Daemon) note_loss();
    if (c_.seam_finished) {
      ASSERT_TRUE(run_until([&] { return !cell_->controller().program_running(); })) << story();
      EXPECT_FALSE(cell_->controller().arc_on());
      EXPECT_EQ(cell_->controller().weld_traces().size(), arcs_at_loss_) << "a seam was begun without the PC";
      EXPECT_LT(cell_->controller().motions().back().end_s, loss_s_ + kSeamEnds_s) << story();
      ran_on_until_s_ = cell_->now_s();
    }
    run_for(kSettle_s);
    const double rests_since_s = cell_->now_s();
    if (c_.meanwhile) c_.meanwhile(*cell_);
    run_for(kStand_s);
    if (c_.event != 0) {
      const auto& events = cell_->controller().events();
      EXPECT_TRUE(std::ranges::any_of(events, [&](const sim::Event& e) { return e.code == c_.event; }))
          << "no event " << c_.event << "\n"
          << story();
    }
    EXPECT_THAT(cell_->status().fault_text, HasSubstr(c_.text)) << story();
    for (const sim::MotionSpan& motion : cell_->controller().motions()) {
      EXPECT_LT(motion.end_s, rests_since_s) << "it moves still\n" << story();
    }
    EXPECT_TRUE(state_is(state)) << "it went on by itself\n" << story();
    EXPECT_FALSE(cell_->controller().arc_on());
    for (const PlcCommand order : {PlcCommand::Start, PlcCommand::Confirm, PlcCommand::Resume}) {
      EXPECT_NE(cell_->order(order), "") << "obeyed unarmed: " << static_cast<int>(order);
    }
    EXPECT_TRUE(state_is(state)) << story();
  }

  void person_clears() {
    if (c_.loss == Loss::PlcHeartbeat) cell_->set_plc_heartbeat(true);
    if (!c_.still_refused.empty()) {
      EXPECT_EQ(cell_->order(PlcCommand::Arm), "");
      const std::string refused = cell_->order(PlcCommand::Resume);
      if (refused.empty()) {
        ASSERT_TRUE(run_until([&] { return state_is(State::Faulted); })) << story();
        EXPECT_EQ(cell_->status().fault, FaultCode::RobotCommand);
        EXPECT_THAT(cell_->status().fault_text, HasSubstr(c_.still_refused)) << story();
        EXPECT_FALSE(cell_->status().armed);
      } else {
        EXPECT_THAT(refused, HasSubstr(c_.still_refused)) << story();
      }
    }
    // Faults that pass by themselves have passed after this.
    run_for(60);
    if (c_.mend) c_.mend(*cell_);
    if (c_.press_motors_on) cell_->controller().inject("motors_on");
    run_for(1);
  }

  void goes_on() {
    ASSERT_EQ(cell_->order(PlcCommand::Arm), "") << story();
    run_for(1);
    ASSERT_EQ(cell_->order(PlcCommand::Resume), "") << story();
    std::vector<State> seen;
    ASSERT_TRUE(run_until([&] {
      if (seen.empty() || seen.back() != cell_->status().state) seen.push_back(cell_->status().state);
      return cell_->finished() || state_is(State::Faulted);
    })) << story();
    ASSERT_TRUE(cell_->finished()) << cell_->status().fault_text << "\n" << story();
    const auto step = std::ranges::find_if(
        seen, [](State state) { return state != State::Importing && state != State::Planning; });
    ASSERT_NE(step, seen.end());
    EXPECT_STREQ(job::to_string(*step), job::to_string(c_.goes_on_at)) << story();
    run_for(kSettle_s);
  }

  void ended_well() {
    const VirtualOutcome outcome = cell_->outcome();
    const std::size_t seams = job_.workpiece.welds.size();
    EXPECT_EQ(outcome.verdict, "weld") << outcome.reason << "\n" << story();
    EXPECT_EQ(outcome.accepted, !c_.seam_left_out) << outcome.reason << "\n" << story();
    if (c_.seam_left_out) {
      EXPECT_THAT(outcome.reason, HasSubstr("was interrupted"));
    }
    std::multiset<std::string> welded;
    for (const auto& seam : sim::welded_seams(scene_, cell_->controller().weld_traces())) {
      welded.insert(seam.seam);
      if (!c_.seam_left_out) {
        EXPECT_LT(seam.lateral_error_mm, 0.5) << seam.seam;
      }
    }
    EXPECT_EQ(welded.size() + c_.never_welded, seams) << story();
    for (const std::string& seam : welded) EXPECT_EQ(welded.count(seam), 1U) << seam << " was welded twice";
  }

  void never_asked_too_fast() {
    EXPECT_GT(cell_->rws_load().total(), 50U);
    EXPECT_LT(cell_->rws_load().most_in_a_second(), 20U) << story();
  }

  void never_moved_unarmed() {
    int armed = 0, unarmed = 0;
    for (const sim::MotionSpan& motion : cell_->controller().motions()) {
      bool without = false;
      for (const sim::MotionSpan& span : cell_->unarmed()) {
        const bool ends_what_ran = motion.begin_s <= ran_on_until_s_ && span.begin_s <= ran_on_until_s_ &&
                                   motion.begin_s >= span.begin_s && ran_on_until_s_ <= span.end_s;
        without = without || (motion.begin_s > span.begin_s && motion.begin_s < span.end_s && !ends_what_ran);
      }
      if (without) {
        ADD_FAILURE() << fmt::format("unarmed, the arm began to move at {:.3f} s", motion.begin_s) << "\n"
                      << story();
      }
      ++(without ? unarmed : armed);
    }
    EXPECT_GT(armed, 4) << "the arm's record is empty: nothing was shown";
    std::printf("  %-36s motions begun armed %d, unarmed %d; RWS requests %zu, in a second at most %zu\n",
                c_.name.c_str(), armed, unarmed, static_cast<std::size_t>(cell_->rws_load().total()),
                cell_->rws_load().most_in_a_second());
  }

  const Case& c_ = GetParam();
  files::CellConfig config_;
  sim::Scene scene_;
  VirtualJob job_;
  std::unique_ptr<VirtualCell> cell_;
  std::size_t arcs_at_loss_ = 0;
  double loss_s_ = 0, ran_on_until_s_ = -1;
};

TEST_P(Recovery, EndsInItsStateAndGoesOnByItsStep) {
  suffer();
  if (HasFatalFailure()) return;
  stands();
  if (HasFatalFailure()) return;
  person_clears();
  if (HasFatalFailure()) return;
  goes_on();
  if (HasFatalFailure()) return;
  ended_well();
  never_asked_too_fast();
  never_moved_unarmed();
}

const std::vector<Case> kCases{
    {.name = "EgmLostInScan", .faults = {"egm_silence@scan+5:3"}, .fault = FaultCode::EgmLost},
    {.name = "NetworkCutInScan",
     .faults = {"egm_silence@scan+5:3", "rws_silence@scan+5:3"},
     .fault = FaultCode::EgmLost,
     .text = "41822",
     .event = 41822},
    {.name = "NetworkCutInWeld",
     .faults = {"egm_silence@weld+1.5:50", "rws_silence@weld+1.5:50"},
     .fault = FaultCode::RobotCommand,
     .event = 80001,
     .seam_finished = true},
    {.name = "CommTimeoutInScan",
     .fault = FaultCode::EgmLost,
     .text = "41822",
     .event = 41822,
     .loss = Loss::Processor},
    {.name = "EgmNeverStarts", .faults = {"egm_silence@0:60"}, .fault = FaultCode::EgmNotStarted},
    {.name = "RwsLostInScan",
     .faults = {"rws_silence@scan+5:100"},
     .fault = FaultCode::RobotCommand,
     .text = "open scan",
     .still_refused = "not reachable"},
    {.name = "LaserLostInScan",
     .faults = {"laser_drop@scan+5:30"},
     .fault = FaultCode::LaserLost,
     .still_refused = "laser is not connected"},
    {.name = "LaserStallsInScan", .faults = {"laser_stall@scan+5:3"}, .fault = FaultCode::LaserLost},
    {.name = "PlcLostInScan", .fault = FaultCode::PlcLost, .text = "heartbeat", .loss = Loss::PlcHeartbeat},
    {.name = "PlcLostInWeld",
     .fault = FaultCode::PlcLost,
     .in = State::Welding,
     .loss = Loss::PlcHeartbeat,
     .seam_left_out = true},
    {.name = "PcCrashInScan", .event = 41822, .loss = Loss::Daemon},
    {.name = "PcCrashInScanAndBackAtOnce", .loss = Loss::Daemon, .down_s = 0.2},
    {.name = "PcCrashInGuidance",
     .in = State::GuideMoving,
     .loss = Loss::Daemon,
     .after_s = 0.5,
     .goes_on_at = State::GuideMoving,
     .guidance = true},
    {.name = "PcCrashInWeld",
     .event = 80001,
     .in = State::Welding,
     .loss = Loss::Daemon,
     .after_s = 1.5,
     .down_s = 60,
     .seam_finished = true},
    {.name = "PcCrashInWeldAndBackAtOnce",
     .event = 10125,
     .in = State::Welding,
     .loss = Loss::Daemon,
     .after_s = 1,
     .down_s = 1,
     .seam_left_out = true},
    {.name = "PcCrashInWeldWithMastershipHeld",
     .event = 10125,
     .in = State::Welding,
     .loss = Loss::Daemon,
     .after_s = 1,
     .down_s = 1,
     .mastership_held = true,
     .seam_left_out = true},
    {.name = "RwsLostInWeld",
     .faults = {"rws_silence@weld+1.5:50"},
     .fault = FaultCode::RobotCommand,
     .event = 80001,
     .seam_finished = true},
    {.name = "RwsLostInWeldForAMoment",
     .faults = {"rws_silence@weld+1:1.5"},
     .fault = FaultCode::RobotCommand,
     .event = 10125,
     .seam_left_out = true},
    {.name = "ControllerRestartInScan",
     .faults = {"restart@scan+5:5"},
     .fault = FaultCode::EgmLost,
     .text = "10045",
     .event = 10045},
    {.name = "ControllerRestartInWeld",
     .faults = {"restart@weld+3:5"},
     .fault = FaultCode::RobotCommand,
     .event = 10045,
     .seam_left_out = true},
    {.name = "EmergencyStopInScan",
     .faults = {"estop@scan+5:3"},
     .fault = FaultCode::EgmLost,
     .text = "10013",
     .event = 10013,
     .still_refused = "press Motors On",
     .press_motors_on = true},
    {.name = "EmergencyStopInWeld",
     .faults = {"estop@weld+3:3"},
     .fault = FaultCode::ProgramStopped,
     .event = 10013,
     .still_refused = "press Motors On",
     .press_motors_on = true,
     .seam_left_out = true},
    {.name = "EmergencyStopStillStands",
     .faults = {"estop@scan+5:40"},
     .fault = FaultCode::EgmLost,
     .text = "10013",
     .event = 10013,
     .still_refused = "emergency stop",
     .press_motors_on = true},
    {.name = "GuardStopInScan",
     .faults = {"guardstop@scan+5:40"},
     .fault = FaultCode::EgmLost,
     .text = "10012",
     .event = 10012,
     .still_refused = "guard"},
    {.name = "GuardStopInWeld",
     .faults = {"guardstop@weld+3:40"},
     .fault = FaultCode::ProgramStopped,
     .event = 10012,
     .still_refused = "guard",
     .seam_left_out = true},
    {.name = "MotorsOffInScan",
     .faults = {"motors_off@scan+5"},
     .fault = FaultCode::EgmLost,
     .text = "10010",
     .event = 10010},
    {.name = "MotorsOffInWeld",
     .faults = {"motors_off@weld+3"},
     .fault = FaultCode::ProgramStopped,
     .event = 10010,
     .seam_left_out = true},
    {.name = "ManualModeInScan",
     .faults = {"manual@scan+5:40"},
     .fault = FaultCode::EgmLost,
     .text = "10015",
     .event = 10015,
     .still_refused = "operation mode"},
    {.name = "ManualModeInWeld",
     .faults = {"manual@weld+3:40"},
     .fault = FaultCode::ProgramStopped,
     .event = 10015,
     .still_refused = "operation mode",
     .seam_left_out = true},
    {.name = "ProgramStoppedInScan",
     .faults = {"program_stop@scan+5"},
     .fault = FaultCode::EgmLost,
     .text = "10125",
     .event = 10125},
    {.name = "ProgramStoppedInWeld",
     .faults = {"program_stop@weld+3"},
     .fault = FaultCode::ProgramStopped,
     .text = "10125",
     .event = 10125,
     .seam_left_out = true},
    {.name = "StartedOnTheFlexPendantAfterAStop",
     .faults = {"program_stop@scan+5"},
     .fault = FaultCode::EgmLost,
     .text = "10125",
     .meanwhile = press_start},
    {.name = "PointerMovedInScan",
     .faults = {"pp_moved@scan+5"},
     .fault = FaultCode::EgmLost,
     .text = "10125",
     .event = 10002},
    {.name = "PointerMovedInWeld",
     .faults = {"pp_moved@weld+3"},
     .fault = FaultCode::ProgramStopped,
     .event = 10002,
     .seam_left_out = true},
    {.name = "OutOfReachInAMove",
     .fault = FaultCode::RobotCommand,
     .text = "50050",
     .event = 50050,
     .in = State::Ready,
     .after_s = 0,
     .goes_on_at = State::GuideMoving,
     .guidance = true,
     .befalls = bounded(2, 0.5),
     .mend = unbounded(2)},
    {.name = "OutOfReachBeforeScan",
     .fault = FaultCode::EgmNotStarted,
     .text = "50050",
     .event = 50050,
     .in = State::Ready,
     .after_s = 0,
     .befalls = bounded(2, 0.5),
     .mend = unbounded(2)},
    {.name = "OutOfReachInWeld",
     .fault = FaultCode::ProgramStopped,
     .text = "50050",
     .event = 50050,
     .in = State::Welding,
     .after_s = 0,
     .seam_left_out = true,
     .never_welded = 1,
     .befalls = edited(kTarget, kFarAway)},
    {.name = "WrongConfigurationInWeld",
     .fault = FaultCode::ProgramStopped,
     .text = "50080",
     .event = 50080,
     .in = State::Welding,
     .after_s = 0,
     .befalls = edited(kConfiguration, kOther)},
    {.name = "JointRangeLeftInScan",
     .fault = FaultCode::EgmLost,
     .text = "50027",
     .event = 50027,
     .befalls = bounded(0, 0.5),
     .mend = unbounded(0)},
    {.name = "SingularityInScan",
     .faults = {"singularity@scan+5"},
     .fault = FaultCode::EgmLost,
     .text = "50027",
     .event = 50027},
    {.name = "SingularityInWeld",
     .faults = {"singularity@weld+3"},
     .fault = FaultCode::ProgramStopped,
     .text = "50026",
     .event = 50026},
    {.name = "SingularityInAMove",
     .faults = {"singularity@0"},
     .fault = FaultCode::RobotCommand,
     .text = "50026",
     .event = 50026,
     .goes_on_at = State::GuideMoving,
     .guidance = true},
    {.name = "CollisionInScan",
     .faults = {"collision@scan+5"},
     .fault = FaultCode::EgmLost,
     .text = "50204",
     .event = 50204},
    {.name = "CollisionInWeld",
     .faults = {"collision@weld+3"},
     .fault = FaultCode::ProgramStopped,
     .text = "50204",
     .event = 50204,
     .seam_left_out = true},
};

TEST(RecoveryTable, NamesEveryCaseAndNoOther) {
  const std::string page = must(files::read_text_file(std::string(WELDCELL_CONFIG) + "/../docs/RECOVERY.md"));
  std::set<std::string> named, there;
  const std::regex name("`([A-Z][A-Za-z]+)`");
  for (std::istringstream lines(page); !lines.eof();) {
    std::string line;
    std::getline(lines, line);
    if (!line.starts_with("| ")) continue;
    line.erase(0, line.rfind('|', line.size() - 2));  // what shows it
    for (std::sregex_iterator m(line.begin(), line.end(), name), end; m != end; ++m) named.insert((*m)[1]);
  }
  for (const Case& c : kCases) there.insert(c.name);
  EXPECT_THAT(named, testing::ContainerEq(there));
}

INSTANTIATE_TEST_SUITE_P(Matrix, Recovery, testing::ValuesIn(kCases),
                         [](const auto& tested) { return tested.param.name; });

}  // namespace
}  // namespace weldcell::app
