// Carries out the cell's robot requests over RWS, one at a time, without ever waiting inside: begin(), then
// step() until it answers. Owned by the rws thread; the virtual cell steps it in virtual time.
#pragma once

#include <optional>
#include <string>

#include "weldcell/adapters/rws_client.hpp"
#include "weldcell/app/controller_watch.hpp"
#include "weldcell/job/cell.hpp"

namespace weldcell::app {

class RobotRunner {
 public:
  /// `resident_module` is the text of WeldcellEgm.mod; it is loaded when the controller does not have it as
  /// it is. `view` is what a subscription tells: while it says that the program runs, the controller is asked
  /// once a second instead of at every step; without it, at every step.
  RobotRunner(adapters::RwsClient& rws, std::string task, std::string resident_module,
              const ControllerView* view = nullptr)
      : rws_(&rws), task_(std::move(task)), resident_(std::move(resident_module)), view_(view) {}

  /// Takes a request; one still under way is dropped without an answer (the cell has stopped waiting for it).
  void begin(const job::RobotRequest& request, HostTime now);
  /// One small piece of the request under way (a handful of HTTP exchanges at most); the answer when it is
  /// done.
  std::optional<job::RobotReply> step(HostTime now);
  bool busy() const { return phase_ != Phase::Idle; }

 private:
  enum class Phase { Idle, Halt, AwaitHalt, Act, AwaitEnd };
  job::RobotReply answer(const Status& status);
  bool worth_asking(HostTime now);
  std::optional<job::RobotReply> await_halt(HostTime now);
  std::optional<job::RobotReply> await_end(HostTime now);
  Status halt();
  Status act();
  Status make_ready();
  Status make_resident();
  Status run_routine(const std::string& module, const std::string& routine, const std::string& symbol_module,
                     const std::string& symbol, const std::string& literal);
  /// The controller's entries since the program began, the newest first, three at most.
  std::string latest_events();
  job::RobotReply query();

  adapters::RwsClient* rws_;
  std::string task_, resident_;
  const ControllerView* view_;
  job::RobotRequest request_;
  Phase phase_ = Phase::Idle;
  HostTime since_, next_poll_, asked_;
  bool resident_checked_ = false, was_running_ = false;
};

}  // namespace weldcell::app
