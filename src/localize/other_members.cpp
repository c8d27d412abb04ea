// Which other members, or none at all, may be the one that is off.
#include <algorithm>
#include <iterator>

#include "freedom.hpp"
#include "refinement.hpp"

namespace weldcell::localize {

namespace {

/// Odds of about 1000 : 1 tell which of two members is off.
constexpr double kTellsMembers_nats = 7;

bool is_free(Freedom f) { return f != Freedom::Held; }

}  // namespace

void Refinement::weigh_other_members() {
  const auto freed = std::count_if(free_.begin(), free_.end(), is_free);
  if (freed > 1 || priors_.member_shift_mm <= 0 || (freed == 0 && !strained_)) return;
  place();
  NormalEquations equations(fields_.member_frames(), priors_);
  weigh_mixture(equations);
  const std::vector<std::size_t> members = freed == 0
                                               ? most_strained(equations, priors_, free_)
                                               : with_the_likeliest_instead(equations, free_, latencies_ms());
  if (members.empty()) return;
  const Freedoms drawn(free_.size(), Freedom::Held);
  const std::vector<Hypothesis> all = hypotheses(equations, drawn, members, latencies_ms());
  const std::vector<double> sums = sum_by_member(all, free_.size());
  const std::size_t first = likeliest(sums);
  const double as_drawn =
      few(free_) ? -1e300 : equations.evidence_with(drawn, {Freed{}}, latencies_ms()).front();
  const double least = std::max(sums[first], as_drawn) - kTellsMembers_nats;
  if (sums[first] < least) return;
  std::vector<Weighed> common;
  if (as_drawn > least) common = answers(equations, drawn);
  const auto reading = [&](std::size_t member) {
    std::vector<Weighed> out = common;
    for (const Hypothesis& h : all) {
      if (h.freed.member != member || h.nats < sums[member] - kTellsMembers_nats) continue;
      Freedoms freedoms = drawn;
      freedoms[member] = h.freed.freedom;
      for (Weighed& w : answers(equations, freedoms)) {
        w.log_weight -= h.odds_nats;
        w.log_bet -= h.odds_nats;
        out.push_back(std::move(w));
      }
    }
    return out;
  };
  const std::vector<Weighed> stated = reading(first);
  Solution estimate = mean_of(stated);
  // The likelier reading instead of the mean, which would be right in neither case; the covariance is the
  // mean square about it over both.
  std::vector<double> others = sums;
  others[first] = -1e300;
  const std::size_t second = likeliest(others);
  if (others[second] < least || as_drawn > sums[first]) {
    take(estimate);
    return;
  }
  std::vector<Weighed> swapped = reading(second), both = stated;
  Either either{{static_cast<int>(first), after(estimate)},
                {static_cast<int>(second), after(mean_of(swapped))},
                estimate.members[first].shift.head<2>().norm()};
  swapped.erase(swapped.begin(), swapped.begin() + static_cast<std::ptrdiff_t>(common.size()));
  both.insert(both.end(), std::make_move_iterator(swapped.begin()), std::make_move_iterator(swapped.end()));
  take(about(both, estimate));
  fit_.either = std::move(either);
}

}  // namespace weldcell::localize
