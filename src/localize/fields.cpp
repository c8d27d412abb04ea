#include "fields.hpp"

#include <algorithm>
#include <cmath>

#include "slips.hpp"
#include "weldcell/base/units.hpp"

namespace weldcell::localize {

namespace {

constexpr double kCell_mm = 8;
constexpr double kMargin_mm = 48;
constexpr double kMaxCells = 160'000;
constexpr double kScoreScale_mm = 12;
constexpr std::size_t kMaxEdges = 60'000;

double distance_to(const FieldEdge& edge, const Vec2& q) {
  const Vec2 d = q - edge.a;
  const double along = std::clamp(d.dot(edge.direction), 0.0, edge.length_mm);
  return (d - along * edge.direction).norm();
}

/// Whether a point whose direction into the material lies in the bin can belong to the edge.
bool fits_bin(const FieldEdge& edge, int bin, double limit_rad) {
  if (bin == kAnyBin) return true;
  const double centre = 2 * kPi * bin / kBins;
  const double inward = std::atan2(-edge.outward.y(), -edge.outward.x());
  return std::abs(wrap_pi(inward - centre)) <= limit_rad;
}

/// Well clear of travel along the edge, so that long parallel edges do not drown the search.
constexpr double kSearchFit_rad = rad(78);
/// Any crossing of the bin's sector, with 3 degrees for a pose still turned wrong.
constexpr double kListFit_rad = rad(90 + 180.0 / kBins + 3);

std::uint16_t score(double d) {
  const double c2 = kScoreScale_mm * kScoreScale_mm;
  const double r2 = TemplateFields::kReach_mm * TemplateFields::kReach_mm;
  const double floor = c2 / (c2 + r2);
  return static_cast<std::uint16_t>(
      std::lround(255 * std::max(0.0, (c2 / (c2 + d * d) - floor) / (1 - floor))));
}

Segment longest_side(const Polygon& outline) {
  Segment best{Vec2::Zero(), Vec2::UnitX()};
  double longest = 0;
  for (std::size_t k = 0; k < outline.size(); ++k) {
    const Segment side{outline[k], outline[(k + 1) % outline.size()]};
    if (side.length() <= longest * (1 + 1e-9)) continue;
    longest = side.length();
    best = side;
  }
  return best;
}

}  // namespace

int bin_of(double angle_rad) {
  const int bin = static_cast<int>(std::floor(angle_rad * (kBins / (2 * kPi)) + 0.5)) % kBins;
  return bin < 0 ? bin + kBins : bin;
}

TemplateFields::TemplateFields(const workpiece::OutlineTemplate& outline) : radius_mm_(outline.radius_mm) {
  for (const workpiece::VisibleEdge& edge : outline.edges) {
    if (edges_.size() == kMaxEdges) break;
    edges_.push_back({edge.line.a - outline.centroid, edge.line.direction(), edge.outward, edge.line.length(),
                      edge.member, edge.round});
  }
  for (const Polygon& member : outline.members) {
    member_centroids_.push_back(centroid(member) - outline.centroid);
    const Segment side = longest_side(member);
    member_frames_.push_back({member_centroids_.back(), side.direction(), side.length()});
  }
  lay_grid(outline);
  scores_.resize(cells_ * kAllBins);
  starts_.assign(1, 0);
  for (int bin = 0; bin < kAllBins; ++bin) fill(bin);
  candidates_.shrink_to_fit();
  slips_ = slips_of(*this);
}

void TemplateFields::lay_grid(const workpiece::OutlineTemplate& outline) {
  Vec2 low = Vec2::Constant(1e300), high = Vec2::Constant(-1e300);
  for (const workpiece::VisibleEdge& edge : outline.edges) {
    low = low.cwiseMin(edge.line.a).cwiseMin(edge.line.b);
    high = high.cwiseMax(edge.line.a).cwiseMax(edge.line.b);
  }
  origin_ = low - outline.centroid - Vec2::Constant(kMargin_mm);
  const Vec2 size = high - low + Vec2::Constant(2 * kMargin_mm);
  cell_mm_ = std::max(kCell_mm, std::sqrt(size.x() * size.y() / kMaxCells));
  columns_ = static_cast<int>(std::ceil(size.x() / cell_mm_)) + 1;
  rows_ = static_cast<int>(std::ceil(size.y() / cell_mm_)) + 1;
  cells_ = static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_);
}

