// Good edge sets, broken at random: whatever is still accepted must lie where the part lies.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <random>

#include "edge_sets.hpp"
#include "weldcell/localize/localizer.hpp"

namespace weldcell::localize {
namespace {

const std::string kFolder = WELDCELL_TEST_DATA "/edges";
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();

/// An accepted pose is known to 1 mm and about 0.2 degrees (2 sigmas): nothing accepted may lie farther off
/// than half as much again.
constexpr double kMost_mm = 1.5;
constexpr double kMost_rad = rad(0.3);

class Mutator {
 public:
  explicit Mutator(std::uint64_t seed) : random_(seed) {}

  /// Up to four kinds of damage, one after the other; returns their names.
  std::string damage(testing::EdgeSet& set) {
    std::string said;
    for (int i = 1 + static_cast<int>(random_() % 4); i > 0; --i) {
      const auto& kind = kKinds[random_() % kKinds.size()];
      (this->*kind.second)(set);
      said += std::string(said.empty() ? "" : ", ") + kind.first;
    }
    return said;
  }

 private:
  using Damage = void (Mutator::*)(testing::EdgeSet&);
  static const std::array<std::pair<const char*, Damage>, 16> kKinds;

  double uniform(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }
  bool chance(double p) { return uniform(0, 1) < p; }
  double bad_number() {
    constexpr std::array<double, 8> kBad{kNan, kInf, -kInf, 1e300, -1e9, 0, -1, 1e-320};
    return kBad[random_() % kBad.size()];
  }

  void drop(testing::EdgeSet& set) {
    const double p = uniform(0, 1);
    std::erase_if(set.edges, [&](const EdgePoint&) { return chance(p); });
  }
  void keep_one_side(testing::EdgeSet& set) {
    const double a = uniform(0, 2 * kPi), limit = uniform(-400, 400);
    const Vec2 n(std::cos(a), std::sin(a));
    std::erase_if(set.edges, [&](const EdgePoint& e) { return n.dot(Vec2(e.x_mm, e.y_mm)) > limit; });
  }
  void keep_one_direction(testing::EdgeSet& set) {
    const bool along_x = chance(0.5);
    std::erase_if(set.edges,
                  [&](const EdgePoint& e) { return along_x == (std::abs(e.dir_x) > std::abs(e.dir_y)); });
  }
  void cut_short(testing::EdgeSet& set) { set.edges.resize(set.edges.size() * (random_() % 100) / 100); }
  void repeat(testing::EdgeSet& set) {
    if (set.edges.empty()) return;
    const EdgePoint e = set.edges[random_() % set.edges.size()];
    set.edges.insert(set.edges.end(), random_() % 500, e);
  }
  void shake(testing::EdgeSet& set) {
    const double most = uniform(0, 1);
    for (EdgePoint& e : set.edges) e.x_mm += uniform(-most, most), e.y_mm += uniform(-most, most);
  }
  void scatter(testing::EdgeSet& set) {
    const std::size_t count = random_() % 150;
    for (std::size_t i = 0; i < count; ++i) {
      const double a = uniform(0, 2 * kPi);
      set.edges.push_back({uniform(-700, 700), uniform(-400, 400), std::cos(a), std::sin(a),
                           static_cast<int>(random_() % 3) - 1, 0.3, 200, false});
    }
  }
  void add_line(testing::EdgeSet& set) {
    const double a = uniform(0, 2 * kPi), x = uniform(-300, 300), y = uniform(-300, 300);
    for (int i = 0; i < 40; ++i) {
      const double t = 10 * i;
      set.edges.push_back({x + t * std::cos(a), y + t * std::sin(a), -std::sin(a), std::cos(a),
                           chance(0.5) ? 1 : -1, 0.3, 200, false});
    }
  }
  void break_places(testing::EdgeSet& set) {
    const double p = uniform(0, 0.2);
    for (EdgePoint& e : set.edges) {
      if (chance(p)) (chance(0.5) ? e.x_mm : e.y_mm) = bad_number();
    }
  }
  void break_directions(testing::EdgeSet& set) {
    const double p = uniform(0, 0.2);
    for (EdgePoint& e : set.edges) {
      if (chance(p)) (chance(0.5) ? e.dir_x : e.dir_y) = bad_number();
    }
  }
  void break_sigmas(testing::EdgeSet& set) {
    const double p = uniform(0, 1);
    for (EdgePoint& e : set.edges) {
      if (chance(p)) e.sigma_mm = bad_number();
    }
  }
  void break_speeds(testing::EdgeSet& set) {
    const double p = uniform(0, 1);
    for (EdgePoint& e : set.edges) {
      if (chance(p)) e.speed_mm_s = bad_number();
    }
  }
  void turn_steps(testing::EdgeSet& set) {
    const double p = uniform(0, 1);
    for (EdgePoint& e : set.edges) {
      if (chance(p)) e.step = chance(0.5) ? -e.step : 0;
    }
  }
  void shuffle(testing::EdgeSet& set) { std::shuffle(set.edges.begin(), set.edges.end(), random_); }
  void lose_path(testing::EdgeSet& set) { set.path.clear(); }
  void break_path(testing::EdgeSet& set) {
    const double p = uniform(0, 0.2);
    for (PathPiece& piece : set.path) {
      if (chance(p)) (chance(0.5) ? piece.x0_mm : piece.y1_mm) = bad_number();
    }
  }

