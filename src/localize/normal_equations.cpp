#include "normal_equations.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>

namespace weldcell::localize {

namespace {

/// Weak knowledge of the pose, so that what the points leave open has a large but finite covariance.
constexpr double kPoseSigma_mm = 200;
constexpr double kPoseSigma_rad = 1;

double precision(double sigma) { return sigma > 1e-6 ? 1 / (sigma * sigma) : 1e12; }

CommonMatrix prior_information(const Priors& priors) {
  CommonMatrix out = CommonMatrix::Zero();
  out(0, 0) = out(1, 1) = precision(kPoseSigma_mm);
  out(2, 2) = precision(kPoseSigma_rad);
  out(3, 3) = precision(priors.latency_ms);
  out(4, 4) = precision(priors.inset_mm);
  return out;
}

/// Scales of the member term, in units of the drawing's tolerance, with the logarithm of their prior weight:
/// half for parts that are as drawn, the rest about the tolerance. Fewer parts as drawn would cost efficiency
/// where they are, more would make three members that happen to agree look certain (NEES of bench localize).
struct Scale {
  double k, log_prior;
};
constexpr std::array<Scale, 9> kScales{{{0, -0.71},
                                        {0.1, -3.93},
                                        {0.2, -3.53},
                                        {0.35, -2.83},
                                        {0.6, -2.06},
                                        {0.9, -1.99},
                                        {1.3, -2.32},
                                        {1.9, -3.53},
                                        {2.8, -4.63}}};

}  // namespace

NormalEquations::NormalEquations(const std::vector<Vec2>& member_centroids, const Priors& priors)
    : centroids_(member_centroids), priors_(priors), sums_(member_centroids.size(), Sums::Zero()) {}

void NormalEquations::clear() {
  for (Sums& sums : sums_) sums.setZero();
}

void NormalEquations::add(int member, const Row& row, double weight) {
  double* s = sums_[static_cast<std::size_t>(member)].data();
  const double f[6] = {row.a.x(), row.a.y(), row.a.z(), row.l, row.b, row.residual};
  for (int j = 0; j < 6; ++j) {
    const double wf = weight * f[j];
    for (int i = 0; i <= j; ++i) s[j * 6 + i] += wf * f[i];
  }
}

Common NormalEquations::solve_rigid() const {
  Sums total = Sums::Zero();
  for (const Sums& sums : sums_) total += sums;
  CommonMatrix normal = total.topLeftCorner<5, 5>().selfadjointView<Eigen::Upper>();
  normal += prior_information(priors_);
  return normal.ldlt().solve(total.topRightCorner<5, 1>());
}

NormalEquations::Block NormalEquations::block(std::size_t member) const {
  const Sums full = sums_[member].selfadjointView<Eigen::Upper>();
  const Vec2& m = centroids_[member];
  // A turn about the member's centroid is a turn about the template's less the shift that this gives the
  // member.
  Eigen::Matrix3d to_member = Eigen::Matrix3d::Identity();
  to_member(2, 0) = m.y();
  to_member(2, 1) = -m.x();
  return {to_member * full.topLeftCorner<3, 3>() * to_member.transpose(),
          to_member * full.topLeftCorner<3, 5>(), to_member * full.topRightCorner<3, 1>()};
}

Eigen::Vector3d NormalEquations::prior_sigma(double k, bool free_member) const {
  if (free_member) return {kFreeShift_mm, kFreeShift_mm, kFreeAngle_rad};
  return {k * priors_.member_shift_mm, k * priors_.member_shift_mm, k * priors_.member_angle_rad};
}

Solution NormalEquations::solve(double k, const std::vector<bool>& free_members, bool with_members) const {
  CommonMatrix normal = prior_information(priors_);
  Common right = Common::Zero();
  double log_determinant = 0, square = 0;
  std::vector<Block> blocks(sums_.size());
  std::vector<Eigen::Matrix3d> posterior(sums_.size());
  for (std::size_t m = 0; m < sums_.size(); ++m) {
    const Sums& sums = sums_[m];
    normal += CommonMatrix(sums.topLeftCorner<5, 5>().selfadjointView<Eigen::Upper>());
    right += sums.topRightCorner<5, 1>();
    square += sums(5, 5);
    posterior[m].setZero();
    if (sums(5, 5) == 0 && sums(0, 0) + sums(1, 1) == 0) {
      const Eigen::Vector3d sigma = prior_sigma(k, free_members[m]);
      posterior[m] = sigma.cwiseAbs2().asDiagonal();
      blocks[m] = {Eigen::Matrix3d::Zero(), Eigen::Matrix<double, 3, 5>::Zero(), Eigen::Vector3d::Zero()};
      continue;
    }
    blocks[m] = block(m);
    if (k <= 0 && !free_members[m]) continue;
    const Eigen::Vector3d sigma = prior_sigma(k, free_members[m]);
    // Posterior covariance S^1/2 (I + S^1/2 G S^1/2)^-1 S^1/2: no division by a prior that may be tiny.
    const Eigen::Matrix3d inner =
        Eigen::Matrix3d::Identity() + sigma.asDiagonal() * blocks[m].gram * sigma.asDiagonal();
    posterior[m] = sigma.asDiagonal() * inner.inverse() * sigma.asDiagonal();
    log_determinant += std::log(inner.determinant());
    normal -= blocks[m].cross.transpose() * posterior[m] * blocks[m].cross;
    right -= blocks[m].cross.transpose() * (posterior[m] * blocks[m].right);
    square -= blocks[m].right.dot(posterior[m] * blocks[m].right);
  }
  Solution out;
  const Eigen::LDLT<CommonMatrix> factor(normal);
  out.common = factor.solve(right);
  out.covariance = factor.solve(CommonMatrix::Identity());
  log_determinant += factor.vectorD().cwiseAbs().array().log().sum();
  log_determinant -= std::log(precision(priors_.latency_ms)) + std::log(precision(priors_.inset_mm));
  out.log_evidence = -0.5 * (log_determinant + square - right.dot(out.common));
  if (!with_members) return out;
  out.members.resize(sums_.size());
  for (std::size_t m = 0; m < sums_.size(); ++m) {
    const Eigen::Matrix<double, 3, 5> carry = posterior[m] * blocks[m].cross;
    out.members[m].shift = posterior[m] * blocks[m].right - carry * out.common;
    out.members[m].covariance = posterior[m] + carry * out.covariance * carry.transpose();
  }
  return out;
}

Solution NormalEquations::solve_over_scales(const std::vector<bool>& free_members) const {
  const bool rigid = !(priors_.member_shift_mm > 0 || priors_.member_angle_rad > 0);
  if (rigid) return solve(0, free_members, true);
  std::vector<Solution> each;
  std::vector<double> log_weight;
  for (const Scale& scale : kScales) {
    each.push_back(solve(scale.k, free_members, true));
    log_weight.push_back(each.back().log_evidence + scale.log_prior);
  }
  return mean_of(each, log_weight);
}

Solution mean_of(const std::vector<Solution>& each, const std::vector<double>& log_weight) {
  const double best = *std::max_element(log_weight.begin(), log_weight.end());
  double sum = 0;
  for (const double w : log_weight) sum += std::exp(w - best);
  Solution out;
  const std::size_t members = each.front().members.size();
  out.members.resize(members);
  out.log_evidence = best + std::log(sum);
  for (std::size_t i = 0; i < each.size(); ++i) {
    const double share = std::exp(log_weight[i] - best) / sum;
    out.common += share * each[i].common;
    for (std::size_t m = 0; m < members; ++m) out.members[m].shift += share * each[i].members[m].shift;
  }
  for (std::size_t i = 0; i < each.size(); ++i) {
    const double share = std::exp(log_weight[i] - best) / sum;
    const Common off = each[i].common - out.common;
    out.covariance += share * (each[i].covariance + off * off.transpose());
    for (std::size_t m = 0; m < members; ++m) {
      const MemberShift member_off = each[i].members[m].shift - out.members[m].shift;
      out.members[m].covariance +=
          share * (each[i].members[m].covariance + member_off * member_off.transpose());
    }
  }
  return out;
}

MemberSolution NormalEquations::unshrunk(std::size_t member, const Common& common) const {
  const Block b = block(member);
  const Eigen::Vector3d sigma = prior_sigma(0, true);
  const Eigen::Matrix3d inner =
      Eigen::Matrix3d::Identity() + sigma.asDiagonal() * b.gram * sigma.asDiagonal();
  MemberSolution out;
  out.covariance = sigma.asDiagonal() * inner.inverse() * sigma.asDiagonal();
  out.shift = out.covariance * (b.right - b.cross * common);
  return out;
}

}  // namespace weldcell::localize
