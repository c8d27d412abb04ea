// Any edge points, path and options: a finite pose with a true covariance, or a refusal with its cause.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <vector>

#include <Eigen/Eigenvalues>

#include "fuzz_target.hpp"
#include "weldcell/base/units.hpp"
#include "weldcell/localize/localizer.hpp"

using namespace weldcell;
using localize::Localization;
using localize::LocalizeOptions;
using localize::Verdict;

namespace {

/// Few points and a small range keep an input at milliseconds; how it scales is the bench's business.
constexpr std::size_t kMostPoints = 120;
constexpr double kMostRange_mm = 60;

/// Two legs and a foot, 300 x 200 mm, no symmetry.
const localize::Localizer& weldment() {
  static const localize::Localizer localizer = [] {
    workpiece::Workpiece w;
    w.name = "fuzzed";
    w.height_mm = 40;
    const auto member = [&](const char* name, double x0, double y0, double x1, double y1) {
      w.members.push_back({name, name, {{x0, y0}, {x1, y0}, {x1, y1}, {x0, y1}}, 0});
    };
    member("foot", 0, 0, 300, 40);
    member("left", 0, 40, 40, 200);
    member("right", 220, 40, 260, 140);
    const auto sound = workpiece::validated(w);
    WELDCELL_ASSERT(sound.ok());
    const auto outline = workpiece::build_template(*sound);
    WELDCELL_ASSERT(outline.ok());
    return localize::Localizer(*outline);
  }();
  return localizer;
}

/// Reads the input to its end; then zeros.
class Source {
 public:
  Source(const std::uint8_t* data, std::size_t size) : data_(data), size_(size) {}
  bool empty() const { return at_ >= size_; }
  std::uint8_t byte() { return empty() ? std::uint8_t{0} : data_[at_++]; }
  /// Tag 0: eight bytes as they stand, so every double there is; other tags: sixteenths of a unit.
  double number() {
    if (byte() != 0) {
      const int low = byte(), high = byte();
      return static_cast<std::int16_t>(low | high << 8) / 16.0;
    }
    std::array<std::uint8_t, 8> raw{};
    for (std::uint8_t& b : raw) b = byte();
    double out;
    std::memcpy(&out, raw.data(), sizeof out);
    return out;
  }