  std::mt19937_64 random_;
};

const std::array<std::pair<const char*, Mutator::Damage>, 16> Mutator::kKinds{
    {{"points dropped", &Mutator::drop},
     {"one side of the part only", &Mutator::keep_one_side},
     {"one direction of travel only", &Mutator::keep_one_direction},
     {"scan cut short", &Mutator::cut_short},
     {"a point repeated", &Mutator::repeat},
     {"points shaken", &Mutator::shake},
     {"clutter", &Mutator::scatter},
     {"a straight thing on the table", &Mutator::add_line},
     {"places broken", &Mutator::break_places},
     {"directions broken", &Mutator::break_directions},
     {"sigmas broken", &Mutator::break_sigmas},
     {"speeds broken", &Mutator::break_speeds},
     {"steps turned", &Mutator::turn_steps},
     {"shuffled", &Mutator::shuffle},
     {"path lost", &Mutator::lose_path},
     {"path broken", &Mutator::break_path}}};

bool positive_semidefinite(const Eigen::Matrix3d& covariance) {
  if (!covariance.allFinite()) return false;
  const Eigen::Vector3d d = covariance.diagonal();
  return d.minCoeff() >= 0 && (covariance - covariance.transpose()).norm() <= 1e-6 * covariance.norm() &&
         covariance.determinant() >= -1e-9 * d.prod();
}

class Mutations : public ::testing::TestWithParam<const char*> {};

TEST_P(Mutations, WhatIsAcceptedLiesWhereThePartLies) {
  constexpr std::uint64_t kSeed = 20261126;
  constexpr std::array<const char*, 5> kSets{"base", "out10", "wide", "lat8zig", "missing"};
  const auto outline = workpiece::build_template(testing::read_workpiece(kFolder, GetParam()));
  ASSERT_TRUE(outline.ok());
  const Localizer localizer(*outline);
  std::map<std::string, int> causes;
  for (int trial = 0; trial < 400; ++trial) {
    const char* kind = kSets[static_cast<std::size_t>(trial) % kSets.size()];
    testing::EdgeSet set = testing::read_set(kFolder, GetParam(), kind, trial / 5 % 2);
    Mutator mutator(kSeed + static_cast<std::uint64_t>(trial));
    const std::string damage = mutator.damage(set);
    SCOPED_TRACE(std::string(GetParam()) + "/" + kind + " seed " +
                 std::to_string(kSeed + static_cast<std::uint64_t>(trial)) + ": " + damage);
    const Localization found = localizer.localize(set.edges, set.path, {});
    ++causes[found.cause];
    EXPECT_FALSE(found.cause.empty());
    EXPECT_FALSE(found.reason.empty());
    EXPECT_EQ(found.edge_of_point.size(), set.edges.size());
    EXPECT_EQ(found.residual_mm.size(), set.edges.size());
    EXPECT_TRUE(std::isfinite(found.pose.x_mm + found.pose.y_mm + found.pose.theta_rad));
    EXPECT_TRUE(positive_semidefinite(found.covariance)) << found.covariance;
    EXPECT_EQ(found.verdict == Verdict::Weld, found.cause == "ok");
    if (found.verdict != Verdict::Weld) continue;
    EXPECT_GT(found.covariance(2, 2), 0);
    double off_mm = 1e9, off_rad = 0;
    std::vector<Pose2> images{found.pose};
    for (const auto& s : outline->symmetries) {
      if (s.gap_mm == 0) images.push_back(found.pose * s.map);
    }
    for (const Pose2& image : images) {
      const Offset off = offset_from_planned(*outline, set.truth, image);
      const double here = std::hypot(off.dx_mm, off.dy_mm);
      if (here < off_mm) off_mm = here, off_rad = std::abs(off.dtheta_rad);
    }
    EXPECT_LT(off_mm, kMost_mm) << found.points << " points, " << found.inliers << " on the part";
    EXPECT_LT(off_rad, kMost_rad) << found.points << " points, " << found.inliers << " on the part";
  }
  for (const auto& [cause, count] : causes) std::printf("%s: %-16s %d\n", GetParam(), cause.c_str(), count);
  // Damage that is refused altogether would prove nothing about what is accepted.
  EXPECT_GT(causes["ok"], 40);
}

INSTANTIATE_TEST_SUITE_P(All, Mutations, ::testing::Values("ladder", "nearsym", "rect"),
                         [](const auto& name) { return std::string(name.param); });

}  // namespace
}  // namespace weldcell::localize
