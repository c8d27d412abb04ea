// The doctor's judgement, fact by fact: what is well, what is only warned of, what fails, and with which
// mend.
#include "app/doctor.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace weldcell::app {
namespace {

using adapters::KernelFacts;
using adapters::ProcessFacts;
using ::testing::HasSubstr;

KernelFacts good_kernel() {
  KernelFacts out;
  out.release = "6.1.0-rt";
  out.preempt_rt = true;
  out.hz = 250;
  out.isolated_cpus = "3";
  out.cpus = 4;
  out.governors = {"performance"};
  out.clock_source = "tsc";
  out.rt_runtime_us = 950000;
  out.rt_period_us = 1000000;
  out.user_namespaces = 1000;
  return out;
}

/// The one ailment of that name.
Ailment of(const Ailments& all, const std::string& check) {
  for (const Ailment& a : all)
    if (a.check == check) return a;
  ADD_FAILURE() << "no check " << check;
  return {};
}

TEST(Doctor, FindsAGoodMachineWell) {
  ProcessFacts daemon{42, {{"weldcelld", false, 0}, {"egm", true, 70}}, 51200};
  Ailments all = judge_real_time(good_kernel(), daemon, {}, false);
  for (const Ailments& more : {judge_kernel(good_kernel()), judge_clock({true, 1200}, good_kernel())})
    all.insert(all.end(), more.begin(), more.end());
  for (const Ailment& a : all) {
    EXPECT_EQ(a.health, Health::Ok) << a.check << ": " << a.seen;
    EXPECT_EQ(a.mend, "") << a.check;
  }
  EXPECT_FALSE(any_failed(all));
}

TEST(Doctor, ARunningDaemonsOwnThreadsCount) {
  // This process may have everything, the daemon has got nothing.
  const ProcessFacts daemon{42, {{"egm", false, 0}}, 0};
  const Ailments all = judge_real_time(good_kernel(), daemon, {true, true}, true);
  EXPECT_EQ(of(all, "real time").health, Health::Fail);
  EXPECT_THAT(of(all, "real time").mend, HasSubstr("LimitRTPRIO"));
  EXPECT_EQ(of(all, "memory lock").health, Health::Fail);
  EXPECT_THAT(of(all, "memory lock").mend, HasSubstr("LimitMEMLOCK"));
  EXPECT_EQ(of(judge_real_time(good_kernel(), ProcessFacts{42, {}, 5}, {}, true), "real time").health,
            Health::Fail);
}

TEST(Doctor, RightsThatAreRefusedMeanMoreToRoot) {
  const auto real_time = [](bool granted, bool root) {
    return of(judge_real_time(good_kernel(), std::nullopt, {granted, granted}, root), "real time").health;
  };
  EXPECT_EQ(real_time(true, true), Health::Ok);
  EXPECT_EQ(real_time(false, true), Health::Fail);
  EXPECT_EQ(real_time(false, false), Health::Warn);
  KernelFacts throttled = good_kernel();
  throttled.rt_runtime_us = 0;
  EXPECT_EQ(of(judge_real_time(throttled, std::nullopt, {true, true}, true), "real-time share").health,
            Health::Fail);
  throttled.rt_runtime_us = -1;
  EXPECT_EQ(of(judge_real_time(throttled, std::nullopt, {true, true}, true), "real-time share").health,
            Health::Ok);
}

TEST(Doctor, AnOrdinaryKernelIsWarnedOf) {
  KernelFacts kernel = good_kernel();
  kernel.preempt_rt = false;
  kernel.governors = {"performance", "powersave"};
  kernel.user_namespaces = 0;
  const Ailments all = judge_kernel(kernel);
  EXPECT_EQ(of(all, "kernel").health, Health::Warn);
  EXPECT_THAT(of(all, "kernel").seen, HasSubstr("HZ 250"));
  EXPECT_EQ(of(all, "processor clock").health, Health::Warn);
  EXPECT_EQ(of(all, "drawings' child").health, Health::Warn);
  kernel.isolated_cpus.clear();
  EXPECT_EQ(of(judge_kernel(kernel), "processors").health, Health::Ok);
  kernel.cpus = 1;
  EXPECT_EQ(of(judge_kernel(kernel), "processors").health, Health::Warn);
  kernel.clock_source = "hpet";
  EXPECT_EQ(of(judge_clock({true, 1}, kernel), "clock source").health, Health::Warn);
  EXPECT_EQ(of(judge_clock({false, 1}, kernel), "clock").health, Health::Warn);
  EXPECT_EQ(of(judge_clock({true, 16'000'000}, kernel), "clock").health, Health::Warn);
}

TEST(Doctor, APortIsNamedWithItsHolder) {
  const auto port = [](int number, adapters::PortFacts facts) {
    return judge_port({"modbus", "127.0.0.1", number, false, std::move(facts)});
  };
  EXPECT_EQ(port(1502, {}).health, Health::Ok);
  EXPECT_EQ(port(0, {}).health, Health::Ok);
  EXPECT_EQ(port(1502, {true, 42, "weldcelld"}).health, Health::Ok);
  EXPECT_EQ(port(502, {true, 1, "systemd"}).health, Health::Ok);
  EXPECT_EQ(port(1502, {true, 0, ""}).health, Health::Warn);
  const Ailment taken = port(1502, {true, 43, "mbserver"});
  EXPECT_EQ(taken.health, Health::Fail);
  EXPECT_THAT(taken.seen, HasSubstr("127.0.0.1:1502/tcp is held by mbserver (pid 43)"));
}

TEST(Doctor, ACardIsJudgedByLinkSpeedAndDelay) {
  const auto card = [](adapters::CardFacts facts, bool own = true) {
    return judge_card({"egm", "192.168.125.50", own, std::move(facts)});
  };
  EXPECT_EQ(card({}).front().health, Health::Fail);
  EXPECT_THAT(card({}).front().seen, HasSubstr("no network card has 192.168.125.50"));
  EXPECT_THAT(card({}, false).front().seen, HasSubstr("no route"));
  EXPECT_EQ(card({"lo", true, false, {}, {}, {}, {}}).size(), 1U);
  EXPECT_EQ(card({"eth0", false, false, {}, {}, {}, {}}).front().health, Health::Fail);
  const Ailments good = card({"eth0", false, true, 1000, true, 0U, false});
  EXPECT_EQ(of(good, "network egm").health, Health::Ok);
  EXPECT_EQ(of(good, "interrupts egm").health, Health::Ok);
  EXPECT_EQ(of(card({"eth0", false, true, 10, true, 0U, false}), "network egm").health, Health::Warn);
  EXPECT_EQ(of(card({"eth0", false, true, 100, false, 0U, false}), "network egm").health, Health::Warn);
  EXPECT_EQ(of(card({"eth0", false, true, {}, {}, {}, {}}), "network egm").health, Health::Ok);
  EXPECT_EQ(of(card({"eth0", false, true, 1000, true, 0U, true}), "interrupts egm").health, Health::Warn);
  const Ailment slow = of(card({"eth0", false, true, 1000, true, 62U, false}), "interrupts egm");
  EXPECT_EQ(slow.health, Health::Warn);
  EXPECT_THAT(slow.seen, HasSubstr("62 us"));
  EXPECT_THAT(slow.mend, HasSubstr("ethtool -C eth0"));
}

TEST(Doctor, ADiskIsJudgedByItsRoom) {
  constexpr std::uint64_t kMiB = 1024 * 1024;
  const auto disk = [](std::uint64_t mib, std::uint64_t inodes_left = 1'000'000) {
    return judge_disk({"spool", "/s", {true, true, "", mib * kMiB, inodes_left, 2'000'000}}).health;
  };
  EXPECT_EQ(disk(20000), Health::Ok);
  EXPECT_EQ(disk(2000), Health::Warn);
  EXPECT_EQ(disk(100), Health::Fail);
  EXPECT_EQ(disk(20000, 10), Health::Fail);
  const Ailment absent = judge_disk({"spool", "/s", {false, false, "No such file or directory", 0, 0, 0}});
  EXPECT_EQ(absent.health, Health::Fail);
  EXPECT_THAT(absent.seen, HasSubstr("/s: No such file or directory"));
}

TEST(Doctor, TellsTheSameInWordsAndJson) {
  const Ailments all{{"a", Health::Ok, "fine", ""},
                     {"b", Health::Warn, "so so", "do this"},
                     {"c", Health::Fail, "bad", "do \"that\""}};
  EXPECT_EQ(ailments_text(all),
            "ok    a: fine\nwarn  b: so so\n      mend: do this\nfail  c: bad\n      mend: do \"that\"\n"
            "3 checks, 1 warned, 1 failed\n");
  const auto json = nlohmann::json::parse(ailments_json(all));
  EXPECT_EQ(json["ok"], false);
  EXPECT_EQ(json["failed"], 1);
  EXPECT_EQ(json["checks"].size(), 3U);
  EXPECT_EQ(json["checks"][2]["mend"], "do \"that\"");
}

}  // namespace
}  // namespace weldcell::app
