// The simulated sensor's wire against bytes worked out by hand from the protocol descriptions, and its whole
// stream through the daemon's decoder.
#include "sim/laser_wire.hpp"

#include <string>

#include "fixture.hpp"
#include "unit/wire/egm_golden.hpp"
#include "unit/wire/laser_streams.hpp"
#include "weldcell/sim/laser.hpp"

namespace weldcell::sim {
namespace {

using wire::LaserDialect;

Sample at(double distance_mm, std::uint64_t number, std::uint64_t device_ns, Echo echo = Echo::Distance) {
  return {distance_mm, echo, number, device_ns};
}

void expect_bytes(LaserDialect dialect, const std::vector<Sample>& samples, const char* hex) {
  const LaserWire sensor(wire::streams::format_of(dialect));
  EXPECT_EQ(sensor.encode(samples), golden::bytes(hex)) << wire::to_string(dialect);
}

}  // namespace

// clang-format off
TEST(LaserWire, GoldenBytes) {
  expect_bytes(LaserDialect::Meas28,
               {at(1, 0x1FFFFFE, 123456000), at(0, 0x1FFFFFF, 123556999, Echo::NoPeak)},
               "5341454d" "70de3e00" "b5f70300" "18000000" "00000000" "0200" "0c00" "feffff01"
               "feffff00" "40e20100" "40420f00"
               "ffffff00" "a4e20100" "fbffff7f");
  expect_bytes(LaserDialect::Data28,
               {at(1, 0xFFFFFFFE, 123456000), at(0, 0xFFFFFFFF, 123556999, Echo::NoPeak)},
               "44415441" "70de3e00" "b5f70300" "00000000" "0c000000" "02000000" "feffffff"
               "00020000" "40420f00" "40e20100"
               "00000000" "04ffff7f" "a4e20100");
  expect_bytes(LaserDialect::Meas32, {at(0, 7, 0), at(50, 8, 0), at(0, 9, 0, Echo::BehindRange)},
               "5341454d" "70de3e00" "b5f70300" "0500000000000000" "00000000" "0300" "0800" "07000000"
               "34120000" "ed3d0000"
               "34120000" "bd0c0000"
               "34120000" "b23e0000");
  expect_bytes(LaserDialect::TwoByte, {at(0, 0, 0), at(100, 1, 0), at(0, 2, 0, Echo::NoPeak)},
               "8120" "fe50" "ff72");
  expect_bytes(LaserDialect::ThreeByte, {at(0, 0, 0), at(100, 1, 0), at(0, 2, 0, Echo::NoPeak)},
               "024a80" "2e758f" "3c7ebf");
  expect_bytes(LaserDialect::Od5000, {at(15.2628, 3810558, 7498592366), at(15.262801, 3810559, 0)},
               "d01c" "40000401" "1db7ea6e" "003a24fe"
               "00e8e450" "7fffffff"
               "00e8e451" "7fffffff");
}
// clang-format on

TEST(LaserWire, EveryDialectOfTheWholeDeviceIsRead) {
  struct Case {
    LaserDialect dialect;
    double step_mm;  ///< of the wire's distance over 200 mm
    bool stamped;
  };
  for (const Case& c :
       {Case{LaserDialect::Meas28, 1e-5, true}, Case{LaserDialect::Data28, 1e-5, true},
        Case{LaserDialect::Meas32, 200.0 / 12592, false},
        Case{LaserDialect::TwoByte, 200 * 1.02 / 16368, false},
        Case{LaserDialect::ThreeByte, 200 * 1.02 / 65520, false}, Case{LaserDialect::Od5000, 1e-5, true}}) {
    SCOPED_TRACE(wire::to_string(c.dialect));
    Scene scene = test_scene();
    scene.laser.noise_mm = scene.laser.speckle_mm = scene.laser.outlier_share = 0;
    scene.laser.dropout_share = 0.01;
    wire::LaserFormat& format = scene.cell.laser_format;
    format = wire::streams::format_of(c.dialect);
    format.range_mm = scene.cell.setup.laser.range_mm;
    format.rate_hz = scene.cell.setup.laser.rate_hz;
    format.offset_mm = 0;
    LaserDevice laser(scene);
    wire::LaserDecoder decoder(format);
    const auto pose = [](HostTime) {
      Eigen::Isometry3d out = Eigen::Isometry3d::Identity();
      out.translate(Eigen::Vector3d(600, 20, 770));
      out.rotate(Eigen::AngleAxisd(kPi, Eigen::Vector3d::UnitX()));
      return Transform<Base, Flange>{out};
    };
    std::vector<wire::LaserReading> read;
    for (const LaserBlock& block : laser.advance({3 * kSecond}, pose))
      decoder.feed(block.bytes, [&](const wire::LaserReading& r) { read.push_back(r); });
    ASSERT_GT(read.size(), static_cast<std::size_t>(2.9 * format.rate_hz));
    std::size_t invalid = 0;
    for (std::size_t i = 0; i < read.size(); ++i) {
      ASSERT_EQ(read[i].counter, i);
      if (read[i].code != 0) {
        ++invalid;
      } else {
        ASSERT_NEAR(read[i].distance_mm, 140, c.step_mm + 1e-5);
      }
      if (i > 0 && c.stamped) {
        ASSERT_NEAR(static_cast<double>(read[i].timestamp_us - read[i - 1].timestamp_us),
                    1e6 / format.rate_hz, 1.5);
      }
    }
    EXPECT_GT(invalid, 0U);
    EXPECT_LT(invalid, read.size() / 50);
    EXPECT_EQ(decoder.counters().resyncs + decoder.counters().lost_readings + decoder.counters().restarts,
              0U);
  }
}

}  // namespace weldcell::sim
