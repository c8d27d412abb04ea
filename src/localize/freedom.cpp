#include "freedom.hpp"

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>

namespace weldcell::localize {

namespace {

/// Odds against a member's being off in everything; so wide a prior pays for itself besides. Less where it is
/// the only way that is asked for.
constexpr double kWide_nats = 4;
constexpr double kWideOfFew_nats = 2;
/// Of one that is off in one way only, so that many a member within its tolerance would look so; along itself
/// that hardly moves the pose.
constexpr double kPulled_nats = 6;
constexpr double kAlong_nats = 4;
constexpr std::size_t kFewestTelling = 4;
constexpr std::size_t kTried = 3;
constexpr double kTight = 0.1;       ///< of the drawing's tolerance
constexpr double kLeastTold = 1e-3;  ///< of a prior's variance, below which points tell nothing
constexpr double kImpossible_nats = -1e300;

using Ordered = std::vector<std::pair<double, std::size_t>>;

std::vector<std::size_t> first_of(Ordered& order) {
  std::sort(order.begin(), order.end());
  std::vector<std::size_t> out;
  for (std::size_t i = 0; i < std::min(kTried, order.size()); ++i) out.push_back(order[i].second);
  return out;
}

double odds_nats(Freedom freedom, bool of_few) {
  if (freedom == Freedom::Along) return kAlong_nats;
  if (freedom == Freedom::Pulled) return kPulled_nats;
  return of_few ? kWideOfFew_nats : kWide_nats;
}

}  // namespace

bool few(const Freedoms& freedoms) { return freedoms.size() < kFewestTelling; }

std::vector<Hypothesis> hypotheses(const NormalEquations& equations, const Freedoms& rest,
                                   const std::vector<std::size_t>& members,
                                   const std::vector<double>& latencies_ms) {
  const std::span<const Freedom> ways =
      few(rest) ? std::span<const Freedom>(kFreedoms).last(1) : std::span<const Freedom>(kFreedoms);
  std::vector<Freed> each;
  for (const std::size_t m : members) {
    for (const Freedom freedom : ways) each.push_back({m, freedom});
  }
  const std::vector<double> evidence = equations.evidence_with(rest, each, latencies_ms);
  std::vector<Hypothesis> out;
  for (std::size_t i = 0; i < each.size(); ++i) {
    const double odds = odds_nats(each[i].freedom, few(rest));
    out.push_back({each[i], evidence[i] - odds, odds});
  }
  return out;
}

std::vector<double> sum_by_member(const std::vector<Hypothesis>& all, std::size_t count) {
  std::vector<std::vector<double>> each(count);
  for (const Hypothesis& h : all) each[h.freed.member].push_back(h.nats);
  std::vector<double> out;
  for (const std::vector<double>& nats : each) out.push_back(nats.empty() ? kImpossible_nats : log_sum(nats));
  return out;
}

std::size_t likeliest(const std::vector<double>& nats) {
  return static_cast<std::size_t>(std::max_element(nats.begin(), nats.end()) - nats.begin());
}

std::vector<std::size_t> most_strained(const NormalEquations& equations, const Priors& priors,
                                       const Freedoms& freedoms) {
  const Solution tight = equations.solve(kTight, freedoms);
  const Eigen::Vector3d prior =
      kTight * Eigen::Vector3d(priors.member_shift_mm, priors.member_shift_mm, priors.member_angle_rad);
  // About what the largest of so many strains is by noise alone, sigmas.
  const double least = std::sqrt(2 * std::log(std::max<double>(2, static_cast<double>(freedoms.size()))));
  Ordered order;
  for (std::size_t m = 0; m < freedoms.size(); ++m) {
    if (freedoms[m] != Freedom::Held) continue;
    double strain = 0;
    for (int i = 0; i < 3; ++i) {
      // What the points leave of the prior's variance is how far they would shift a member as drawn.
      const double variance = prior(i) * prior(i), left = tight.members[m].covariance(i, i);
      const double told = std::max(variance - left, kLeastTold * variance);
      if (told > 0) strain = std::max(strain, std::abs(tight.members[m].shift(i)) / std::sqrt(told));
    }
    if (strain > least) order.push_back({-strain, m});
  }
  return first_of(order);
}

std::vector<std::size_t> with_the_likeliest_instead(const NormalEquations& equations,
                                                    const Freedoms& freedoms,
                                                    const std::vector<double>& latencies_ms) {
  std::vector<Freed> each;
  for (std::size_t m = 0; m < freedoms.size(); ++m) {
    if (freedoms[m] == Freedom::Held && equations.touches(m)) each.push_back({m, Freedom::Wide});
  }
  const std::vector<double> evidence =
      equations.evidence_with(Freedoms(freedoms.size(), Freedom::Held), each, latencies_ms);
  Ordered order;
  for (std::size_t i = 0; i < each.size(); ++i) order.push_back({-evidence[i], each[i].member});
  std::vector<std::size_t> out = first_of(order);
  const auto freed =
      std::find_if(freedoms.begin(), freedoms.end(), [](Freedom f) { return f != Freedom::Held; });
  out.insert(out.begin(), static_cast<std::size_t>(freed - freedoms.begin()));
  return out;
}

}  // namespace weldcell::localize