 private:
  const std::uint8_t* data_;
  std::size_t size_, at_ = 0;
};

/// What a laser without noise sees of the part at a pose, a crossing every `pitch_mm` of each edge, so that
/// the input's points meet a fit that has something to hold on to.
void scan_part(const Pose2& pose, double pitch_mm, std::vector<EdgePoint>& edges,
               std::vector<PathPiece>& path) {
  for (const workpiece::VisibleEdge& edge : weldment().outline().edges) {
    const Vec2 n = pose.rotate(edge.outward);
    for (double along = pitch_mm / 2; along < edge.line.length(); along += pitch_mm) {
      const Vec2 p = pose * Vec2(edge.line.a + along * edge.line.direction());
      edges.push_back({p.x(), p.y(), n.x(), n.y(), -1, 0.3, 200, false});
      const Vec2 from = p - 5 * n, to = p + 5 * n;
      path.push_back({from.x(), from.y(), to.x(), to.y()});
    }
  }
}

void check_covariance(const Eigen::Matrix3d& covariance) {
  WELDCELL_ASSERT(covariance.allFinite());
  // Angles in units that bring them beside millimetres.
  const Eigen::DiagonalMatrix<double, 3> units(1, 1, 100);
  const Eigen::Matrix3d scaled = units * covariance * units;
  WELDCELL_ASSERT((scaled - scaled.transpose()).norm() <= 1e-6 * scaled.norm());
  const Eigen::Vector3d values = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(scaled).eigenvalues();
  WELDCELL_ASSERT(values(0) >= -1e-6 * values(2));
}

void check(const Localization& found, std::size_t points, const LocalizeOptions& options) {
  WELDCELL_ASSERT(!found.cause.empty() && !found.reason.empty());
  WELDCELL_ASSERT(found.edge_of_point.size() == points && found.residual_mm.size() == points);
  WELDCELL_ASSERT(found.inliers >= 0 && static_cast<std::size_t>(found.inliers) <= points);
  WELDCELL_ASSERT(std::isfinite(found.pose.x_mm) && std::isfinite(found.pose.y_mm) &&
                  std::isfinite(found.pose.theta_rad) && std::isfinite(found.mean_error_mm));
  WELDCELL_ASSERT(found.centroid_base.allFinite() && std::isfinite(found.inset_mm));
  WELDCELL_ASSERT(!found.latency_s || std::isfinite(*found.latency_s));
  check_covariance(found.covariance);
  const int edge_count = static_cast<int>(weldment().outline().edges.size());
  for (std::size_t i = 0; i < points; ++i) {
    WELDCELL_ASSERT(found.edge_of_point[i] >= -1 && found.edge_of_point[i] < edge_count);
    WELDCELL_ASSERT(std::isfinite(found.residual_mm[i]));
  }
  for (const localize::MemberPose& m : found.members) {
    WELDCELL_ASSERT(std::isfinite(m.dx_mm) && std::isfinite(m.dy_mm) && std::isfinite(m.dtheta_rad));
    check_covariance(m.covariance);
  }
  WELDCELL_ASSERT((found.verdict == Verdict::Weld) == (found.cause == "ok"));
  if (found.verdict != Verdict::Weld || options.method == localize::Method::Paper) return;
  WELDCELL_ASSERT(found.covariance.diagonal().minCoeff() > 0);
  WELDCELL_ASSERT(2 * std::sqrt(std::max(found.covariance(0, 0), found.covariance(1, 1))) <= 1.5 + 1e-6);
}

}  // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 2) return 0;
  Source in(data, size);
  const std::uint8_t flags = in.byte(), more = in.byte();
  LocalizeOptions options;
  options.range_mm = options.max_offset_mm = 25;
  std::vector<EdgePoint> edges;
  std::vector<PathPiece> path;
  if ((flags & 1) != 0) {
    const Pose2 truth{in.byte() / 8.0 - 16, in.byte() / 8.0 - 16, rad(in.byte() / 8.0 - 16)};
    scan_part(truth, 25.0 + (more >> 5) * 10, edges, path);
    if ((flags & 2) != 0) path.clear();
  }
  if ((flags & 4) != 0) options.method = localize::Method::Paper;
  if ((flags & 8) != 0) options.range_rad = options.max_rotation_rad = kPi;
  if ((flags & 16) != 0) {
    constexpr std::array<double LocalizeOptions::*, 9> kFields{
        &LocalizeOptions::max_offset_mm,          &LocalizeOptions::max_rotation_rad,
        &LocalizeOptions::default_sigma_mm,       &LocalizeOptions::latency_sigma_s,
        &LocalizeOptions::inset_sigma_mm,         &LocalizeOptions::member_shift_sigma_mm,
        &LocalizeOptions::member_angle_sigma_rad, &LocalizeOptions::max_member_shift_mm,
        &LocalizeOptions::max_mean_error_mm};
    options.*kFields[in.byte() % kFields.size()] = in.number();
  }
  if ((flags & 32) != 0) options.planned = {in.number(), in.number(), in.number()};
  if ((flags & 64) != 0)
    options.range_mm = std::min(in.number(), kMostRange_mm);  // its square is the search's time
  while (!in.empty() && edges.size() < kMostPoints) {
    const std::uint8_t what = in.byte();
    if (what < 32) {
      path.push_back({in.number(), in.number(), in.number(), in.number()});
    } else if (what < 96 && !edges.empty()) {
      EdgePoint& e = edges[in.byte() % edges.size()];
      constexpr std::array<double EdgePoint::*, 6> kFields{&EdgePoint::x_mm,     &EdgePoint::y_mm,
                                                           &EdgePoint::dir_x,    &EdgePoint::dir_y,
                                                           &EdgePoint::sigma_mm, &EdgePoint::speed_mm_s};
      e.*kFields[what % kFields.size()] = in.number();
    } else if (what < 112 && !edges.empty()) {
      edges.erase(edges.begin() + in.byte() % static_cast<std::ptrdiff_t>(edges.size()));
    } else {
      const double a = rad(1.5 * in.byte());
      EdgePoint e{in.number(), in.number(), std::cos(a), std::sin(a), what % 3 - 1, 0, 0, false};
      if ((what & 64) != 0) e.sigma_mm = in.number();
      if ((what & 32) != 0) e.speed_mm_s = in.number();
      edges.push_back(e);
    }
  }
  check(weldment().localize(edges, path, options), edges.size(), options);
  return 0;
}
