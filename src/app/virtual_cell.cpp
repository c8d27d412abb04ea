#include "weldcell/app/virtual_cell.hpp"

#include <algorithm>
#include <array>
#include <deque>

#include "weldcell/app/robot_runner.hpp"
#include "weldcell/base/units.hpp"
#include "weldcell/job/work_order.hpp"
#include "weldcell/robot/egm_session.hpp"
#include "weldcell/sim/fault_schedule.hpp"
#include "weldcell/sim/laser.hpp"
#include "weldcell/wire/rws_pace.hpp"

namespace weldcell::app {

namespace {

constexpr std::uint64_t kTickCycles = 5, kRobotCycles = 12, kPersonCycles = 50;
constexpr Nanoseconds kLook = kSecond;

/// The simulated controller's RWS without a socket. The thread that asks waits for its turn as the daemon's
/// does: what it does at once here takes its time until busy() ends. `session` is what the cookies name, and
/// lies on the disk.
class PacedTransport final : public ports::HttpTransport {
 public:
  PacedTransport(sim::Controller& controller, sim::RwsLoad& load, int& session)
      : controller_(&controller), load_(&load), session_(&session) {}
  Result<ports::HttpReply> exchange(const ports::HttpRequest& request) override {
    time_ = time_ + pace_.wait(time_);
    pace_.started(time_);
    if (controller_->rws_silent())
      return Error{"http.connection", request.path, "the connection was refused", "check the network"};
    if (!load_->admit(seconds(time_.ns))) {
      ports::HttpReply refused;
      refused.status = 503;
      return refused;
    }
    return controller_->handle_rws(request, *session_);
  }
  Status logout() {
    time_ = time_ + pace_.wait(time_);
    pace_.started(time_);
    if (controller_->rws_silent() || !load_->admit(seconds(time_.ns)))
      return Error{"http.connection", "/logout", "the connection was refused", "check the network"};
    controller_->end_rws_session((*session_)++);
    return Done{};
  }
  bool busy(HostTime now) const { return time_ > now; }
  /// What follows is asked from `now` on.
  void begin(HostTime now) { time_ = std::max(time_, now); }

 private:
  sim::Controller* controller_;
  sim::RwsLoad* load_;
  int* session_;
  wire::RwsPace pace_;
  HostTime time_;
};

/// What ends when the process ends.
struct Daemon {
  Daemon(const files::CellConfig& config, const VirtualJob& job, sim::Controller& controller,
         sim::RwsLoad& load, int& rws_session)
      : cell(config.setup, config.laser_format, job.plc),
        session(config.setup),
        transport(controller, load, rws_session),
        rws(transport,
            controller.rws_generation() == 2 ? wire::RwsGeneration::Two : wire::RwsGeneration::One),
        runner(rws, config.rws_task, job.resident_module) {
    job::CellMemory memory = cell.memory();
    memory.watches_latency = true;
    cell.recall(memory);
    if (rws_session == 0) {
      rws_session = 1;
    } else {
      rws.end_former_session_first([this] { return transport.logout(); });
    }
  }

  job::Cell cell;
  robot::EgmSession session;
  PacedTransport transport;
  adapters::RwsClient rws;
  RobotRunner runner;
  std::deque<job::InputBody> answers;
  std::deque<job::RobotRequest> requests;
  std::optional<job::RobotReply> reply;  ///< told once the thread has come to it
  std::vector<std::shared_ptr<const plan::MotionPlan>> plans;
};

}  // namespace

struct VirtualCell::State {
  State(const files::CellConfig& config_, const sim::Scene& scene_, const VirtualJob& job_)
      : config(config_),
        scene(scene_),
        job(job_),
        setup(std::make_shared<cell::CellSetup>(config_.setup)),
        controller(scene_, config_.setup.arm),
        laser(scene_),
        rws_load(scene_.controller.rws_requests_per_s),
        faults(scene_.faults) {}

  void begin(bool interrupted);
  void feed(job::InputBody body) { feed(now, std::move(body)); }
  void feed(HostTime time, job::InputBody body);
  void dispatch(job::Output& output);
  void advance();
  void exchange_egm(const std::vector<std::byte>& datagram);
  void deliver_laser();
  void serve_robot();
  void watch_links();
  void note_armed();
  bool served() const { return daemon && !stalled; }

  const files::CellConfig& config;
  const sim::Scene& scene;
  const VirtualJob& job;
  std::shared_ptr<const cell::CellSetup> setup;
  sim::Controller controller;
  sim::LaserDevice laser;
  sim::RwsLoad rws_load;
  sim::FaultSchedule faults;
  std::unique_ptr<Daemon> daemon;
  job::SaveState saved;  ///< what a disk would hold
  int rws_session = 0;   ///< as saved

