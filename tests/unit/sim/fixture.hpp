// A small cell for the simulator's tests: the IRB 2600 by its lengths, no file needed.
#pragma once

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>

#include "weldcell/base/units.hpp"
#include "weldcell/sim/controller.hpp"
#include "weldcell/sim/laser.hpp"

namespace weldcell::sim {

inline kinematics::ArmModel test_arm() {
  kinematics::ArmModel arm;
  arm.name = "irb2600_12_185";
  arm.a1 = 150;
  arm.a2 = -115;
  arm.c1 = 445;
  arm.c2 = 900;
  arm.c3 = 795;
  arm.c4 = 85;
  arm.offset = {0, 0, rad(-90), 0, 0, 0};
  const double lower[6] = {-180, -95, -180, -400, -120, -400}, upper[6] = {180, 155, 75, 400, 120, 400};
  const double speed[6] = {175, 175, 175, 360, 360, 500};
  for (std::size_t i = 0; i < 6; ++i) {
    arm.lower[i] = rad(lower[i]);
    arm.upper[i] = rad(upper[i]);
    arm.max_speed[i] = rad(speed[i]);
  }
  return arm;
}

/// One bar of 40 x 400 mm, 40 high, on the table at z = 500, and a laser that looks straight down when the
/// flange does.
inline Scene test_scene() {
  Scene scene;
  scene.name = "bar";
  scene.seed = 7;
  scene.cell.setup.arm = test_arm();
  scene.cell.setup.home = {0, 0, 0, 0, rad(90), 0};
  scene.cell.setup.table.z_mm = 500;
  workpiece::Member bar;
  bar.name = "bar";
  bar.outline = {{0, 0}, {400, 0}, {400, 40}, {0, 40}};
  scene.workpiece.name = "bar";
  scene.workpiece.height_mm = 40;
  scene.workpiece.members = {bar};
  scene.members.resize(1);
  scene.planned = scene.truth = {800, 0, 0};
  return scene;
}

/// A controller stepped at its cycle, with RWS at hand.
class Bench {
 public:
  explicit Bench(Scene scene = test_scene())
      : scene_(std::move(scene)), controller(scene_, scene_.cell.setup.arm) {}

  void step(int cycles = 1) {
    for (int i = 0; i < cycles; ++i) {
      now_ = now_ + 4 * kMillisecond;
      controller.step(now_);
    }
  }
  ports::HttpReply rws(const std::string& method, const std::string& path, const std::string& body = "",
                       int session = 1) {
    ports::HttpRequest request;
    request.method = method;
    request.path = path;
    request.body = body;
    return controller.handle_rws(request, session);
  }
  HostTime now() const { return now_; }

  /// Uploads, loads, points PP at the routine and starts it, as a client would.
  void run_program(const std::string& text, const std::string& module, const std::string& routine) {
    EXPECT_EQ(rws("POST", "/rw/panel/ctrlstate?action=setctrlstate", "ctrl-state=motoron").status, 204);
    EXPECT_LE(rws("PUT", "/fileservice/$home/test.mod", text).status, 201);
    EXPECT_EQ(rws("POST", "/rw/mastership/rapid?action=request").status, 204);
    const auto loaded =
        rws("POST", "/rw/rapid/tasks/T_ROB1?action=loadmod", "modulepath=$HOME/test.mod&replace=true");
    EXPECT_EQ(loaded.status, 204) << loaded.body;
    const auto pointed = rws("POST", "/rw/rapid/tasks/T_ROB1/pcp?action=set-pp-routine",
                             "module=" + module + "&routine=" + routine);
    EXPECT_EQ(pointed.status, 204) << pointed.body;
    const auto started = rws("POST", "/rw/rapid/execution?action=start", kStart);
    EXPECT_EQ(started.status, 204) << started.body;
  }
  /// Steps until the program stopped; false when it still runs after the given time.
  bool finish(double seconds_at_most) {
    for (double t = 0; t < seconds_at_most; t += 0.004) {
      step();
      if (!controller.program_running()) return true;
    }
    return false;
  }
  std::string value(const std::string& module, const std::string& name) {
    const std::string body =
        rws("GET", "/rw/rapid/symbol/data/RAPID/T_ROB1/" + module + "/" + name + "?json=1").body;
    const std::size_t at = body.find("\"value\":\"");
    if (at == std::string::npos) return body;
    return body.substr(at + 9, body.rfind('"') - at - 9);
  }
  std::string last_events() const {
    std::string out;
    for (const Event& event : controller.events())
      out += std::to_string(event.code) + " " + event.title + ": " + event.text + "\n";
    return out;
  }

  static constexpr const char* kStart =
      "regain=continue&execmode=continue&cycle=once&condition=none&stopatbp=disabled&alltaskbytsp=false";

 private:
  Scene scene_;
  HostTime now_;

 public:
  Controller controller;
};

inline constexpr const char* kHal = "application/hal+json;v=2.0";
inline constexpr const char* kXhtml = "application/xhtml+xml;v=2.0";
inline constexpr const char* kForm = "application/x-www-form-urlencoded;v=2.0";

inline Scene omnicore() {
  Scene scene = test_scene();
  scene.controller.rws_generation = 2;
  return scene;
}

/// The same controller as RWS 2.0 shows it.
struct Two : Bench {
  explicit Two(const Scene& scene = omnicore()) : Bench(scene) {}
  ports::HttpReply ask(const std::string& method, const std::string& path, const std::string& body = "",
                       int session = 1) {
    return controller.handle_rws(
        {method, path, body, method == "GET" ? "" : kForm, method == "GET" ? kHal : kXhtml}, session);
  }
  nlohmann::json json(const std::string& path) { return nlohmann::json::parse(ask("GET", path).body); }
};

}  // namespace weldcell::sim
