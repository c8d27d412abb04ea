// Weighted sums of a linear fit with one common pose and one shift per member; the members leave by a Schur
// complement. Pure.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "fit.hpp"

namespace weldcell::localize {

/// Row of one crossing: residual = a . pose + latency * l + inset * b + (member shift) + noise.
struct Row {
  Eigen::Vector3d a;  ///< derivative by the part's (dx, dy, dtheta) about the centroid, part axes
  double l = 0, b = 0, residual = 0;
};

using Common = Eigen::Matrix<double, 5, 1>;  ///< pose increment (3), latency ms, inset mm
using CommonMatrix = Eigen::Matrix<double, 5, 5>;

struct MemberSolution {
  MemberShift shift = MemberShift::Zero();
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
};

struct Solution {
  Common common = Common::Zero();
  CommonMatrix covariance = CommonMatrix::Zero();
  std::vector<MemberSolution> members;
  double log_evidence = 0;  ///< restricted likelihood of the member scale, up to a constant
};

/// The mean over several answers, each with its log weight; covariances grow by the spread between them.
Solution mean_of(const std::vector<Solution>& each, const std::vector<double>& log_weight);

class NormalEquations {
 public:
  /// member_centroids about the template's centroid.
  NormalEquations(const std::vector<Vec2>& member_centroids, const Priors& priors);

  void clear();
  void add(int member, const Row& row, double weight);
  /// Other priors over the same sums.
  void set_priors(const Priors& priors) { priors_ = priors; }

  /// Whether any row belongs to the member.
  bool touches(std::size_t member) const { return sums_[member](0, 0) + sums_[member](1, 1) > 0; }
  /// Common parameters alone, members rigid.
  Common solve_rigid() const;
  /// With member shifts of prior k * tolerance; members flagged free have a wide prior instead. k = 0: rigid.
  Solution solve(double k, const std::vector<bool>& free_members, bool with_members) const;
  /// Mean over the scale k, each k weighted by its evidence and a broad prior around the drawing's tolerance.
  Solution solve_over_scales(const std::vector<bool>& free_members) const;
  /// A member's own shift when nothing is assumed about it, given the common solution.
  MemberSolution unshrunk(std::size_t member, const Common& common) const;

 private:
  using Sums = Eigen::Matrix<double, 6, 6>;  ///< of (a, l, b, residual)
  struct Block {
    Eigen::Matrix3d gram;
    Eigen::Matrix<double, 3, 5> cross;
    Eigen::Vector3d right;
  };
  Block block(std::size_t member) const;
  Eigen::Vector3d prior_sigma(double k, bool free_member) const;

  std::vector<Vec2> centroids_;
  Priors priors_;
  std::vector<Sums> sums_;
};

/// Prior of a member about which nothing is assumed.
inline constexpr double kFreeShift_mm = 6;
inline constexpr double kFreeAngle_rad = 0.05;

}  // namespace weldcell::localize
