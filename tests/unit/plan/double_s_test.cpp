#include "weldcell/plan/double_s.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <random>

namespace weldcell::plan {
namespace {

constexpr std::uint64_t kSeed = 31415;

TEST(DoubleS, KeepsItsLimitsAndArrives) {
  std::printf("seed %llu\n", static_cast<unsigned long long>(kSeed));
  std::mt19937_64 random(kSeed);
  std::uniform_real_distribution<double> decade(-3, 3);
  int cruising = 0, full_ramp = 0, jerk_only = 0;
  for (int n = 0; n < 20000; ++n) {
    const double length = std::pow(10, decade(random)), v = std::pow(10, decade(random)),
                 a = std::pow(10, decade(random)), j = std::pow(10, decade(random));
    const DoubleS s = double_s(length, v, a, j);
    SCOPED_TRACE(::testing::Message() << "L " << length << " V " << v << " A " << a << " J " << j);
    const double t = s.duration_s();
    ASSERT_LE(s.peak_speed(), v * (1 + 1e-12));
    ASSERT_LE(s.peak_acceleration(), a * (1 + 1e-12));
    // Arrives by its own motion, not by the clamp at the end.
    ASSERT_NEAR(s.at(t * (1 - 1e-12)).position, length, 1e-9 * length);
    ASSERT_NEAR(s.peak_speed() * (s.ramp_s + s.cruise_s), length, 1e-9 * length);
    double before = 0;
    for (int k = 0; k <= 50; ++k) {
      const ProfilePoint p = s.at(t * k / 50);
      ASSERT_GE(p.position, before - 1e-12 * length);
      ASSERT_LE(p.speed, v * (1 + 1e-9));
      ASSERT_LE(std::abs(p.acceleration), a * (1 + 1e-9));
      ASSERT_LE(std::abs(p.jerk), j * (1 + 1e-9));
      before = p.position;
    }
    cruising += s.cruise_s > 0;
    full_ramp += s.ramp_s > 2 * s.jerk_s * (1 + 1e-12);
    jerk_only += s.cruise_s == 0 && s.ramp_s == 2 * s.jerk_s;
  }
  EXPECT_GT(cruising, 1000);
  EXPECT_GT(full_ramp, 1000);
  EXPECT_GT(jerk_only, 1000);
}

TEST(DoubleS, IsTheDerivativeOfItself) {
  std::mt19937_64 random(kSeed + 1);
  std::uniform_real_distribution<double> factor(0.2, 5);
  for (int n = 0; n < 500; ++n) {
    const DoubleS s = double_s(factor(random), factor(random), factor(random), factor(random));
    const double h = 1e-5 * s.duration_s();
    for (int k = 1; k < 40; ++k) {
      const double t = s.duration_s() * k / 40;
      ASSERT_NEAR((s.at(t + h).position - s.at(t - h).position) / (2 * h), s.at(t).speed, 1e-3);
      ASSERT_NEAR((s.at(t + h).speed - s.at(t - h).speed) / (2 * h), s.at(t).acceleration, 1e-2);
    }
  }
}

TEST(DoubleS, IsTimeOptimal) {
  // Each profile uses one limit fully at every instant; the known optimum of three hand cases.
  EXPECT_NEAR(double_s(1, 100, 100, 2).duration_s(), 4 * std::cbrt(0.25), 1e-12);  // jerk only
  EXPECT_NEAR(double_s(100, 1, 10, 1e9).duration_s(), 100 + 0.1, 1e-6);            // trapezoid
  EXPECT_NEAR(double_s(4, 1e3, 1, 1e9).duration_s(), 4, 1e-6);                     // triangle
  EXPECT_EQ(double_s(0, 1, 1, 1).duration_s(), 0);
}

}  // namespace
}  // namespace weldcell::plan
