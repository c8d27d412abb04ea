// Robot Web Services as bytes: the requests of both generations, their answers as JSON, HAL and XHTML, event
// frames, and the pace.
#include <gtest/gtest.h>

#include <deque>
#include <random>

#include "weldcell/wire/rws_pace.hpp"
#include "weldcell/wire/rws_replies.hpp"
#include "weldcell/wire/rws_requests.hpp"

namespace weldcell::wire {
namespace {

struct Row {
  RwsAsk ask;
  const char* method;
  const char* path;
  const char* body;
};

TEST(RwsDialect, SpeaksGenerationTwo) {
  const RwsDialect two(RwsGeneration::Two);
  const Row rows[] = {
      {two.system(), "GET", "/rw/system", ""},
      {two.controller_state(), "GET", "/rw/panel/ctrl-state", ""},
      {two.set_motors(true), "POST", "/rw/panel/ctrl-state", "ctrl-state=motoron"},
      {two.operation_mode(), "GET", "/rw/panel/opmode", ""},
      {two.set_speed_ratio(50), "POST", "/rw/panel/speedratio?action=setspeedratio", "speed-ratio=50"},
      {two.start(false), "POST", "/rw/rapid/execution/start",
       "regain=continue&execmode=continue&cycle=once&condition=none&stopatbp=disabled&alltaskbytsp=false"},
      {two.stop(), "POST", "/rw/rapid/execution/stop", "stopmode=stop&usetsp=normal"},
      {two.reset_pp(), "POST", "/rw/rapid/execution/resetpp", ""},
      {two.set_pp_to_routine("T_ROB1", "Job", "weld"), "POST", "/rw/rapid/tasks/T_ROB1/pcp/routine",
       "routine=weld&module=Job&userlevel=FALSE"},
      {two.request_mastership(MastershipDomain::Rapid), "POST", "/rw/mastership/edit/request", ""},
      {two.release_mastership(MastershipDomain::Cfg), "POST", "/rw/mastership/edit/release", ""},
      {two.request_mastership(MastershipDomain::Motion), "POST", "/rw/mastership/motion/request", ""},
      {two.read_file("HOME/x.modx"), "GET", "/fileservice/HOME/x.modx", ""},
      {two.write_file("HOME/a b.modx", "text"), "PUT", "/fileservice/HOME/a%20b.modx", "text"},
      {two.make_folder("HOME", "weldcell"), "POST", "/fileservice/HOME/create", "fs-newname=weldcell"},
      {two.modules("T_ROB1"), "GET", "/rw/rapid/tasks/T_ROB1/modules", ""},
      {two.module_text("T_ROB1", "Job"), "GET", "/rw/rapid/tasks/T_ROB1/modules/Job/text", ""},
      {two.load_module("T_ROB1", "HOME/x.modx", true), "POST", "/rw/rapid/tasks/T_ROB1/loadmod",
       "modulepath=HOME/x.modx&replace=true"},
      {two.unload_module("T_ROB1", "Job"), "POST", "/rw/rapid/tasks/T_ROB1/unloadmod", "module=Job"},
      {two.read_symbol("T_ROB1", "Job", "n"), "GET", "/rw/rapid/symbol/RAPID/T_ROB1/Job/n/data", ""},
      {two.write_symbol("T_ROB1", "Job", "n", "[9E+09]"), "POST", "/rw/rapid/symbol/RAPID/T_ROB1/Job/n/data",
       "value=[9E%2B09]"},
      {two.signals(), "GET", "/rw/iosystem/signals?start=0&limit=100", ""},
      {two.signals("signals?start=100&limit=100"), "GET", "/rw/iosystem/signals?start=100&limit=100", ""},
      {two.write_signal("N/D/s", "1"), "POST", "/rw/iosystem/signals/N/D/s/set-value", "lvalue=1"},
      {two.event_log(5), "GET", "/rw/elog/0?lang=en&order=lifo&limit=5", ""},
      {two.unsubscribe("7"), "DELETE", "/subscription/7", ""},
  };
  for (const Row& row : rows) {
    EXPECT_EQ(row.ask.method, row.method) << row.path;
    EXPECT_EQ(row.ask.path, row.path);
    EXPECT_EQ(row.ask.body, row.body) << row.path;
    EXPECT_NE(row.ask.accept.find(";v=2."), std::string::npos) << row.path << ": 406 without";
    if (row.ask.method != "GET") {
      EXPECT_NE(row.ask.content_type.find(";v=2.0"), std::string::npos) << row.path << ": 415 without";
    }
    if (row.ask.method == "POST") {
      EXPECT_EQ(row.ask.accept, "application/xhtml+xml;v=2.0") << row.path << ": POST answers are XHTML only";
    }
  }
  EXPECT_EQ(two.event_log(5).accept, "application/hal+json;v=2.1") << "the order wants 2.1";
  EXPECT_EQ(two.module_path("WeldcellJob"), "HOME/WeldcellJob.modx");
  RwsDialect old = two;
  old.without_hal();
  EXPECT_EQ(old.system().accept, "application/xhtml+xml;v=2.0");
}

TEST(RwsDialect, SubscribesInBothGenerations) {
  for (const auto& [generation, state, protocol] :
       {std::tuple{RwsGeneration::One, "/rw/panel/ctrlstate;ctrlstate", "robapi2_subscription"},
        std::tuple{RwsGeneration::Two, "/rw/panel/ctrl-state;ctrlstate", "rws_subscription"}}) {
    const RwsDialect dialect(generation);
    const RwsAsk ask = dialect.subscribe({dialect.controller_state_resource(), dialect.event_log_resource(),
                                          dialect.symbol_resource("T_ROB1", "M", "s")});
    EXPECT_EQ(ask.path, "/subscription");
    const std::string symbol = generation == RwsGeneration::One ? "/rw/rapid/symbol/data/RAPID/T_ROB1/M/s"
                                                                : "/rw/rapid/symbol/RAPID/T_ROB1/M/s/data";
    EXPECT_EQ(ask.body, std::string("resources=1&1=") + state + "&1-p=1&resources=2&2=/rw/elog/0&2-p=1" +
                            "&resources=3&3=" + symbol + ";value&3-p=2");
    EXPECT_STREQ(dialect.websocket_protocol(), protocol);
  }
}

TEST(RwsReplies, OneEntryWhateverTheShape) {
  const char* const bodies[] = {
      R"({"_links":{"base":{"href":"http://h/"}},"_embedded":{"_state":[{"_type":"pnl-ctrlstate ","_title":"ctrlstate","ctrlstate":"motoron"}]}})",
      R"({"state":[{"_type":"pnl-ctrlstate","_title":"ctrlstate","ctrlstate":"motoron"}]})",
      R"({"_links":{"base":{"href":"https://h/"},"self":{"href":"x"}},"status":{"code":294912},"state":[{"_type":"pnl-ctrlstate","_title":"ctrl-state","ctrlstate":"motoron"}]})",
      R"({"_embedded":{"resources":[{"_links":{"self":{"href":"y"}},"_type":"pnl-ctrlstate","_title":"ctrl-state","ctrlstate":"motoron"}]}})",
      R"(<?xml version="1.0" encoding="UTF-8"?><html xmlns="http://www.w3.org/1999/xhtml"><head><base href="http://h/"/></head><body><div class="state"><a href="" rel="self"></a><ul><li class="pnl-ctrlstate " title="ctrlstate"><span class="ctrlstate">motoron</span></li></ul></div></body></html>)",
      R"(<x:html xmlns:x="http://www.w3.org/1999/xhtml"><x:body><x:div class="state"><x:ul><x:li class="pnl-ctrlstate" title="ctrlstate"><x:span class="ctrlstate">motoron</x:span></x:li></x:ul></x:div></x:body></x:html>)"};
  for (const char* body : bodies) {
    const auto states = rws_states(body);
    ASSERT_EQ(states.size(), 1u) << body;
    EXPECT_EQ(rws_field(states[0], "_type"), "pnl-ctrlstate") << body;
    EXPECT_EQ(controller_state_of(rws_field(states[0], "ctrlstate")), ControllerState::MotorsOn) << body;
  }
  for (const char* body : {"", "hello", "{", "[]", "null", "<html", "<html/>", "{\"state\":5}"})
    EXPECT_TRUE(rws_states(body).empty()) << body;
}

TEST(RwsReplies, DeepNestingIsCutNotFollowed) {
  std::string deep = "{\"a\":";
  for (int i = 0; i < 100'000; ++i) deep += "[";
  EXPECT_TRUE(rws_states(deep).empty());
  std::string closed = R"({"a":)" + std::string(500, '[') + R"({"_type":"x"})" + std::string(500, ']') + "}";
  EXPECT_TRUE(rws_states(closed).empty()) << "below the level that is read";
  std::string xhtml;
  for (int i = 0; i < 20'000; ++i) xhtml += "<div>";
  EXPECT_TRUE(rws_states(xhtml).empty());
}

TEST(RwsReplies, FindsTheNextPage) {
  EXPECT_EQ(rws_next_page(R"({"_links":{"next":{"href":"signals?start=100&amp;limit=100"}},"_embedded":{}})"),
            "signals?start=100&limit=100");
  EXPECT_EQ(
      rws_next_page(
          R"(<html><body><div class="state"><a href="signals?start=100&amp;limit=100" rel="next"/></div></body></html>)"),
      "signals?start=100&limit=100");
  EXPECT_EQ(rws_next_page(R"({"_links":{"self":{"href":"x"}}})"), "");
}

TEST(RwsReplies, FindsTheWebSocketInHeaderOrBody) {
  const char* const body =
      R"(<html xmlns="http://www.w3.org/1999/xhtml"><body><div class="state"><a href="subscription/12" rel="group"></a><a href="ws://192.168.125.1:80/poll/12" rel="self"></a></div></body></html>)";
  struct Case {
    const char* location;
    const char* body;
    const char* poll;
    const char* group;
  };
  for (const Case& c : {Case{"ws://192.168.125.1/poll/12", "", "/poll/12", "12"},
                        Case{"wss://h:443/poll/ab-12", "", "/poll/ab-12", "ab-12"},
                        Case{"/poll/12", body, "/poll/12", "12"}, Case{"", body, "/poll/12", "12"}}) {
    const auto made = rws_subscribed(c.location, c.body);
    ASSERT_TRUE(made) << c.location;
    EXPECT_EQ(made->poll, c.poll);
    EXPECT_EQ(made->group, c.group);
  }
  for (const char* bad : {"", "http://h/", "ws://h/poll/", "/poll/1\r\nX: y"})
    EXPECT_FALSE(rws_subscribed(bad, "")) << bad;
}

TEST(RwsReplies, ReadsTheNewsOfAnEventFrame) {
  const auto frame = [](const std::string& entries) {
    return R"(<?xml version="1.0" encoding="utf-8"?><html xmlns="http://www.w3.org/1999/xhtml"><head><title>Event</title><base href="http://h/"/></head><body><div class="state"><a href="subscription/1" rel="group"/><ul>)" +
           entries + "</ul></div></body></html>";
  };
  const RwsNews news = rws_news(frame(
      R"(<li class="pnl-ctrlstate-ev" title="ctrlstate"><a href="/rw/panel/ctrlstate;ctrlstate" rel="self"/><span class="ctrlstate">emergencystop</span></li>)"
      R"(<li class="pnl-opmode-ev" title="opmode"><a href="/rw/panel/opmode" rel="self"/><span class="opmode">MANR</span></li>)"
      R"(<li class="rap-ctrlexecstate-ev" title="ctrlexecstate"><a href="/rw/rapid/execution;ctrlexecstate" rel="self"/><span class="ctrlexecstate">stopped</span></li>)"
      R"(<li class="elog-message-ev" title="/rw/elog/0/18"><a href="/rw/elog/0/18" rel="self"/><span class="seqnum">18</span></li>)"
      R"(<li class="elog-message-ev" title="/rw/elog/0/19"><span class="seqnum">19</span></li>)"));
  EXPECT_EQ(news.controller, ControllerState::EmergencyStop);
  EXPECT_EQ(news.mode, OperationMode::ManualReduced);
  EXPECT_EQ(news.execution, ExecutionState::Stopped);
  EXPECT_EQ(news.log_entries, (std::vector<std::uint32_t>{18, 19}));
  const RwsNews none = rws_news(frame(R"(<li class="elog-message-ev"><span class="seqnum">x</span></li>)"));
  EXPECT_FALSE(none.controller || none.mode || none.execution || !none.log_entries.empty());
}

TEST(RwsRefusal, MastershipHeldByAnotherIsSaidInWordsWithTheCode) {
  const Error error = rws_refusal(
      403,
      R"(<html><body><div class="status"><span class="code">-1073445862</span><span class="msg">a.cpp[547] held code:-1073445862 icode:-1</span></div></body></html>)",
      "POST /rw/mastership/edit/request");
  EXPECT_EQ(error.code, "rws.held");
  EXPECT_NE(error.what.find("held by someone else"), std::string::npos) << error.text();
  EXPECT_NE(error.what.find("-1073445862"), std::string::npos) << error.text();
  EXPECT_EQ(rws_refusal(410, "", "POST /rw/mastership/edit/request").code, "rws.unexpected");
  EXPECT_NE(rws_refusal(406, "", "GET /rw/system").mend.find("rws.generation"), std::string::npos);
}

TEST(RwsPace, NeverTwentyWithinASecond) {
  const unsigned seed = 20261125;
  std::mt19937 random(seed);
  RwsPace pace;
  std::deque<HostTime> starts;
  HostTime now{5 * kSecond};
  std::size_t most = 0, waited = 0;
  for (int i = 0; i < 20'000; ++i) {
    // A greedy caller with pauses now and then.
    if (random() % 50 == 0) now = now + static_cast<Nanoseconds>(random() % (3 * kSecond));
    const Nanoseconds wait = pace.wait(now);
    waited += wait > 0;
    now = now + wait;
    EXPECT_EQ(pace.wait(now), 0);
    pace.started(now);
    starts.push_back(now);
    while (starts.front() < now - kSecond) starts.pop_front();
    most = std::max(most, starts.size());
  }
  EXPECT_LT(most, 20u) << "seed " << seed;
  EXPECT_GE(most, 16u) << "or it would be slower than needed; seed " << seed;
  EXPECT_GT(waited, 10'000u);
  pace.hold_until(now + kSecond);
  EXPECT_EQ(pace.wait(now), kSecond);
}

}  // namespace
}  // namespace weldcell::wire
