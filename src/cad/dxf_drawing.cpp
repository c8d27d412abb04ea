#include "cad/dxf_drawing.hpp"

#include <dxflib/dl_creationadapter.h>
#include <dxflib/dl_dxf.h>
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <cmath>
#include <set>

#include "weldcell/base/units.hpp"

namespace weldcell::cad {

namespace {

constexpr std::size_t kMaxCurves = 20'000;
constexpr std::size_t kMaxPoints = 1'000'000;
constexpr int kMaxNesting = 16;

struct Raw {
  std::string layer;
  std::vector<Vec2> points;
  bool closed = false;
};
struct Insertion {
  std::string block, layer;
  Eigen::Affine2d placed;
};
struct Block {
  Vec2 base = Vec2::Zero();
  std::vector<Raw> curves;
  std::vector<Insertion> inserts;
};

/// Keeps what dxflib reports: the model's entities and each block's, and the header's unit.
class Collector : public DL_CreationAdapter {
 public:
  Block model;
  std::map<std::string, Block> blocks;
  std::map<std::string, int> left_out;
  std::set<std::string> hidden_layers;
  int insunits = 0;
  bool too_much = false, tilted = false;

  void setVariableInt(const std::string& key, int value, int) override {
    if (key == "$INSUNITS") insunits = value;
  }
  void addLayer(const DL_LayerData& data) override {
    if (data.off || (data.flags & 1) != 0) hidden_layers.insert(data.name);
  }
  void addBlock(const DL_BlockData& data) override {
    Block& block = blocks[data.name];
    block = Block{};
    block.base = {data.bpx, data.bpy};
    into_ = &block;
  }
  void endBlock() override { into_ = &model; }

  void addLine(const DL_LineData& d) override { add({{d.x1, d.y1}, {d.x2, d.y2}}, false, false); }
  void addArc(const DL_ArcData& d) override {
    double a1 = rad(d.angle2);
    const double a0 = rad(d.angle1);
    while (a1 <= a0) a1 += 2 * kPi;
    add(arc_points({d.cx, d.cy}, d.radius, a0, a1), false, true);
  }
  void addCircle(const DL_CircleData& d) override {
    add(arc_points({d.cx, d.cy}, d.radius, 0, 2 * kPi), true, true);
  }
  void addEllipse(const DL_EllipseData& d) override {
    double a1 = d.angle2;
    while (a1 <= d.angle1) a1 += 2 * kPi;
    std::vector<Vec2> points = arc_points({0, 0}, 1, d.angle1, a1);
    for (Vec2& p : points)
      p = Vec2(d.cx, d.cy) + p.x() * Vec2(d.mx, d.my) + p.y() * d.ratio * Vec2(-d.my, d.mx);
    add(std::move(points), std::abs(a1 - d.angle1 - 2 * kPi) < 1e-9, false);
  }
  void addPolyline(const DL_PolylineData& d) override {
    finish_curve();
    polyline_ = true;
    polyline_closed_ = (d.flags & 1) != 0;
    // 3D polylines, meshes and polyfaces are no outlines.
    polyline_flat_ = (d.flags & (16 | 64)) == 0;
    polyline_layer_ = getAttributes().getLayer();
    polyline_hidden_ = hidden();
  }
  void addVertex(const DL_VertexData& d) override { vertices_.push_back({{d.x, d.y}, d.bulge}); }
  void addSpline(const DL_SplineData& d) override {
    finish_curve();
    spline_ = true;
    degree_ = static_cast<int>(d.degree);
  }
  void addControlPoint(const DL_ControlPointData& d) override {
    control_.emplace_back(d.x, d.y);
    weights_.push_back(d.w > 0 ? d.w : 1);
  }
  void addKnot(const DL_KnotData& d) override { knots_.push_back(d.k); }
  void addFitPoint(const DL_FitPointData& d) override { fit_.emplace_back(d.x, d.y); }
  void endEntity() override { finish_curve(); }
  void endSequence() override { finish_curve(); }

