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

/// Scales of the member term, in units of the drawing's tolerance, with the logarithm of their prior among
/// parts that are not as drawn: log-normal about 0.9, a factor of 1.65 wide, with a floor for parts nearly as
/// drawn.
struct Prior {
  double k, log_share;
};
constexpr std::array<Prior, 9> kScales{{{0.1, -3.30},
                                        {0.2, -3.00},
                                        {0.35, -2.40},
                                        {0.6, -1.49},
                                        {0.9, -1.16},
                                        {1.3, -1.43},
                                        {1.9, -2.28},
                                        {2.8, -3.72},
                                        {4.2, -5.87}}};
/// Share of parts that are as drawn. Two members alone cannot tell whether they are, so the covariance doubts
/// it the more there; the estimate of two or three bets on it, which costs little where the bet is lost
/// (bench localize, frontier).
constexpr double kAsDrawn = 0.5;
constexpr double kAsDrawnOfTwo = 0.15;
constexpr double kAsDrawnBetOfThree = 0.9;

/// An answer so far behind the best changes no digit of a sum.
constexpr double kNoDigit_nats = 45;
/// A share too small to matter in any sum.
constexpr double kNoShare = 1e-7;

double log_sum(const std::vector<double>& logs) {
  const double best = *std::max_element(logs.begin(), logs.end());
  double sum = 0;
  for (const double log : logs) sum += std::exp(log - best);
  return best + std::log(sum);
}

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

NormalEquations::Reduced& NormalEquations::Reduced::operator+=(const Reduced& other) {
  normal += other.normal;
  right += other.right;
  square += other.square;
  log_determinant += other.log_determinant;
  return *this;
}

NormalEquations::Reduced& NormalEquations::Reduced::operator-=(const Reduced& other) {
  normal -= other.normal;
  right -= other.right;
  square -= other.square;
  log_determinant -= other.log_determinant;
  return *this;
}

NormalEquations::Reduced NormalEquations::reduced(std::size_t member, double k, bool free_member,
                                                  const Block& block, Eigen::Matrix3d& posterior) const {
  const Sums& sums = sums_[member];
  const Eigen::Vector3d sigma = prior_sigma(k, free_member);
  Reduced out;
  if (!touches(member)) {
    posterior = sigma.cwiseAbs2().asDiagonal();
    return out;
  }
  out.normal = sums.topLeftCorner<5, 5>().selfadjointView<Eigen::Upper>();
  out.right = sums.topRightCorner<5, 1>();
  out.square = sums(5, 5);
  if (k <= 0 && !free_member) {
    posterior.setZero();
    return out;
  }
  // Posterior covariance S^1/2 (I + S^1/2 G S^1/2)^-1 S^1/2: no division by a prior that may be tiny.
  const Eigen::Matrix3d inner =
      Eigen::Matrix3d::Identity() + sigma.asDiagonal() * block.gram * sigma.asDiagonal();
  posterior = sigma.asDiagonal() * inner.inverse() * sigma.asDiagonal();
  const Eigen::Matrix<double, 3, 5> carry = posterior * block.cross;
  out.log_determinant = std::log(inner.determinant());
  out.normal -= block.cross.transpose() * carry;
  out.right -= carry.transpose() * block.right;
  out.square -= block.right.dot(posterior * block.right);
  return out;
}

NormalEquations::Reduced NormalEquations::common_prior(double latency_ms) const {
  Reduced out;
  Priors priors = priors_;
  priors.latency_ms = latency_ms;
  out.normal = prior_information(priors);
  out.log_determinant = -std::log(precision(priors.latency_ms)) - std::log(precision(priors.inset_mm));
  return out;
}

double NormalEquations::evidence_of(const Reduced& total) const {
  const Eigen::LDLT<CommonMatrix> factor(total.normal);
  const double log_determinant = total.log_determinant + factor.vectorD().cwiseAbs().array().log().sum();
  return -0.5 * (log_determinant + total.square - total.right.dot(factor.solve(total.right)));
}

