#include "weldcell/app/virtual_cell.hpp"

#include <algorithm>
#include <deque>

#include "weldcell/app/robot_runner.hpp"
#include "weldcell/base/units.hpp"
#include "weldcell/job/work_order.hpp"
#include "weldcell/robot/egm_session.hpp"
#include "weldcell/sim/laser.hpp"

namespace weldcell::app {

namespace {

/// The simulated controller's RWS without a socket.
class DirectTransport final : public ports::HttpTransport {
 public:
  explicit DirectTransport(sim::Controller& controller) : controller_(&controller) {}
  Result<ports::HttpReply> exchange(const ports::HttpRequest& request) override {
    return controller_->handle_rws(request);
  }

 private:
  sim::Controller* controller_;
};

class VirtualCell {
 public:
  VirtualCell(const files::CellConfig& config, const sim::Scene& scene, const VirtualJob& job)
      : scene_(scene),
        job_(job),
        setup_(std::make_shared<cell::CellSetup>(config.setup)),
        cell_(config.setup, config.laser_format, false),
        session_(config.setup),
        controller_(scene, config.setup.arm),
        laser_(scene),
        transport_(controller_),
        rws_(transport_,
             controller_.rws_generation() == 2 ? wire::RwsGeneration::Two : wire::RwsGeneration::One),
        runner_(rws_, config.rws_task, job.resident_module) {}

  VirtualOutcome run() {
    feed(job::LinkChange{job::Link::Laser, true, {}});
    feed(job::LinkChange{job::Link::Rws, true, {}});
    job::JobArrived arrived;
    arrived.id = job_.order.name;
    arrived.order = job_.order;
    feed(arrived);
    const auto cycle = static_cast<Nanoseconds>(scene_.controller.cycle_ms * 1e6);
    while (!outcome_.finished && seconds(now_.ns) < job_.give_up_s) {
      now_ = now_ + cycle;
      advance();
    }
    return summary();
  }

 private:
  void feed(job::InputBody body) { feed(now_, std::move(body)); }

  void feed(HostTime time, job::InputBody body) {
    job::Outputs outputs = cell_.step({time, std::move(body)});
    for (job::Output& output : outputs) dispatch(output);
  }

  void dispatch(job::Output& output) {
    if (const auto order = job::work_order(output, cell_, setup_)) {
      answers_.push_back(job::run(*order));
    } else if (std::holds_alternative<job::ImportRequest>(output)) {
      answers_.push_back(job::ImportDone{job_.workpiece});
    } else if (const auto* request = std::get_if<job::RobotRequest>(&output)) {
      requests_.push_back(*request);
    } else if (const auto* motion = std::get_if<job::StartMotion>(&output)) {
      plans_.push_back(motion->plan);
      session_.offer(plans_.back().get());
      outcome_.scan_s += motion->plan->duration_s();
    } else if (std::holds_alternative<job::StopMotion>(output)) {
      session_.request_stop();
    } else if (const auto* arm = std::get_if<job::SetArmed>(&output)) {
      session_.set_armed(arm->armed);
    } else if (const auto* finish = std::get_if<job::FinishJob>(&output)) {
      outcome_.finished = true;
      outcome_.accepted = finish->accepted;
      outcome_.verdict = finish->verdict;
      outcome_.reason = finish->reason;
    } else if (const auto* event = std::get_if<job::LogEvent>(&output)) {
      outcome_.log.push_back(event->text);
    }
  }

  void advance() {
    controller_.step(now_);
    if (const auto datagram = controller_.egm_datagram()) exchange_egm(*datagram);
    deliver_laser();
    while (!answers_.empty()) {
      job::InputBody body = std::move(answers_.front());
      answers_.pop_front();
      feed(std::move(body));
    }
    ++cycles_;
    if (cycles_ % 5 == 0) feed(job::Tick{});
    if (cycles_ % 12 == 0) serve_robot();
    if (cycles_ % 50 == 0) act_as_person();
  }

