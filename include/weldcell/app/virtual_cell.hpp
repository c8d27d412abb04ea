// A whole job in virtual time: the daemon's brain and EGM session against the simulated controller and laser,
// byte for byte, without sockets or sleeping. Deterministic for a seed. Single-threaded.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "weldcell/files/cell_file.hpp"
#include "weldcell/job/cell.hpp"
#include "weldcell/sim/controller.hpp"
#include "weldcell/sim/scene.hpp"

namespace weldcell::app {

struct VirtualJob {
  job::JobOrder order;
  workpiece::Workpiece workpiece;
  std::string resident_module;  ///< text of WeldcellEgm.mod
  double give_up_s = 1200;      ///< virtual time
  bool plc = false;             ///< a PLC is required, and there
};

struct VirtualOutcome {
  bool finished = false, accepted = false;
  std::string verdict, reason, cause;
  std::optional<Pose2> found;
  Pose2 truth;
  Vec2 centroid_error_mm = Vec2::Zero();  ///< found - truth at the template's centroid, Base axes
  double theta_error_rad = 0;
  std::vector<weld::WeldCertificate> certificates;
  std::vector<sim::WeldedSeam> welded;
  double scan_s = 0;  ///< virtual time of all passes
  double virtual_s = 0;
  int passes = 0, points = 0;
  std::shared_ptr<const job::Solution> solution;  ///< of the last localization; null when there was none
  std::vector<std::string> log;
};

/// The cell cycle by cycle, with its daemon to be killed and started again. The scene's faults come at their
/// time. The job arrives when the cell is made; nobody orders anything but the caller.
class VirtualCell {
 public:
  /// All three must outlive the cell.
  VirtualCell(const files::CellConfig& config, const sim::Scene& scene, const VirtualJob& job);
  ~VirtualCell();

  /// One cycle of the controller.
  void advance();
  double now_s() const;
  /// The job has ended, and how.
  bool finished() const;
  VirtualOutcome outcome() const;

  bool daemon_runs() const;
  /// Of the running daemon.
  const job::CellStatus& status() const;
  /// Orders as a person would; why it was refused, empty when it was obeyed.
  std::string order(wire::PlcCommand command);
  /// Confirms and starts as a job needs it in its present state; arms only when the job waits for its start.
  void act_as_person();
  /// From one moment to the next, as by power loss: what was durable stays. With `holding_mastership` in the
  /// moment of a write, so that the controller keeps the mastership for the dead session.
  void kill_daemon(bool holding_mastership = false);
  /// The job is found interrupted.
  void start_daemon();
  /// A daemon that gets no processor: it neither hears nor speaks, and knows nothing of it.
  void stall_daemon(bool stalled);
  void set_plc_heartbeat(bool up);

  sim::Controller& controller();
  /// Requests over Robot Web Services, by the controller's clock.
  const sim::RwsLoad& rws_load() const;
  /// When the cell was not armed, a dead daemon's time included; the last stretch may last still.
  std::vector<sim::MotionSpan> unarmed() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// Runs one job to its end, a person arming, starting and confirming at once.
VirtualOutcome run_virtual(const files::CellConfig& config, const sim::Scene& scene, const VirtualJob& job);

}  // namespace weldcell::app
