// The only brain: Cell::step(Input) -> Outputs. Holds the job at hand, its state and its evidence; no thread,
// clock or I/O. Pure; the cell thread steps it, replay and trials do the same.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "weldcell/base/time.hpp"
#include "weldcell/job/state_table.hpp"
#include "weldcell/job/work.hpp"
#include "weldcell/robot/egm_session.hpp"
#include "weldcell/wire/egm.hpp"
#include "weldcell/wire/laser_dialects.hpp"
#include "weldcell/wire/plc_map.hpp"

namespace weldcell::job {

enum class Link : std::uint8_t { Laser, Rws, Plc };
inline constexpr std::size_t kLinks = 3;
const char* to_string(Link);

/// Fault numbers as the PLC reads them (docs/PLC.md).
enum class FaultCode : std::uint16_t {
  None = 0,
  EgmLost = 10,
  EgmNotStarted = 11,
  MotionRefused = 12,
  RobotStopped = 13,
  LaserLost = 20,
  LaserOverrun = 21,
  RobotCommand = 30,
  ProgramStopped = 31,
  PlcLost = 40,
  StoppedByPerson = 50,
  Held = 51,
  StateNotSaved = 60
};
const char* to_string(FaultCode);

// ---- inputs, one at a time, in the order of their arrival ----

struct Tick {};
/// One EGM cycle as the real-time thread did it: the datagram, our reply, and the session's report.
struct EgmCycle {
  std::vector<std::byte> datagram, reply;
  robot::EgmReport report;
};
/// As received at once: a piece of the stream, or one datagram.
struct LaserBytes {
  std::vector<std::byte> bytes;
};
struct LinkChange {
  Link link = Link::Laser;
  bool up = false;
  std::string detail;
};
struct PlcInput {
  wire::PlcOrder order;
};
struct OperatorCommand {
  wire::PlcCommand command = wire::PlcCommand::None;
  std::string who;  ///< "plc", "cli"
};
/// A job taken from the spool. `resume_from` is set for one found interrupted at start.
struct JobArrived {
  std::string id;  ///< the spool folder's name
  JobOrder order;
  int number = 0;
  bool interrupted = false;
  int seams_done = 0;  ///< of an interrupted job
  bool guidance_done = false;
  bool weld_begun = false;  ///< its weld program had been started: ask the controller how far it came
};
struct ImportDone {
  Result<workpiece::Workpiece> workpiece;
};
struct PlanDone {
  Result<std::shared_ptr<const Prepared>> prepared;
};
struct PassPlanned {
  Result<std::shared_ptr<const NextPass>> pass;
};
struct SolveDone {
  std::shared_ptr<const Solution> solution;
};
/// Answer to a RobotRequest of the same id.
struct RobotReply {
  std::uint64_t id = 0;
  bool ok = false;
  std::string text;  ///< cause and mend when not ok; else, of Stop and Query, the controller's latest events
  bool running = false;   ///< of Query: RAPID executes; of Stop: it did when the stop came
  int seams_done = 0;     ///< of Query: their arc is out
  int seams_begun = 0;    ///< of Query: their arc was about to start
  int seams_allowed = 0;  ///< of Query: how many the daemon has let begin
};
/// A state could not be made durable. What that step would have set in motion was kept back.
struct StorageLost {
  std::string text;  ///< cause and mend
};
/// Raw data were lost before they reached the cell (a ring was full).
struct Overrun {
  Link link = Link::Laser;
  std::uint64_t lost = 0;
};

using InputBody =
    std::variant<Tick, EgmCycle, LaserBytes, LinkChange, PlcInput, OperatorCommand, JobArrived, ImportDone,
                 PlanDone, PassPlanned, SolveDone, RobotReply, Overrun, StorageLost>;
struct Input {
  HostTime time;
  InputBody body;
};

// ---- outputs ----

enum class RobotTask : std::uint8_t { Move, OpenScan, Stop, Upload, Weld, Query, Allow };
const char* to_string(RobotTask);
struct RobotRequest {
  std::uint64_t id = 0;
  RobotTask task = RobotTask::Query;
  kinematics::Joints joints{};  ///< Move, OpenScan: where RAPID moves first
  std::string module_text;      ///< Upload
  int skip_seams = 0;           ///< Weld
  int allowed_seams = 0;        ///< Allow: so many seams may have begun
  bool own_only = false;        ///< Stop: nothing but weldcell's own modules
};
struct ImportRequest {};
struct PlanRequest {};
struct PassRequest {};
struct SolveRequest {
  std::shared_ptr<const ScanRecord> scan;
};
struct StartMotion {
  std::shared_ptr<const plan::MotionPlan> plan;
};
struct StopMotion {};
struct SetArmed {
  bool armed = false;
};
struct ShowDrawing {
  std::shared_ptr<const guidance::Drawing> drawing;  ///< null: dark
  int step = 0;                                      ///< 1-based
};
/// Must be durable before anything else of the same step takes effect.
struct SaveState {
  State state = State::Idle;
  int seams_done = 0;
  bool guidance_done = false;
  bool weld_begun = false;
};
/// The job was not begun and gives way to another: it waits in the spool again.
struct ReturnJob {};
/// The PLC's choice: only the job of this number may come next; 0 = any.
struct SelectJob {
  std::int32_t number = 0;
};
struct FinishJob {
  bool accepted = false;
  std::string verdict;  ///< weld | rescan | reject | failed | aborted
  std::string reason;
};
struct LogEvent {
  enum class Level : std::uint8_t { Info, Warning, Error } level = Level::Info;
  std::string text;
};

using Output =
    std::variant<RobotRequest, ImportRequest, PlanRequest, PassRequest, SolveRequest, StartMotion, StopMotion,
                 SetArmed, ShowDrawing, SaveState, ReturnJob, SelectJob, FinishJob, LogEvent>;
using Outputs = std::vector<Output>;

/// What can be asked of the cell at any time.
struct CellStatus {
  State state = State::Idle;
  bool armed = false;
  std::string job;
  int guide_step = 0, guide_steps = 0;
  FaultCode fault = FaultCode::None;
  std::string fault_text;
  double progress = 0;  ///< 0..1 of the scan or the seams
  int pass = 0;
  int seams_done = 0, seams = 0;
  std::array<bool, kLinks> links{};
  wire::PlcStatus plc;
};

/// What the cell carries from job to job. A record begins with it, so that replay starts from the same cell.
struct CellMemory {
  State state = State::Idle;
  bool armed = false;
  std::array<bool, kLinks> links{};
  std::uint64_t next_request = 1;
  std::uint16_t last_sequence = 0;
  bool sequence_known = false;
  std::int32_t selected_job = 0;
  /// The residual latency that localizations find, averaged over the last ten or so; false in records of
  /// before, which watched nothing.
  bool watches_latency = false;
  double latency_drift_ms = 0;
  int latency_jobs = 0;
};

/// Timeouts in which the world must answer. Virtual or real seconds.
struct CellTimeouts {
  double egm_gap_s = 0.4;  ///< below the controller's own time-out of 0.5 s
  double egm_open_s = 30;
  double query_s = 0.4;
  double stop_again_s = 1;  ///< a stop that did not arrive is sent again
  double laser_gap_s = 0.5;
  double offer_s = 0.25;  ///< a refusal seen earlier than this after the offer belongs to the plan before
  double settle_s = 0.1;  ///< rest after a scan, so that the last readings arrive
};

class Cell {
 public:
  Cell(const cell::CellSetup& setup, const wire::LaserFormat& laser, bool plc_required,
       CellTimeouts timeouts = {});

