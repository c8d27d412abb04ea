// The simulated sensors' command interpreters against the daemon's talk, and by their own manuals' examples.
#include "sim/laser_interpreter.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "unit/wire/laser_streams.hpp"
#include "weldcell/wire/laser_setup.hpp"

namespace weldcell::sim {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using wire::LaserDialect;

constexpr LaserDialect kWithCommands[] = {LaserDialect::Meas28, LaserDialect::Data28, LaserDialect::Meas32,
                                          LaserDialect::TwoByte, LaserDialect::ThreeByte};

wire::LaserWanted wanted_of(const wire::LaserFormat& format) {
  wire::LaserWanted wanted;
  wanted.format = format;
  wanted.data_port = 10240;
  return wanted;
}

/// The daemon's talk with the sensor; readings come between the answers where they share the stream.
std::unique_ptr<wire::LaserSetup> talk(LaserInterpreter& sensor, const wire::LaserFormat& format) {
  auto setup = wire::laser_setup(wanted_of(format));
  const bool in_stream = format.dialect == LaserDialect::TwoByte || format.dialect == LaserDialect::ThreeByte;
  for (std::string request = setup->request(); !request.empty(); request = setup->request()) {
    std::string answer;
    if (in_stream && sensor.sending()) {
      wire::streams::Stream readings;
      wire::streams::put_block(readings, format.dialect, 77, 30);
      answer.assign(reinterpret_cast<const char*>(readings.data()), readings.size());
    }
    answer += sensor.hear(request);
    EXPECT_TRUE(setup->take(answer)) << wire::to_string(format.dialect) << ": " << setup->asked();
  }
  return setup;
}

TEST(LaserInterpreter, ASensorOfTheCellFileFits) {
  for (const LaserDialect dialect : kWithCommands) {
    SCOPED_TRACE(wire::to_string(dialect));
    const wire::LaserFormat format = wire::streams::format_of(dialect);
    const auto sensor = make_interpreter(format, 10240);
    const auto setup = talk(*sensor, format);
    EXPECT_FALSE(setup->fault()) << setup->fault()->text();
    EXPECT_TRUE(sensor->sending());
  }
}

TEST(LaserInterpreter, AnotherRateOrRangeIsRefusedInEveryDialect) {
  for (const LaserDialect dialect : kWithCommands) {
    SCOPED_TRACE(wire::to_string(dialect));
    wire::LaserFormat format = wire::streams::format_of(dialect);
    const auto sensor = make_interpreter(format, 10240);
    format.rate_hz = 5000;
    format.range_mm = 77;
    const auto fault = talk(*sensor, format)->fault();
    ASSERT_TRUE(fault);
    EXPECT_EQ(fault->code, "laser.mismatch");
    EXPECT_THAT(fault->what, HasSubstr("laser.rate_hz is 5000, the sensor has 10000 Hz"));
    // A confocal controller does not tell its sensor's range.
    if (dialect != LaserDialect::Data28) {
      EXPECT_THAT(fault->what, HasSubstr("laser.range_mm is 77"));
    }
  }
}

TEST(LaserInterpreter, OtherOutputsAreRefused) {
  wire::LaserFormat format = wire::streams::format_of(LaserDialect::Meas28);
  format.meas28.status = true;
  const auto sensor = make_interpreter(format, 10240);
  format.meas28.status = false;
  EXPECT_THAT(talk(*sensor, format)->fault()->what, HasSubstr("timestamp, distance, status]"));
}

TEST(LaserInterpreter, WhatSomebodySwitchedOnIsSwitchedOff) {
  const wire::LaserFormat format = wire::streams::format_of(LaserDialect::Meas28);
  const auto sensor = make_interpreter(format, 10240);
  EXPECT_EQ(sensor->hear("AVERAGE MOVING 8\r\n"), "E03 Access denied\r\n->");
  EXPECT_EQ(sensor->hear("LOGIN 000\nAVERAGE MOV"), "->");
  EXPECT_EQ(sensor->hear("ING 8\nOUTHOLD 0\nOUTPUT RS422\nLOGOUT\n"), "->->->->");
  EXPECT_FALSE(sensor->sending());
  const auto setup = talk(*sensor, format);
  EXPECT_FALSE(setup->fault()) << setup->fault()->text();
  EXPECT_EQ(setup->notes().size(), 3U);
  EXPECT_TRUE(sensor->sending());
  EXPECT_EQ(sensor->hear("AVERAGE\n"), "AVERAGE NONE\r\n->");
  EXPECT_EQ(sensor->hear("OUTHOLD\n"), "OUTHOLD NONE\r\n->");
  EXPECT_THAT(talk(*sensor, format)->notes(), IsEmpty());

  const wire::LaserFormat capacitive = wire::streams::format_of(LaserDialect::Meas32);
  const auto controller = make_interpreter(capacitive, 10001);
  EXPECT_EQ(controller->hear("noise$AVT3\r"), "noise$AVT3\r\n$AVT3OK\r\n");
  EXPECT_FALSE(talk(*controller, capacitive)->fault());
  EXPECT_EQ(controller->hear("$AVT?\r"), "$AVT?\r\n$AVT?0OK\r\n");
}

}  // namespace
}  // namespace weldcell::sim
