// Resources, bodies and refusals of both generations, a row each: what docs/SIMULATOR.md lists and no other
// test of the simulator has. Without sockets.
#include <nlohmann/json.hpp>

#include "fixture.hpp"

namespace weldcell::sim {
namespace {

constexpr const char* kModule =
    "MODULE T\n PERS num n:=1;\n CONST num c:=2;\n PROC main()\n  WaitTime 1;\n ENDPROC\n PROC other()\n "
    "ENDPROC\nENDMODULE";

struct Row {
  const char* method;
  const char* path;
  const char* body;
  int status;
  const char* words;
};

long code_of(const std::string& xhtml) {
  const std::size_t at = xhtml.find("<span class=\"code\">");
  return at == std::string::npos ? 0L : std::stol(xhtml.substr(at + 19));
}

void check(const Row& row, const ports::HttpReply& reply) {
  EXPECT_EQ(reply.status, row.status) << row.method << " " << row.path << "\n" << reply.body;
  EXPECT_NE(reply.body.find(row.words), std::string::npos) << row.path << "\n" << reply.body;
}

TEST(RwsOne, ResourcesByTheirTypeNames) {
  Bench bench;
  ASSERT_TRUE(bench.controller.load_module(kModule));
  bench.rws("POST", "/rw/mastership?action=request");
  bench.step(250);
  const Row table[] = {
      {"GET", "/rw/system?json=1", "", 200, "\"_type\":\"sys-system-li\""},
      {"GET", "/rw/system?json=1", "", 200, "\"rwversionname\":\"6."},
      {"GET", "/rw/system?json=1", "", 200, "\"option\":\"689-1 Externally Guided Motion (EGM)\""},
      {"GET", "/ctrl/identity?json=1", "", 200, "ctrl-identity-info"},
      {"GET", "/ctrl/clock?json=1", "", 200, "\"datetime\":\"2026-01-01 T 00:00:01\""},
      {"PUT", "/ctrl/clock",
       "sys-clock-year=2026&sys-clock-month=11&sys-clock-day=26&sys-clock-hour=13&sys-clock-min=5&sys-clock-"
       "sec=0",
       204, ""},
      {"GET", "/ctrl/clock?json=1", "", 200, "\"datetime\":\"2026-11-26 T 13:05:00\""},
      {"PUT", "/ctrl/clock", "sys-clock-year=2026&sys-clock-month=13", 400, ""},
      {"GET", "/rw/panel/ctrlstate?json=1&debug=1", "", 200, "\"ctrlstate\":\"motoroff\""},
      {"POST", "/rw/panel/speedratio?action=setspeedratio", "speed-ratio=40", 204, ""},
      {"GET", "/rw/panel/speedratio", "", 200, "<span class=\"speedratio\">40</span>"},
      {"GET", "/rw/rapid/execution?json=1", "", 200, "\"cycle\":\"once\""},
      {"POST", "/rw/rapid/execution?action=setcycle", "cycle=forever", 204, ""},
      {"GET", "/rw/rapid/execution?json=1", "", 200, "\"cycle\":\"forever\""},
      {"POST", "/rw/rapid/execution?action=stop", "stopmode=stop", 204, ""},
      {"POST", "/rw/rapid/execution?action=stop&json=1", "stopmode=halt", 400, "-1073445879"},
      {"GET", "/rw/rapid/tasks/T_ROB1?json=1", "", 200, "\"taskstate\""},
      {"POST", "/rw/rapid/tasks/T_ROB1?action=deactivate", "", 204, ""},
      {"POST", "/rw/rapid/tasks/T_ROB1?action=activate", "", 204, ""},
      {"GET", "/rw/rapid/modules?task=T_ROB1&json=1", "", 200, "\"_type\":\"rap-module-info-li\""},
      {"GET", "/rw/rapid/modules/none?task=T_ROB1&json=1", "", 404, "-1073442816"},
      {"POST", "/rw/rapid/tasks/T_ROB1?action=unloadmod&json=1", "module=none", 400, "-1073442816"},
      {"POST", "/rw/rapid/tasks/T_ROB1?action=unloadmod", "module=T", 204, ""},
      {"GET", "/rw/rapid/modules/T?task=T_ROB1", "", 404, ""},
      {"GET", "/rw/mastership?json=1", "", 200, "\"_title\":\"cfg\""},
      {"GET", "/rw/motionsystem/mechunits?json=1", "", 200, "\"_title\":\"ROB_1\""},
      {"GET", "/rw/motionsystem/mechunits/ROB_1?resource=static&json=1", "", 200, "\"tool-name\":\"tool0\""},
      {"GET", "/rw/motionsystem/mechunits/ROB_1/cartesian?json=1", "", 200, "ms-mechunit-cartesian"},
      {"GET", "/rw/motionsystem/mechunits/ROB_1/robtarget?tool=none&json=1", "", 400, "-1073445879"},
      {"GET", "/rw/iosystem/signals/EtherNetIP/Local_IO/doArcOn?json=1", "", 200, "\"lvalue\":\"0\""},
      {"POST", "/rw/iosystem/signals/EtherNetIP/Local_IO/doArcOn?action=set", "lvalue=1", 204, ""},
      {"GET", "/rw/iosystem/signals/doArcOn?json=1", "", 200, "\"lvalue\":\"1\""},
      {"POST", "/rw/iosystem/signals/diGateClosed?action=set&json=1", "lvalue=1", 403, "-1073445881"},
      {"GET", "/rw/retcode?code=-1073442809&json=1", "", 200, "refused"},
      {"GET", "/rw/retcode?code=1&json=1", "", 404, ""},
      {"GET", "/users/rmmp/?json=1", "", 200, "\"privilege\":\"none\""},
  };
  for (const Row& row : table) check(row, bench.rws(row.method, row.path, row.body));
}

TEST(RwsTwo, ResourcesByTheirPaths) {
  Two bench;
  ASSERT_TRUE(bench.controller.load_module(kModule));
  EXPECT_EQ(bench.ask("POST", "/rw/mastership/edit/request").status, 204);
  const Row table[] = {
      {"GET", "/rw/system", "", 200, "\"major\":\"7\""},
      {"GET", "/rw/system", "", 200, "3124-1"},
      {"GET", "/ctrl/clock", "", 200, "ctrl-clock-info"},
      {"GET", "/rw/panel/coldetstate", "", 200, "coldetstate"},
      {"POST", "/rw/rapid/execution/cycle", "cycle=forever", 204, ""},
      {"POST", "/rw/rapid/tasks/deactivate", "task=T_ROB1", 204, ""},
      {"POST", "/rw/rapid/tasks/activate", "task=T_ROB1", 204, ""},
      {"POST", "/rw/rapid/tasks/T_ROB1/pcp/reset", "", 204, ""},
      {"GET", "/rw/rapid/tasks/T_ROB1/pcp", "", 200, "pcp-info"},
      {"GET", "/rw/rapid/tasks/T_ROB1/modules", "", 200, "\"_type\":\"rap-module-info-li\""},
      {"GET", "/rw/rapid/symbol/RAPID/T_ROB1/T/n/properties", "", 200, "rap-sympropper"},
      {"POST", "/rw/rapid/symbol/RAPID/T_ROB1/T/c/data", "value=3", 403, "-1073445881"},
      {"GET", "/rw/motionsystem/mechunits/ROB_1/robtarget", "", 200, "\"_type\":\"ms-robtargets\""},
      {"GET", "/rw/motionsystem/mechunits/ROB_1/robtarget", "", 200, "\"eax_a\""},
      {"GET", "/rw/elog/0?lang=en", "", 200, "elog-message-li"},
      {"GET", "/rw/elog/0/1?lang=en", "", 200, "elog-message"},
      {"GET", "/rw/nothing", "", 404, "\"status\":{\"code\":-1073414146"},
      {"GET", "/rw/controlstation", "", 404, ""},
      {"POST", "/rw/panel/opmode", "opmode=manf", 204, ""},
      {"GET", "/rw/panel/opmode", "", 200, "\"opmode\":\"MANF\""},
      {"POST", "/rw/panel/opmode/acknowledge", "", 204, ""},
      {"POST", "/rw/panel/opmode", "opmode=auto", 204, ""},
      {"POST", "/users/rmmp", "privilege=exec", 202, ""},
      {"GET", "/users/rmmp", "", 200, "\"privilege\":\"pending exec\""},
      {"POST", "/users/rmmp/cancel", "", 204, ""},
      {"GET", "/users/rmmp", "", 200, "\"privilege\":\"none\""},
  };
  for (const Row& row : table) check(row, bench.ask(row.method, row.path, row.body));
}

TEST(RwsTwo, FilesAreCopiedAndRenamed) {
  Two bench;
  const auto put = [&bench](const char* path) {
    return bench.controller.handle_rws({"PUT", path, "text", "text/plain;v=2.0", kXhtml}, 1).status;
  };
  EXPECT_EQ(put("/fileservice/HOME/a.modx"), 201);
  EXPECT_EQ(put("/fileservice/HOME/a.modx"), 200) << "written over";
  EXPECT_EQ(bench.ask("POST", "/fileservice/HOME/a.modx/copy", "fs-newname=b.modx").status, 201);
  EXPECT_EQ(bench.ask("POST", "/fileservice/HOME/a.modx/rename", "fs-newname=c.modx").status, 204);
  EXPECT_EQ(bench.ask("GET", "/fileservice/HOME/a.modx").status, 404);
  for (const char* path : {"/fileservice/HOME/b.modx", "/fileservice/HOME/c.modx"})
    EXPECT_EQ(bench.ask("GET", path).body, "text") << path;
  EXPECT_EQ(bench.controller.handle_rws({"GET", "/fileservice/HOME/b.modx", "", "", "*/*"}, 1).status, 200)
      << "files are raw: any type is taken";
  EXPECT_EQ(bench.ask("POST", "/fileservice/HOME/none/copy", "fs-newname=x").status, 404);
  EXPECT_EQ(bench.ask("DELETE", "/fileservice/HOME/b.modx").status, 204);
}

TEST(RwsTwo, MastershipWithAnIdIsGivenBackByWhoKnowsIt) {
  Two bench;
  const auto asked = bench.ask("POST", "/rw/mastership/edit/request-with-id");
  ASSERT_EQ(asked.status, 200);
  const std::size_t at = asked.body.find("<span class=\"mastershipid\">");
  ASSERT_NE(at, std::string::npos) << asked.body;
  const std::string id = asked.body.substr(at + 27, asked.body.find('<', at + 27) - at - 27);
  EXPECT_EQ(bench.ask("POST", "/rw/mastership/edit/request-with-id", "", 2).status, 403);
  EXPECT_EQ(bench.ask("POST", "/rw/mastership/edit/release-with-id", "mastershipid=" + id + "9", 2).status,
            403);
  EXPECT_EQ(bench.ask("POST", "/rw/mastership/edit/release-with-id", "mastershipid=" + id, 2).status, 204);
  EXPECT_EQ(bench.ask("POST", "/rw/mastership/edit/request", "", 2).status, 204);
}

TEST(Rws, ManualModeWantsAPersonsLeave) {
  Scene scene = test_scene();
  scene.controller.auto_mode = false;
  Bench bench(scene);
  const auto refused = bench.rws("POST", "/rw/mastership/rapid?action=request");
  EXPECT_EQ(refused.status, 403);
  EXPECT_EQ(code_of(refused.body), -1073445881);
  EXPECT_EQ(bench.rws("POST", "/users/rmmp", "privilege=modify").status, 202);
  EXPECT_EQ(bench.rws("POST", "/users/rmmp", "privilege=modify", 2).status, 403) << "one at a time";
  const auto status = [&bench](int session = 1) {
    return nlohmann::json::parse(bench.rws("GET", "/users/rmmp/poll?json=1", "", session)
                                     .body)["_embedded"]["_state"][0]["status"]
        .get<std::string>();
  };
  EXPECT_EQ(status(2), "NONE");
  EXPECT_EQ(status(), "PENDING");
  EXPECT_EQ(bench.rws("POST", "/rw/mastership/rapid?action=request").status, 403) << "not yet";
  EXPECT_EQ(status(), "GRANTED");
  EXPECT_EQ(bench.rws("POST", "/rw/mastership/rapid?action=request").status, 204);
  bench.controller.end_rws_session(1);
  EXPECT_EQ(bench.rws("POST", "/rw/mastership/rapid?action=request").status, 403)
      << "it ends with the session";
}

TEST(Rws, StartWithoutTheGrantIsRefused) {
  Scene scene = test_scene();
  scene.controller.remote_start = false;
  Bench bench(scene);
  ASSERT_TRUE(bench.controller.load_module(kModule));
  bench.rws("POST", "/rw/panel/ctrlstate?action=setctrlstate", "ctrl-state=motoron");
  EXPECT_EQ(bench.rws("POST", "/rw/rapid/execution?action=resetpp").status, 204);
  const auto refused = bench.rws("POST", "/rw/rapid/execution?action=start", Bench::kStart);
  EXPECT_EQ(refused.status, 403);
  EXPECT_EQ(code_of(refused.body), -1073445867);
}

TEST(Rws, PanelStatesByTheirNames) {
  Bench bench;
  const auto state = [&bench] {
    return nlohmann::json::parse(
               bench.rws("GET", "/rw/panel/ctrlstate?json=1").body)["_embedded"]["_state"][0]["ctrlstate"]
        .get<std::string>();
  };
  EXPECT_EQ(state(), "motoroff");
  bench.rws("POST", "/rw/panel/ctrlstate?action=setctrlstate", "ctrl-state=motoron");
  EXPECT_EQ(state(), "motoron");
  bench.controller.inject("guardstop", 0.1);
  EXPECT_EQ(state(), "guardstop");
  bench.step(30);
  bench.controller.inject("estop", 0.1);
  EXPECT_EQ(state(), "emergencystop");
  bench.step(30);
  EXPECT_EQ(state(), "emergencystopreset");
}

TEST(Rws, ConfigurationRowsAreShownAndLoaded) {
  Bench one;
  const auto shown =
      nlohmann::json::parse(one.rws("GET", "/rw/cfg/SIO/COM_TRP/instances/weldcell?json=1").body);
  const auto row = shown["_embedded"]["_state"][0];
  EXPECT_EQ(row["_title"], "weldcell");
  EXPECT_EQ(row["attrib"][1]["_title"], "Type");
  EXPECT_EQ(row["attrib"][1]["value"], "UDPUC");
  const std::string list = one.rws("GET", "/rw/cfg/MOC/EXT_MOTION_DATA/instances").body;
  EXPECT_NE(list.find("<li class=\"cfg-dt-instance-li\" title=\"default\">"), std::string::npos) << list;
  EXPECT_NE(list.find("<li class=\"cfg-ia-t-li\" title=\"ext_motion_level\"><span class=\"value\">0</span>"),
            std::string::npos)
      << list;
  EXPECT_EQ(one.rws("GET", "/rw/cfg/SIO/NONE/instances").status, 404);

  const std::string text =
      "SIO:CFG_1.0:6:0::\n#\nCOM_TRP:\n\n      -Name \"PC\" -Type \"UDPUC\"\\\n"
      "      -RemoteAdress \"10.0.0.9\" -RemotePortNumber 6512\n";
  EXPECT_EQ(one.rws("PUT", "/fileservice/$home/SIO.cfg", text).status, 201);
  const std::string load = "/rw/cfg?action=load";
  EXPECT_EQ(one.rws("POST", load, "filepath=$HOME/SIO.cfg&action-type=add").status, 403) << "mastership";
  EXPECT_EQ(one.rws("POST", "/rw/mastership/cfg?action=request").status, 204);
  EXPECT_EQ(one.rws("POST", load, "filepath=$HOME/SIO.cfg&action-type=add").status, 204);
  EXPECT_EQ(one.rws("POST", load, "filepath=$HOME/SIO.cfg&action-type=add").status, 400) << "a duplicate";
  EXPECT_EQ(one.rws("POST", load, "filepath=$HOME/SIO.cfg&action-type=replace").status, 204);
  EXPECT_NE(one.rws("GET", "/rw/cfg/SIO/COM_TRP/instances/PC?json=1").body.find("\"value\":\"10.0.0.9\""),
            std::string::npos);
  one.rws("PUT", "/fileservice/$home/bad.cfg", "SIO:CFG_1.0:6:0::\nCOM_TRP:\n  Name x\n");
  EXPECT_EQ(one.rws("POST", load, "filepath=$HOME/bad.cfg&action-type=add").status, 400);

  Two seven;
  const auto hal = seven.json("/rw/cfg/SIO/COM_TRP/instances");
  EXPECT_EQ(hal["_embedded"]["resources"][0]["attrib"][0]["_type"], "cfg-ia-t");
}

}  // namespace
}  // namespace weldcell::sim
