// The talk over the command port against answers as the manuals print them.
#include "weldcell/wire/laser_setup.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <random>

#include "unit/wire/laser_streams.hpp"

namespace weldcell::wire {
namespace {

using testing::Contains;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

/// Answers each request with a text of a table; what is written changes the table as the sensor would.
struct Script {
  std::map<std::string, std::string> answers;
  std::vector<std::string> heard;

  std::string answer(const std::string& request) {
    heard.push_back(request);
    const auto found = answers.find(request);
    return found == answers.end() ? "" : found->second;
  }
};

/// Talks to the end, each answer in pieces of `piece` bytes. False when a request got no complete answer.
bool talk(LaserSetup& setup, Script& script, std::size_t piece = 1000) {
  for (std::string request = setup.request(); !request.empty(); request = setup.request()) {
    const std::string answer = script.answer(request);
    bool done = false;
    for (std::size_t at = 0; at < answer.size(); at += piece) {
      EXPECT_FALSE(done) << "answered before its end: " << request;
      done = setup.take(std::string_view(answer).substr(at, piece));
    }
    if (!done) return false;
  }
  return true;
}

/// An optoNCDT 2300 as its manual shows it, set as the wanted sensor.
Script ild2300() {
  Script s;
  s.answers["GETINFO\r\n"] =
      "GETINFO\r\nName: ILD2300\r\nSerial: 10110002\r\nOption: 000\r\nArticle: 4120178\r\n"
      "MAC-Address: 00-0C-12-01-03-04\r\nMeasuring range: 20.00mm\r\nName CalTab: DIFFUSE\r\n"
      "Version: 0003.066.087\r\nImagetype: User\r\n->";
  s.answers["GETUSERLEVEL\r\n"] = "GETUSERLEVEL PROFESSIONAL\r\n->";
  s.answers["MEASRATE\r\n"] = "MEASRATE 10\r\n->";
  s.answers["AVERAGE\r\n"] = "AVERAGE NONE\r\n->";
  s.answers["OUTHOLD\r\n"] = "OUTHOLD NONE\r\n->";
  s.answers["OUTREDUCE\r\n"] = "OUTREDUCE 1 NONE\r\n->";
  s.answers["GETOUTINFO_ETH\r\n"] = "GETOUTINFO_ETH COUNTER TIMESTAMP DIST1\r\n->";
  s.answers["MEASTRANSFER\r\n"] = "MEASTRANSFER SERVER/TCP 1024\r\n->";
  s.answers["OUTPUT\r\n"] = "OUTPUT ETHERNET\r\n->";
  return s;
}

LaserWanted wanted(LaserDialect dialect) {
  LaserWanted w;
  w.format = streams::format_of(dialect);
  w.device = "laser 192.168.125.60:23";
  return w;
}

LaserWanted wanted_2300() {
  LaserWanted w = wanted(LaserDialect::Meas28);
  w.format.range_mm = 20;
  w.data_port = 1024;
  return w;
}

TEST(LaserSetup, ASensorThatFitsIsLeftAlone) {
  for (const std::size_t piece : {1U, 2U, 7U, 1000U}) {
    Script sensor = ild2300();
    const auto setup = laser_setup(wanted_2300());
    ASSERT_TRUE(talk(*setup, sensor, piece)) << setup->asked();
    EXPECT_FALSE(setup->fault()) << setup->fault()->text();
    EXPECT_THAT(setup->notes(), IsEmpty());
    EXPECT_EQ(sensor.heard.size(), 9U);
  }
}

TEST(LaserSetup, EveryDifferenceIsNamedWithBothValues) {
  Script sensor = ild2300();
  sensor.answers["MEASRATE\r\n"] = "MEASRATE 2.5\r\n->";
  sensor.answers["GETINFO\r\n"] = "Name: ILD2300\r\nSerial: 7\r\nMeasuring range: 200.00mm\r\n->";
  sensor.answers["GETOUTINFO_ETH\r\n"] = "GETOUTINFO_ETH COUNTER TIMESTAMP INTENSITY DIST1\r\n->";
  sensor.answers["MEASTRANSFER\r\n"] = "MEASTRANSFER CLIENT/UDP 192.168.0.1 1024\r\n->";
  const auto setup = laser_setup(wanted_2300());
  ASSERT_TRUE(talk(*setup, sensor));
  ASSERT_TRUE(setup->fault());
  EXPECT_EQ(setup->fault()->code, "laser.mismatch");
  const std::string text = setup->fault()->text();
  EXPECT_THAT(text, HasSubstr("laser 192.168.125.60:23 (ILD2300, serial 7): "));
  EXPECT_THAT(text, HasSubstr("laser.range_mm is 20, the sensor has 200 mm"));
  EXPECT_THAT(text, HasSubstr("laser.rate_hz is 10000, the sensor has 2500 Hz"));
  EXPECT_THAT(text, HasSubstr("laser.frame is [counter, timestamp, distance], the sensor has [counter, "
                              "timestamp, intensity, distance]"));
  EXPECT_THAT(text, HasSubstr("SERVER/TCP 1024, the sensor has CLIENT/UDP 192.168.0.1 1024"));
  EXPECT_THAT(setup->fault()->mend, HasSubstr("laser.rate_hz"));
}

TEST(LaserSetup, AReductionOfTheOutputCountsAsItsRate) {
  Script sensor = ild2300();
  sensor.answers["OUTREDUCE\r\n"] = "OUTREDUCE 4 ETHERNET\r\n->";
  auto setup = laser_setup(wanted_2300());
  ASSERT_TRUE(talk(*setup, sensor));
  ASSERT_TRUE(setup->fault());
  EXPECT_THAT(setup->fault()->what, HasSubstr("2500 Hz"));
  sensor.answers["OUTREDUCE\r\n"] = "OUTREDUCE 4 ANALOG\r\n->";
  setup = laser_setup(wanted_2300());
  ASSERT_TRUE(talk(*setup, sensor));
  EXPECT_FALSE(setup->fault());
}

TEST(LaserSetup, AveragingAndHoldAreSwitchedOffAfterALogin) {
  Script sensor = ild2300();
  sensor.answers["GETUSERLEVEL\r\n"] = "GETUSERLEVEL USER\r\n->";
  sensor.answers["LOGIN secret\r\n"] = "->";
  sensor.answers["AVERAGE\r\n"] = "AVERAGE MOVING 8\r\n->";
  sensor.answers["AVERAGE NONE\r\n"] = "AVERAGE NONE ok\r\n->";
  LaserWanted w = wanted_2300();
  w.password = "secret";
  auto setup = laser_setup(w);
  ASSERT_TRUE(talk(*setup, sensor));
  // The sensor took the command and kept its setting.
  ASSERT_TRUE(setup->fault());
  EXPECT_THAT(setup->fault()->what, HasSubstr("AVERAGE is NONE, the sensor has MOVING 8"));
  EXPECT_THAT(sensor.heard, Contains("LOGIN secret\r\n"));
  EXPECT_THAT(setup->notes(), Contains(HasSubstr("AVERAGE MOVING 8, set to NONE")));

  sensor.answers["LOGIN secret\r\n"] = "E24 Wrong password\r\n->";
  setup = laser_setup(w);
  ASSERT_TRUE(talk(*setup, sensor));
  ASSERT_TRUE(setup->fault());
  EXPECT_EQ(setup->fault()->code, "laser.refused");
  EXPECT_THAT(setup->fault()->text(), HasSubstr("E24 Wrong password"));
}

TEST(LaserSetup, APromptLeftOverFromTheWelcomeIsNoAnswer) {
  Script sensor = ild2300();
  sensor.answers["GETINFO\r\n"] = "Welcome\r\n->" + sensor.answers["GETINFO\r\n"];
  const auto setup = laser_setup(wanted_2300());
  ASSERT_TRUE(talk(*setup, sensor));
  EXPECT_FALSE(setup->fault());
}

TEST(LaserSetup, AConfocalControllerNamesItsWordsInOrder) {
  Script sensor = ild2300();
  sensor.answers["GETINFO\r\n"] = "Name: IFC2421\r\nSerial: 1\r\n->";
  sensor.answers["GETOUTINFO_ETH\r\n"] = "GETOUTINFO_ETH 01INTENSITY 01DIST1 TIMESTAMP\r\n->";
  auto setup = laser_setup(wanted(LaserDialect::Data28));
  ASSERT_TRUE(talk(*setup, sensor));
  EXPECT_FALSE(setup->fault()) << setup->fault()->text();
  EXPECT_THAT(setup->notes(), Contains(HasSubstr("laser.range_mm is believed")));
  sensor.answers["GETOUTINFO_ETH\r\n"] = "GETOUTINFO_ETH 01DIST1 01INTENSITY TIMESTAMP\r\n->";
  setup = laser_setup(wanted(LaserDialect::Data28));
  ASSERT_TRUE(talk(*setup, sensor));
  ASSERT_TRUE(setup->fault());
  EXPECT_THAT(setup->fault()->what, HasSubstr("[other, distance, timestamp], the sensor has [distance"));
}

TEST(LaserSetup, DollarCommands) {
  const auto sensor_of = [](const char* sample_us) {
    Script s;
    s.answers["$CHS\r"] = "$CHS\r\n$CHS1,0,2,0OK\r\n";
    s.answers["$CHI3\r"] = "$CHI3\r\n$CHI3:ANO4120176,NAMDL6220,SNO1001,OFS0,RNG50000,UNT\xB5m,DTY1OK\r\n";
    s.answers["$STI?\r"] = std::string("$STI?\r\n$STI?") + sample_us + "OK\r\n";
    s.answers["$AVT?\r"] = "$AVT?0OK\r\n";  // echo and answer on one line
    return s;
  };
  for (const std::size_t piece : {1U, 3U, 1000U}) {
    Script fits = sensor_of("100");
    const auto setup = laser_setup(wanted(LaserDialect::Meas32));
    ASSERT_TRUE(talk(*setup, fits, piece)) << setup->asked();
    EXPECT_FALSE(setup->fault()) << setup->fault()->text();
  }
  Script slow = sensor_of("960");
  slow.answers["$CHS\r"] = "$CHS1,1,1,0OK\r\n";
  slow.answers["$CHI2\r"] = "$CHI2:ANO1,NAMDL6220,SNO1001,OFS0,RNG2,UNTmm,DTY1OK\r\n";
  slow.answers["$AVT?\r"] = "$AVT?2OK\r\n";
  slow.answers["$AVT0\r"] = "$AVT0OK\r\n";
  const auto setup = laser_setup(wanted(LaserDialect::Meas32));
  ASSERT_TRUE(talk(*setup, slow)) << setup->asked();
  ASSERT_TRUE(setup->fault());
  EXPECT_THAT(setup->fault()->where, HasSubstr("DL6220, channel 2"));
  EXPECT_THAT(setup->fault()->what, HasSubstr("laser.frame is 2 channels, the sensor has 3 channels"));
  EXPECT_THAT(setup->fault()->what, HasSubstr("laser.range_mm is 50, the sensor has 2 mm"));
  EXPECT_THAT(setup->fault()->what, HasSubstr("1041.67 Hz"));
  EXPECT_THAT(setup->fault()->what, HasSubstr("averaging is none, the sensor has type 2"));
  EXPECT_THAT(slow.heard, Contains("$AVT0\r"));
}

std::string ild1402_reply(std::uint32_t id, std::string body) {
  while (body.size() % 4 != 0) body += ' ';
  std::string out = "ILD1";
  out += static_cast<char>(id >> 8);
  out += static_cast<char>(id & 0xFF);
  out += '\0';
  out += static_cast<char>(2 + body.size() / 4);
  return out + body + "  \r\n";
}

Script ild1402(const std::string& settings) {
  // Before the output stops, readings come; one holds the first letters of an answer.
  const std::string readings("\x81\x20\xFE\x50ILD\x81\x20ILD1\x90\x11", 15);
  Script s;
  s.answers[std::string("+++\rILD1\x20\x76\x00\x02", 12)] = readings + ild1402_reply(0xA076, "");
  s.answers[std::string("+++\rILD1\x20\x49\x00\x02", 12)] =
      ild1402_reply(0xA049, "ILD 1402: Standard\r\nA/N: 4120154\r\nS/N: 1234570\r\nMR: 100\r\n" + settings);
  s.answers[std::string("+++\rILD1\x20\x77\x00\x02", 12)] = ild1402_reply(0xA077, "");
  s.answers[std::string("+++\rILD1\x20\x90\x00\x03\x00\x00\x00\x01", 16)] = ild1402_reply(0xA090, "");
  return s;
}

TEST(LaserSetup, WordsOfTheIld1402InTheStreamOfReadings) {
  LaserWanted w = wanted(LaserDialect::TwoByte);
  w.format.rate_hz = 1500;
  for (const std::size_t piece : {1U, 5U, 1000U}) {
    Script sensor = ild1402(
        "Out Channel: analog\r\nFilter Type: moving average\r\nFilter Number: 1\r\nScanrate: 1500Hz\r\n"
        "type of digital output: binary\r\nmode of analog/digital output: continuous\r\n");
    const auto setup = laser_setup(w);
    ASSERT_TRUE(talk(*setup, sensor, piece)) << setup->asked();
    EXPECT_FALSE(setup->fault()) << setup->fault()->text();
    EXPECT_THAT(setup->notes(), Contains(HasSubstr("analog output, set to RS422")));
    EXPECT_EQ(sensor.heard.size(), 4U);
  }
  Script other = ild1402(
      "Out Channel: digital\r\nFilter Type: median\r\nFilter Number: 7\r\nScanrate: 750Hz\r\n"
      "type of digital output: ascii\r\nmode of analog/digital output: continuous\r\n");
  const auto setup = laser_setup(w);
  ASSERT_TRUE(talk(*setup, other));
  ASSERT_TRUE(setup->fault());
  EXPECT_THAT(setup->fault()->what, HasSubstr("laser.rate_hz is 1500, the sensor has 750 Hz"));
  EXPECT_THAT(setup->fault()->what, HasSubstr("the sensor has median of 7"));
  EXPECT_THAT(setup->fault()->what, HasSubstr("digital output: is binary, the sensor has ascii"));

  other.answers[std::string("+++\rILD1\x20\x49\x00\x02", 12)] =
      ild1402_reply(0xE049, std::string("\0\0\0\x05", 4));
  const auto refusing = laser_setup(w);
  ASSERT_TRUE(talk(*refusing, other));
  EXPECT_THAT(refusing->fault()->text(), HasSubstr("error 0x0005"));
}

TEST(LaserSetup, AnOd5000IsAskedForItsRateAndItsFiltersAreSwitchedOff) {
  const auto bytes = [](const char* text, std::size_t n) { return std::string(text, n); };
  Script s;
  const std::string done = bytes("\xC0\x00", 2);
  s.answers[bytes("\x40\x02\x01\xE0\x00\x04\x00\x00\x00\x00", 10)] = done;
  s.answers[bytes("\x30\x02\x0C\x10", 4)] = bytes("\xB0\x04\x00\x00\x00\x03", 6);
  s.answers[bytes("\x30\x02\x02\x10", 4)] = bytes("\xB0\x04\x00\x00\x00\x00", 6);
  s.answers[bytes("\x30\x02\x02\x14", 4)] = bytes("\xB0\x04\x00\x00\x01\x00", 6);
  s.answers[bytes("\x40\x02\x02\x14\x00\x04\x00\x00\x00\x01", 10)] = done;
  s.answers[bytes("\x30\x02\x02\x2C", 4)] = bytes("\xB0\x04\x00\x00\x00\xE1", 6);
  s.answers[bytes("\x40\x02\x10\xE4\x00\x04\xC0\x00\x02\x01", 10)] = done;
  s.answers[bytes("\x40\x02\x10\xE2\x00\x02\x13\x92", 8)] = done;
  s.answers[bytes("\x40\x02\x01\xE0\x00\x04\x00\x00\x00\x03", 10)] = done;
  LaserWanted w = wanted(LaserDialect::Od5000);
  w.push_ip = 0xC0000201;
  w.push_port = 5010;
  auto setup = laser_setup(w);
  ASSERT_TRUE(talk(*setup, s)) << setup->asked();
  // The script's moving average stays as it was after being written.
  ASSERT_TRUE(setup->fault());
  EXPECT_THAT(setup->fault()->what, HasSubstr("a moving average is off, the sensor has 256"));
  EXPECT_THAT(setup->fault()->what, Not(HasSubstr("rate")));
  EXPECT_THAT(setup->notes(), Contains(HasSubstr("0x022C")));

  w.format.rate_hz = 5000;
  setup = laser_setup(w);
  ASSERT_TRUE(talk(*setup, s));
  EXPECT_THAT(setup->fault()->what, HasSubstr("laser.rate_hz is 5000, the sensor has 10000 Hz"));
}

TEST(LaserSetup, AnAnswerWithoutAnEndIsAFaultAndNothingElseBreaks) {
  for (const LaserDialect dialect : {LaserDialect::Meas28, LaserDialect::Data28, LaserDialect::Meas32,
                                     LaserDialect::TwoByte, LaserDialect::ThreeByte, LaserDialect::Od5000}) {
    std::mt19937 random(20261126);
    for (int seed = 0; seed < 300; ++seed) {
      const auto setup = laser_setup(wanted(dialect));
      for (int i = 0; i < 60 && !setup->request().empty(); ++i) {
        for (int tries = 0; tries < 20; ++tries) {
          std::string noise;
          const std::size_t length = random() % 40;
          for (std::size_t k = 0; k < length; ++k) noise += "->OK\r\n$ILD1E01: 9.\xA0\x49"[random() % 21];
          if (setup->take(noise)) break;
        }
      }
    }
    const auto setup = laser_setup(wanted(dialect));
    ASSERT_FALSE(setup->request().empty());
    bool ended = false;
    for (int i = 0; i < 400 && !ended; ++i) ended = setup->take(std::string(100, 'x'));
    if (dialect == LaserDialect::TwoByte || dialect == LaserDialect::Od5000)
      continue;  // they keep none of it
    EXPECT_TRUE(ended);
    EXPECT_EQ(setup->fault()->code, "laser.answer");
  }
}

}  // namespace
}  // namespace weldcell::wire
