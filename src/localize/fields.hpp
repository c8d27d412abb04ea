// Grids over the part's plane: how well a point at a place fits, and which edges may be the closest to it.
// Pure.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "weldcell/workpiece/outline_template.hpp"

namespace weldcell::localize {

/// An edge prepared for distance queries; frame Part, origin at the template's centroid.
struct FieldEdge {
  Vec2 a = Vec2::Zero(), direction = Vec2::Zero(), outward = Vec2::Zero();
  double length_mm = 0;
  int member = 0;
  bool round = false;
};

/// Points are told apart by the direction into the material, as their step and travel say: kBins sectors of
/// the plane and one bin for points that cannot say.
inline constexpr int kBins = 8;
inline constexpr int kAnyBin = kBins;
inline constexpr int kAllBins = kBins + 1;
/// The sector of a direction (radians, frame Part).
int bin_of(double angle_rad);

/// Where a member lies: its centroid about the template's, direction and length of its longest side.
struct MemberFrame {
  Vec2 centroid = Vec2::Zero(), axis = Vec2::UnitX();
  double length_mm = 1;
};

/// All in frame Part with the template's centroid as origin, so that turning is about the centroid.
class TemplateFields {
 public:
  explicit TemplateFields(const workpiece::OutlineTemplate& outline);

  double cell_mm() const { return cell_mm_; }
  int columns() const { return columns_; }
  int rows() const { return rows_; }
  const Vec2& origin() const { return origin_; }
  const std::vector<FieldEdge>& edges() const { return edges_; }
  const std::vector<Vec2>& member_centroids() const { return member_centroids_; }
  const std::vector<MemberFrame>& member_frames() const { return member_frames_; }
  double radius_mm() const { return radius_mm_; }
  /// Shifts of a pitch between members by which the outline nearly covers itself (slips.hpp).
  const std::vector<Vec2>& slips() const { return slips_; }

  /// Score 0..255 of each cell, row by row: 255 on an edge, 0 from kReach_mm on.
  const std::uint16_t* scores(int bin) const {
    return scores_.data() + static_cast<std::size_t>(bin) * cells_;
  }
  /// Edges that may be the closest one to a point of the cell that holds q; empty outside the grid.
  std::span<const std::uint16_t> near(int bin, const Vec2& q) const;
  /// Lower bound of the distance from q to any edge, at most kReach_mm.
  double clearance_mm(const Vec2& q) const;
  std::size_t memory_bytes() const;

  static constexpr double kReach_mm = 40;

 private:
  void lay_grid(const workpiece::OutlineTemplate& outline);
  void fill(int bin);

  double cell_mm_ = 8, radius_mm_ = 0;
  int columns_ = 0, rows_ = 0;
  std::size_t cells_ = 0;
  Vec2 origin_ = Vec2::Zero();
  std::vector<FieldEdge> edges_;
  std::vector<Vec2> member_centroids_, slips_;
  std::vector<MemberFrame> member_frames_;
  std::vector<std::uint16_t> scores_;
  std::vector<std::uint32_t> starts_;
  std::vector<std::uint16_t> candidates_;
};

}  // namespace weldcell::localize