std::vector<NormalEquations::Block> NormalEquations::blocks() const {
  std::vector<Block> out(sums_.size());
  for (std::size_t m = 0; m < sums_.size(); ++m) {
    if (touches(m)) {
      out[m] = block(m);
    } else {
      out[m] = {Eigen::Matrix3d::Zero(), Eigen::Matrix<double, 3, 5>::Zero(), Eigen::Vector3d::Zero()};
    }
  }
  return out;
}

std::vector<Solution> NormalEquations::solve_common(double k, const std::vector<bool>& free_members,
                                                    const std::vector<double>& latencies_ms,
                                                    const std::vector<Block>& blocks,
                                                    std::vector<Eigen::Matrix3d>& posterior) const {
  Reduced seen;
  posterior.resize(sums_.size());
  for (std::size_t m = 0; m < sums_.size(); ++m)
    seen += reduced(m, k, free_members[m], blocks[m], posterior[m]);
  std::vector<Solution> out;
  for (const double latency_ms : latencies_ms) {
    Reduced total = common_prior(latency_ms);
    total += seen;
    Solution one;
    const Eigen::LDLT<CommonMatrix> factor(total.normal);
    one.common = factor.solve(total.right);
    one.covariance = factor.solve(CommonMatrix::Identity());
    one.log_evidence = evidence_of(total);
    one.members.resize(sums_.size());
    out.push_back(std::move(one));
  }
  return out;
}

void NormalEquations::solve_members(const std::vector<Block>& blocks,
                                    const std::vector<Eigen::Matrix3d>& posterior, Solution& solution) const {
  for (std::size_t m = 0; m < sums_.size(); ++m) {
    MemberSolution& member = solution.members[m];
    member.covariance = posterior[m];
    if (!touches(m)) continue;
    const Eigen::Matrix<double, 3, 5> carry = posterior[m] * blocks[m].cross;
    member.shift = posterior[m] * blocks[m].right - carry * solution.common;
    member.covariance += carry * solution.covariance * carry.transpose();
  }
}

Solution NormalEquations::solve(double k, const std::vector<bool>& free_members) const {
  const std::vector<Block> all = blocks();
  std::vector<Eigen::Matrix3d> posterior;
  Solution out = std::move(solve_common(k, free_members, {priors_.latency_ms}, all, posterior).front());
  solve_members(all, posterior, out);
  return out;
}

struct NormalEquations::Scale {
  double k, log_weight, log_bet;
};

std::vector<NormalEquations::Scale> NormalEquations::scales() const {
  // A member alone is the part.
  const bool rigid = sums_.size() < 2 || !(priors_.member_shift_mm > 0 || priors_.member_angle_rad > 0);
  if (rigid) return {{0, 0, 0}};
  std::size_t seen = 0;
  for (std::size_t m = 0; m < sums_.size(); ++m) seen += touches(m);
  const double drawn = seen <= 2 ? kAsDrawnOfTwo : kAsDrawn;
  const double bet = seen <= 3 ? kAsDrawnBetOfThree : drawn;
  std::vector<Scale> out{{0, std::log(drawn), std::log(bet)}};
  for (const Prior& prior : kScales) {
    out.push_back({prior.k, std::log(1 - drawn) + prior.log_share, std::log(1 - bet) + prior.log_share});
  }
  return out;
}

std::vector<Weighed> NormalEquations::over_scales(const std::vector<bool>& free_members,
                                                  const std::vector<double>& latencies_ms) const {
  std::vector<Weighed> out;
  const std::vector<Block> all = blocks();
  const std::vector<Scale> each = scales();
  std::vector<std::vector<Eigen::Matrix3d>> posteriors(each.size());
  Weighed best{{}, -1e300, -1e300};
  for (std::size_t i = 0; i < each.size(); ++i) {
    for (Solution& solution : solve_common(each[i].k, free_members, latencies_ms, all, posteriors[i])) {
      const double evidence = solution.log_evidence;
      out.push_back({std::move(solution), evidence + each[i].log_weight, evidence + each[i].log_bet});
      best.log_weight = std::max(best.log_weight, out.back().log_weight);
      best.log_bet = std::max(best.log_bet, out.back().log_bet);
    }
  }
  // The members of an answer too unlikely to change any digit are left where they are drawn.
  for (std::size_t i = 0; i < out.size(); ++i) {
    if (out[i].log_weight > best.log_weight - kNoDigit_nats || out[i].log_bet > best.log_bet - kNoDigit_nats)
      solve_members(all, posteriors[i / latencies_ms.size()], out[i].solution);
  }
  return out;
}

