// Generation 2 as its clients meet it: types of content, paths and verbs, HAL, pages, .modx, codes. Without
// sockets.
#include <nlohmann/json.hpp>

#include "fixture.hpp"

namespace weldcell::sim {
namespace {

constexpr const char* kModule =
    "MODULE T\n PERS num n:=1;\n CONST num c:=2;\n PROC main()\n  WaitTime 1;\n ENDPROC\n PROC other()\n "
    "ENDPROC\nENDMODULE";

TEST(RwsTwo, WantsItsVersionInEveryType) {
  Two bench;
  struct Case {
    const char* method;
    const char* type;
    const char* accept;
    int status;
  };
  for (const Case& c : {Case{"GET", "", kHal, 200}, Case{"GET", "", kXhtml, 200}, Case{"GET", "", "*/*", 406},
                        Case{"GET", "", "application/json", 406}, Case{"GET", "", "", 406},
                        Case{"POST", "application/x-www-form-urlencoded", kXhtml, 415},
                        Case{"POST", "", kXhtml, 415}, Case{"POST", kForm, kHal, 406}}) {
    const char* const path = c.method[0] == 'G' ? "/rw/panel/opmode" : "/rw/mastership/edit/request";
    EXPECT_EQ(bench.controller.handle_rws({c.method, path, "", c.type, c.accept}, 1).status, c.status)
        << c.method << " type '" << c.type << "' accept '" << c.accept << "'";
  }
  Scene early = omnicore();
  early.controller.rws_hal = false;
  Two without(early);
  EXPECT_EQ(without.ask("GET", "/rw/system").status, 406);
  EXPECT_EQ(without.controller.handle_rws({"GET", "/rw/system", "", "", kXhtml}, 1).status, 200);
}

TEST(RwsTwo, ShowsHalWithNumbersAsText) {
  Two bench;
  const auto state = bench.json("/rw/panel/ctrl-state");
  EXPECT_EQ(state["state"][0]["_type"], "pnl-ctrlstate");
  EXPECT_EQ(state["state"][0]["ctrlstate"], "motoroff");
  EXPECT_EQ(state["status"]["code"], 294912);
  EXPECT_TRUE(state["_links"]["base"]["href"].is_string());
  EXPECT_EQ(bench.json("/rw/panel/speedratio")["state"][0]["speedratio"], "100");
  EXPECT_TRUE(bench.json("/rw/motionsystem/mechunits/ROB_1/jointtarget")["state"][0]["rax_1"].is_string());
  const auto system = bench.json("/rw/system")["state"][0];
  EXPECT_EQ(system["_type"], "sys-system");
  EXPECT_EQ(system["rwversion"].get<std::string>().rfind("7.", 0), 0u);
  const auto task = bench.json("/rw/rapid/tasks")["_embedded"]["resources"][0];
  EXPECT_EQ(task["name"], "T_ROB1");
  EXPECT_TRUE(task["_links"]["self"]["href"].is_string());
}

TEST(RwsTwo, TheOldPathsAreGone) {
  Two bench;
  ASSERT_TRUE(bench.controller.load_module(kModule));
  for (const char* path : {"/rw/panel/ctrlstate", "/rw/rapid/modules?task=T_ROB1",
                           "/rw/rapid/symbol/data/RAPID/T_ROB1/T/n", "/rw/iosystem/signals/doArcOn"})
    EXPECT_EQ(bench.ask("GET", path).status, 404) << path;
  for (const char* path : {"/rw/rapid/execution?action=stop", "/rw/rapid/tasks/T_ROB1?action=loadmod",
                           "/rw/mastership/rapid/request", "/rw/mastership/edit?action=request"})
    EXPECT_GE(bench.ask("POST", path).status, 400) << path;
  Bench one;
  for (const char* path : {"/rw/panel/ctrl-state", "/rw/rapid/symbol/RAPID/T_ROB1/T/n/data"})
    EXPECT_EQ(one.rws("GET", path).status, 404) << path << " in generation 1";
}

TEST(RwsTwo, RunsAProgramByItsPaths) {
  Two bench;
  const auto error_code = [](const ports::HttpReply& reply) {
    const std::size_t at = reply.body.find("<span class=\"code\">");
    return at == std::string::npos ? 0L : std::stol(reply.body.substr(at + 19));
  };
  EXPECT_EQ(
      bench.controller.handle_rws({"PUT", "/fileservice/HOME/t.modx", kModule, "text/plain;v=2.0", kXhtml}, 1)
          .status,
      201);
  EXPECT_EQ(bench.controller
                .handle_rws({"PUT", "/fileservice/$home/t.modx", kModule, "text/plain;v=2.0", kXhtml}, 1)
                .status,
            400)
      << "the volume is HOME";
  const std::string load = "/rw/rapid/tasks/T_ROB1/loadmod";
  EXPECT_EQ(error_code(bench.ask("POST", load, "modulepath=HOME/t.modx&replace=true")), -1073445859);
  EXPECT_EQ(bench.ask("POST", "/rw/mastership/edit/request", "", 2).status, 204);
  const auto held = bench.ask("POST", "/rw/mastership/edit/request");
  EXPECT_EQ(held.status, 403);
  EXPECT_EQ(error_code(held), -1073445862);
  EXPECT_NE(held.body.find("held by someone else"), std::string::npos);
  EXPECT_EQ(bench.ask("POST", "/rw/mastership/edit/release", "", 2).status, 204);
  EXPECT_EQ(bench.ask("POST", "/rw/mastership/edit/request").status, 204);
  EXPECT_EQ(bench.ask("POST", load, "modulepath=HOME/t.modx&replace=true").status, 204);
  EXPECT_EQ(
      bench.controller.handle_rws({"PUT", "/fileservice/HOME/t.mod", kModule, "text/plain;v=2.0", kXhtml}, 1)
          .status,
      201);
  EXPECT_EQ(error_code(bench.ask("POST", load, "modulepath=HOME/t.mod&replace=true")), -1073442813)
      << "RobotWare 7 loads .modx";
  EXPECT_EQ(bench.ask("POST", "/rw/panel/ctrl-state", "ctrl-state=motoron").status, 204);
  EXPECT_EQ(bench.ask("POST", "/rw/rapid/tasks/T_ROB1/pcp/routine", "routine=other&module=T&userlevel=FALSE")
                .status,
            204);
  EXPECT_EQ(bench.ask("POST", "/rw/rapid/execution/resetpp").status, 204);
  EXPECT_EQ(bench.ask("POST", "/rw/rapid/symbol/RAPID/T_ROB1/T/n/data", "value=7").status, 204);
  EXPECT_EQ(bench.json("/rw/rapid/symbol/RAPID/T_ROB1/T/n/data")["state"][0]["value"], "7");
  EXPECT_NE(
      bench.json("/rw/rapid/tasks/T_ROB1/modules/T/text")["state"][0]["module-text"].get<std::string>().find(
          "PROC main"),
      std::string::npos);
  EXPECT_EQ(bench
                .ask("POST", "/rw/rapid/execution/start",
                     "regain=continue&execmode=continue&cycle=asis&condition=none&stopatbp=disabled&"
                     "alltaskbytsp=false")
                .status,
            204);
  EXPECT_EQ(bench.json("/rw/rapid/execution")["state"][0]["ctrlexecstate"], "running");
  EXPECT_EQ(bench.ask("POST", "/rw/rapid/execution/stop", "stopmode=stop&usetsp=normal").status, 204);
  bench.step(100);
  EXPECT_EQ(bench.json("/rw/rapid/execution")["state"][0]["ctrlexecstate"], "stopped");
  EXPECT_EQ(
      bench.ask("POST", "/rw/rapid/symbols/search", "view=block&blockurl=RAPID/T_ROB1/T&regexp=^n$").status,
      200);
}

TEST(RwsTwo, SpeedRatioKeptItsQueryAndWantsMastership) {
  Two bench;
  const std::string path = "/rw/panel/speedratio?action=setspeedratio";
  EXPECT_EQ(bench.ask("POST", path, "speed-ratio=50").status, 403);
  EXPECT_EQ(bench.ask("POST", path + "&mastership=implicit", "speed-ratio=60").status, 204);
  bench.ask("POST", "/rw/mastership/edit/request");
  EXPECT_EQ(bench.ask("POST", path, "speed-ratio=50").status, 204);
  EXPECT_EQ(bench.ask("POST", path, "speed-ratio=150").status, 400);
}

TEST(RwsTwo, SignalsComeInPagesOfAHundred) {
  Two bench;
  const auto first = bench.json("/rw/iosystem/signals?start=0&limit=500");
  EXPECT_EQ(first["_embedded"]["resources"].size(), 100u);
  EXPECT_EQ(first["_links"]["next"]["href"], "signals?start=100&amp;limit=100");
  const auto last = bench.json("/rw/iosystem/signals?start=100&limit=100");
  EXPECT_EQ(last["_embedded"]["resources"].size(), 26u);
  EXPECT_FALSE(last["_links"].contains("next"));
  const std::string place = first["_embedded"]["resources"][0]["_title"];
  EXPECT_EQ(std::count(place.begin(), place.end(), '/'), 2) << place;
  EXPECT_EQ(bench.ask("POST", "/rw/iosystem/signals/" + place + "/set-value", "lvalue=1").status, 204);
  EXPECT_EQ(bench.json("/rw/iosystem/signals/" + place)["state"][0]["lvalue"], "1");
  EXPECT_EQ(
      bench.ask("POST", "/rw/iosystem/signals/EtherNetIP/Local_IO/diGateClosed/set-value", "lvalue=1").status,
      403);
  Bench one;
  const auto whole = nlohmann::json::parse(one.rws("GET", "/rw/iosystem/signals?json=1").body);
  EXPECT_EQ(whole["_embedded"]["_state"].size(), 126u) << "generation 1 sends the whole list";
}

TEST(RwsTwo, TheLogsOrderWantsANewerType) {
  Two bench;
  bench.controller.inject("motors_off");
  bench.controller.inject("estop");
  EXPECT_EQ(bench.ask("GET", "/rw/elog/0?lang=en&order=lifo").status, 406);
  const auto reply = bench.controller.handle_rws(
      {"GET", "/rw/elog/0?lang=en&order=lifo&limit=1", "", "", "application/hal+json;v=2.1"}, 1);
  ASSERT_EQ(reply.status, 200);
  const auto entries = nlohmann::json::parse(reply.body)["_embedded"]["resources"];
  ASSERT_EQ(entries.size(), 1u);
  EXPECT_EQ(entries[0]["code"], "10013");
}

TEST(RwsTwo, UsersFoldersAndTheKey) {
  Two bench;
  EXPECT_EQ(bench.ask("POST", "/users/register", "username=x&application=y&location=z&ulocale=remote").status,
            201);
  EXPECT_EQ(bench.ask("POST", "/users/rmmp", "privilege=modify").status, 202);
  EXPECT_EQ(bench.ask("POST", "/fileservice/HOME/create", "fs-newname=weldcell").status, 201);
  EXPECT_EQ(bench.controller
                .handle_rws({"PUT", "/fileservice/HOME/weldcell/x.modx", "a", "text/plain;v=2.0", kXhtml}, 1)
                .status,
            201);
  EXPECT_EQ(bench.controller
                .handle_rws({"PUT", "/fileservice/HOME/none/x.modx", "a", "text/plain;v=2.0", kXhtml}, 1)
                .status,
            404);
  EXPECT_EQ(bench.ask("POST", "/rw/panel/opmode", "opmode=man").status, 204);
  EXPECT_EQ(bench.json("/rw/panel/opmode")["state"][0]["opmode"], "MANR");
  EXPECT_EQ(bench.ask("POST", "/rw/panel/ctrl-state", "ctrl-state=motoron").status, 403);
}

struct Literal {
  const char* method;
  const char* path;
  const char* body;
  int status;
  const char* words;
};

TEST(RwsOne, WhatItsClientsRelyOn) {
  Bench bench;
  ASSERT_TRUE(bench.controller.load_module(kModule));
  ASSERT_EQ(bench.rws("PUT", "/fileservice/$home/x.mod", kModule).status, 201);
  const Literal table[] = {
      // librws and the python clients write the volume as it is; a percent sign is another volume.
      {"GET", "/fileservice/$home/x.mod", "", 200, "MODULE T"},
      {"GET", "/fileservice/$HOME/x.mod", "", 200, "MODULE T"},
      {"GET", "/fileservice/%24home/x.mod", "", 400, "-1073438716"},
      {"GET", "/fileservice/$home?json=1", "", 200, "\"fs-size\":\""},
      {"POST", "/fileservice/$home", "fs-action=create&fs-newname=sub", 201, ""},
      {"GET", "/rw/panel/ctrlstate", "", 200, "<li class=\"pnl-ctrlstate\" title=\"ctrlstate\">"},
      {"GET", "/rw/panel/ctrlstate?json=1", "", 200,
       "\"_embedded\":{\"_state\":[{\"_type\":\"pnl-ctrlstate\""},
      {"GET", "/rw/panel/coldetstate", "", 200, "class=\"coldetstate \""},
      {"GET", "/rw/panel/speedratio?json=1", "", 200, "\"speedratio\":\"100\""},
      {"GET", "/rw/rapid/tasks?json=1", "", 200, "\"motiontask\":\"TRUE\""},
      {"GET", "/rw/rapid/tasks/T_ROB1/pcp?json=1", "", 200, "modulemame"},
      {"GET", "/rw/rapid/modules/T?resource=module-text&task=T_ROB1&json=1", "", 200, "PROC main"},
      {"POST", "/rw/rapid/symbols?action=search-symbols&json=1",
       "view=block&blockurl=RAPID/T_ROB1/T&symtyp=per&regexp=^n", 200, "RAPID/T_ROB1/T/n"},
      {"POST", "/rw/rapid/symbols?action=search-symbol&json=1", "blockurl=RAPID/T_ROB1", 400, "-1073445879"},
      {"GET", "/rw/rapid/symbol/properties/RAPID/T_ROB1/T/n?json=1", "", 200, "rap-sympropper"},
      {"GET", "/rw/motionsystem/mechunits/ROB_1/jointtarget?json=1", "", 200, "8.999999E+09"},
      {"GET", "/rw/elog/0?lang=en&json=1", "", 200, "\"_title\":\"/rw/elog/0/1\""},
      {"GET", "/rw/elog/0/1?lang=en&json=1", "", 200, "elog-message"},
      {"GET", "/rw/nothing?json=1", "", 404, "\"status\":{\"code\":-1073414146"},
      {"GET", "/rw/nothing", "", 404, "<div class=\"status\"><span class=\"code\">-1073414146</span>"},
      {"GET", "/rw/iosystem/signals/none?json=1", "", 404, "-1073445866"},
      {"POST", "/rw/iosystem/signals/doArcOn?action=set", "lvalue=1", 204, ""},
      {"POST", "/rw/rapid/tasks/T_ROB9?action=activate&json=1", "", 404, "-1073445879"},
      {"POST", "/rw/mastership?action=request", "", 204, ""},
      {"GET", "/rw/mastership/rapid?json=1", "", 200, "msh-resource"},
      {"POST", "/users", "username=a&application=b&location=c&ulocale=local", 201, ""},
      {"POST", "/users/rmmp", "privilege=exec", 202, ""},
  };
  for (const Literal& row : table) {
    const auto reply = bench.rws(row.method, row.path, row.body);
    EXPECT_EQ(reply.status, row.status) << row.method << " " << row.path << "\n" << reply.body;
    EXPECT_NE(reply.body.find(row.words), std::string::npos) << row.path << "\n" << reply.body;
  }
}

TEST(RwsRestart, ForgetsAndComesBackWithMotorsOff) {
  Bench bench;
  bench.run_program(kModule, "T", "main");
  bench.step(5);
  ASSERT_TRUE(bench.controller.program_running());
  bench.controller.inject("restart", 1);
  EXPECT_TRUE(bench.controller.restarting());
  EXPECT_FALSE(bench.controller.program_running());
  EXPECT_FALSE(bench.controller.motors_on());
  bench.step(260);
  EXPECT_FALSE(bench.controller.restarting());
  EXPECT_EQ(bench.controller.restarts(), 1u);
  EXPECT_NE(bench.rws("GET", "/rw/mastership/rapid?json=1").body.find("nomaster"), std::string::npos);
  EXPECT_EQ(bench.value("T", "n"), "1") << "modules stay loaded";
}

}  // namespace
}  // namespace weldcell::sim
