// RWS calls against the bodies that the protocol's reference and client libraries show.
#include "weldcell/adapters/rws_client.hpp"

#include <gtest/gtest.h>

#include <deque>

namespace weldcell::adapters {
namespace {

/// Answers from a script and keeps what was asked.
class Script : public ports::HttpTransport {
 public:
  Result<ports::HttpReply> exchange(const ports::HttpRequest& request) override {
    asked.push_back(request);
    if (answers.empty()) return ports::HttpReply{204, {}, ""};
    auto answer = answers.front();
    answers.pop_front();
    return answer;
  }
  Script& answer(int status, std::string body = "") {
    answers.push_back(ports::HttpReply{status, {}, std::move(body)});
    return *this;
  }
  const ports::HttpRequest& last() const { return asked.back(); }

  std::deque<Result<ports::HttpReply>> answers;
  std::vector<ports::HttpRequest> asked;
};

std::string state_body(const std::string& state) {
  return R"({"_links":{"base":{"href":"http://127.0.0.1/rw/"}},"_embedded":{"_state":[)" + state + "]}}";
}

TEST(RwsClient, ReadsTheControllersState) {
  for (const auto& [text, expected] : {std::pair{"init", ControllerState::Init},
                                       {"motoroff", ControllerState::MotorsOff},
                                       {"motoron", ControllerState::MotorsOn},
                                       {"guardstop", ControllerState::GuardStop},
                                       {"emergencystop", ControllerState::EmergencyStop},
                                       {"emergencystopreset", ControllerState::EmergencyStopReset},
                                       {"sysfail", ControllerState::SystemFailure},
                                       {"somethingnew", ControllerState::Unknown}}) {
    Script script;
    script.answer(
        200, state_body(std::string(R"({"_type":"pnl-ctrlstate","_title":"ctrlstate","ctrlstate":")") + text +
                        "\"}"));
    const auto state = RwsClient(script).controller_state();
    ASSERT_TRUE(state.ok()) << text;
    EXPECT_EQ(*state, expected) << text;
    EXPECT_EQ(script.last().method, "GET");
    EXPECT_EQ(script.last().path, "/rw/panel/ctrlstate?json=1");
  }
}

TEST(RwsClient, TakesATopLevelStateAndBlanksBehindATypeToo) {
  Script script;
  script.answer(200, R"({"state":[{"_type":"pnl-opmode ","_title":"opmode","opmode":"AUTO"}]})");
  script.answer(
      200, state_body(
               R"({"_type":"rap-execution","_title":"execution","ctrlexecstate":"running","cycle":"once"})"));
  script.answer(200, state_body(R"({"_type":"pnl-speedratio","speedratio":50})"));
  RwsClient client(script);
  EXPECT_EQ(client.operation_mode().value(), OperationMode::Auto);
  EXPECT_EQ(client.execution_state().value(), ExecutionState::Running);
  EXPECT_EQ(client.speed_ratio_percent().value(), 50) << "numbers come as text and as numbers";
}

TEST(RwsClient, ReadsSystemJointsModulesAndSymbols) {
  Script script;
  script.answer(
      200, state_body(R"j({"_type":"sys-system-li","_title":"system","name":"cell4","rwversion":"6.16.0163",
    "sysid":"{A}","options":[{"_type":"sys-option-li","_title":"0","option":"RobotWare Base"},
    {"_type":"sys-option-li","_title":"1","option":"689-1 Externally Guided Motion (EGM)"}]})j"));
  script.answer(200, state_body(R"j({"_type":"ms-jointtarget","_title":"ROB_1","rax_1":"0.5","rax_2":"-12.25",
    "rax_3":"30","rax_4":"0","rax_5":"45","rax_6":"-180","eax_a":"8.999999E+09"})j"));
  script.answer(200, state_body(R"j({"_type":"rap-module-info-li","name":"BASE","type":"SysMod"},
    {"_type":"rap-module-info-li","name":"WeldcellMain","type":"ProgMod"})j"));
  script.answer(200, state_body(R"j({"_type":"rap-data","_title":"RAPID/T_ROB1/WeldcellMain/wc_state",
    "value":"[[1,2,3],\"x\"]"})j"));
  RwsClient client(script);
  const auto system = client.system();
  ASSERT_TRUE(system.ok());
  EXPECT_EQ(system->rapid_version, "6.16.0163");
  ASSERT_EQ(system->options.size(), 2u);
  EXPECT_EQ(system->options[1], "689-1 Externally Guided Motion (EGM)");
  const auto joints = client.joints_deg();
  ASSERT_TRUE(joints.ok());
  EXPECT_EQ(*joints, (std::array<double, 6>{0.5, -12.25, 30, 0, 45, -180}));
  EXPECT_EQ(client.modules("T_ROB1").value(), (std::vector<std::string>{"BASE", "WeldcellMain"}));
  EXPECT_EQ(script.last().path, "/rw/rapid/modules?task=T_ROB1&json=1");
  EXPECT_EQ(client.read_symbol("T_ROB1", "WeldcellMain", "wc_state").value(), "[[1,2,3],\"x\"]");
  EXPECT_EQ(script.last().path, "/rw/rapid/symbol/data/RAPID/T_ROB1/WeldcellMain/wc_state?json=1");
}

TEST(RwsClient, SendsTheActionsOfTheReference) {
  Script script;
  RwsClient client(script);
  const auto sent = [&] {
    return script.last().method + " " + script.last().path + " " + script.last().body;
  };
  ASSERT_TRUE(client.set_motors(true).ok());
  EXPECT_EQ(sent(), "POST /rw/panel/ctrlstate?action=setctrlstate ctrl-state=motoron");
  EXPECT_EQ(script.last().content_type, "application/x-www-form-urlencoded");
  ASSERT_TRUE(client.start().ok());
  EXPECT_EQ(sent(),
            "POST /rw/rapid/execution?action=start "
            "regain=continue&execmode=continue&cycle=once&condition=none&stopatbp=disabled"
            "&alltaskbytsp=false");
  ASSERT_TRUE(client.start(true).ok());
  EXPECT_NE(sent().find("cycle=forever"), std::string::npos);
  ASSERT_TRUE(client.stop().ok());
  EXPECT_EQ(sent(), "POST /rw/rapid/execution?action=stop stopmode=stop");
  ASSERT_TRUE(client.reset_pp().ok());
  EXPECT_EQ(sent(), "POST /rw/rapid/execution?action=resetpp ");
  ASSERT_TRUE(client.set_pp_to_routine("T_ROB1", "WeldcellJob", "weld_all").ok());
  EXPECT_EQ(sent(),
            "POST /rw/rapid/tasks/T_ROB1/pcp?action=set-pp-routine module=WeldcellJob&routine=weld_all");
  ASSERT_TRUE(client.load_module("T_ROB1", "$HOME/weldcell/job.mod").ok());
  EXPECT_EQ(sent(),
            "POST /rw/rapid/tasks/T_ROB1?action=loadmod modulepath=$HOME/weldcell/job.mod&replace=true");
  ASSERT_TRUE(client.unload_module("T_ROB1", "WeldcellJob").ok());
  EXPECT_EQ(sent(), "POST /rw/rapid/tasks/T_ROB1?action=unloadmod module=WeldcellJob");
  ASSERT_TRUE(client.write_symbol("T_ROB1", "M", "s", "\"a+b & c=d%\"").ok());
  EXPECT_EQ(sent(),
            "POST /rw/rapid/symbol/data/RAPID/T_ROB1/M/s?action=set value=%22a%2Bb%20%26%20c%3Dd%25%22");
  ASSERT_TRUE(client.write_symbol("T_ROB1", "M", "s", "[[1,-2.5],[9E+09]]").ok());
  EXPECT_EQ(script.last().body, "value=[[1,-2.5],[9E%2B09]]") << "a plus is a blank in a form";
  ASSERT_TRUE(client.make_folder("$home", "weldcell").ok());
  EXPECT_EQ(sent(), "POST /fileservice/$home fs-action=create&fs-newname=weldcell");
  ASSERT_TRUE(client.delete_file("$home/x.mod").ok());
  EXPECT_EQ(sent(), "DELETE /fileservice/$home/x.mod ");
}

TEST(RwsClient, ALeaseIsReleasedOnEveryWayOut) {
  Script script;
  RwsClient client(script);
  {
    const auto lease = client.lease(MastershipDomain::Rapid);
    ASSERT_TRUE(lease.ok());
    EXPECT_EQ(script.last().path, "/rw/mastership/rapid?action=request");
    EXPECT_EQ(script.asked.size(), 1u);
  }
  ASSERT_EQ(script.asked.size(), 2u);
  EXPECT_EQ(script.last().path, "/rw/mastership/rapid?action=release");
  {
    auto lease = client.lease(MastershipDomain::Motion);
    ASSERT_TRUE(lease.ok());
    ASSERT_TRUE(lease->release().ok());
  }
  EXPECT_EQ(script.asked.size(), 4u) << "released once";
}

TEST(RwsClient, UploadsAndReadsBack) {
  const std::string module = "MODULE WeldcellJob\r\n  ! \xE4\r\nENDMODULE\n";
  Script script;
  script.answer(201).answer(200, module);
  RwsClient client(script);
  ASSERT_TRUE(client.upload_file("$home/weldcell/job.mod", module).ok());
  EXPECT_EQ(script.asked[0].method, "PUT");
  EXPECT_EQ(script.asked[0].path, "/fileservice/$home/weldcell/job.mod");
  EXPECT_EQ(script.asked[0].body, module);
  EXPECT_EQ(script.asked[1].method, "GET");
  script.answer(200).answer(200, module.substr(0, 10) + "X" + module.substr(11));
  const auto differs = client.upload_file("$home/weldcell/job.mod", module);
  ASSERT_FALSE(differs.ok());
  EXPECT_EQ(differs.error().code, "rws.mismatch");
  EXPECT_NE(differs.error().what.find("byte 10"), std::string::npos) << differs.error().text();
  script.answer(200).answer(200, module.substr(0, 10));
  EXPECT_EQ(client.upload_file("$home/weldcell/job.mod", module).error().code, "rws.mismatch");
}

struct Refusal {
  int status;
  int code;
  const char* expected;
};

TEST(RwsClient, SaysInWordsWhyTheControllerRefused) {
  const Refusal table[] = {{403, -1073445862, "rws.held"},       {403, -1073445859, "rws.no_mastership"},
                           {403, -1073445881, "rws.rejected"},   {403, -1073445867, "rws.not_allowed"},
                           {400, -1073445879, "rws.bad_value"},  {400, -1073442809, "rws.wrong_state"},
                           {400, -1073442813, "rws.bad_module"}, {404, -1073442816, "rws.not_found"},
                           {404, -1073414146, "rws.not_found"},  {404, -1073445866, "rws.bad_signal"},
                           {404, -1073438713, "rws.no_path"},    {400, -1073438716, "rws.no_path"},
                           {400, -1073438708, "rws.no_path"},    {400, -1, "rws.unexpected"},
                           {503, 0, "rws.overloaded"},           {500, 0, "rws.unexpected"}};
  for (const Refusal& row : table) {
    const std::string code = std::to_string(row.code),
                      message = "rwsrapid.cpp[547] the controller's own words";
    const std::string bodies[] = {
        R"({"_links":{},"_embedded":{"status":{"code":)" + code + R"(,"msg":")" + message +
            R"("},"_state":[]}})",
        R"({"_links":{},"status":{"code":")" + code + R"(","msg":")" + message + R"("}})",
        R"(<?xml version="1.0" encoding="UTF-8"?><html xmlns="http://www.w3.org/1999/xhtml"><body><div class="status">)"
        R"(<span class="code">)" +
            code + R"(</span><span class="msg">)" + message + "</span></div></body></html>"};
    for (const std::string& body : bodies) {
      Script script;
      script.answer(row.status, body);
      const auto refused = RwsClient(script).start();
      ASSERT_FALSE(refused.ok()) << body;
      EXPECT_EQ(refused.error().code, row.expected) << body;
      EXPECT_NE(refused.error().what.find(message), std::string::npos) << refused.error().text();
      EXPECT_FALSE(refused.error().mend.empty()) << body;
      EXPECT_NE(refused.error().where.find("/rw/rapid/execution"), std::string::npos);
    }
  }
}