  void addInsert(const DL_InsertData& d) override {
    if (hidden()) return;
    const double mirror = mirrored();
    const int cols = std::max(1, d.cols), rows = std::max(1, d.rows);
    if (cols > 1000 || rows > 1000) {
      too_much = true;
      return;
    }
    for (int c = 0; c < cols && !too_much; ++c) {
      for (int r = 0; r < rows && !too_much; ++r) {
        Eigen::Affine2d placed = Eigen::Affine2d::Identity();
        placed.scale(Vec2(mirror, 1));
        placed.translate(Vec2(d.ipx, d.ipy));
        placed.rotate(rad(d.angle));
        placed.translate(Vec2(c * d.colSp, r * d.rowSp));
        placed.scale(Vec2(d.sx == 0 ? 1 : d.sx, d.sy == 0 ? 1 : d.sy));
        into_->inserts.push_back({d.name, getAttributes().getLayer(), placed});
        too_much = into_->inserts.size() > kMaxCurves;
      }
    }
  }

  void addHatch(const DL_HatchData&) override { ++left_out["HATCH"]; }
  void addSolid(const DL_SolidData&) override { ++left_out["SOLID"]; }
  void addTrace(const DL_TraceData&) override { ++left_out["TRACE"]; }
  void add3dFace(const DL_3dFaceData&) override { ++left_out["3DFACE"]; }
  void addXLine(const DL_XLineData&) override { ++left_out["XLINE"]; }
  void addRay(const DL_RayData&) override { ++left_out["RAY"]; }

  /// dxflib ends a polyline or spline only by the next entity.
  void finish_curve() {
    if (polyline_) finish_polyline();
    if (spline_) finish_spline();
    vertices_.clear();
    knots_.clear();
    control_.clear();
    weights_.clear();
    fit_.clear();
    polyline_ = spline_ = false;
  }

 private:
  struct Vertex {
    Vec2 p;
    double bulge;
  };

  /// On a layer that is off or frozen, or on the paper around the drawing.
  bool hidden() {
    return getAttributes().isInPaperSpace() || hidden_layers.count(getAttributes().getLayer()) != 0;
  }

  /// -1 when the entity is seen from below (extrusion along -Z mirrors its x), 1 from above.
  double mirrored() {
    double direction[3] = {0, 0, 1};
    if (getExtrusion() != nullptr) getExtrusion()->getDirection(direction);
    const double length =
        std::sqrt(direction[0] * direction[0] + direction[1] * direction[1] + direction[2] * direction[2]);
    if (length > 0 && std::abs(direction[2]) < 0.999 * length) tilted = true;
    return direction[2] < 0 ? -1 : 1;
  }

  void add(std::vector<Vec2> points, bool closed, bool in_object_plane) {
    if (hidden()) return;
    if (in_object_plane && mirrored() < 0) {
      for (Vec2& p : points) p.x() = -p.x();
    }
    put(getAttributes().getLayer(), std::move(points), closed);
  }

  void put(const std::string& layer, std::vector<Vec2> points, bool closed) {
    for (const Vec2& p : points) {
      if (!p.allFinite() || p.cwiseAbs().maxCoeff() > 1e9) return;
    }
    points_ += points.size();
    if (points.size() < 2) return;
    if (into_->curves.size() >= kMaxCurves || points_ > kMaxPoints) {
      too_much = true;
      return;
    }
    into_->curves.push_back({layer, std::move(points), closed});
  }

  void finish_polyline() {
    if (!polyline_flat_) {
      ++left_out["3D POLYLINE"];
      return;
    }
    if (vertices_.size() < 2 || polyline_hidden_) return;
    std::vector<Vec2> points{vertices_.front().p};
    const std::size_t sides = polyline_closed_ ? vertices_.size() : vertices_.size() - 1;
    for (std::size_t i = 0; i < sides; ++i) {
      const Vertex &a = vertices_[i], &b = vertices_[(i + 1) % vertices_.size()];
      for (const Vec2& p : bulge_points(a.p, b.p, a.bulge)) points.push_back(p);
    }
    if (mirrored() < 0) {
      for (Vec2& p : points) p.x() = -p.x();
    }
    put(polyline_layer_, std::move(points), polyline_closed_);
  }

