// What any rule can reach where two members alone tell how far members stray: computed from true
// correspondences and true laws, beside which the rows of the localizer are to be read.
#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <random>

#include "book.hpp"
#include "weldcell/base/units.hpp"

namespace weldcell::bench {

namespace {

using Vector3 = Eigen::Vector3d;

/// How far members stray in shares of 1 mm / 0.25 deg: as drawn, half, whole.
constexpr std::array<double, 3> kStray{0, 0.5, 1};
constexpr int kInside = 1000;  ///< samples of each integral over a law

/// Two members whose own poses are measured; frame Part about the template's centroid.
struct Pair {
  std::array<Eigen::Matrix3d, 2> carried;  ///< a member's motion about its centroid when the part moves
};

Pair pair_of(const workpiece::OutlineTemplate& outline) {
  Pair out;
  for (std::size_t m = 0; m < 2; ++m) {
    const Vec2 arm = centroid(outline.members[m]) - outline.centroid;
    out.carried[m].setIdentity();
    out.carried[m](0, 2) = -arm.y();
    out.carried[m](1, 2) = arm.x();
  }
  return out;
}

Vector3 within(std::mt19937_64& random, const Vector3& limits) {
  std::uniform_real_distribution<double> uniform(-1, 1);
  return Vector3(uniform(random), uniform(random), uniform(random)).cwiseProduct(limits);
}

Vector3 limits_of(double stray) { return stray * Vector3(1, 1, rad(0.25)); }

/// Error of the best linear estimate when the members are off by u.
Vector3 error_of_best(const Pair& pair, const std::array<Vector3, 2>& u) {
  const Vector3 weight = limits_of(1).cwiseAbs2().cwiseInverse();
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Vector3 right = Vector3::Zero();
  for (std::size_t m = 0; m < 2; ++m) {
    normal += pair.carried[m].transpose() * weight.asDiagonal() * pair.carried[m];
    right += pair.carried[m].transpose() * weight.asDiagonal() * u[m];
  }
  return normal.ldlt().solve(right);
}

/// Densities, up to a common factor, of what can be seen (the members' places against each other) together
/// with the estimate being right, and being wrong, when members stray by `stray`.
struct Densities {
  double right = 0, wrong = 0;
};
Densities densities(const Pair& pair, const std::array<Vector3, 2>& u, double stray,
                    std::mt19937_64& random) {
  const Vector3 limits = limits_of(stray), estimate = error_of_best(pair, u);
  const Eigen::Matrix3d back = pair.carried[0].inverse();
  Densities out;
  for (int i = 0; i < kInside; ++i) {
    const Vector3 pose = back * (u[0] - within(random, limits));
    const Vector3 other = u[1] - pair.carried[1] * pose;
    if ((other.cwiseAbs().array() > limits.array()).any()) continue;
    (good(estimate - pose) ? out.right : out.wrong) += 1 / (kInside * limits.prod());
  }
  return out;
}

/// The least share of wrong poses at 1 mm that a rule can accept which refuses 5 % of the right ones at
/// 0.5 mm: by the lemma of Neyman and Pearson the one that compares the two densities.
void least_false_accepts(Book& book, const PartUnderTest& part, std::uint64_t seed) {
  const Pair pair = pair_of(part.outline());
  std::mt19937_64 random(seed);
  struct Draw {
    double ratio = 0;
    bool right = false;
  };
  std::array<std::vector<Draw>, 2> draws;
  const int trials = 10 * book.options.trials;
  for (std::size_t law = 0; law < 2; ++law) {
    for (int i = 0; i < trials; ++i) {
      const Vector3 limits = limits_of(kStray[law + 1]);
      const std::array<Vector3, 2> u{within(random, limits), within(random, limits)};
      const Densities half = densities(pair, u, 0.5, random), whole = densities(pair, u, 1, random);
      draws[law].push_back({half.right > 0 ? whole.wrong / half.right : 1e300, good(error_of_best(pair, u))});
    }
  }
  std::sort(draws[0].begin(), draws[0].end(), [](const Draw& a, const Draw& b) { return a.ratio < b.ratio; });
  const double limit = draws[0][static_cast<std::size_t>(0.95 * trials)].ratio;
  const auto wrong = std::count_if(draws[1].begin(), draws[1].end(),
                                   [&](const Draw& d) { return !d.right && d.ratio <= limit; });
  const double share = static_cast<double>(wrong) / trials;
  book.add("frontier " + part.workpiece.name + " false accept at 1 mm, 5 % refused at 0.5 mm", 100 * share,
           "%", NAN, NAN, Better::None, 100 * std::sqrt(share * (1 - share) / trials));
}

/// A member's own place as its points show it, about its centroid, with the covariance of noise alone.
struct Seen {
  Vector3 place = Vector3::Zero();
  Eigen::Matrix3d noise = Eigen::Matrix3d::Zero();
};

std::array<Seen, 2> seen_members(const workpiece::OutlineTemplate& outline, const EdgeSet& set,
                                 double sigma) {
  constexpr double kUnseen = 1 / (5.0 * 5.0);  // 1/mm2: what no point shows
  std::array<Eigen::Matrix3d, 2> information;
  std::array<Vector3, 2> right{Vector3::Zero(), Vector3::Zero()};
  for (Eigen::Matrix3d& each : information) each = Vector3(kUnseen, kUnseen, 1).asDiagonal();
  const Pose2 to_part = set.truth.inverse();
  for (std::size_t i = 0; i < set.edges.size(); ++i) {
    if (set.edge_of_point[i] < 0) continue;
    const workpiece::VisibleEdge& e = outline.edges[static_cast<std::size_t>(set.edge_of_point[i])];
    const auto m = static_cast<std::size_t>(e.member);
    const Vec2 p = to_part * Vec2(set.edges[i].x_mm, set.edges[i].y_mm), n = e.outward;
    const Vec2 arm = p - centroid(outline.members[m]);
    const Vector3 row(n.x(), n.y(), n.y() * arm.x() - n.x() * arm.y());
    information[m] += row * row.transpose() / (sigma * sigma);
    right[m] += row * (p - e.line.a).dot(n) / (sigma * sigma);
  }
  std::array<Seen, 2> out;
  for (std::size_t m = 0; m < 2; ++m) {
    out[m].noise = information[m].inverse();
    out[m].place = out[m].noise * right[m];
  }
  return out;
}

/// The estimate under one law and how likely the members' places against each other are under it.
struct Judged {
  double nees = 0, log_density = 0;
};
Judged judged(const Pair& pair, const std::array<Seen, 2>& seen, double stray) {
  const Vector3 variance = limits_of(stray).cwiseAbs2() / 3;
  std::array<Eigen::Matrix3d, 2> spread;
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Vector3 right = Vector3::Zero();
  for (std::size_t m = 0; m < 2; ++m) {
    spread[m] = seen[m].noise;
    spread[m].diagonal() += variance;
    const Eigen::Matrix3d weighed = pair.carried[m].transpose() * spread[m].inverse();
    normal += weighed * pair.carried[m];
    right += weighed * seen[m].place;
  }
  const Eigen::Matrix3d over = pair.carried[0] * pair.carried[1].inverse();
  const Vector3 apart = seen[0].place - over * seen[1].place;
  const Eigen::Matrix3d covariance = spread[0] + over * spread[1] * over.transpose();
  // The truth is zero, so the estimate is the error and the normal matrix its inverse covariance.
  const Vector3 error = normal.ldlt().solve(right);
  return {error.dot(normal * error) / 3,
          -0.5 * (std::log(covariance.determinant()) + apart.dot(covariance.ldlt().solve(apart)))};
}

/// NEES at 0.5 mm and 1 mm of the rule that takes parts for as drawn by the likelihood ratio and else claims
/// what the true law allows, set so that its NEES of parts as drawn is 0.7.
void least_nees(Book& book, const PartUnderTest& part, std::uint64_t seed) {
  struct Draw {
    double ratio, drawn, strayed;
  };
  const Pair pair = pair_of(part.outline());
  const int trials = 3 * book.options.trials;
  for (const double stray : {kStray[1], kStray[2]}) {
    std::array<std::vector<Draw>, 2> draws;
    for (std::size_t law = 0; law < 2; ++law) {
      Setting s;
      s.member_mm = law == 0 ? 0 : stray, s.member_deg = 0.25 * s.member_mm;
      for (int i = 0; i < trials; ++i) {
        const EdgeSet set = make_set(part.outline(), s, seed + static_cast<std::uint64_t>(i));
        const std::array<Seen, 2> seen = seen_members(part.outline(), set, s.sigma_mm);
        const Judged drawn = judged(pair, seen, 0), strayed = judged(pair, seen, stray);
        draws[law].push_back({drawn.log_density - strayed.log_density, drawn.nees, strayed.nees});
      }
    }
    std::sort(draws[0].begin(), draws[0].end(),
              [](const Draw& a, const Draw& b) { return a.ratio > b.ratio; });
    double sum = 0;
    for (const Draw& d : draws[0]) sum += d.strayed;
    double limit = draws[0].front().ratio;
    for (const Draw& d : draws[0]) {
      sum += d.drawn - d.strayed;
      limit = d.ratio;
      if (sum >= 0.7 * trials) break;
    }
    double nees = 0, square = 0;
    for (const Draw& d : draws[1]) {
      const double one = d.ratio >= limit ? d.drawn : d.strayed;
      nees += one / trials, square += one * one / trials;
    }
    book.add("frontier " + part.workpiece.name + (stray < 1 ? " NEES at 0.5 mm" : " NEES at 1 mm") +
                 ", 0.7 as drawn",
             nees, "1", NAN, NAN, Better::None, std::sqrt(std::max(0.0, square - nees * nees) / trials));
  }
}

}  // namespace

void frontier(Book& book) {
  book.each_part([&](const PartUnderTest& part, std::uint64_t seed) {
    if (part.workpiece.members.size() != 2 || !book.wanted("frontier " + part.workpiece.name)) return;
    least_false_accepts(book, part, seed);
    least_nees(book, part, seed);
  });
}

}  // namespace weldcell::bench
