// How far members stray: answers and evidence over the scales of the member term.
#include <algorithm>
#include <array>
#include <cmath>

#include "normal_equations.hpp"

namespace weldcell::localize {

namespace {

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
/// Beyond a scale so far behind the best the evidence only falls: what members say of a scale has one best
/// one, but for little.
constexpr double kHopeless_nats = 60;
/// The scale to begin with: parts of many members, for which it matters, are often nearly as drawn.
constexpr std::size_t kFirstScale = 2;
/// A share too small to matter in any sum.
constexpr double kNoShare = 1e-7;

/// Visits scales from the first one outwards, in either direction for as long as visit() says so.
template <typename Visit>
void outwards(std::size_t scales, const Visit& visit) {
  const std::size_t first = std::min(kFirstScale, scales - 1);
  visit(first);
  for (std::size_t i = first + 1; i < scales && visit(i); ++i) continue;
  for (std::size_t i = first; i > 0 && visit(i - 1); --i) continue;
}

}  // namespace

double log_sum(const std::vector<double>& logs) {
  const double best = *std::max_element(logs.begin(), logs.end());
  double sum = 0;
  for (const double log : logs) sum += std::exp(log - best);
  return best + std::log(sum);
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

std::vector<Weighed> NormalEquations::over_scales(const Freedoms& freedoms,
                                                  const std::vector<double>& latencies_ms,
                                                  Detail detail) const {
  const std::vector<Block> all = blocks();
  const Reduced undivided = rigid();
  const std::vector<Scale> each = scales();
  std::vector<std::vector<Own>> own(each.size());
  std::vector<std::vector<Solution>> answers(each.size());
  double best_weight = -1e300, best_bet = -1e300;
  outwards(each.size(), [&](std::size_t i) {
    answers[i] = solve_common(each[i].k, freedoms, latencies_ms, all, undivided, own[i]);
    bool matters = false;
    for (const Solution& solution : answers[i]) {
      const double weight = solution.log_evidence + each[i].log_weight,
                   bet = solution.log_evidence + each[i].log_bet;
      best_weight = std::max(best_weight, weight);
      best_bet = std::max(best_bet, bet);
      matters = matters || weight > best_weight - kHopeless_nats || bet > best_bet - kHopeless_nats;
    }
    return matters;
  });
  std::vector<Weighed> out;
  for (std::size_t i = 0; i < each.size(); ++i) {
    for (Solution& solution : answers[i]) {
      const double weight = solution.log_evidence + each[i].log_weight,
                   bet = solution.log_evidence + each[i].log_bet;
      // The members of an answer too unlikely to change any digit are left where they are drawn.
      if (weight > best_weight - kNoDigit_nats || bet > best_bet - kNoDigit_nats)
        solve_members(own[i], detail, solution);
      out.push_back({std::move(solution), weight, bet});
    }
  }
  return out;
}

double NormalEquations::evidence(const Freedoms& freedoms) const {
  std::vector<double> logs;
  const std::vector<Block> all = blocks();
  const std::vector<Scale> each = scales();
  Reduced undivided = rigid();
  add_prior(priors_.latency_ms, undivided);
  double best = -1e300;
  outwards(each.size(), [&](std::size_t i) {
    Reduced left = undivided;
    for (std::size_t m = 0; m < sums_.size(); ++m)
      if (touches(m)) eliminate(own_shift(m, each[i].k, freedoms[m], all[m]), 1, left);
    logs.push_back(evidence_of(left) + each[i].log_weight);
    best = std::max(best, logs.back());
    return logs.back() > best - kHopeless_nats;
  });
  return log_sum(logs);
}

std::vector<double> NormalEquations::evidence_with(const Freedoms& freedoms, const std::vector<Freed>& tried,
                                                   const std::vector<double>& latencies_ms) const {
  const std::vector<Block> all = blocks();
  const std::vector<Scale> each = scales();
  const Reduced undivided = rigid();
  std::vector<std::vector<double>> logs(tried.size());
  std::vector<double> best(tried.size(), -1e300);
  outwards(each.size(), [&](std::size_t scale) {
    Reduced held = undivided;
    for (std::size_t m = 0; m < sums_.size(); ++m)
      if (touches(m)) eliminate(own_shift(m, each[scale].k, freedoms[m], all[m]), 1, held);
    bool matters = false;
    for (std::size_t i = 0; i < tried.size(); ++i) {
      const std::size_t m = tried[i].member;
      Reduced other = held;
      eliminate(own_shift(m, each[scale].k, freedoms[m], all[m]), -1, other);
      eliminate(own_shift(m, each[scale].k, tried[i].freedom, all[m]), 1, other);
      for (const double latency_ms : latencies_ms) {
        Reduced total = other;
        add_prior(latency_ms, total);
        logs[i].push_back(evidence_of(total) + each[scale].log_weight);
        best[i] = std::max(best[i], logs[i].back());
        matters = matters || logs[i].back() > best[i] - kHopeless_nats;
      }
    }
    return matters;
  });
  std::vector<double> out;
  for (const std::vector<double>& one : logs) out.push_back(log_sum(one));
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

}  // namespace weldcell::localize