TEST(RwsClient, WhatIsNoAnswerOfAControllerIsAnError) {
  for (const char* body :
       {"", "hello", "{", "[]", "null", "{\"_embedded\":5}", "{\"_embedded\":{\"_state\":[{}]}}", "<html/>",
        R"({"_embedded":{"_state":[{"_type":"pnl-ctrlstate"}]}})"}) {
    Script script;
    script.answer(200, body).answer(200, body).answer(500, body).answer(200, body);
    RwsClient client(script);
    EXPECT_EQ(client.controller_state().error().code, "rws.unexpected") << body;
    EXPECT_EQ(client.joints_deg().error().code, "rws.unexpected") << body;
    EXPECT_EQ(client.stop().error().code, "rws.unexpected") << body;
    EXPECT_EQ(client.event_log().value().size(), 0u) << body;
  }
}

TEST(RwsClient, TheCarriersErrorIsHandedUp) {
  Script script;
  script.answers.push_back(Error{"http.timeout", "rws", "no answer", ""});
  EXPECT_EQ(RwsClient(script).controller_state().error().code, "http.timeout");
}

TEST(RwsClient, ReadsTheNewestEventsFirst) {
  Script script;
  script.answer(
      200,
      state_body(
          R"({"_type":"elog-message-li","_title":"/rw/elog/0/17","msgtype":"1","code":"10010","src-name":"MC0","tstamp":"2026-07-09 T 01:29:50","title":"Motors OFF state","desc":"d"},
         {"_type":"elog-message-li","_title":"/rw/elog/0/18","msgtype":"3","code":"41822","tstamp":"2026-07-09 T 01:29:56","title":"No data from the UdpUc device","desc":"d","causes":"c","actions":"a"})"));
  const auto events = RwsClient(script).event_log(1);
  ASSERT_TRUE(events.ok());
  ASSERT_EQ(events->size(), 1u);
  EXPECT_EQ((*events)[0].number, 18u);
  EXPECT_EQ((*events)[0].code, 41822);
  EXPECT_EQ((*events)[0].type, 3);
  EXPECT_EQ((*events)[0].title, "No data from the UdpUc device");
}

}  // namespace
}  // namespace weldcell::adapters
