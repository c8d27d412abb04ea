#include "weldcell/calibrate/latency.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace weldcell::calibrate {
namespace {

constexpr int kRounds = 30;
constexpr double kTukey = 4.685;      // 95 % efficient on normal errors
constexpr double kSlopeSpan_mm = 20;  // an edge crossed over less than this keeps its slope of zero
constexpr std::size_t kCommon = 2;    // latency, bias

Error refuse(std::string what, std::string mend) {
  return {"calibrate.latency", "", std::move(what), std::move(mend)};
}

/// Columns of one edge: its place and, where its crossings spread along it, its slope.
struct EdgeColumns {
  int id = 0;
  Eigen::Index place = 0, slope = -1;
  double middle_mm = 0;
};

struct Problem {
  Eigen::MatrixXd rows;  ///< d(across)/d(latency ms, bias, places, slopes)
  Eigen::VectorXd seen, sigma;
  std::vector<EdgeColumns> edges;
};

std::vector<EdgeColumns> edge_columns(std::span<const GaugeCrossing> crossings, Eigen::Index& columns) {
  std::vector<EdgeColumns> edges;
  for (const GaugeCrossing& c : crossings) {
    if (std::none_of(edges.begin(), edges.end(), [&](const EdgeColumns& e) { return e.id == c.edge; }))
      edges.push_back({c.edge, 0, -1, 0});
  }
  std::sort(edges.begin(), edges.end(), [](const auto& a, const auto& b) { return a.id < b.id; });
  columns = kCommon;
  for (EdgeColumns& edge : edges) {
    double low = INFINITY, high = -INFINITY;
    int count = 0;
    for (const GaugeCrossing& c : crossings) {
      if (c.edge != edge.id) continue;
      low = std::min(low, c.along_mm);
      high = std::max(high, c.along_mm);
      ++count;
    }
    edge.middle_mm = 0.5 * (low + high);
    edge.place = columns++;
    if (high - low > kSlopeSpan_mm && count >= 4) edge.slope = columns++;
  }
  return edges;
}

Problem build(std::span<const GaugeCrossing> crossings, const LatencyOptions& options) {
  Problem p;
  Eigen::Index columns = 0;
  p.edges = edge_columns(crossings, columns);
  const auto n = static_cast<Eigen::Index>(crossings.size());
  p.rows = Eigen::MatrixXd::Zero(n, columns);
  p.seen.resize(n);
  p.sigma.resize(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const GaugeCrossing& c = crossings[static_cast<std::size_t>(i)];
    const auto edge =
        std::find_if(p.edges.begin(), p.edges.end(), [&](const auto& e) { return e.id == c.edge; });
    p.rows(i, 0) = 1e-3 * c.direction * c.speed_mm_s;
    p.rows(i, 1) = c.direction;
    p.rows(i, edge->place) = 1;
    if (edge->slope >= 0) p.rows(i, edge->slope) = c.along_mm - edge->middle_mm;
    p.seen(i) = c.across_mm;
    p.sigma(i) = c.sigma_mm > 0 ? c.sigma_mm : options.default_sigma_mm;
  }
  return p;
}

double median_of(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

struct Solved {
  Eigen::VectorXd parameters, residuals, weights;
  Eigen::MatrixXd covariance;
  double scatter = 1;
};

/// Least absolute residuals first, so that gross outliers do not pull; then Tukey's weights.
Solved solve(const Problem& p) {
  Solved s;
  const Eigen::Index n = p.rows.rows(), m = p.rows.cols();
  s.weights = Eigen::VectorXd::Ones(n);
  Eigen::MatrixXd normal;
  for (int round = 0; round < kRounds; ++round) {
    const Eigen::VectorXd w = s.weights.array() / p.sigma.array().square();
    normal = p.rows.transpose() * w.asDiagonal() * p.rows;
    normal.diagonal().array() += 1e-12 * normal.diagonal().maxCoeff();
    s.parameters = normal.ldlt().solve(p.rows.transpose() * (w.asDiagonal() * p.seen));
    s.residuals = p.seen - p.rows * s.parameters;
    std::vector<double> sizes(static_cast<std::size_t>(n));
    for (Eigen::Index i = 0; i < n; ++i)
      sizes[static_cast<std::size_t>(i)] = std::abs(s.residuals(i)) / p.sigma(i);
    // The fit itself took m degrees of freedom from the residuals.
    const double freed = std::sqrt(static_cast<double>(n) / std::max<double>(1, static_cast<double>(n - m)));
    s.scatter = 1.4826 * median_of(sizes) * freed;
    const double scale = std::max(0.2, s.scatter);
    for (Eigen::Index i = 0; i < n; ++i) {
      const double r = sizes[static_cast<std::size_t>(i)] / scale;
      if (round < kRounds / 2) {
        s.weights(i) = 1 / std::max(0.3, r);
      } else {
        const double u = r / kTukey;
        s.weights(i) = u < 1 ? (1 - u * u) * (1 - u * u) : 0;
      }
    }
  }
  s.covariance = normal.ldlt().solve(Eigen::MatrixXd::Identity(m, m));
  const double widen = std::max(1.0, s.scatter);
  s.covariance *= widen * widen;
  return s;
}

std::vector<double> speed_clusters(std::span<const GaugeCrossing> crossings, double step) {
  std::vector<double> speeds;
  for (const GaugeCrossing& c : crossings) speeds.push_back(c.speed_mm_s);
  std::sort(speeds.begin(), speeds.end());
  std::vector<double> out;
  for (std::size_t begin = 0; begin < speeds.size();) {
    std::size_t end = begin;
    double sum = 0;
    while (end < speeds.size() && speeds[end] <= speeds[begin] * (1 + step)) sum += speeds[end++];
    out.push_back(sum / static_cast<double>(end - begin));
    begin = end;
  }
  return out;
}

/// What is wrong with the passes themselves, before anything is fitted.
Status enough(const LatencyFit& fit, std::size_t count, const LatencyOptions& options) {
  const auto& v = fit.speeds_mm_s;
  if (static_cast<int>(count) < options.min_crossings) {
    return refuse(fmt::format("{} crossings, at least {} are needed", count, options.min_crossings),
                  "scan the edge to and fro at three speeds, three passes each");
  }
  if (fit.forward == 0 || fit.backward == 0) {
    return refuse(
        "all passes run in one direction: a latency moves their crossings as another place of the edge would",
        "scan the same edge to and fro");
  }
  if (v.size() == 1) {
    return refuse(
        fmt::format("one speed, {:.0f} mm/s: a latency of 1 ms and a bias of {:.2f} mm that depends "
                    "on the direction alone look the same",
                    v[0], 1e-3 * v[0]),
        "scan at three speeds, the fastest at least twice the slowest");
  }
  if (static_cast<int>(v.size()) < options.min_speeds || v.back() < options.min_speed_ratio * v.front()) {
    return refuse(
        fmt::format("{} speeds from {:.0f} to {:.0f} mm/s: too alike to tell a latency from a bias "
                    "that depends on the direction alone",
                    v.size(), v.front(), v.back()),
        fmt::format("scan at {} speeds or more, the fastest at least twice the slowest", options.min_speeds));
  }
  return Done{};
}

}  // namespace

double LatencyFit::sigma_ms() const { return std::sqrt(covariance(0, 0)); }
double LatencyFit::bias_sigma_mm() const { return std::sqrt(covariance(1, 1)); }
double LatencyFit::correlation() const {
  return covariance(0, 1) / std::sqrt(std::max(1e-300, covariance(0, 0) * covariance(1, 1)));
}

Result<LatencyFit> fit_latency(std::span<const GaugeCrossing> given, const LatencyOptions& options) {
  std::vector<GaugeCrossing> crossings;
  for (const GaugeCrossing& c : given) {
    const bool sound = std::isfinite(c.across_mm) && std::isfinite(c.along_mm) && std::isfinite(c.sigma_mm) &&
                       c.speed_mm_s > 0 && std::abs(c.direction) > 1e-3 && std::abs(c.direction) <= 1.001;
    if (!sound) {
      return refuse(fmt::format("crossing {} has no place, speed or direction", crossings.size() + 1),
                    "every crossing needs a finite place, a speed above 0 and a direction");
    }
    crossings.push_back(c);
  }
  LatencyFit fit;
  fit.speeds_mm_s = speed_clusters(crossings, options.speed_step);
  for (const GaugeCrossing& c : crossings) ++(c.direction > 0 ? fit.forward : fit.backward);
  if (const Status status = enough(fit, crossings.size(), options); !status.ok()) return status.error();

  const Problem problem = build(crossings, options);
  if (problem.rows.rows() < problem.rows.cols() + 2) {
    return refuse(fmt::format("{} crossings of {} edges leave nothing to judge the fit by", crossings.size(),
                              problem.edges.size()),
                  "cross each edge more often");
  }
  const Solved solved = solve(problem);
  fit.latency_ms = solved.parameters(0);
  fit.bias_mm = solved.parameters(1);
  fit.covariance = solved.covariance.topLeftCorner<2, 2>();
  fit.scatter = solved.scatter;
  const double r = std::min(1.0, std::abs(fit.correlation()));
  fit.condition = (1 + r) / std::max(1e-12, 1 - r);
  for (const EdgeColumns& edge : problem.edges) {
    fit.edge_ids.push_back(edge.id);
    const double slope = edge.slope >= 0 ? solved.parameters(edge.slope) : 0;
    fit.edge_mm.push_back(solved.parameters(edge.place) - slope * edge.middle_mm);
  }
  for (Eigen::Index i = 0; i < solved.residuals.size(); ++i) {
    fit.residual_mm.push_back(solved.residuals(i));
    fit.used.push_back(solved.weights(i) > 0 ? 1 : 0);
    fit.rejected += solved.weights(i) > 0 ? 0 : 1;
  }

  if (fit.rejected > options.max_rejected_share * static_cast<double>(crossings.size())) {
    return refuse(
        fmt::format("{} of {} crossings do not fit straight edges at rest", fit.rejected, crossings.size()),
        "clamp the gauge, clean its edge and scan again");
  }
  if (!std::isfinite(fit.sigma_ms()) || fit.sigma_ms() > options.max_sigma_ms) {
    return refuse(
        fmt::format("the latency is known to +-{:.3f} ms only, {:.3f} ms are wanted (crossings scatter "
                    "by {:.1f} times their sigma, correlation with the bias {:.2f})",
                    fit.sigma_ms(), options.max_sigma_ms, fit.scatter, fit.correlation()),
        "more passes, or speeds that lie farther apart");
  }
  return fit;
}

}  // namespace weldcell::calibrate