  HostTime now, next_look;
  std::uint64_t cycles = 0, jitter = 1;
  bool stalled = false;
  bool laser_up = false, rws_up = false, plc_beats = false, was_armed = true;
  std::deque<sim::LaserBlock> wire;
  std::vector<sim::MotionSpan> unarmed;
  VirtualOutcome outcome;
};

void VirtualCell::State::begin(bool interrupted) {
  daemon = std::make_unique<Daemon>(config, job, controller, rws_load, rws_session);
  laser_up = laser.connected();
  rws_up = !controller.rws_silent();
  if (laser_up) feed(job::LinkChange{job::Link::Laser, true, {}});
  if (rws_up) feed(job::LinkChange{job::Link::Rws, true, {}});
  plc_beats = job.plc;
  if (plc_beats) feed(job::LinkChange{job::Link::Plc, true, {}});
  job::JobArrived arrived;
  arrived.id = job.order.name;
  arrived.order = job.order;
  arrived.interrupted = interrupted;
  if (interrupted) {
    arrived.seams_done = saved.seams_done;
    arrived.guidance_done = saved.guidance_done;
    arrived.weld_begun = saved.weld_begun;
  }
  feed(arrived);
}

void VirtualCell::State::feed(HostTime time, job::InputBody body) {
  job::Outputs outputs = daemon->cell.step({time, std::move(body)});
  for (job::Output& output : outputs) dispatch(output);
}

void VirtualCell::State::dispatch(job::Output& output) {
  if (const auto order = job::work_order(output, daemon->cell, setup)) {
    daemon->answers.push_back(job::run(*order));
  } else if (std::holds_alternative<job::ImportRequest>(output)) {
    daemon->answers.push_back(job::ImportDone{job.workpiece});
  } else if (const auto* request = std::get_if<job::RobotRequest>(&output)) {
    daemon->requests.push_back(*request);
  } else if (const auto* motion = std::get_if<job::StartMotion>(&output)) {
    daemon->plans.push_back(motion->plan);
    daemon->session.offer(motion->plan.get());
    outcome.scan_s += motion->plan->duration_s();
  } else if (std::holds_alternative<job::StopMotion>(output)) {
    daemon->session.request_stop();
  } else if (const auto* arm = std::get_if<job::SetArmed>(&output)) {
    daemon->session.set_armed(arm->armed);
  } else if (const auto* state = std::get_if<job::SaveState>(&output)) {
    saved = *state;
  } else if (const auto* finish = std::get_if<job::FinishJob>(&output)) {
    outcome.finished = true;
    outcome.accepted = finish->accepted;
    outcome.verdict = finish->verdict;
    outcome.reason = finish->reason;
  } else if (const auto* event = std::get_if<job::LogEvent>(&output)) {
    outcome.log.push_back(event->text);
  }
}

void VirtualCell::State::advance() {
  now = now + static_cast<Nanoseconds>(scene.controller.cycle_ms * 1e6);
  for (const sim::TimedFault& fault : faults.due(now, controller)) {
    if (!laser.inject(fault.kind, fault.duration_s)) controller.inject(fault.kind, fault.duration_s);
  }
  controller.step(now);
  if (const auto datagram = controller.egm_datagram(); datagram && served()) exchange_egm(*datagram);
  deliver_laser();
  ++cycles;
  if (served()) {
    watch_links();
    while (!daemon->answers.empty()) {
      job::InputBody body = std::move(daemon->answers.front());
      daemon->answers.pop_front();
      feed(std::move(body));
    }
    if (cycles % kTickCycles == 0) feed(job::Tick{});
    if (cycles % kRobotCycles == 0) serve_robot();
  }
  note_armed();
}

void VirtualCell::State::exchange_egm(const std::vector<std::byte>& datagram) {
  // The wire takes a little, each time a little differently, but the same at every run.
  jitter = jitter * 6364136223846793005ULL + 1442695040888963407ULL;
  const HostTime arrival = now + 150 * kMicrosecond + static_cast<Nanoseconds>((jitter >> 33) % 200'000);
  std::array<std::byte, wire::kEgmMaxBytes> reply{};
  const std::size_t size = daemon->session.on_datagram(datagram, arrival, reply);
  const std::span<const std::byte> sent(reply.data(), size);
  if (size > 0) controller.on_egm_datagram(sent);
  feed(arrival, job::EgmCycle{datagram, {sent.begin(), sent.end()}, daemon->session.report()});
}

void VirtualCell::State::deliver_laser() {
  const auto pose_at = [this](HostTime t) {
    return kinematics::forward(setup->arm, controller.joints_at(t));
  };
  for (sim::LaserBlock& block : laser.advance(now, pose_at)) wire.push_back(std::move(block));
  while (!wire.empty() && wire.front().arrival <= now) {
    if (served() && daemon->cell.wants_laser())
      feed(wire.front().arrival, job::LaserBytes{std::move(wire.front().bytes)});
    wire.pop_front();
  }
}

void VirtualCell::State::serve_robot() {
  RobotRunner& runner = daemon->runner;
  auto& requests = daemon->requests;
  if (daemon->transport.busy(now)) return;
  daemon->transport.begin(now);
  if (const auto reply = std::exchange(daemon->reply, std::nullopt)) feed(*reply);
  // As the daemon's own thread has it: a stop never waits behind a move, a move does behind a stop.
  if (!requests.empty() && (!runner.busy() || requests.front().task == job::RobotTask::Stop)) {
    runner.begin(requests.front(), now);
    requests.pop_front();
  }
  daemon->reply = runner.step(now);
}

void VirtualCell::State::watch_links() {
  if (laser.connected() != laser_up) {
    laser_up = !laser_up;
    feed(job::LinkChange{job::Link::Laser, laser_up, laser_up ? "" : "closed by the sensor"});
  }
  if (now < next_look || daemon->transport.busy(now)) return;
  next_look = now + kLook;
  daemon->transport.begin(now);
  const auto state = daemon->rws.controller_state();
  if (state.ok() == rws_up) return;
  rws_up = !rws_up;
  feed(job::LinkChange{job::Link::Rws, rws_up, rws_up ? "" : state.error().text()});
}

void VirtualCell::State::note_armed() {
  const bool armed = daemon && daemon->cell.status().armed;
  if (!armed && was_armed) unarmed.push_back({seconds(now.ns), 0});
  if (!armed) unarmed.back().end_s = seconds(now.ns);
  was_armed = armed;
}

VirtualCell::VirtualCell(const files::CellConfig& config, const sim::Scene& scene, const VirtualJob& job)
    : state_(std::make_unique<State>(config, scene, job)) {
  state_->begin(false);
}
VirtualCell::~VirtualCell() = default;

void VirtualCell::advance() { state_->advance(); }
double VirtualCell::now_s() const { return seconds(state_->now.ns); }
bool VirtualCell::finished() const { return state_->outcome.finished; }
bool VirtualCell::daemon_runs() const { return state_->daemon != nullptr; }
const job::CellStatus& VirtualCell::status() const { return state_->daemon->cell.status(); }
const sim::RwsLoad& VirtualCell::rws_load() const { return state_->rws_load; }
sim::Controller& VirtualCell::controller() { return state_->controller; }
std::vector<sim::MotionSpan> VirtualCell::unarmed() const { return state_->unarmed; }

std::string VirtualCell::order(wire::PlcCommand command) {
  state_->feed(job::OperatorCommand{command, "person"});
  const std::string refusal = state_->daemon->cell.refusal();
  state_->note_armed();
  return refusal;
}

void VirtualCell::act_as_person() {
  if (status().state == job::State::Ready) {
    order(wire::PlcCommand::Arm);
    order(wire::PlcCommand::Start);
  } else if (status().state == job::State::Placing) {
    order(wire::PlcCommand::Confirm);
  }
}

void VirtualCell::kill_daemon(bool holding_mastership) {
  if (holding_mastership)
    static_cast<void>(state_->daemon->rws.request_mastership(wire::MastershipDomain::Rapid));
  state_->daemon.reset();
  state_->note_armed();
}

void VirtualCell::stall_daemon(bool stalled) { state_->stalled = stalled; }

void VirtualCell::start_daemon() { state_->begin(true); }

void VirtualCell::set_plc_heartbeat(bool up) {
  if (up == state_->plc_beats) return;
  state_->plc_beats = up;
  state_->feed(job::LinkChange{job::Link::Plc, up, up ? "" : "heartbeat stands still"});
}

VirtualOutcome VirtualCell::outcome() const {
  State& s = *state_;
  VirtualOutcome out = s.outcome;
  out.truth = s.scene.truth;
  out.virtual_s = now_s();
  out.welded = sim::welded_seams(s.scene, s.controller.weld_traces());
  if (!s.daemon) return out;
  const job::Cell& cell = s.daemon->cell;
  out.passes = cell.status().pass;
  if (!out.finished) out.reason = "gave up in state " + std::string(job::to_string(cell.status().state));
  if (const auto solution = cell.solution()) {
    const Vec2& centroid = cell.prepared()->outline.centroid;
    out.solution = solution;
    out.cause = solution->found.cause;
    out.found = solution->found.pose;
    out.centroid_error_mm = solution->found.pose * centroid - s.scene.truth * centroid;
    out.theta_error_rad = wrap_pi(solution->found.pose.theta_rad - s.scene.truth.theta_rad);
    out.certificates = solution->certificates;
    out.points = solution->found.points;
  }
  if (!out.accepted) {
    if (const auto events = s.daemon->rws.event_log(5); events.ok()) {
      for (const auto& e : *events)
        out.log.push_back("controller's log: " + std::to_string(e.code) + " " + e.title + ": " +
                          e.description);
    }
  }
  return out;
}

VirtualOutcome run_virtual(const files::CellConfig& config, const sim::Scene& scene, const VirtualJob& job) {
  VirtualCell cell(config, scene, job);
  for (std::uint64_t cycle = 1; !cell.finished() && cell.now_s() < job.give_up_s; ++cycle) {
    cell.advance();
    if (cycle % kPersonCycles != 0 || cell.finished()) continue;
    cell.act_as_person();
    if (cell.status().state == job::State::Faulted) cell.order(wire::PlcCommand::Abort);
  }
  return cell.outcome();
}

}  // namespace weldcell::app
