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

#include "recovery_cases.hpp"
#include "weldcell/app/virtual_cell.hpp"
#include "weldcell/base/units.hpp"
#include "weldcell/files/document.hpp"
#include "weldcell/files/job_file.hpp"
#include "weldcell/weld/resident.hpp"

namespace weldcell::app {
namespace {

using testing::HasSubstr;
using wire::PlcCommand;

constexpr std::uint64_t kSeed = 21;
constexpr double kSettle_s = 3;     // within which whatever moved must rest
constexpr double kStand_s = 8;      // for which the cell must stay where it is, by itself
constexpr double kSeamEnds_s = 15;  // within which a seam under way ends and the torch is away
constexpr double kGiveUp_s = 900;

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