  Outputs step(const Input& input);

  const CellStatus& status() const { return status_; }
  /// Why the command of the last step was not obeyed; empty when it was, or when there was none.
  const std::string& refusal() const { return refusal_; }
  CellMemory memory() const;
  /// Before the first step only.
  void recall(const CellMemory& memory);
  /// True while laser bytes are wanted; else the caller may keep them to itself.
  bool wants_laser() const;
  /// Fits a new job: nothing under way, and no PLC that has yet to reset the last one.
  bool takes_jobs() const;

  const std::optional<JobInput>& job() const { return job_; }
  std::shared_ptr<const Prepared> prepared() const { return prepared_; }
  std::shared_ptr<const Solution> solution() const { return solution_; }
  std::shared_ptr<const NextPass> next_pass() const { return next_pass_; }

 private:
  void on(const Tick&);
  void on(const EgmCycle& cycle);
  void on(const LaserBytes& bytes);
  void on(const LinkChange& change);
  void on(const PlcInput& input);
  void on(const OperatorCommand& command);
  void on(const JobArrived& arrived);
  void on(const ImportDone& done);
  void on(const PlanDone& done);
  void on(const PassPlanned& done);
  void on(const SolveDone& done);
  void on(const RobotReply& reply);
  void on(const Overrun& overrun);
  void on(const StorageLost& lost);