  void exchange_egm(const std::vector<std::byte>& datagram) {
    // The wire takes a little, each time a little differently, but the same at every run.
    jitter_ = jitter_ * 6364136223846793005ULL + 1442695040888963407ULL;
    const HostTime arrival = now_ + 150 * kMicrosecond + static_cast<Nanoseconds>((jitter_ >> 33) % 200'000);
    std::array<std::byte, wire::kEgmMaxBytes> reply{};
    const std::size_t size = session_.on_datagram(datagram, arrival, reply);
    const std::span<const std::byte> sent(reply.data(), size);
    if (size > 0) controller_.on_egm_datagram(sent);
    feed(arrival, job::EgmCycle{datagram, {sent.begin(), sent.end()}, session_.report()});
  }

  void deliver_laser() {
    const auto pose_at = [this](HostTime t) {
      return kinematics::forward(setup_->arm, controller_.joints_at(t));
    };
    for (sim::LaserBlock& block : laser_.advance(now_, pose_at)) wire_.push_back(std::move(block));
    while (!wire_.empty() && wire_.front().arrival <= now_) {
      if (cell_.wants_laser()) feed(wire_.front().arrival, job::LaserBytes{std::move(wire_.front().bytes)});
      wire_.pop_front();
    }
  }

  void serve_robot() {
    if (!runner_.busy() && !requests_.empty()) {
      runner_.begin(requests_.front(), now_);
      requests_.pop_front();
    }
    if (const auto reply = runner_.step(now_)) feed(*reply);
  }

  void act_as_person() {
    const auto order = [this](wire::PlcCommand command) { feed(job::OperatorCommand{command, "person"}); };
    switch (cell_.status().state) {
      case job::State::Ready:
        order(wire::PlcCommand::Arm);
        order(wire::PlcCommand::Start);
        break;
      case job::State::Placing:
        order(wire::PlcCommand::Confirm);
        break;
      case job::State::Faulted:
        order(wire::PlcCommand::Abort);
        break;
      default:
        break;
    }
  }

  VirtualOutcome summary() {
    outcome_.truth = scene_.truth;
    outcome_.virtual_s = seconds(now_.ns);
    outcome_.passes = cell_.status().pass;
    if (!outcome_.finished)
      outcome_.reason = "gave up in state " + std::string(job::to_string(cell_.status().state));
    if (const auto solution = cell_.solution()) {
      const Vec2& centroid = cell_.prepared()->outline.centroid;
      outcome_.solution = solution;
      outcome_.cause = solution->found.cause;
      outcome_.found = solution->found.pose;
      outcome_.centroid_error_mm = solution->found.pose * centroid - scene_.truth * centroid;
      outcome_.theta_error_rad = wrap_pi(solution->found.pose.theta_rad - scene_.truth.theta_rad);
      outcome_.certificates = solution->certificates;
      outcome_.points = solution->found.points;
    }
    if (!outcome_.accepted) {
      if (const auto events = rws_.event_log(5); events.ok()) {
        for (const auto& e : *events)
          outcome_.log.push_back("controller's log: " + std::to_string(e.code) + " " + e.title + ": " +
                                 e.description);
      }
    }
    outcome_.seam_error_mm = sim::seam_errors_mm(scene_, controller_.weld_traces());
    return outcome_;
  }

  const sim::Scene& scene_;
  const VirtualJob& job_;
  std::shared_ptr<const cell::CellSetup> setup_;
  job::Cell cell_;
  robot::EgmSession session_;
  sim::Controller controller_;
  sim::LaserDevice laser_;
  DirectTransport transport_;
  adapters::RwsClient rws_;
  RobotRunner runner_;

  HostTime now_;
  std::uint64_t cycles_ = 0, jitter_ = 1;
  std::deque<job::InputBody> answers_;
  std::deque<job::RobotRequest> requests_;
  std::deque<sim::LaserBlock> wire_;
  std::vector<std::shared_ptr<const plan::MotionPlan>> plans_;
  VirtualOutcome outcome_;
};

}  // namespace

VirtualOutcome run_virtual(const files::CellConfig& config, const sim::Scene& scene, const VirtualJob& job) {
  return VirtualCell(config, scene, job).run();
}

}  // namespace weldcell::app
