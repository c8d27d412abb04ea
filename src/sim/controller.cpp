#include "weldcell/sim/controller.hpp"

#include <algorithm>
#include <cmath>

#include "sim/controller_state.hpp"
#include "sim/rws_handler.hpp"
#include "sim/rws_observe.hpp"

namespace weldcell::sim {

using kinematics::Joints;

namespace {
constexpr std::size_t kMaxEvents = 1000;
constexpr int kStatementsPerCycle = 64;
constexpr double kBrakeTime_s = 0.15;
constexpr double kTraceStep_mm = 0.2;
constexpr double kMoving_rad = 1e-6;  // in a cycle: less is rest
constexpr double kPause_s = 0.1;      // a shorter rest does not end a motion
}  // namespace

const char* to_string(PanelState state) {
  switch (state) {
    case PanelState::MotorsOff:
      return "motoroff";
    case PanelState::MotorsOn:
      return "motoron";
    case PanelState::GuardStop:
      return "guardstop";
    case PanelState::EmergencyStop:
      return "emergencystop";
    case PanelState::EmergencyStopReset:
      return "emergencystopreset";
  }
  return "sysfail";
}

namespace {

int generation_of(const Scene& scene) {
  if (scene.controller.rws_generation != 0) return scene.controller.rws_generation;
  return scene.cell.rws_generation == files::RwsGenerationChoice::Two ? 2 : 1;
}

EgmShape shape_of(const Scene& scene) {
  const ControllerTruth& truth = scene.controller;
  const int usual = generation_of(scene) == 2 ? 716 : 610;
  return {truth.robotware != 0 ? truth.robotware : usual, truth.external_axes, truth.egm_seqno_restarts};
}

}  // namespace

ControllerState::ControllerState(const Scene& scene, const kinematics::ArmModel& arm_model)
    : truth(scene.controller),
      arm(arm_model),
      cycle_s(scene.controller.cycle_ms * 1e-3),
      task(memory, *this),
      egm(arm_model, scene.controller.position_gain, scene.controller.low_pass_hz, cycle_s, shape_of(scene)),
      path(arm_model, cycle_s),
      servo(cycle_s, scene.controller.dead_time_ms * 1e-3, scene.cell.setup.home),
      reference(scene.cell.setup.home) {
  path.reset(reference);
  generation = generation_of(scene);
  configuration = default_configuration(scene.cell.egm.host, scene.cell.egm.port);
  for (int i = 1; i <= 120; ++i) {
    const std::string number = std::to_string(i);
    idle_signals["doSpare" + std::string(3 - number.size(), '0') + number] = 0;
  }
  memory.set_machine_function([this](const std::string& name, const std::vector<rapid::Value>& arguments) {
    return machine_function(name, arguments);
  });
  for (const char* signal : {"doArcOn", "doGasOn", "doWireFeed", "doJobDone"}) {
    memory.define(signal, "signaldo", rapid::Value::of(0.0), rapid::Storage::Variable);
  }
  for (const char* signal : {"diArcEstablished", "diGateClosed"}) {
    memory.define(signal, "signaldi", rapid::Value::of(0.0), rapid::Storage::Variable);
  }
  log(1, 10010, "Motors OFF state");
  for (const std::string& module : truth.modules) {
    if (auto loaded = memory.load(module, true); !loaded)
      log(3, 40025, "Module not loaded", loaded.error().text());
  }
}

std::int64_t ControllerState::device_us(HostTime t) const {
  const double host_s = seconds(t.ns);
  return std::llround((truth.clock.offset_s + host_s * (1 + truth.clock.drift_ppm * 1e-6)) * 1e6);
}

void ControllerState::log(int type, int code, const std::string& title, const std::string& text) {
  Event event;
  event.number = ++event_number;
  event.type = type;
  event.code = code;
  event.at = now;
  event.title = title;
  event.text = text;
  if (events.size() >= kMaxEvents) events.erase(events.begin());
  events.push_back(std::move(event));
}

void ControllerState::set_panel(PanelState next) {
  if (next == panel) return;
  panel = next;
  switch (next) {
    case PanelState::MotorsOn:
      log(1, 10011, "Motors ON state");
      break;
    case PanelState::MotorsOff:
      log(1, 10010, "Motors OFF state");
      break;
    case PanelState::GuardStop:
      log(2, 10012, "Safety guard stop state");
      break;
    case PanelState::EmergencyStop:
      log(3, 10013, "Emergency stop state");
      break;
    case PanelState::EmergencyStopReset:
      log(1, 10014, "Emergency stop reset");
      break;
  }
  if (next != PanelState::MotorsOn) {
    stop_program("motors off");
    start_ramp(kBrakeTime_s);
  }
}

void ControllerState::start_ramp(double duration_s) {
  bool moving = false;
  for (const double v : reference_speed) moving = moving || std::abs(v) > 1e-9;
  if (drive == Drive::Path && !moving) return;
  drive = Drive::Ramp;
  ramp_speed = reference_speed;
  ramp_left_s = ramp_total_s = moving ? std::max(duration_s, cycle_s) : cycle_s;
}

std::vector<std::pair<std::string, double>> ControllerState::signals() {
  std::vector<std::pair<std::string, double>> out;
  for (const char* name :
       {"doArcOn", "doGasOn", "doWireFeed", "doJobDone", "diArcEstablished", "diGateClosed"}) {
    out.emplace_back(name, memory.symbol("", rapid::lower(name))->value.number);
  }
  out.insert(out.end(), idle_signals.begin(), idle_signals.end());
  return out;
}

void ControllerState::set_signal(const std::string& name, double value) {
  if (const auto idle = idle_signals.find(name); idle != idle_signals.end()) {
    idle->second = value;
  } else {
    memory.symbol("", rapid::lower(name))->value.number = value;
  }
}

bool ControllerState::start_program(bool forever) {
  if (!task.start(forever)) return false;
  log(1, 10156, "Program started");
  if (egm_interrupted) {
    // Program stop left the channel CONNECTED; a restart makes it RUNNING again from where the arm stands.
    egm_interrupted = false;
    if (egm.run(egm_run, reference)) drive = Drive::Egm;
  }
  return true;
}

void ControllerState::stop_program(const std::string& why) {
  if (!task.running()) return;
  task.stop();
  arc_on = false;
  log(1, 10125, "Program stopped", why);
  if (egm.state() == EgmState::Running) {
    egm_interrupted = egm.guiding();
    egm.end();
    start_ramp(egm_run.ramp_out_s);
  }
}

void ControllerState::on_program_event(int event, const std::string& what, bool error) {
  arc_on = false;
  ++programs_ended;
  log(error ? 3 : 1, event, error ? "Program stopped because of an error" : "Program stopped", what);
  if (egm.state() == EgmState::Running) {
    egm.end();
    start_ramp(egm_run.ramp_out_s);
  }
}

void ControllerState::move_reference() {
  const Joints before = reference;
  if (drive == Drive::Egm) {
    const EgmChannel::Outcome outcome = egm.step(reference, reference_speed);
    if (outcome == EgmChannel::Outcome::None) return;
    if (outcome == EgmChannel::Outcome::Converged) egm.end();
    if (outcome == EgmChannel::Outcome::TimedOut) {
      log(3, 41822, "No data from the UdpUc device", "EGM guidance ended after the communication time-out");
      egm_timed_out = true;
      if (!egm_wait) {
        stop_program("EGM communication time-out without a waiting instruction");
        ++programs_ended;
      }
    }
    if (outcome == EgmChannel::Outcome::OutOfRange) {
      log(3, 50027, "Joint Out of Range", "EGM reference leads out of a joint's working range");
      stop_program("joint out of range");
    }
    start_ramp(egm_run.ramp_out_s);
    return;
  }
  if (drive == Drive::Ramp) {
    (void)egm.step(reference, reference_speed);
    ramp_left_s -= cycle_s;
    const double share = std::max(0.0, ramp_left_s / ramp_total_s);
    for (std::size_t i = 0; i < 6; ++i) {
      reference_speed[i] = ramp_speed[i] * share;
      reference[i] = std::clamp(reference[i] + reference_speed[i] * cycle_s, arm.lower[i], arm.upper[i]);
    }
    if (ramp_left_s <= 0) {
      drive = Drive::Path;
      path.reset(reference);
      reference_speed = {};
    }
    return;
  }
  if (egm.sending()) (void)egm.step(reference, reference_speed);
  path.step(speed_ratio, !task.running() || !motors_on());
  reference = path.reference();
  for (std::size_t i = 0; i < 6; ++i) reference_speed[i] = (reference[i] - before[i]) / cycle_s;
}

void ControllerState::record_weld() {
  if (!arc_on || welds.empty()) return;
  const Eigen::Vector3d tcp = (kinematics::forward(arm, servo.posture()).iso * arc_tool).translation();
  auto& trace = welds.back().tcp_mm;
  if (trace.empty() || (trace.back() - tcp).norm() >= kTraceStep_mm) trace.push_back(tcp);
}

void ControllerState::record_motion(const Joints& before) {
  double most = 0;
  for (std::size_t i = 0; i < 6; ++i) most = std::max(most, std::abs(servo.posture()[i] - before[i]));
  if (most <= kMoving_rad) return;
  const double end_s = seconds(now.ns), begin_s = end_s - cycle_s;
  if (motions.empty() || begin_s > motions.back().end_s + kPause_s) motions.push_back({begin_s, end_s});
  motions.back().end_s = end_s;
}

std::vector<std::byte> ControllerState::egm_frame() {
  EgmFrame frame;
  // The posture was read out one cycle before the message leaves.
  const HostTime measured_at = now - from_seconds(cycle_s);
  frame.tm_ms = static_cast<std::uint32_t>(device_us(now) / 1000);
  frame.measured = servo.posture_at(measured_at);
  frame.feedback_us = device_us(measured_at) + std::llround(truth.feedback_latency_ms * 1e3);
  frame.planned = reference;
  frame.planned_us = device_us(now) + std::llround(truth.dead_time_ms * 1e3 + cycle_s * 1e6);
  frame.motors_on = motors_on();
  frame.rapid_running = task.running();
  frame.rapid_unknown = rapid_state_unknown;
  return egm.frame(frame);
}

void ControllerState::step(HostTime t) {
  now = t;
  end_faults();
  move_pointer();
  if (task.running()) {
    run_time_s += cycle_s;
    task.run(kStatementsPerCycle);
  }
  move_reference();
  const Joints before = servo.posture();
  servo.step(now, reference);
  record_motion(before);
  record_weld();
  datagram.reset();
  if (egm.frame_due() && !fault_until_s.contains("egm_silence") && !restarting()) datagram = egm_frame();
  if (seconds(now.ns) >= complaint_after_s) {
    if (const std::string complaint = egm.take_complaint(); !complaint.empty()) {
      log(2, 41821, "Inbound UdpUc message invalid", complaint);
      complaint_after_s = seconds(now.ns) + 1;
    }
  }
}

Controller::Controller(const Scene& scene, const kinematics::ArmModel& arm)
    : state_(std::make_unique<ControllerState>(scene, arm)) {}
Controller::~Controller() = default;

void Controller::step(HostTime now) { state_->step(now); }

std::optional<std::vector<std::byte>> Controller::egm_datagram() {
  return std::exchange(state_->datagram, std::nullopt);
}

void Controller::on_egm_datagram(std::span<const std::byte> datagram) {
  if (!state_->fault_until_s.contains("egm_silence")) state_->egm.on_datagram(datagram);
}

ports::HttpReply Controller::handle_rws(const ports::HttpRequest& request, int session) {
  return RwsHandler(*state_, session).handle(request);
}

void Controller::end_rws_session(int session) {
  if (state_->rmmp.session == session) state_->rmmp = {};
  std::erase_if(state_->mastership, [session](const auto& held) { return held.second == session; });
}

const Joints& Controller::joints() const { return state_->servo.posture(); }
Joints Controller::joints_at(HostTime t) const { return state_->servo.posture_at(t); }
const std::vector<WeldTrace>& Controller::weld_traces() const { return state_->welds; }

Status Controller::load_module(const std::string& text) {
  if (auto loaded = state_->memory.load(text, true); !loaded) return loaded.error();
  return Done{};
}

std::optional<RwsObserved> Controller::observe_rws(const std::string& uri) {
  return rws_observed(*state_, uri);
}
int Controller::rws_generation() const { return state_->generation; }
bool Controller::arc_on() const { return state_->arc_on; }
const std::vector<MotionSpan>& Controller::motions() const { return state_->motions; }
bool Controller::rws_silent() const {
  return state_->restarting() || state_->fault_until_s.contains("rws_silence");
}
bool Controller::restarting() const { return state_->restarting(); }
std::uint64_t Controller::restarts() const { return state_->restarts; }

bool Controller::motors_on() const { return state_->motors_on(); }
bool Controller::program_running() const { return state_->task.running(); }
bool Controller::egm_guiding() const { return state_->egm.guiding(); }
std::uint64_t Controller::programs_ended() const { return state_->programs_ended; }
std::uint64_t Controller::malformed_egm_datagrams() const { return state_->egm.malformed(); }
const std::vector<Event>& Controller::events() const { return state_->events; }

}  // namespace weldcell::sim
