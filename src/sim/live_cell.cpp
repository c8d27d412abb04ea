#include "sim/live_cell.hpp"

#include <time.h>

#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "sim/laser_push_server.hpp"

namespace weldcell::sim {

namespace {

HostTime monotonic() {
  timespec t{};
  ::clock_gettime(CLOCK_MONOTONIC, &t);
  return {t.tv_sec * kSecond + t.tv_nsec};
}

void sleep_until(HostTime t) {
  timespec at{t.ns / kSecond, t.ns % kSecond};
  ::clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &at, nullptr);
}

}  // namespace

namespace {

RwsServerOptions rws_options(const Scene& scene, const LiveOptions& options) {
  RwsServerOptions out;
  out.endpoint = scene.cell.rws;
  out.user = scene.controller.user;
  out.password = scene.controller.password;
  out.seed = scene.seed;
  out.requests_per_s = scene.controller.rws_requests_per_s;
  if (!options.certificate_file.empty()) {
    auto kept = TlsIdentity::keep(options.certificate_file);
    if (!kept.ok()) throw std::runtime_error(kept.error().text());
    out.identity = std::move(*kept);
  }
  return out;
}

std::unique_ptr<LaserOutlet> laser_outlet(const files::CellConfig& cell) {
  if (cell.laser_format.dialect == wire::LaserDialect::Od5000) return std::make_unique<LaserPushServer>(cell);
  return std::make_unique<LaserServer>(cell);
}

}  // namespace

LiveCell::LiveCell(Scene scene, LiveOptions options)
    : scene_(std::move(scene)),
      options_(std::move(options)),
      controller_(scene_, scene_.cell.setup.arm),
      laser_(scene_),
      egm_(scene_.cell.egm),
      laser_outlet_(laser_outlet(scene_.cell)),
      rws_(rws_options(scene_, options_), controller_, lock_),
      faults_(scene_.faults),
      fault_input_(options_.fault_fd) {
  if (options_.plc) {
    plc_ = std::make_unique<PlcLink>(scene_.cell.modbus, scene_.cell.word_order,
                                     PlcWorker(scene_.plc_confirm_after_s, options_.plc_rearm));
  }
}

std::string LiveCell::ports_json() const {
  const nlohmann::ordered_json out{{"egm", scene_.cell.egm.port},
                                   {"rws", rws_.port()},
                                   {"laser", laser_outlet_->port()},
                                   {"laser_commands", laser_outlet_->command_port()},
                                   {"modbus", scene_.cell.modbus.port},
                                   {"rws_generation", controller_.rws_generation()},
                                   {"rws_certificate_sha256", rws_.fingerprint()}};
  return out.dump();
}

void LiveCell::write_truth() {
  const RwsLoad load = rws_.load();
  std::string text;
  {
    const std::lock_guard<std::mutex> hold(lock_);
    // By CLOCK_MONOTONIC, so that other programs of this machine can place them.
    std::vector<MotionSpan> motions = controller_.motions();
    for (MotionSpan& motion : motions) {
      motion.begin_s += seconds(start_.ns);
      motion.end_s += seconds(start_.ns);
    }
    text = truth_json(scene_, controller_.weld_traces(), motions, &load);
  }
  const std::string fresh = options_.truth_file + ".new";
  std::ofstream file(fresh, std::ios::binary);
  file << text << '\n';
  file.close();
  if (!file || std::rename(fresh.c_str(), options_.truth_file.c_str()) != 0) {
    std::fprintf(stderr, "weldcell-sim: cannot write %s\n", options_.truth_file.c_str());
  }
}

void LiveCell::start_faults(HostTime now) {
  for (const TimedFault& fault : fault_input_.take()) faults_.add(fault, now);
  for (const TimedFault& fault : faults_.due(now, controller_)) {
    std::fprintf(stderr, "weldcell-sim: fault %s for %g s\n", fault.kind.c_str(), fault.duration_s);
    if (!laser_.inject(fault.kind, fault.duration_s)) controller_.inject(fault.kind, fault.duration_s);
  }
}

void LiveCell::cycle(HostTime now) {
  const std::lock_guard<std::mutex> hold(lock_);
  while (const auto datagram = egm_.receive()) controller_.on_egm_datagram(*datagram);
  start_faults(now);
  controller_.step(now);
  if (const auto datagram = controller_.egm_datagram()) egm_.send(*datagram);
  programs_ended_ = controller_.programs_ended();
  // The arm's next postures are decided already (dead time), so a block is known before it is due on the
  // wire.
  const double ahead_ms = std::min(scene_.controller.cycle_ms, scene_.controller.dead_time_ms / 2);
  const auto pose_at = [this](HostTime t) {
    return kinematics::forward(scene_.cell.setup.arm, controller_.joints_at(t));
  };
  for (LaserBlock& block : laser_.advance(now + from_seconds(ahead_ms * 1e-3), pose_at)) {
    blocks_.push_back(std::move(block));
  }
}

void LiveCell::run(const std::atomic<bool>& stop) {
  start_ = monotonic();
  write_truth();
  const Nanoseconds cycle_ns = from_seconds(scene_.controller.cycle_ms * 1e-3);
  HostTime next{cycle_ns};
  while (!stop) {
    const bool block_first = !blocks_.empty() && blocks_.front().arrival < next;
    sleep_until(start_ + (block_first ? blocks_.front().arrival : next).ns);
    const HostTime now{monotonic() - start_};
    if (now >= next) {
      cycle(next);
      next = next + cycle_ns;
      if (laser_.connected()) {
        laser_outlet_->serve();
      } else {
        laser_outlet_->drop_clients();
      }
    }
    laser_outlet_->send_due(blocks_, now);
    if (programs_ended_ != programs_seen_) {
      programs_seen_ = programs_ended_;
      write_truth();
    }
  }
  plc_.reset();
  write_truth();
}

}  // namespace weldcell::sim
