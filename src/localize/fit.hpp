// From a rough pose to the estimate: graduated non-convexity, then the mixture of edge and clutter with
// members that may each be a little off. Pure.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "crossings.hpp"
#include "fields.hpp"
#include "search.hpp"

namespace weldcell::localize {

/// One crossing at one pose; frame Part about the centroid.
struct Match {
  Vec2 place = Vec2::Zero();
  int edge = -1;           ///< -1: none within reach
  double residual_mm = 0;  ///< along the edge's outward normal
  double beyond_mm = 0;    ///< how far past the edge's end
  double distance_mm = 0;  ///< to the edge as a segment
};
Match match(const TemplateFields& fields, const Crossing& crossing, const CentredPose& pose, double cos_theta,
            double sin_theta);

/// Priors of what is fitted beside the pose; 0 fixes a quantity.
struct Priors {
  double latency_ms = 0.5;
  double inset_mm = 0.5;
  bool inset_everywhere = false;  ///< false: only round edges shift
  double member_shift_mm = 0.5;
  double member_angle_rad = 0.0022;
};

/// (dx, dy, dtheta) of a member about its own centroid, part axes.
using MemberShift = Eigen::Vector3d;

struct FitState {
  CentredPose pose;
  double latency_ms = 0;
  double inset_mm = 0;
  std::vector<MemberShift> members;
};

/// The pose may lie about here: offset from the estimate and covariance of (x, y, theta), part axes about the
/// centroid.
struct Chance {
  double share = 1;
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
};

struct Estimate {
  FitState state;
  /// How far members of this part stray is not known, so the pose is no Gaussian: one for each scale.
  std::vector<Chance> chances;
  /// Of (x, y, theta, latency ms, inset mm), part axes about the centroid, mm and rad.
  Eigen::Matrix<double, 5, 5> covariance = Eigen::Matrix<double, 5, 5>::Zero();
  std::vector<Eigen::Matrix3d> member_covariance;
};

/// Two members of which one is far off its place, and the points on the drawing's edges do not tell which.
struct Either {
  struct Reading {
    int member = -1;  ///< the one that is off
    Estimate estimate;
  };
  Reading first, second;
  double apart_mm = 0;  ///< how far they are shifted against each other
};

struct Fit : Estimate {
  std::vector<int> member_points;
  std::vector<Match> matches;     ///< one per crossing, at the final pose
  std::vector<double> residuals;  ///< after latency, inset and member shifts
  std::vector<double> inlier;     ///< probability of each crossing to be a crossing of its edge
  double scale = 1;           ///< residuals against the stated sigmas; 1 when these were honest or too large
  double log_likelihood = 0;  ///< nats, against the same points being all on edges without error
  int iterations = 0;
  /// When either of two members may be the one that is off; the estimate is the first one's, its
  /// covariance the mean square about it over both.
  std::optional<Either> either;
};

/// Geman-McClure from 12 mm down to 3 mm over the given crossings; members rigid. Returns the pose and the
/// latency.
FitState polish(const TemplateFields& fields, const std::vector<Crossing>& crossings,
                const CentredPose& start, double first_scale_mm, int* iterations);

/// Log-likelihood of a rough pose, nats, with 1 mm for everything not yet modelled.
double rough_log_likelihood(const TemplateFields& fields, const std::vector<Crossing>& crossings,
                            const FitState& state);

/// A rough start is right to some millimetres, members included; a close one to about a millimetre, so that
/// wide weights and members would only lead away from it.
enum class Start : std::uint8_t { Rough, Close };

/// The full estimate from a polished state.
Fit refine(const TemplateFields& fields, const std::vector<Crossing>& crossings, const FitState& start,
           const Priors& priors, Start nearness = Start::Rough);

/// Takes one estimate for the fit's own and matches the crossings anew; both must explain the points alike.
void settle_on(const TemplateFields& fields, const std::vector<Crossing>& crossings, const Estimate& estimate,
               Fit& fit);

/// Distance, in sigmas, at which a point is as likely clutter as a crossing.
inline constexpr double kInlierGate = 3.4;

}  // namespace weldcell::localize
