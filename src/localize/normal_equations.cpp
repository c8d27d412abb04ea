#include "normal_equations.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
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

}  // namespace

NormalEquations::NormalEquations(const std::vector<MemberFrame>& members, const Priors& priors)
    : frames_(members), priors_(priors), sums_(members.size(), Sums::Zero()) {}

void NormalEquations::clear() {
  for (Sums& sums : sums_) sums.setZero();
}

void NormalEquations::add(int member, const Row& row, double weight) {
  Sums& sums = sums_[static_cast<std::size_t>(member)];
  Eigen::Matrix<double, 6, 1> f;
  f << row.a, row.l, row.b, row.residual;
  // The upper triangle counts; of the lower one what comes with it in pairs.
  sums.col(0).head<2>() += weight * f(0) * f.head<2>();
  sums.col(1).head<2>() += weight * f(1) * f.head<2>();
  sums.col(2).head<4>() += weight * f(2) * f.head<4>();
  sums.col(3).head<4>() += weight * f(3) * f.head<4>();
  sums.col(4) += weight * f(4) * f;
  sums.col(5) += weight * f(5) * f;
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
  const Vec2& m = frames_[member].centroid;
  // A turn about the member's centroid is a turn about the template's less the shift that this gives the
  // member.
  Eigen::Matrix3d to_member = Eigen::Matrix3d::Identity();
  to_member(2, 0) = m.y();
  to_member(2, 1) = -m.x();
  const Shared cross = to_member * full.topRows<3>();
  return {cross.leftCols<3>() * to_member.transpose(), cross};
}

Eigen::Vector3d NormalEquations::prior_sigma(std::size_t member, double k, Freedom freedom) const {
  if (freedom == Freedom::Wide) return {kFreeShift_mm, kFreeShift_mm, kFreeAngle_rad};
  Eigen::Vector3d sigma(k * priors_.member_shift_mm, k * priors_.member_shift_mm,
                        k * priors_.member_angle_rad);
  if (freedom == Freedom::Along) sigma(0) = std::max(sigma(0), kOff_mm);
  if (freedom == Freedom::Pulled) {
    // The mean of both ends' shifts, and their difference over the length.
    sigma(1) = std::max(sigma(1), kOff_mm / std::sqrt(2.0));
    sigma(2) =
        std::max(sigma(2), std::min(kOff_mm * std::sqrt(2.0) / frames_[member].length_mm, kFreeAngle_rad));
  }
  return sigma;
}

NormalEquations::Own NormalEquations::own_shift(std::size_t member, double k, Freedom freedom,
                                                const Block& block) const {
  Own out;
  if (k <= 0 && freedom == Freedom::Held) return out;
  const Eigen::Vector3d sigma = prior_sigma(member, k, freedom);
  // Along the member's own axes where sigmas differ.
  const bool turned = sigma(0) != sigma(1);
  const Vec2& axis = frames_[member].axis;
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();
  axes.topLeftCorner<2, 2>() << axis.x(), -axis.y(), axis.y(), axis.x();
  out.root = sigma.asDiagonal();
  out.d.setOnes();
  if (touches(member)) {
    const Block own =
        turned ? Block{axes.transpose() * block.gram * axes, axes.transpose() * block.cross} : block;
    // No division by a prior that may be tiny.
    const Eigen::Matrix3d inner =
        Eigen::Matrix3d::Identity() + own.gram.cwiseProduct(sigma * sigma.transpose());
    const double d0 = inner(0, 0), l10 = inner(1, 0) / d0, l20 = inner(2, 0) / d0;
    const double d1 = inner(1, 1) - l10 * inner(1, 0);
    const double below = inner(2, 1) - l20 * inner(1, 0), l21 = below / d1;
    const double d2 = inner(2, 2) - l20 * inner(2, 0) - l21 * below;
    out.d << 1 / d0, 1 / d1, 1 / d2;
    out.log_determinant = std::log(d0 * d1 * d2);
    out.root(1, 0) = -l10 * sigma(0);
    out.root(2, 0) = (l21 * l10 - l20) * sigma(0);
    out.root(2, 1) = -l21 * sigma(1);
    out.half.row(0) = sigma(0) * own.cross.row(0);
    out.half.row(1) = sigma(1) * own.cross.row(1) - l10 * out.half.row(0);
    out.half.row(2) = sigma(2) * own.cross.row(2) - l20 * out.half.row(0) - l21 * out.half.row(1);
  }
  if (turned) out.root *= axes.transpose();
  return out;
}