void TemplateFields::fill(int bin) {
  struct Near {
    std::uint32_t cell;
    float distance;
    std::uint16_t edge;
  };
  std::vector<float> closest(cells_, static_cast<float>(kReach_mm)), closest_listed = closest;
  std::vector<Near> near;
  const double half_diagonal = cell_mm_ * std::sqrt(0.5);
  for (std::size_t e = 0; e < edges_.size(); ++e) {
    const FieldEdge& edge = edges_[e];
    if (!fits_bin(edge, bin, kListFit_rad)) continue;
    const bool in_search = fits_bin(edge, bin, kSearchFit_rad);
    const Vec2 end = edge.a + edge.length_mm * edge.direction;
    const Vec2 low = (edge.a.cwiseMin(end) - origin_ - Vec2::Constant(kReach_mm)) / cell_mm_;
    const Vec2 high = (edge.a.cwiseMax(end) - origin_ + Vec2::Constant(kReach_mm)) / cell_mm_;
    for (int row = std::max(0, static_cast<int>(low.y())); row < std::min<double>(rows_, high.y() + 1);
         ++row) {
      for (int column = std::max(0, static_cast<int>(low.x()));
           column < std::min<double>(columns_, high.x() + 1); ++column) {
        const double d = distance_to(edge, origin_ + cell_mm_ * Vec2(column + 0.5, row + 0.5));
        if (d >= kReach_mm) continue;
        const auto cell = static_cast<std::uint32_t>(row * columns_ + column);
        const auto distance = static_cast<float>(d);
        if (in_search) closest[cell] = std::min(closest[cell], distance);
        closest_listed[cell] = std::min(closest_listed[cell], distance);
        near.push_back({cell, distance, static_cast<std::uint16_t>(e)});
      }
    }
  }
  std::uint16_t* out = scores_.data() + static_cast<std::size_t>(bin) * cells_;
  for (std::size_t i = 0; i < cells_; ++i) out[i] = score(closest[i]);

  const auto kept = [&](const Near& n) { return n.distance <= closest_listed[n.cell] + 2 * half_diagonal; };
  std::vector<std::uint32_t> count(cells_ + 1, 0);
  for (const Near& n : near) count[n.cell + 1] += kept(n);
  const std::uint32_t base = starts_.back();
  for (std::size_t i = 0; i < cells_; ++i) count[i + 1] += count[i];
  candidates_.resize(base + count[cells_]);
  for (std::size_t i = 1; i <= cells_; ++i) starts_.push_back(base + count[i]);
  for (const Near& n : near) {
    if (kept(n)) candidates_[base + count[n.cell]++] = n.edge;
  }
}

std::span<const std::uint16_t> TemplateFields::near(int bin, const Vec2& q) const {
  const double x = (q.x() - origin_.x()) / cell_mm_, y = (q.y() - origin_.y()) / cell_mm_;
  if (!(x >= 0 && y >= 0 && x < columns_ && y < rows_)) return {};
  const std::size_t cell = static_cast<std::size_t>(bin) * cells_ +
                           static_cast<std::size_t>(y) * static_cast<std::size_t>(columns_) +
                           static_cast<std::size_t>(x);
  return {candidates_.data() + starts_[cell], starts_[cell + 1] - starts_[cell]};
}

double TemplateFields::clearance_mm(const Vec2& q) const {
  double closest = kReach_mm - cell_mm_ * std::sqrt(0.5);
  for (const std::uint16_t e : near(kAnyBin, q)) closest = std::min(closest, distance_to(edges_[e], q));
  return closest;
}

std::size_t TemplateFields::memory_bytes() const {
  return scores_.size() * sizeof(scores_[0]) + starts_.size() * sizeof(starts_[0]) +
         candidates_.size() * sizeof(candidates_[0]) + edges_.size() * sizeof(FieldEdge);
}

}  // namespace weldcell::localize