  void finish_spline() {
    std::vector<Vec2> points = spline_points(degree_, knots_, control_, weights_);
    if (points.empty() && fit_.size() >= 2) {
      ++left_out["SPLINE by fit points (taken as straight pieces)"];
      points = fit_;
    }
    if (points.empty()) {
      ++left_out["SPLINE"];
      return;
    }
    add(std::move(points), false, false);
  }

  Block* into_ = &model;
  std::size_t points_ = 0;
  bool polyline_ = false, polyline_closed_ = false, polyline_flat_ = true, polyline_hidden_ = false,
       spline_ = false;
  std::string polyline_layer_;
  std::vector<Vertex> vertices_;
  int degree_ = 3;
  std::vector<double> knots_, weights_;
  std::vector<Vec2> control_, fit_;
};

/// Blocks put where they are inserted, to any depth of nesting; every insertion is a group of its own.
class Expander {
 public:
  Expander(const Collector& from, Drawing& into) : from_(from), into_(into) {}

  Status model() {
    std::map<std::string, int> group_of_layer;
    for (const Raw& raw : from_.model.curves) {
      auto [at, fresh] = group_of_layer.try_emplace(raw.layer, static_cast<int>(into_.groups.size()));
      if (fresh) into_.groups.push_back(raw.layer);
      into_.curves.push_back({at->second, raw.points, raw.closed});
    }
    return inserts(from_.model, Eigen::Affine2d::Identity(), 0);
  }

 private:
  Status inserts(const Block& block, const Eigen::Affine2d& placed, int depth) {
    if (depth >= kMaxNesting) {
      return Error{"cad.limit", "", fmt::format("blocks are nested deeper than {}", kMaxNesting),
                   "does a block insert itself? explode the blocks and export again"};
    }
    for (const Insertion& insertion : block.inserts) {
      const auto found = from_.blocks.find(insertion.block);
      if (found == from_.blocks.end()) {
        return Error{"cad.unreadable", "",
                     "inserts the block '" + insertion.block + "' that it does not hold",
                     "bind external references and export again"};
      }
      const Block& inner = found->second;
      const Eigen::Affine2d inner_placed = placed * insertion.placed * Eigen::Translation2d(-inner.base);
      const int group = static_cast<int>(into_.groups.size());
      into_.groups.push_back(insertion.block);
      for (const Raw& raw : inner.curves) {
        if (into_.curves.size() >= kMaxCurves) {
          return Error{"cad.limit", "", fmt::format("holds more than {} curves", kMaxCurves),
                       "export only the members' outlines"};
        }
        Curve curve{group, {}, raw.closed};
        for (const Vec2& p : raw.points) curve.points.push_back(inner_placed * p);
        into_.curves.push_back(std::move(curve));
      }
      if (Status nested = inserts(inner, inner_placed, depth + 1); !nested.ok()) return nested;
      if (into_.groups.size() > kMaxCurves) {
        return Error{"cad.limit", "", fmt::format("holds more than {} insertions", kMaxCurves),
                     "explode or thin out the blocks"};
      }
    }
    return Done{};
  }

  const Collector& from_;
  Drawing& into_;
};

}  // namespace

Result<Drawing> read_drawing(const std::string& path) {
  Collector collector;
  DL_Dxf dxf;
  if (!dxf.in(path, &collector)) {
    return Error{"cad.unreadable", "", "cannot be opened as a DXF", "check its permissions"};
  }
  collector.finish_curve();
  if (collector.too_much) {
    return Error{"cad.limit", "",
                 fmt::format("holds more than {} curves or {} points", kMaxCurves, kMaxPoints),
                 "export only the members' outlines"};
  }
  if (collector.tilted) {
    return Error{"cad.unsupported", "", "holds curves that do not lie in the drawing plane",
                 "export the view from above as a flat 2D drawing"};
  }
  Drawing drawing;
  drawing.insunits = collector.insunits;
  drawing.left_out = collector.left_out;
  if (Status expanded = Expander(collector, drawing).model(); !expanded.ok()) return expanded.error();
  return drawing;
}

}  // namespace weldcell::cad
