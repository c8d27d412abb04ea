// The daemon's side of RWS against the simulated controller over real sockets, in both generations: one
// interface, the pin, subscriptions that come back, and the pace.
#include "weldcell/app/controller_watch.hpp"

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <mutex>
#include <thread>

#include "sim/rws_server.hpp"
#include "weldcell/adapters/host_clock.hpp"
#include "weldcell/base/units.hpp"

namespace weldcell::app {
namespace {

using adapters::ControllerState;
using adapters::ExecutionState;
using adapters::MastershipDomain;
using adapters::OperationMode;
using wire::RwsGeneration;

constexpr const char* kModule =
    "MODULE T\n PERS num n:=1;\n PROC main()\n  WaitTime 60;\n ENDPROC\nENDMODULE\n";

sim::Scene scene_of(int generation) {
  sim::Scene scene;
  scene.cell.setup.arm.lower.fill(rad(-180));
  scene.cell.setup.arm.upper.fill(rad(180));
  scene.cell.setup.arm.max_speed.fill(rad(175));
  scene.controller.rws_generation = generation;
  return scene;
}

struct Site {
  explicit Site(int g) : generation(g), scene(scene_of(g)), controller(scene, scene.cell.setup.arm) {
    sim::RwsServerOptions options;
    options.endpoint = {"127.0.0.1", 0};
    server = std::make_unique<sim::RwsServer>(std::move(options), controller, lock);
  }
  adapters::RwsAccess access() const {
    adapters::RwsAccess out;
    out.port = server->port();
    out.generation = generation == 2 ? RwsGeneration::Two : RwsGeneration::One;
    out.certificate_sha256 = server->fingerprint();
    out.password = "robotics";
    return out;
  }
  void inject(const std::string& fault, double duration_s = 0) {
    const std::lock_guard<std::mutex> hold(lock);
    controller.inject(fault, duration_s);
  }
  void step(int cycles) {
    const std::lock_guard<std::mutex> hold(lock);
    for (int i = 0; i < cycles; ++i) controller.step(now = now + 4 * kMillisecond);
  }

