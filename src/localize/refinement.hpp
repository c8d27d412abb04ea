// The loop of refine(): matches, weights, sums, solution, over and over. Pure.
#pragma once

#include <vector>

#include "fit.hpp"
#include "normal_equations.hpp"
#include "rows.hpp"

namespace weldcell::localize {

class Refinement {
 public:
  Refinement(const TemplateFields& fields, const std::vector<Crossing>& crossings, const FitState& start,
             const Priors& priors, Start nearness);

  /// Members, tolerances and scale, from a start that is right to some millimetres.
  void settle();
  /// What another run over fewer crossings has settled.
  void adopt(const Refinement& coarse);
  /// Whether a member is free altogether that could be so in one way only.
  bool any_wide() const;
  /// Members free altogether are held along themselves from here on.
  void hold_along();
  Fit run();

 private:
  static constexpr int kSteps = 4;

  void place();
  int member_of(std::size_t i) const {
    return fields_.edges()[static_cast<std::size_t>(fit_.matches[i].edge)].member;
  }

  void weigh_geman_mcclure(NormalEquations& equations, double scale);
  void weigh_mixture(NormalEquations& equations);

  // Settling.
  /// Pose and members together with wide priors, so that a member some millimetres off keeps its points.
  void find_members();
  /// The median of the residuals says whether the stated sigmas can be believed.
  void measure_scale();
  /// Sharp edges in the drawing: an inset is only believed when the points insist on it. Round ones: its
  /// prior gives way when the points insist.
  void choose_inset();
  double evidence_of(const Priors& priors);
  /// One member far off among members that are as drawn must not widen the tolerance of all: it is set free
  /// when the evidence pays for its freedom.
  void free_outlying_members();

  // Running.
  void iterate(int step);
  /// A latency outside its prior must not bend the pose: its stated prior and a wide one stand side by side,
  /// and the evidence, which charges the wide one for what it allows, weighs them.
  std::vector<double> latencies_ms() const;
  /// Over scales and latencies. Where a scan tells a latency from a turn by little the stated prior, which
  /// bends the pose when it is wrong, must be the likelier one by more than the charge alone.
  std::vector<Weighed> answers(const NormalEquations& equations, const Freedoms& freedoms,
                               Detail detail = Detail::All) const;
  /// A member may be off in one way or another, or hardly at all; a rail pulled off its rungs, moreover,
  /// looks the same as the rest of the part pulled off that rail. What explains the points about as well
  /// takes part in the covariance.
  void weigh_other_members();
  /// What a solution leads to from here.
  Estimate after(const Solution& solution, Detail detail = Detail::All) const;
  /// Residuals larger than stated widen everything; smaller ones are not believed.
  void rescale();
  void take(const Solution& solution, Detail detail = Detail::All);
  void finish();

  const TemplateFields& fields_;
  const std::vector<Crossing>& crossings_;
  Priors priors_;
  Start start_;
  Freedoms free_;
  bool strained_ = false;  ///< some member presses against a tight tolerance
  std::vector<Row> rows_;
  Fit fit_;
};

}  // namespace weldcell::localize
