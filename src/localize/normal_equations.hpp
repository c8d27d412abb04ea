// Weighted sums of a linear fit with one common pose and one shift per member; the members leave by a Schur
// complement. Pure.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
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
  CommonMatrix covariance = CommonMatrix::Zero();  ///< mean square about `common`
  std::vector<MemberSolution> members;
  double log_evidence = 0;      ///< restricted likelihood of the member scale, up to a constant
  std::vector<Chance> chances;  ///< of the pose about `common`, shares sum to 1; empty when there is one only
};

/// One answer of several, with its log weights: in how far the truth may lie there, and in how far the
/// estimate bets on it.
struct Weighed {
  Solution solution;
  double log_weight = 0, log_bet = 0;
};

/// The mean over several answers by their bets; the covariance is the mean square about it by their weights.
Solution mean_of(const std::vector<Weighed>& each);
/// The same about a given estimate (its `common` and the members' shifts).
Solution about(const std::vector<Weighed>& each, const Solution& estimate);

/// Logarithm of the sum of what these are the logarithms of.
double log_sum(const std::vector<double>& logs);

/// Whether a solution holds the members' covariances as well, or their shifts only.
enum class Detail : std::uint8_t { Shifts, All };

/// In what a member may be off by more than the drawing's tolerance: in nothing, along its longest side,
/// across it at either end, or in everything.
enum class Freedom : std::uint8_t { Held, Along, Pulled, Wide };
inline constexpr std::array<Freedom, 3> kFreedoms{Freedom::Along, Freedom::Pulled, Freedom::Wide};
using Freedoms = std::vector<Freedom>;  ///< of each member
struct Freed {
  std::size_t member = 0;
  Freedom freedom = Freedom::Held;
};

class NormalEquations {
 public:
  NormalEquations(const std::vector<MemberFrame>& members, const Priors& priors);

  void clear();
  void add(int member, const Row& row, double weight);
  /// Whether any row belongs to the member.
  bool touches(std::size_t member) const { return sums_[member](0, 0) + sums_[member](1, 1) > 0; }
  /// Common parameters alone, members rigid.
  Common solve_rigid() const;
  /// With member shifts of prior k * tolerance, wider where a member is free. k = 0: rigid.
  Solution solve(double k, const Freedoms& freedoms, Detail detail = Detail::All) const;
  /// One answer for each scale k and each prior of the latency, weighed by its evidence and the prior of the
  /// scales; none for scales too unlikely to change any digit.
  std::vector<Weighed> over_scales(const Freedoms& freedoms, const std::vector<double>& latencies_ms,
                                   Detail detail = Detail::All) const;
  /// Log-evidence over all scales.
  double evidence(const Freedoms& freedoms) const;
  /// The same over the priors of the latency with another freedom of one member, for each of those given.
  std::vector<double> evidence_with(const Freedoms& freedoms, const std::vector<Freed>& tried,
                                    const std::vector<double>& latencies_ms) const;

 private:
  using Sums = Eigen::Matrix<double, 6, 6>;  ///< of (a, l, b, residual)
  using Shared = Eigen::Matrix<double, 3, 6, Eigen::RowMajor>;
  /// What a member's shift shares with itself and with (a, l, b, residual), about the member's centroid.
  struct Block {
    Eigen::Matrix3d gram = Eigen::Matrix3d::Zero();
    Shared cross = Shared::Zero();
  };
  /// What is left to the common parameters once the members' own shifts are eliminated.
  struct Reduced {
    Sums sums = Sums::Zero();
    double log_determinant = 0;
    CommonMatrix normal() const { return sums.topLeftCorner<5, 5>(); }
    Common right() const { return sums.topRightCorner<5, 1>(); }
    double square() const { return sums(5, 5); }
  };
  struct Scale;
  /// A member's own shift, eliminated: with prior sigmas S along its axes A and gram G,
  /// I + S A' G A S = L diag(1/d) L'.
  struct Own {
    Eigen::Matrix3d root = Eigen::Matrix3d::Zero();  ///< L^-1 S A'
    Eigen::Vector3d d = Eigen::Vector3d::Zero();     ///< 0: held where it is drawn
    Shared half = Shared::Zero();                    ///< L^-1 S A' cross
    double log_determinant = 0;
    /// Covariance of the shift given the common parameters.
    Eigen::Matrix3d posterior() const { return root.transpose() * d.asDiagonal() * root; }
  };
  Block block(std::size_t member) const;
  /// Of a member along itself, across and turned.
  Eigen::Vector3d prior_sigma(std::size_t member, double k, Freedom freedom) const;
  Own own_shift(std::size_t member, double k, Freedom freedom, const Block& block) const;
  /// Takes a member's own shift out of what is left (sign 1), or puts it back (-1).
  static void eliminate(const Own& own, int sign, Reduced& left);
  Reduced rigid() const;
  void add_prior(double latency_ms, Reduced& left) const;
  std::vector<Block> blocks() const;
  double evidence_of(const Reduced& total) const;
  /// The common parameters of one scale for each prior of the latency, and what the members know beside them.
  std::vector<Solution> solve_common(double k, const Freedoms& freedoms,
                                     const std::vector<double>& latencies_ms,
                                     const std::vector<Block>& blocks, const Reduced& rigid,
                                     std::vector<Own>& own) const;
  void solve_members(const std::vector<Own>& own, Detail detail, Solution& solution) const;
  std::vector<Scale> scales() const;

  std::vector<MemberFrame> frames_;
  Priors priors_;
  std::vector<Sums> sums_;
};

/// Prior of a member about which nothing is assumed.
inline constexpr double kFreeShift_mm = 6;
inline constexpr double kFreeAngle_rad = 0.05;
/// Of one that is off in one way only: along itself, or at each of its ends across itself.
inline constexpr double kOff_mm = 3;

}  // namespace weldcell::localize