double NormalEquations::evidence(const std::vector<bool>& free_members) const {
  std::vector<double> each;
  const std::vector<Block> all = blocks();
  Eigen::Matrix3d unused;
  for (const Scale& scale : scales()) {
    Reduced total = common_prior(priors_.latency_ms);
    for (std::size_t m = 0; m < sums_.size(); ++m)
      total += reduced(m, scale.k, free_members[m], all[m], unused);
    each.push_back(evidence_of(total) + scale.log_weight);
  }
  return log_sum(each);
}

std::vector<double> NormalEquations::evidence_turned(const std::vector<bool>& free_members,
                                                     const std::vector<std::size_t>& members,
                                                     const std::vector<double>& latencies_ms) const {
  const std::vector<Block> all = blocks();
  std::vector<std::vector<double>> each(members.size());
  Eigen::Matrix3d unused;
  for (const Scale& scale : scales()) {
    Reduced seen;
    for (std::size_t m = 0; m < sums_.size(); ++m)
      seen += reduced(m, scale.k, free_members[m], all[m], unused);
    for (std::size_t i = 0; i < members.size(); ++i) {
      const std::size_t m = members[i];
      Reduced turned = seen;
      turned -= reduced(m, scale.k, free_members[m], all[m], unused);
      turned += reduced(m, scale.k, !free_members[m], all[m], unused);
      for (const double latency_ms : latencies_ms) {
        Reduced total = common_prior(latency_ms);
        total += turned;
        each[i].push_back(evidence_of(total) + scale.log_weight);
      }
    }
  }
  std::vector<double> out;
  for (const std::vector<double>& logs : each) out.push_back(log_sum(logs));
  return out;
}

Solution mean_of(const std::vector<Weighed>& each) {
  std::vector<double> bets;
  for (const Weighed& w : each) bets.push_back(w.log_bet);
  const double all = log_sum(bets);
  Solution estimate;
  estimate.members.resize(each.front().solution.members.size());
  for (const Weighed& w : each) {
    const double share = std::exp(w.log_bet - all);
    estimate.common += share * w.solution.common;
    for (std::size_t m = 0; m < estimate.members.size(); ++m)
      estimate.members[m].shift += share * w.solution.members[m].shift;
  }
  return about(each, estimate);
}

Solution about(const std::vector<Weighed>& each, const Solution& estimate) {
  std::vector<double> weights;
  for (const Weighed& w : each) weights.push_back(w.log_weight);
  Solution out;
  out.log_evidence = log_sum(weights);
  out.common = estimate.common;
  out.members.resize(estimate.members.size());
  for (std::size_t m = 0; m < out.members.size(); ++m) out.members[m].shift = estimate.members[m].shift;
  for (const Weighed& w : each) {
    const double share = std::exp(w.log_weight - out.log_evidence);
    if (share < kNoShare) continue;
    const Common off = w.solution.common - out.common;
    out.covariance += share * (w.solution.covariance + off * off.transpose());
    out.chances.push_back({share, off.head<3>(), w.solution.covariance.topLeftCorner<3, 3>()});
    for (std::size_t m = 0; m < out.members.size(); ++m) {
      const MemberShift member_off = w.solution.members[m].shift - out.members[m].shift;
      out.members[m].covariance +=
          share * (w.solution.members[m].covariance + member_off * member_off.transpose());
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