void NormalEquations::eliminate(const Own& own, int sign, Reduced& left) {
  if (own.d(0) == 0) return;
  for (int j = 0; j < 6; ++j) {
    const Eigen::Vector3d weighed = sign * own.d.cwiseProduct(own.half.col(j));
    left.sums.col(j) -= weighed(0) * own.half.row(0).transpose() + weighed(1) * own.half.row(1).transpose() +
                        weighed(2) * own.half.row(2).transpose();
  }
  left.log_determinant += sign * own.log_determinant;
}

/// Members as drawn.
NormalEquations::Reduced NormalEquations::rigid() const {
  Reduced out;
  for (const Sums& sums : sums_) out.sums += sums;
  out.sums = Sums(out.sums.selfadjointView<Eigen::Upper>());
  return out;
}

void NormalEquations::add_prior(double latency_ms, Reduced& left) const {
  Priors priors = priors_;
  priors.latency_ms = latency_ms;
  left.sums.topLeftCorner<5, 5>() += prior_information(priors);
  left.log_determinant -= std::log(precision(priors.latency_ms)) + std::log(precision(priors.inset_mm));
}

double NormalEquations::evidence_of(const Reduced& total) const {
  const Eigen::LDLT<CommonMatrix> factor(total.normal());
  const double log_determinant = total.log_determinant + factor.vectorD().cwiseAbs().array().log().sum();
  return -0.5 * (log_determinant + total.square() - total.right().dot(factor.solve(total.right())));
}

std::vector<NormalEquations::Block> NormalEquations::blocks() const {
  std::vector<Block> out(sums_.size());
  for (std::size_t m = 0; m < sums_.size(); ++m) {
    if (touches(m)) out[m] = block(m);
  }
  return out;
}

std::vector<Solution> NormalEquations::solve_common(double k, const Freedoms& freedoms,
                                                    const std::vector<double>& latencies_ms,
                                                    const std::vector<Block>& blocks, const Reduced& rigid,
                                                    std::vector<Own>& own) const {
  Reduced left = rigid;
  own.resize(sums_.size());
  for (std::size_t m = 0; m < sums_.size(); ++m) {
    own[m] = own_shift(m, k, freedoms[m], blocks[m]);
    if (touches(m)) eliminate(own[m], 1, left);
  }
  std::vector<Solution> out;
  for (const double latency_ms : latencies_ms) {
    Reduced total = left;
    add_prior(latency_ms, total);
    Solution one;
    const Eigen::LDLT<CommonMatrix> factor(total.normal());
    one.common = factor.solve(total.right());
    one.covariance = factor.solve(CommonMatrix::Identity());
    one.log_evidence = evidence_of(total);
    one.members.resize(sums_.size());
    out.push_back(std::move(one));
  }
  return out;
}

void NormalEquations::solve_members(const std::vector<Own>& own, Detail detail, Solution& solution) const {
  for (std::size_t m = 0; m < sums_.size(); ++m) {
    MemberSolution& member = solution.members[m];
    const Own& o = own[m];
    const Eigen::Matrix3d back = o.root.transpose() * o.d.asDiagonal();
    member.shift = back * (o.half.col(5) - o.half.leftCols<5>() * solution.common);
    if (detail == Detail::Shifts) continue;
    const Eigen::Matrix<double, 3, 5> carry = back * o.half.leftCols<5>();
    member.covariance = o.posterior() + carry * solution.covariance * carry.transpose();
  }
}

Solution NormalEquations::solve(double k, const Freedoms& freedoms, Detail detail) const {
  std::vector<Own> own;
  Solution out = std::move(solve_common(k, freedoms, {priors_.latency_ms}, blocks(), rigid(), own).front());
  solve_members(own, detail, out);
  return out;
}

}  // namespace weldcell::localize
