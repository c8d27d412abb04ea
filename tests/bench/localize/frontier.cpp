// What any rule can reach where two to five members alone tell how far members stray: computed from true
// correspondences and true laws, beside which the rows of the localizer are to be read.
#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "book.hpp"
#include "weldcell/base/units.hpp"

namespace weldcell::bench {

namespace {

using Vector3 = Eigen::Vector3d;

/// How far members stray in shares of 1 mm / 0.25 deg: as drawn, half, whole.
constexpr std::array<double, 3> kStray{0, 0.5, 1};
constexpr int kInside = 1000;  ///< samples of each integral over a law
constexpr std::size_t kMostMembers = 5;

/// How each member's own pose (about its centroid) moves with the part; frame Part about the template's
/// centroid.
using Carried = std::vector<Eigen::Matrix3d>;

Carried carried_of(const workpiece::OutlineTemplate& outline) {
  Carried out(outline.members.size(), Eigen::Matrix3d::Identity());
  for (std::size_t m = 0; m < out.size(); ++m) {
    const Vec2 arm = centroid(outline.members[m]) - outline.centroid;
    out[m](0, 2) = -arm.y();
    out[m](1, 2) = arm.x();
  }
  return out;
}

Vector3 within(std::mt19937_64& random, const Vector3& limits) {
  std::uniform_real_distribution<double> uniform(-1, 1);
  return Vector3(uniform(random), uniform(random), uniform(random)).cwiseProduct(limits);
}

Vector3 limits_of(double stray) { return stray * Vector3(1, 1, rad(0.25)); }

/// A member's own place as its points show it, about its centroid, with the covariance of noise alone.
struct Seen {
  Vector3 place = Vector3::Zero();
  Eigen::Matrix3d noise = Eigen::Matrix3d::Zero();
};

std::vector<Seen> seen_members(const workpiece::OutlineTemplate& outline, const EdgeSet& set, double sigma) {
  constexpr double kUnseen = 1 / (5.0 * 5.0);  // 1/mm2: what no point shows
  const std::size_t members = outline.members.size();
  std::vector<Eigen::Matrix3d> information(members, Vector3(kUnseen, kUnseen, 1).asDiagonal());
  std::vector<Vector3> right(members, Vector3::Zero());
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
  std::vector<Seen> out(members);
  for (std::size_t m = 0; m < members; ++m) {
    out[m].noise = information[m].inverse();
    out[m].place = out[m].noise * right[m];
  }
  return out;
}

/// What a scan shows of one member's place: its angle, and its shift or one component of it.
struct View {
  bool whole = true;
  Vec2 along = Vec2::UnitX();  ///< the component, where not the whole shift is seen
};

std::vector<View> views_in(const workpiece::OutlineTemplate& outline, const EdgeSet& set, double sigma) {
  constexpr double kSeen_mm = 0.5;
  std::vector<View> out;
  for (const Seen& seen : seen_members(outline, set, sigma)) {
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes(seen.noise.topLeftCorner<2, 2>());
    out.push_back({axes.eigenvalues()(1) < kSeen_mm * kSeen_mm, axes.eigenvectors().col(0)});
  }
  return out;
}

/// Density of what is seen of a member that is off by `by`, uniform within the limits.
double density(const View& view, const Vector3& by, const Vector3& limits) {
  if (std::abs(by.z()) > limits.z()) return 0;
  const double angle = 1 / (2 * limits.z());
  if (view.whole) {
    const bool within = std::abs(by.x()) <= limits.x() && std::abs(by.y()) <= limits.y();
    return within ? angle / (4 * limits.x() * limits.y()) : 0;
  }
  // The sum of two uniform ones.
  const double a = std::abs(view.along.x()) * limits.x(), b = std::abs(view.along.y()) * limits.y();
  const double longer = std::max(a, b), shorter = std::max(std::min(a, b), 1e-6);
  const double at = std::abs(view.along.dot(by.head<2>()));
  if (at >= longer + shorter) return 0;
  if (at <= longer - shorter) return angle / (2 * longer);
  return angle * (longer + shorter - at) / (4 * longer * shorter);
}

/// The best linear estimate from what is seen when the members are off by u, which is its error, and its
/// covariance when members stray by 1 mm.
struct Estimate {
  Vector3 error;
  Eigen::Matrix3d covariance;
};
Estimate best_estimate(const Carried& carried, const std::vector<View>& views,
                       const std::vector<Vector3>& u) {
  const Vector3 each = 3 * limits_of(1).cwiseAbs2().cwiseInverse();
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Vector3 right = Vector3::Zero();
  for (std::size_t m = 0; m < u.size(); ++m) {
    Eigen::Matrix3d weight = each.asDiagonal();
    if (!views[m].whole) {
      const Vec2& n = views[m].along;
      weight.topLeftCorner<2, 2>() = each.x() * n * n.transpose();
    }
    normal += carried[m].transpose() * weight * carried[m];
    right += carried[m].transpose() * weight * u[m];
  }
  return {normal.ldlt().solve(right), normal.inverse()};
}

/// Densities, up to a common factor, of what can be seen (the members' places against each other) together
/// with the estimate being right, and being wrong, when members stray by `stray`: over all poses that leave
/// every member within its limits, drawn about the estimate twice as wide as it is spread.
struct Densities {
  double right = 0, wrong = 0;
};
Densities densities(const Carried& carried, const std::vector<View>& views, const std::vector<Vector3>& u,
                    double stray, std::mt19937_64& random) {
  constexpr double kWider = 2;
  const Vector3 limits = limits_of(stray);
  const Estimate estimate = best_estimate(carried, views, u);
  const Eigen::Matrix3d spread = kWider * stray * estimate.covariance.llt().matrixL().toDenseMatrix();
  std::normal_distribution<double> normal(0, 1);
  Densities out;
  for (int i = 0; i < kInside; ++i) {
    const Vector3 z(normal(random), normal(random), normal(random));
    const Vector3 pose = estimate.error + spread * z;
    double law = spread.determinant() * std::exp(0.5 * z.squaredNorm()) / kInside;
    for (std::size_t m = 0; m < u.size() && law > 0; ++m)
      law *= density(views[m], u[m] - carried[m] * pose, limits);
    (good(estimate.error - pose) ? out.right : out.wrong) += law;
  }
  return out;
}

/// By the lemma of Neyman and Pearson no rule does better than the one that compares the two densities. What
/// it accepts of the wrong poses at 1 mm when it refuses 5 % of the right ones at 0.5 mm, how many right ones
/// at 1 mm that costs, and what it accepts when it refuses a fifth of the right ones at 1 mm itself.
void least_false_accepts(Book& book, const PartUnderTest& part, std::uint64_t seed) {
  const Carried carried = carried_of(part.outline());
  constexpr std::uint64_t kScans = 100;
  std::vector<std::vector<View>> views;
  for (std::uint64_t i = 0; i < kScans; ++i)
    views.push_back(
        views_in(part.outline(), make_set(part.outline(), Setting{}, seed + i), Setting{}.sigma_mm));
  std::mt19937_64 random(seed);
  struct Draw {
    double against_half = 0, against_whole = 0;  ///< wrong at 1 mm against right at 0.5 mm, and at 1 mm
    bool right = false;
  };
  std::array<std::vector<Draw>, 2> draws;
  const int trials = 10 * book.options.trials;
  for (std::size_t law = 0; law < 2; ++law) {
    for (int i = 0; i < trials; ++i) {
      const Vector3 limits = limits_of(kStray[law + 1]);
      std::vector<Vector3> u(carried.size());
      for (Vector3& each : u) each = within(random, limits);
      const std::vector<View>& seen = views[static_cast<std::size_t>(i) % views.size()];
      const Densities half = densities(carried, seen, u, 0.5, random),
                      whole = densities(carried, seen, u, 1, random);
      const auto odds = [&](double right) { return right > 0 ? whole.wrong / right : 1e300; };
      draws[law].push_back(
          {odds(half.right), odds(whole.right), good(best_estimate(carried, seen, u).error)});
    }
  }
  const std::string name = "frontier " + part.workpiece.name;
  const auto add = [&](const std::string& what, auto counts) {
    const auto n = std::count_if(draws[1].begin(), draws[1].end(), counts);
    const double share = static_cast<double>(n) / trials;
    book.add(name + what, 100 * share, "%", NAN, NAN, Better::None,
             100 * std::sqrt(share * (1 - share) / trials));
  };
  // The limit that this share of the right ones keeps.
  const auto limit_of = [](const std::vector<Draw>& all, double Draw::*odds, double share) {
    std::vector<double> right;
    for (const Draw& d : all) {
      if (d.right) right.push_back(d.*odds);
    }
    std::sort(right.begin(), right.end());
    return right[static_cast<std::size_t>(share * static_cast<double>(right.size() - 1))];
  };
  const double half = limit_of(draws[0], &Draw::against_half, 0.95),
               whole = limit_of(draws[1], &Draw::against_whole, 0.8);
  add(" false accept at 1 mm, 5 % refused at 0.5 mm",
      [&](const Draw& d) { return !d.right && d.against_half <= half; });
  add(" right ones refused at 1 mm then", [&](const Draw& d) { return d.right && d.against_half > half; });
  add(" false accept at 1 mm, a fifth refused there",
      [&](const Draw& d) { return !d.right && d.against_whole <= whole; });
}

/// The estimate under one law and how likely the members' places against each other are under it.
struct Judged {
  double nees = 0, log_density = 0;
};
Judged judged(const Carried& carried, const std::vector<Seen>& seen, double stray) {
  const Vector3 variance = limits_of(stray).cwiseAbs2() / 3;
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Vector3 right = Vector3::Zero();
  double square = 0, log_determinant = 0;
  for (std::size_t m = 0; m < seen.size(); ++m) {
    Eigen::Matrix3d spread = seen[m].noise;
    spread.diagonal() += variance;
    const Eigen::Matrix3d inverse = spread.inverse(), weighed = carried[m].transpose() * inverse;
    normal += weighed * carried[m];
    right += weighed * seen[m].place;
    square += seen[m].place.dot(inverse * seen[m].place);
    log_determinant += std::log(spread.determinant());
  }
  // The truth is zero, so the estimate is the error and the normal matrix its inverse covariance. What the
  // members say beside the pose is the restricted likelihood.
  const Vector3 error = normal.ldlt().solve(right);
  return {error.dot(normal * error) / 3,
          -0.5 * (log_determinant + std::log(normal.determinant()) + square - right.dot(error))};
}

/// NEES at 0.5 mm and 1 mm of the rule that takes parts for as drawn by the likelihood ratio and else claims
/// what the true law allows, set so that its NEES of parts as drawn is 0.7.
void least_nees(Book& book, const PartUnderTest& part, std::uint64_t seed) {
  struct Draw {
    double ratio, drawn, strayed;
  };
  const Carried carried = carried_of(part.outline());
  const int trials = 3 * book.options.trials;
  for (const double stray : {kStray[1], kStray[2]}) {
    std::array<std::vector<Draw>, 2> draws;
    for (std::size_t law = 0; law < 2; ++law) {
      Setting s;
      s.member_mm = law == 0 ? 0 : stray, s.member_deg = 0.25 * s.member_mm;
      for (int i = 0; i < trials; ++i) {
        const EdgeSet set = make_set(part.outline(), s, seed + static_cast<std::uint64_t>(i));
        const std::vector<Seen> seen = seen_members(part.outline(), set, s.sigma_mm);
        const Judged drawn = judged(carried, seen, 0), strayed = judged(carried, seen, stray);
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
    if (part.workpiece.members.size() > kMostMembers || !book.wanted("frontier " + part.workpiece.name))
      return;
    least_false_accepts(book, part, seed);
    least_nees(book, part, seed);
  });
}

}  // namespace weldcell::bench