  const int generation;
  sim::Scene scene;
  std::mutex lock;
  sim::Controller controller;
  HostTime now;
  std::unique_ptr<sim::RwsServer> server;
};

/// Steps the watch until the condition holds; the limit only ends a failing test.
template <typename Condition>
bool until(ControllerWatch& watch, Condition condition) {
  for (int i = 0; i < 1500; ++i) {
    watch.step(adapters::now());
    if (condition()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  return false;
}

class RobotLink : public ::testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(Generations, RobotLink, ::testing::Values(1, 2));

TEST_P(RobotLink, RunsAProgramThroughOneInterface) {
  Site site(GetParam());
  EXPECT_EQ(*adapters::find_rws_generation(site.access()), site.access().generation);
  adapters::RwsHttp http(site.access());
  adapters::RwsClient rws(http, site.access().generation);
  ASSERT_TRUE(rws.system().ok()) << rws.system().error().text();
  EXPECT_EQ(rws.system()->rapid_version.substr(0, 1), GetParam() == 2 ? "7" : "6");
  EXPECT_EQ(*rws.operation_mode(), OperationMode::Auto);
  ASSERT_TRUE(rws.set_motors(true).ok());
  EXPECT_EQ(*rws.controller_state(), ControllerState::MotorsOn);
  const std::string path = rws.module_path("T");
  ASSERT_TRUE(rws.upload_file(path, kModule).ok());
  EXPECT_EQ(rws.load_module("T_ROB1", path).error().code, "rws.no_mastership");
  {
    auto lease = rws.lease(MastershipDomain::Rapid);
    ASSERT_TRUE(lease.ok()) << lease.error().text();
    ASSERT_TRUE(rws.load_module("T_ROB1", path).ok());
    ASSERT_TRUE(rws.write_symbol("T_ROB1", "T", "n", "42").ok());
    ASSERT_TRUE(rws.set_pp_to_routine("T_ROB1", "T", "main").ok());
  }
  EXPECT_EQ(*rws.read_symbol("T_ROB1", "T", "n"), "42");
  EXPECT_EQ(rws.modules("T_ROB1")->size(), 1u);
  EXPECT_NE(rws.module_text("T_ROB1", "T")->find("WaitTime"), std::string::npos);
  const auto found = rws.search_symbols("T_ROB1", "T", "^n$");
  ASSERT_TRUE(found.ok()) << found.error().text();
  ASSERT_EQ(found->size(), 1u);
  EXPECT_EQ(found->front().url, "RAPID/T_ROB1/T/n");
  ASSERT_TRUE(rws.start().ok());
  EXPECT_EQ(*rws.execution_state(), ExecutionState::Running);
  ASSERT_TRUE(rws.stop().ok());
  site.step(100);
  EXPECT_EQ(*rws.execution_state(), ExecutionState::Stopped);
  const auto signals = rws.signals();
  ASSERT_TRUE(signals.ok()) << signals.error().text();
  EXPECT_EQ(signals->size(), 126u) << "all pages";
  ASSERT_TRUE(rws.write_signal(signals->front().place, "1").ok());
  EXPECT_EQ(*rws.read_signal(signals->front().place), "1");
  const auto log = rws.event_log(2);
  ASSERT_TRUE(log.ok()) << log.error().text();
  ASSERT_EQ(log->size(), 2u);
  EXPECT_GT((*log)[0].number, (*log)[1].number);
  EXPECT_EQ(rws.event((*log)[1].number)->code, (*log)[1].code);
  ASSERT_TRUE(rws.joints_deg().ok());
  EXPECT_EQ(http.counters().overloads, 0u) << "its pace stays below the controller's limit";
  EXPECT_EQ(site.server->sessions(), 1u) << "one session for all";
  EXPECT_TRUE(http.logout().ok());
  EXPECT_EQ(site.server->sessions(), 0u);
}

TEST_P(RobotLink, SaysThatAnotherHoldsTheMastership) {
  Site site(GetParam());
  adapters::RwsHttp first(site.access()), second(site.access());
  adapters::RwsClient holder(first, site.access().generation), other(second, site.access().generation);
  const auto lease = holder.lease(MastershipDomain::Rapid);
  ASSERT_TRUE(lease.ok()) << lease.error().text();
  const auto held = other.request_mastership(MastershipDomain::Rapid);
  ASSERT_FALSE(held.ok());
  EXPECT_EQ(held.error().code, "rws.held");
  EXPECT_NE(held.error().what.find("held by someone else"), std::string::npos) << held.error().text();
  EXPECT_NE(held.error().what.find("-1073445862"), std::string::npos) << held.error().text();
}

struct SessionFile {
  SessionFile() {
    std::string pattern = (std::filesystem::temp_directory_path() / "rws-session-XXXXXX").string();
    folder = ::mkdtemp(pattern.data());
  }
  ~SessionFile() { std::filesystem::remove_all(folder); }
  std::string at(const char* name) const { return (folder / name).string(); }
  std::filesystem::path folder;
};

TEST_P(RobotLink, TheMastershipOfAKilledProcessIsGivenBackBeforeAnythingElse) {
  Site site(GetParam());
  SessionFile files;
  adapters::RwsAccess access = site.access();
  access.session_file = files.at("killed");
  adapters::RwsHttp killed_http(access);
  adapters::RwsClient killed(killed_http, access.generation);
  ASSERT_TRUE(killed.controller_state().ok());
  ASSERT_TRUE(killed.request_mastership(MastershipDomain::Rapid).ok());
  // What the disk holds at the kill; the killed one's own end comes too late to help.
  std::filesystem::copy_file(access.session_file, files.at("kept"));
  std::filesystem::permissions(files.at("kept"), std::filesystem::perms(0600));
  access.session_file = files.at("kept");
  adapters::RwsHttp http(access);
  ASSERT_TRUE(http.has_former_session());
  adapters::RwsClient rws(http, access.generation);
  rws.end_former_session_first([&http] { return http.logout(); });
  site.inject("rws_silence", 0.4);
  EXPECT_FALSE(rws.controller_state().ok()) << "not answered: it is tried again";
  EXPECT_TRUE(std::filesystem::exists(access.session_file));
  site.step(120);
  const auto lease = rws.lease(MastershipDomain::Rapid);
  ASSERT_TRUE(lease.ok()) << lease.error().text();
  EXPECT_FALSE(http.has_former_session());
  EXPECT_EQ(site.server->sessions(), 1u) << "the killed one's session was ended";
  EXPECT_NE(adapters::RwsHttp(access).cookie_header(), killed_http.cookie_header());
}

TEST_P(RobotLink, ASessionThatTheControllerKnowsNoLongerIsFollowedByALogin) {
  Site site(GetParam());
  SessionFile files;
  adapters::RwsAccess access = site.access();
  access.session_file = files.at("kept");
  {
    adapters::RwsHttp killed(access);
    ASSERT_TRUE(adapters::RwsClient(killed, access.generation).controller_state().ok());
    std::filesystem::copy_file(access.session_file, files.at("copy"));
  }
  EXPECT_FALSE(std::filesystem::exists(access.session_file)) << "logged out: nothing is kept";
  std::filesystem::rename(files.at("copy"), access.session_file);
  adapters::RwsHttp http(access);
  ASSERT_TRUE(http.has_former_session());
  adapters::RwsClient rws(http, access.generation);
  rws.end_former_session_first([&http] { return http.logout(); });
  ASSERT_TRUE(rws.lease(MastershipDomain::Rapid).ok());
  EXPECT_EQ(site.server->sessions(), 1u);
  EXPECT_EQ(http.counters().overloads, 0u);
}

TEST(RobotLinkTwo, NothingGoesToAnotherCertificate) {
  Site site(2);
  adapters::RwsAccess access = site.access();
  access.certificate_sha256 = std::string(64, 'a');
  adapters::RwsHttp http(access);
  const auto reply = http.exchange({"GET", "/rw/system", "", "", "application/hal+json;v=2.0"});
  ASSERT_FALSE(reply.ok());
  EXPECT_EQ(reply.error().code, "http.certificate");
  EXPECT_NE(reply.error().what.find(site.server->fingerprint()), std::string::npos) << reply.error().text();
  EXPECT_EQ(reply.error().text().find("robotics"), std::string::npos);
  EXPECT_EQ(site.server->sessions(), 0u);
  EXPECT_EQ(adapters::RwsSocket::open(access, "/poll/1", "").error().code, "http.certificate");
}

TEST(RobotLinkTwo, EarlyControllersAreAskedForXhtml) {
  sim::Scene scene = scene_of(2);
  scene.controller.rws_hal = false;
  sim::Controller controller(scene, scene.cell.setup.arm);
  struct Direct final : ports::HttpTransport {
    explicit Direct(sim::Controller& c) : controller(&c) {}
    Result<ports::HttpReply> exchange(const ports::HttpRequest& request) override {
      ++asked;
      return controller->handle_rws(request, 1);
    }
    sim::Controller* controller;
    int asked = 0;
  } direct(controller);
  adapters::RwsClient rws(direct, RwsGeneration::Two);
  EXPECT_EQ(*rws.controller_state(), ControllerState::MotorsOff);
  EXPECT_EQ(*rws.operation_mode(), OperationMode::Auto);
  EXPECT_EQ(direct.asked, 3) << "one refusal, then it knows";
  EXPECT_EQ(rws.signals()->size(), 126u);
  EXPECT_FALSE(rws.event_log(3)->empty());
}

TEST_P(RobotLink, ChangesComeByThemselves) {
  Site site(GetParam());
  adapters::RwsHttp http(site.access());
  adapters::RwsClient rws(http, site.access().generation);
  ControllerWatchOptions options;
  options.look = 300 * kSecond;  // what is seen in between came by subscription
  ControllerWatch watch(rws, http, options);
  ASSERT_TRUE(until(watch, [&] { return watch.view().live && watch.view().mode == OperationMode::Auto; }));
  EXPECT_EQ(watch.view().controller, ControllerState::MotorsOff);
  EXPECT_EQ(watch.view().execution, ExecutionState::Stopped);
  watch.step(adapters::now());  // everything once more, now that changes are told
  const auto asked = http.counters().requests;
  site.inject("manual");
  ASSERT_TRUE(until(watch, [&] { return watch.view().mode == OperationMode::ManualReduced; }));
  site.inject("estop", 1000);
  ASSERT_TRUE(until(watch, [&] { return watch.view().controller == ControllerState::EmergencyStop; }));
  std::vector<adapters::ControllerEvent> events;
  ASSERT_TRUE(until(watch, [&] {
    for (auto& event : watch.take_events()) events.push_back(event);
    return !events.empty() && events.back().code == 10013;
  }));
  EXPECT_LE(http.counters().requests - asked, events.size())
      << "a question for each entry of the log, no other";
}

TEST_P(RobotLink, ASubscriptionComesBackAfterARestart) {
  Site site(GetParam());
  adapters::RwsHttp http(site.access());
  adapters::RwsClient rws(http, site.access().generation);
  ControllerWatchOptions options;
  options.look = options.first_retry = 200 * kMillisecond;
  ControllerWatch watch(rws, http, options);
  ASSERT_TRUE(until(watch, [&] { return watch.view().live; }));
  site.inject("restart", 0.4);
  ASSERT_TRUE(until(watch, [&] { return !watch.view().live && !watch.view().reachable; }));
  EXPECT_EQ(watch.view().controller, ControllerState::Unknown) << "nothing old is shown as new";
  site.step(120);
  site.inject("guardstop", 1000);
  ASSERT_TRUE(until(watch, [&] {
    return watch.view().live && watch.subscriptions() == 2 &&
           watch.view().controller == ControllerState::GuardStop;
  })) << watch.view().detail;
  EXPECT_EQ(http.counters().overloads, 0u);
}

}  // namespace
}  // namespace weldcell::app
