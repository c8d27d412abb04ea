// The laser against geometry that can be worked out by hand.
#include <cmath>

#include "fixture.hpp"
#include "sim/laser_light.hpp"
#include "weldcell/wire/laser.hpp"

namespace weldcell::sim {

namespace {

struct Sample {
  double x_mm;
  wire::LaserReading reading;
  double host_s;
};

/// Moves the beam (pointing down, receiver towards receiver_deg in the table's plane) along x at 100 mm/s and
/// y = y_mm.
std::vector<Sample> sweep(const Scene& scene, double x_from, double x_to, double y_mm, double receiver_deg,
                          double speed = 100, double z_mm = 770) {
  LaserDevice laser(scene);
  const double sign = x_to > x_from ? 1 : -1;
  const auto x_at = [=](HostTime t) { return x_from + sign * speed * seconds(t.ns); };
  const auto pose = [&](HostTime t) {
    Eigen::Isometry3d out = Eigen::Isometry3d::Identity();
    out.translate(Eigen::Vector3d(x_at(t), y_mm, z_mm));
    out.rotate(Eigen::AngleAxisd(rad(receiver_deg), Eigen::Vector3d::UnitZ()) *
               Eigen::AngleAxisd(kPi, Eigen::Vector3d::UnitX()));
    return Transform<Base, Flange>{out};
  };
  std::vector<Sample> out;
  wire::Meas28Decoder decoder(scene.cell.laser_format.meas28);
  const double duration = std::abs(x_to - x_from) / speed;
  for (const LaserBlock& block : laser.advance({from_seconds(duration)}, pose)) {
    decoder.feed(block.bytes, [&](const wire::LaserReading& reading) {
      const double host =
          reading.counter / scene.cell.setup.laser.rate_hz / (1 + scene.laser.clock.drift_ppm * 1e-6);
      out.push_back({x_at({from_seconds(host)}), reading, host});
    });
  }
  return out;
}

Scene quiet() {
  Scene scene = test_scene();
  scene.laser.noise_mm = scene.laser.speckle_mm = scene.laser.outlier_share = scene.laser.dropout_share = 0;
  return scene;
}

/// Where readings cross half the step, by neighbours; invalid ones are skipped.
double crossing(const std::vector<Sample>& samples, double level) {
  const Sample* last = nullptr;
  for (const Sample& sample : samples) {
    if (sample.reading.code != 0) continue;
    if (last && (last->reading.distance_mm - level) * (sample.reading.distance_mm - level) < 0) {
      return 0.5 * (last->x_mm + sample.x_mm);
    }
    last = &sample;
  }
  return NAN;
}

}  // namespace

TEST(Laser, ReadsTableAndTop) {
  const auto samples = sweep(quiet(), 700, 1300, 20, 90);
  ASSERT_GT(samples.size(), 25000U);
  for (const Sample& sample : samples) {
    ASSERT_EQ(sample.reading.code, 0U) << sample.x_mm;
    if (sample.x_mm < 798 || sample.x_mm > 1202) {
      EXPECT_NEAR(sample.reading.distance_mm, 270 - 130, 1e-4);
    }
    if (sample.x_mm > 802 && sample.x_mm < 1198) {
      EXPECT_NEAR(sample.reading.distance_mm, 230 - 130, 1e-4);
    }
  }
}

TEST(Laser, SeesATableThatIsLiftedAndTilted) {
  Scene scene = quiet();
  scene.table = {1, 0, rad(0.5)};
  // The middle of the planned part's top lies at (1000, 20, 540); pitch lowers what lies at larger x.
  const double slope = -std::tan(rad(0.5)), rise = 40 / std::cos(rad(0.5));
  int on_table = 0, on_top = 0;
  for (const Sample& sample : sweep(scene, 700, 1300, 20, 90)) {
    if (std::abs(std::abs(sample.x_mm - 1000) - 200) < 3) continue;
    const double top_mm = 541 + slope * (sample.x_mm - 1000);
    const bool top = std::abs(sample.x_mm - 1000) < 200;
    ++(top ? on_top : on_table);
    ASSERT_NEAR(sample.reading.distance_mm, 770 - 130 - (top ? top_mm : top_mm - rise), 2e-4) << sample.x_mm;
  }
  EXPECT_GT(on_table, 5000);
  EXPECT_GT(on_top, 5000);
}

TEST(Laser, PlaneAlongTheEdgeStepsAtTheEdge) {
  // Receiver across the travel: no shadow, the step stands where the bar ends.
  EXPECT_NEAR(crossing(sweep(quiet(), 780, 820, 20, 90), 120), 800, 0.05);
  EXPECT_NEAR(crossing(sweep(quiet(), 820, 780, 20, 90), 120), 800, 0.05);
}

TEST(Laser, ShadowIsHeightTimesTangent) {
  // Travelling +x over the bar's far end at 1200 with the receiver towards -x, over the bar: the foot is
  // hidden.
  const Scene scene = quiet();
  const auto samples = sweep(scene, 1180, 1230, 20, 180);
  double first_hidden = 0, last_hidden = 0;
  for (const Sample& sample : samples) {
    if (sample.reading.code == 0) continue;
    EXPECT_EQ(sample.reading.code, 0x7FFFFFFBU);
    if (first_hidden == 0) first_hidden = sample.x_mm;
    last_hidden = sample.x_mm;
  }
  // At the table the receiver is seen under atan(baseline / 270 mm).
  const double length = 40 * 230 * std::tan(scene.laser.triangulation_rad) / 270;
  EXPECT_NEAR(last_hidden, 1200 + length, 0.6);
  EXPECT_NEAR(first_hidden, 1200, 0.9);
  // Receiver away from the bar: nothing is hidden.
  for (const Sample& sample : sweep(scene, 1180, 1230, 20, 0))
    EXPECT_EQ(sample.reading.code, 0U) << sample.x_mm;
}

TEST(Laser, RoundEdgeLowersTheReadingGradually) {
  Scene scene = quiet();
  scene.workpiece.members[0].edge_radius_mm = 4;
  scene.truth = {900, 300, rad(-90)};  // long sides now across x: x in [900, 940]
  for (const Sample& sample : sweep(scene, 902, 920, 100, 90)) {
    const double inside = sample.x_mm - 900;
    if (sample.reading.code != 0 || inside < 2.6) continue;
    const double expected = inside >= 4 ? 0 : 4 - std::sqrt(16 - (4 - inside) * (4 - inside));
    EXPECT_NEAR(sample.reading.distance_mm - 100, expected, 0.06) << inside;
  }
}

TEST(Laser, RangeEndsAreToldApart) {
  const Scene scene = quiet();
  for (const Sample& sample : sweep(scene, 600, 601, 0, 0, 100, 500 + 120))
    EXPECT_EQ(sample.reading.code, 0x7FFFFFFAU);
  for (const Sample& sample : sweep(scene, 600, 601, 0, 0, 100, 500 + 340))
    EXPECT_EQ(sample.reading.code, 0x7FFFFFF9U);
}

TEST(Laser, NoiseHasItsSizeAndSpeckleRepeats) {
  Scene scene = quiet();
  scene.laser.noise_mm = 0.08;
  double sum = 0, squares = 0;
  const auto samples = sweep(scene, 600, 700, 300, 90);
  for (const Sample& sample : samples) {
    sum += sample.reading.distance_mm - 140;
    squares += std::pow(sample.reading.distance_mm - 140, 2);
  }
  const double n = static_cast<double>(samples.size());
  EXPECT_NEAR(sum / n, 0, 5 * 0.08 / std::sqrt(n));
  EXPECT_NEAR(std::sqrt(squares / n), 0.08, 0.004);

  scene.laser.noise_mm = 0;
  scene.laser.speckle_mm = 0.05;
  const auto there = sweep(scene, 600, 650, 300, 90), back = sweep(scene, 650, 600, 300, 90);
  double same = 0, power = 0;
  for (std::size_t i = 1; i + 1 < std::min(there.size(), back.size()); ++i) {
    const Sample& other = back[there.size() - i];
    ASSERT_NEAR(there[i].x_mm, other.x_mm, 0.03);
    same += (there[i].reading.distance_mm - 140) * (other.reading.distance_mm - 140);
    power += std::pow(there[i].reading.distance_mm - 140, 2);
  }
  EXPECT_GT(same / power, 0.95);
}

TEST(Laser, ClockDriftsAndStampsTheLatency) {
  Scene scene = quiet();
  scene.laser.clock = {12.3, 50};
  scene.laser.latency_ms = 2.7;
  const auto samples = sweep(scene, 600, 1100, 300, 90, 50);
  for (const std::size_t k : {std::size_t{0}, samples.size() - 1}) {
    const double expected = 12.3 + (samples[k].host_s + 0.0027) * (1 + 50e-6);
    EXPECT_NEAR(samples[k].reading.timestamp_us * 1e-6, expected, 2e-6);
    EXPECT_EQ(samples[k].reading.counter, k);
  }
}

TEST(Laser, BlocksArriveInOrderNotBeforeTheyAreReady) {
  const Scene scene = test_scene();
  LaserDevice laser(scene);
  HostTime last;
  int blocks = 0;
  for (int i = 1; i <= 500; ++i) {
    const HostTime now{i * 4 * kMillisecond};
    for (const LaserBlock& block : laser.advance(now, [](HostTime) { return Transform<Base, Flange>{}; })) {
      EXPECT_GE(block.arrival, last);
      EXPECT_GE(block.arrival.ns, now.ns - 4 * kMillisecond + 2'700'000);
      last = block.arrival;
      ++blocks;
    }
  }
  EXPECT_NEAR(blocks, 500, 2);
}

TEST(Laser, DropLosesAndStallHoldsBack) {
  LaserDevice laser(test_scene());
  const auto pose = [](HostTime) { return Transform<Base, Flange>{}; };
  laser.advance({kSecond}, pose);
  EXPECT_FALSE(laser.inject("nonsense", 1));
  ASSERT_TRUE(laser.inject("laser_drop", 0.5));
  EXPECT_FALSE(laser.connected());
  for (const LaserBlock& block : laser.advance({kSecond + 400 * kMillisecond}, pose))
    ADD_FAILURE() << block.arrival.ns;
  EXPECT_FALSE(laser.advance({2 * kSecond}, pose).empty());
  EXPECT_TRUE(laser.connected());
  ASSERT_TRUE(laser.inject("laser_stall", 0.5));
  for (const LaserBlock& block : laser.advance({2 * kSecond + 100 * kMillisecond}, pose)) {
    EXPECT_GE(block.arrival.ns, 2 * kSecond + 500 * kMillisecond);
  }
}

TEST(LaserLight, BrightnessFollowsTheLobe) {
  const Eigen::Vector3d down(0, 0, -1), place(0, 0, 500);
  const auto at = [&](double off_deg) {
    return Eigen::Vector3d(std::sin(rad(off_deg)), 0, std::cos(rad(off_deg)));
  };
  EXPECT_DOUBLE_EQ(brightness(Finish::Ideal, down, at(60), place, 1), 1);
  EXPECT_NEAR(brightness(Finish::Ceramic, down, at(20), place, 1), std::cos(rad(20)), 1e-12);
  // Ground steel: 0.35 (cos a + 0.5 exp(-(a / 5 deg)^2)).
  EXPECT_NEAR(brightness(Finish::GroundSteel, down, at(5), place, 1),
              0.35 * (std::cos(rad(5)) + 0.5 / std::exp(1)), 1e-9);
  EXPECT_NEAR(brightness(Finish::GroundSteel, down, at(20), place, 1), 0.35 * std::cos(rad(20)), 1e-7);
  // A beam that leans by a half of the receiver's angle throws its mirror image into it.
  EXPECT_NEAR(brightness(Finish::GroundSteel, Eigen::Vector3d(std::sin(rad(10)), 0, -std::cos(rad(10))),
                         at(10), place, 1),
              0.35 * (std::cos(rad(10)) + 0.5), 1e-9);
  double least = 9, most = 0;
  for (int i = 0; i < 400; ++i) {
    const double light = brightness(Finish::Galvanized, down, at(20), {8.0 * i, 0, 500}, 1);
    least = std::min(least, light), most = std::max(most, light);
  }
  EXPECT_NEAR(least / (0.5 * std::cos(rad(20))), 0.5, 0.05);
  EXPECT_NEAR(most / (0.5 * std::cos(rad(20))), 1.5, 0.05);
}

TEST(LaserLight, GainIsFourSamplesLate) {
  ExposureLoop loop;
  for (int i = 0; i < 8; ++i) loop.next(0.1);
  EXPECT_NEAR(loop.next(0.1).noise_factor, 1, 1e-12);
  for (int i = 0; i < 4; ++i) EXPECT_EQ(loop.next(0.5).noise_factor, 5) << i;  // five times too bright
  EXPECT_NEAR(loop.next(0.5).noise_factor, 1, 1e-12);
  for (int i = 0; i < 4; ++i)
    EXPECT_NEAR(loop.next(0.25).noise_factor, std::sqrt(2), 1e-12) << i;  // half as bright
  EXPECT_NEAR(loop.next(0.25).noise_factor, 1, 1e-12);
  EXPECT_TRUE(loop.next(0.25 * 17).lost);    // burnt out
  EXPECT_TRUE(loop.next(0.25 * 0.07).lost);  // too dark
  EXPECT_FALSE(loop.next(0.25 * 0.09).lost);
}

TEST(LaserLight, CharacteristicAndTiltHaveTheirStatedSize) {
  double peak = 0;
  for (int i = 0; i <= 2000; ++i) peak = std::max(peak, std::abs(linearity_error_mm(i * 0.1, 200, 0.001)));
  EXPECT_NEAR(peak, 0.2, 1e-4);
  EXPECT_EQ(linearity_error_mm(50, 200, 0), 0);
  const Eigen::Vector3d receiver(1, 0, 0);
  const auto lean = [&](double deg_x) {
    return tilt_error_mm({std::sin(rad(deg_x)), 0, -std::cos(rad(deg_x))}, receiver, 200);
  };
  EXPECT_NEAR(lean(0), 0, 1e-12);
  EXPECT_NEAR(lean(5), 0.24, 1e-9);
  EXPECT_NEAR(lean(15), 0.4, 1e-9);
  EXPECT_NEAR(lean(-30), -1.0, 1e-9);
  EXPECT_NEAR(tilt_error_mm({0, std::sin(rad(15)), -std::cos(rad(15))}, receiver, 200), 0, 1e-12);
}

TEST(Laser, FourSamplesAreSaturatedAfterABrighterSurface) {
  Scene scene = quiet();
  scene.laser.beam_spot = false;  // the light jumps from one sample to the next
  scene.laser.part = Finish::MillScale;
  scene.laser.table = Finish::Ceramic;
  const auto clean = sweep(scene, 1195, 1205, 20, 90);
  scene.laser.noise_mm = 0.05;
  const auto right_gain = sweep(scene, 1195, 1205, 20, 90);
  scene.laser.exposure_loop = true;
  const auto late_gain = sweep(scene, 1195, 1205, 20, 90);
  ASSERT_EQ(clean.size(), late_gain.size());
  int saturated = 0, judged = 0;
  for (std::size_t i = 8; i < clean.size(); ++i) {  // the first samples set the gain
    ASSERT_EQ(late_gain[i].reading.code, 0U);
    const double plain = right_gain[i].reading.distance_mm - clean[i].reading.distance_mm;
    if (std::abs(plain) < 1e-3) continue;
    const double factor = (late_gain[i].reading.distance_mm - clean[i].reading.distance_mm) / plain;
    ++judged;
    if (std::abs(factor - 5) < 0.1) {
      ++saturated;
      EXPECT_NEAR(clean[i].x_mm, 1200, 0.15);
    } else {
      EXPECT_NEAR(factor, 1, 0.1) << clean[i].x_mm;
    }
  }
  EXPECT_GT(judged, 400);
  EXPECT_GE(saturated, 3);  // one may be hidden by a noise close to zero
  EXPECT_LE(saturated, 4);
}

TEST(Laser, TheBrighterSideTakesMoreOfTheEdge) {
  // The peak changes sides where both hold as much light: at the quantile of a Gaussian spot of sigma D / 4.
  Scene scene = quiet();
  scene.laser.part = Finish::GroundSteel;
  scene.laser.table = Finish::Ceramic;  // 2.9 times as bright: 0.654 sigma into the bar
  EXPECT_NEAR(crossing(sweep(scene, 780, 820, 20, 90), 120) - 800, 0.654 * 1.1 / 4, 0.06);
  EXPECT_NEAR(crossing(sweep(scene, 1180, 1220, 20, 90), 120) - 1200, -0.654 * 1.1 / 4, 0.06);
  std::swap(scene.laser.part, scene.laser.table);
  EXPECT_NEAR(crossing(sweep(scene, 780, 820, 20, 90), 120) - 800, -0.654 * 1.1 / 4, 0.06);
}

TEST(Laser, CharacteristicShiftsTheReading) {
  Scene scene = quiet();
  scene.laser.linearity_share = 0.001;
  // 50 of 200 mm, where the characteristic has its peak.
  for (const Sample& sample : sweep(scene, 600, 602, 20, 90, 100, 500 + 130 + 50))
    EXPECT_NEAR(sample.reading.distance_mm, 50.2, 1e-4);
}

TEST(Laser, LightByWayOfASideReadsTooFarAndOnlyThere) {
  Scene scene = quiet();
  scene.laser.secondary_share = 0.25;
  int far = 0, near_edge = 0;
  for (const Sample& sample : sweep(scene, 700, 799.9, 20, 90)) {
    ASSERT_EQ(sample.reading.code, 0U);
    const double beyond = sample.reading.distance_mm - 140;
    if (beyond > 0.5) {
      ++far;
      EXPECT_LE(beyond, 8.001);
      EXPECT_GT(sample.x_mm, 790) << "far from any member";
    }
    near_edge += sample.x_mm > 799.3;
  }
  EXPECT_GT(far, near_edge / 8);
}

}  // namespace weldcell::sim