  /// Takes the first row whose guard holds; false when there is none.
  bool fire(Event event);
  bool holds(Guard guard) const;
  void act(Action action);
  void fault(FaultCode code, const std::string& text);
  void finish_with(bool accepted, const std::string& verdict, const std::string& reason);
  /// Why a command was not obeyed, for the PLC and in words.
  struct Answer {
    wire::PlcResult result = wire::PlcResult::Done;
    std::string hindrance;
  };
  wire::PlcResult command(wire::PlcCommand command, std::int32_t job_number, const std::string& who);
  Answer obey(wire::PlcCommand command, std::int32_t job_number, const std::string& who);
  Answer start_or_resume(wire::PlcCommand command, std::int32_t job_number);
  Answer select(std::int32_t job_number);
  void select_job(std::int32_t job_number);
  /// The number that the PLC sees: -1 for a job without one.
  static std::int32_t shown_number(const JobOrder& order);
  void set_armed(bool armed);
  void request(RobotTask task);
  void begin_scan();
  void enter(State state);
  void watch_scan();
  /// After a localization: whether the laser's clock and its latency are what the cell file says.
  void watch_laser();
  double latency_limit_ms() const;
  bool latency_beyond() const;
  void save_state();
  void settle_seams(const RobotReply& reply);
  void weld_goes_on(const RobotReply& reply);
  void settle_stop(const RobotReply& reply);
  void chase_stop();
  void log(LogEvent::Level level, const std::string& text);
  void refresh_plc();
  Answer start_hindrance() const;
  const std::shared_ptr<const plan::MotionPlan>& scan_plan() const;

  cell::CellSetup setup_;
  bool plc_required_;
  CellTimeouts timeouts_;
  CellStatus status_;
  Outputs out_;
  HostTime now_;

  std::optional<JobInput> job_;
  std::string job_id_;
  std::shared_ptr<const Prepared> prepared_;
  std::shared_ptr<const NextPass> next_pass_;
  std::shared_ptr<const Solution> solution_;
  std::shared_ptr<ScanRecord> scan_;
  std::string failure_, refusal_;
  State resume_state_ = State::Idle;
  bool resuming_ = false;
  bool guidance_done_ = false;
  int guide_step_ = 0;

  wire::EgmCodec codec_;
  wire::LaserDecoder laser_decoder_;
  std::uint64_t next_request_ = 1, awaited_request_ = 0;
  std::uint64_t seams_request_ = 0;  ///< the query after a resume; other requests may follow it at once
  std::uint64_t stop_request_ = 0;   ///< the last stop, until it is answered
  bool stop_owed_ = false;           ///< RAPID was to be stopped, and nobody has said that it is
  bool stop_own_only_ = false;       ///< that stop spares programs that are not weldcell's
  RobotTask awaited_task_ = RobotTask::Query;
  bool program_started_ = false;
  bool weld_begun_ = false;   ///< a weld program of this job was started, perhaps by an earlier process
  bool seams_known_ = true;   ///< false: how far that program came must be asked before the next arc
  int interrupted_seam_ = 0;  ///< left out, to be finished by hand; 0 = none
  int running_frames_ = 0;
  HostTime state_since_, last_egm_, last_laser_, last_query_, last_stop_, motion_done_at_;
  bool egm_seen_ = false, motion_started_ = false, motion_finished_ = false;
  std::uint16_t last_sequence_ = 0;
  bool sequence_known_ = false;
  std::int32_t selected_job_ = 0;  ///< by the PLC; 0 = the spool's order
  bool cleared_ = false;           ///< a person has acknowledged the fault or the interruption
  bool watches_latency_ = false, latency_drifted_ = false;
  double latency_drift_ms_ = 0;
  std::string laser_trouble_;  ///< why the laser is not connected; "" while it is, or was never tried
  int latency_jobs_ = 0;
};

}  // namespace weldcell::job
