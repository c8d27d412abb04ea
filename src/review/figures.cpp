#include "figures.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "plane_svg.hpp"
#include "wording.hpp"

namespace weldcell::review {

namespace {

constexpr double kMarginMm = 40;

void grow(Box2& box, bool& any, const Vec2& p) {
  if (!p.allFinite()) return;
  box.min = any ? Vec2(box.min.cwiseMin(p)) : p;
  box.max = any ? Vec2(box.max.cwiseMax(p)) : p;
  any = true;
}

/// What every figure shows: the part as planned and as found, and the beam's way as far as it stays near
/// them.
Box2 view_of(const ReportInput& in) {
  Box2 box;
  bool any = false;
  for (const workpiece::Member& m : in.workpiece.members) {
    for (const Vec2& p : m.outline) {
      grow(box, any, in.planned * p);
      if (in.found) grow(box, any, in.found->pose * p);
    }
  }
  if (!any) {
    for (const EdgePoint& e : in.edges) grow(box, any, {e.x_mm, e.y_mm});
    for (const SurfaceSample& s : in.surface) grow(box, any, {s.x_mm, s.y_mm});
  }
  if (!any) return {Vec2(0, 0), Vec2(100, 100)};
  Box2 beam = box;
  for (const plan::BeamPath& path : in.beam_paths) {
    for (const Vec2& p : path.points) grow(beam, any, p);
  }
  const Vec2 reach = 0.25 * (box.max - box.min) + Vec2(60, 60);
  box.min = beam.min.cwiseMax(box.min - reach) - Vec2(kMarginMm, kMarginMm);
  box.max = beam.max.cwiseMin(box.max + reach) + Vec2(kMarginMm, kMarginMm);
  return box;
}

std::string figure(const std::string& svg, const std::string& caption) {
  return "<figure>\n" + svg + "<figcaption>" + caption + "</figcaption>\n</figure>\n";
}

/// A swatch for the caption; `shape` is svg inside a 28 x 12 box.
std::string key(const std::string& shape, const std::string& text) {
  return "<span class=\"key\"><svg viewBox=\"0 0 28 12\" width=\"28\" height=\"12\" aria-hidden=\"true\">" +
         shape + "</svg>" + text + "</span> ";
}
std::string line_key(const char* style, const std::string& text) {
  return key(fmt::format("<path class=\"{}\" d=\"M1,6H27\"/>", style), text);
}
std::string dot_key(const char* style, const std::string& text) {
  return key(fmt::format("<path class=\"{}\" d=\"M14,6h0\"/>", style), text);
}

void members(PlaneSvg& svg, const ReportInput& in, const Pose2& pose, const char* style) {
  for (const workpiece::Member& m : in.workpiece.members) svg.polygon(transformed(m.outline, pose), style);
}

std::string tag_of(const workpiece::Member& m, std::size_t index) {
  return m.tag.empty() ? std::to_string(index + 1) : m.tag;
}

std::vector<Vec2> flat(const std::vector<Eigen::Vector3d>& path) {
  std::vector<Vec2> out;
  for (const Eigen::Vector3d& p : path) out.push_back(p.head<2>());
  return out;
}

/// The welds where they are certified, or else where they are planned; with their names beside them.
void welds(PlaneSvg& svg, const ReportInput& in) {
  for (const workpiece::Weld& w : in.workpiece.welds) {
    std::vector<Vec2> path;
    const char* style = "seam";
    for (const weld::WeldCertificate& c : in.certificates) {
      if (c.name != w.name) continue;
      path = flat(c.path);
      style = c.verdict == localize::Verdict::Weld     ? "seam ok"
              : c.verdict == localize::Verdict::Rescan ? "seam again"
                                                       : "seam no";
    }
    if (path.size() < 2) {
      path.clear();
      for (const Eigen::Vector3d& p : workpiece::sample_path(w, 5))
        path.push_back(in.planned * Vec2(p.head<2>()));
    }
    if (path.size() < 2) continue;
    svg.line(path, style);
    const Vec2 along = (path.back() - path.front()).normalized(), aside(-along.y(), along.x());
    svg.text(path[path.size() / 2], w.name, "weldname", 15 * aside.x(), -15 * aside.y() + 4);
  }
}

std::vector<Vec2> edge_points(const ReportInput& in, bool outliers) {
  std::vector<Vec2> out;
  for (std::size_t i = 0; i < in.edges.size(); ++i) {
    const bool known = in.found && i < in.found->edge_of_point.size();
    const bool outlier = known && in.found->edge_of_point[i] < 0;
    if (outlier == outliers) out.push_back({in.edges[i].x_mm, in.edges[i].y_mm});
  }
  return out;
}

}  // namespace

std::string plan_figure(const ReportInput& in) {
  if (in.workpiece.members.empty()) return "";
  std::size_t lines = 0;
  for (const plan::BeamPath& p : in.beam_paths) lines += p.points.size() > 1;
  PlaneSvg svg(view_of(in), "plan", "Planned place, welds and scan path",
               fmt::format("{} members and {} welds as planned, {} scan paths", in.workpiece.members.size(),
                           in.workpiece.welds.size(), lines));
  for (const workpiece::Member& m : in.workpiece.members)
    svg.polygon(transformed(m.outline, in.planned), "solid");
  for (const plan::BeamPath& p : in.beam_paths) svg.line(p.points, "beam");
  for (const workpiece::Weld& w : in.workpiece.welds) {
    std::vector<Vec2> path;
    for (const Eigen::Vector3d& p : workpiece::sample_path(w, 5))
      path.push_back(in.planned * Vec2(p.head<2>()));
    if (path.size() > 1) svg.line(path, "seam");
  }
  for (std::size_t i = 0; i < in.workpiece.members.size(); ++i) {
    svg.marker(in.planned * centroid(in.workpiece.members[i].outline), tag_of(in.workpiece.members[i], i),
               "tag");
  }
  return figure(svg.finish(), line_key("solid", "member, with its number") + line_key("seam", "weld") +
                                  (lines ? line_key("beam", "path of the laser spot") : ""));
}

std::string scan_figure(const ReportInput& in) {
  if (in.surface.empty()) return "";
  constexpr int kBins = 8;
  const double low = in.table_z_mm - 2, high = in.table_z_mm + std::max(1.0, in.workpiece.height_mm) + 2;
  std::array<std::vector<Vec2>, kBins> bins;
  std::vector<Vec2> lost;
  for (const SurfaceSample& s : in.surface) {
    const Vec2 p(s.x_mm, s.y_mm);
    if (!s.valid || !std::isfinite(s.z_mm)) {
      lost.push_back(p);
      continue;
    }
    const double share = (static_cast<double>(s.z_mm) - low) / (high - low);
    bins[static_cast<std::size_t>(std::clamp(static_cast<int>(share * kBins), 0, kBins - 1))].push_back(p);
  }
  PlaneSvg svg(
      view_of(in), "scan", "Laser readings by height",
      fmt::format("{} readings shown, {} of them drop-outs; heights from {:.0f} to {:.0f} mm in Base",
                  in.surface.size(), lost.size(), low, high));
  if (in.found) members(svg, in, in.found->pose, "ghost");
  std::string scale;
  for (int b = 0; b < kBins; ++b) {
    const std::string style = fmt::format("dot h{}", b);
    svg.dots(bins[static_cast<std::size_t>(b)], style);
    scale += fmt::format("<rect class=\"f{0}\" x=\"{1}\" y=\"1\" width=\"14\" height=\"10\"/>", b, 14 * b);
  }
  svg.dots(lost, "dot lost");
  std::string caption = fmt::format(
      "<span class=\"key\">{:.0f} mm <svg viewBox=\"0 0 112 12\" width=\"112\" height=\"12\" "
      "aria-hidden=\"true\">{}</svg> "
      "{:.0f} mm height over the base</span> ",
      low, scale, high);
  if (!lost.empty())
    caption += dot_key("dot lost", fmt::format("no reading ({} of those shown)", lost.size()));
  return figure(svg.finish(), caption);
}

std::string edge_figure(const ReportInput& in) {
  if (in.edges.empty()) return "";
  std::vector<Vec2> rising, falling, unknown;
  std::vector<Segment> crossings;
  PlaneSvg svg(
      view_of(in), "edges", "Edge points",
      fmt::format("{} edge points; a stroke shows the laser's direction of travel", in.edges.size()));
  for (const EdgePoint& e : in.edges) {
    const Vec2 p(e.x_mm, e.y_mm), d(e.dir_x, e.dir_y);
    (e.step > 0 ? rising : e.step < 0 ? falling : unknown).push_back(p);
    crossings.push_back({p, p + 9 * svg.mm_per_px() * d});
  }
  std::vector<Segment> travelled;
  for (const PathPiece& piece : in.path)
    travelled.push_back({{piece.x0_mm, piece.y0_mm}, {piece.x1_mm, piece.y1_mm}});
  svg.strokes(travelled, "travelled");
  if (in.found) members(svg, in, in.found->pose, "ghost");
  svg.strokes(crossings, "crossing");
  svg.dots(rising, "dot rising");
  svg.dots(falling, "dot falling");
  svg.dots(unknown, "dot unknown");
  return figure(
      svg.finish(),
      dot_key("dot rising", fmt::format("surface rises ({})", rising.size())) +
          dot_key("dot falling", fmt::format("falls ({})", falling.size())) +
          (unknown.empty() ? "" : dot_key("dot unknown", fmt::format("unknown ({})", unknown.size()))) +
          line_key("travelled", "travel with valid readings"));
}

std::string fit_figure(const ReportInput& in) {
  if (in.workpiece.members.empty() || (!in.found && in.edges.empty())) return "";
  const std::vector<Vec2> inliers = edge_points(in, false), outliers = edge_points(in, true);
  PlaneSvg svg(
      view_of(in), "fit", "The fit: planned, found and measured",
      in.found
          ? fmt::format("Outline as planned (dotted) and as found (solid), {} edge points that belong to "
                        "it and {} that do not",
                        inliers.size(), outliers.size())
          : fmt::format("Outline as planned and {} edge points; the part was not found", inliers.size()));
  members(svg, in, in.planned, "planned");
  if (in.truth) members(svg, in, *in.truth, "truth");
  if (in.found) members(svg, in, in.found->pose, "found");
  welds(svg, in);
  svg.dots(outliers, "dot outlier");
  svg.dots(inliers, "dot edge");
  std::string caption = line_key("planned", "planned");
  if (in.found) caption += line_key("found", "found");
  if (in.truth) caption += line_key("truth", "truth (simulated)");
  caption += dot_key("dot edge", fmt::format("edge point ({})", inliers.size()));
  if (!outliers.empty()) caption += dot_key("dot outlier", fmt::format("set aside ({})", outliers.size()));
  if (!in.workpiece.welds.empty()) caption += line_key("seam ok", "weld");
  return figure(svg.finish(), caption);
}

std::string arrow_figure(const ReportInput& in) {
  if (!in.found || in.found->residual_mm.size() != in.edges.size() || in.outline.edges.empty()) return "";
  const localize::Localization& f = *in.found;
  std::vector<double> sizes;
  for (std::size_t i = 0; i < in.edges.size(); ++i) {
    const int edge = i < f.edge_of_point.size() ? f.edge_of_point[i] : -1;
    if (edge >= 0 && static_cast<std::size_t>(edge) < in.outline.edges.size() &&
        std::isfinite(f.residual_mm[i])) {
      sizes.push_back(std::abs(f.residual_mm[i]));
    }
  }
  if (sizes.empty()) return "";
  std::sort(sizes.begin(), sizes.end());
  const double typical = std::max(1e-3, sizes[sizes.size() * 9 / 10]);
  const Box2 view = view_of(in);
  const double larger = round_step(0.03 * (view.max - view.min).norm() / typical / 2);
  PlaneSvg svg(
      view, "arrows", "Residuals",
      fmt::format("Distance of each edge point from the found outline, drawn {:.0f} times larger", larger));
  members(svg, in, f.pose, "found");
  for (std::size_t i = 0; i < in.edges.size(); ++i) {
    const int edge = i < f.edge_of_point.size() ? f.edge_of_point[i] : -1;
    if (edge < 0 || static_cast<std::size_t>(edge) >= in.outline.edges.size()) continue;
    const Vec2 n = f.pose.rotate(in.outline.edges[static_cast<std::size_t>(edge)].outward);
    const Vec2 p(in.edges[i].x_mm, in.edges[i].y_mm), foot = p - f.residual_mm[i] * n;
    svg.arrow(foot, foot + larger * f.residual_mm[i] * n, f.residual_mm[i] >= 0 ? "arrow out" : "arrow in");
  }
  return figure(svg.finish(), fmt::format("drawn {:.0f} times larger than they are. ", larger) +
                                  line_key("arrow out", "seen outside the found outline") +
                                  line_key("arrow in", "seen inside"));
}

std::string residual_histogram(const ReportInput& in) {
  if (!in.found) return "";
  std::vector<double> values;
  for (std::size_t i = 0; i < in.found->residual_mm.size(); ++i) {
    const bool inlier = i < in.found->edge_of_point.size() && in.found->edge_of_point[i] >= 0;
    if (inlier && std::isfinite(in.found->residual_mm[i])) values.push_back(in.found->residual_mm[i]);
  }
  if (values.size() < 5) return "";
  double sum = 0, squares = 0, largest = 0;
  for (const double v : values) sum += v, squares += v * v, largest = std::max(largest, std::abs(v));
  const double n = static_cast<double>(values.size()), mean = sum / n;
  const double sigma = std::sqrt(std::max(1e-12, squares / n - mean * mean));
  // A few far points must not squeeze all others into two bars: they are counted in the outermost ones.
  const double range = std::min(largest, std::abs(mean) + 3 * sigma);
  const double width = round_step(std::max(0.005, 2 * range / 36));
  const int half = std::max(3, static_cast<int>(std::ceil(range / width)));
  std::vector<int> counts(static_cast<std::size_t>(2 * half), 0);
  for (const double v : values) {
    const int bin = std::clamp(static_cast<int>(std::floor(v / width)) + half, 0, 2 * half - 1);
    ++counts[static_cast<std::size_t>(bin)];
  }
  const double top =
      std::max(*std::max_element(counts.begin(), counts.end()) * 1.0, n * width / (sigma * 2.5066));
  constexpr double kW = 640, kH = 240, kLeft = 46, kBase = 200, kTop = 12;
  const double bar = (kW - kLeft - 10) / (2.0 * half);
  const auto x_of = [&](double mm) { return kLeft + (mm / width + half) * bar; };
  const auto y_of = [&](double count) { return kBase - (kBase - kTop) * count / top; };
  std::string svg = fmt::format(
      "<svg viewBox=\"0 0 {0} {1}\" style=\"max-width:{0}px\" role=\"img\" aria-labelledby=\"hist-t "
      "hist-d\"><title id=\"hist-t\">"
      "Histogram of the residuals</title><desc id=\"hist-d\">{2} edge points, mean {3} mm, standard "
      "deviation {4} mm"
      "</desc>\n",
      kW, kH, values.size(), signed_number(mean, 3), number(sigma, 3));
  for (std::size_t b = 0; b < counts.size(); ++b) {
    if (!counts[b]) continue;
    const double y = y_of(counts[b]);
    svg += fmt::format("<rect class=\"bar\" x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\"/>\n",
                       kLeft + static_cast<double>(b) * bar + 0.5, y, bar - 1, kBase - y);
  }
  std::string bell;
  for (int k = 0; k <= 120; ++k) {
    const double v = (-1 + k / 60.0) * half * width, z = (v - mean) / sigma;
    bell += fmt::format("{}{:.1f},{:.1f}", k ? " " : "", x_of(v),
                        y_of(n * width / (sigma * 2.5066) * std::exp(-z * z / 2)));
  }
  svg += "<polyline class=\"bell\" points=\"" + bell + "\"/>\n";
  svg += fmt::format("<path class=\"axis\" d=\"M{},{}H{}\"/>", kLeft, kBase, kW - 10);
  const double tick = round_step(half * width / 4);
  for (double v = -std::floor(half * width / tick) * tick; v <= half * width + 1e-9; v += tick) {
    svg += fmt::format("<text class=\"tick\" x=\"{:.1f}\" y=\"{}\">{}</text>", x_of(v), kBase + 16,
                       number(std::abs(v) < 1e-9 ? 0 : v, tick < 0.1 ? 2 : 1));
  }
  svg += fmt::format(
      "<text class=\"tick end\" x=\"{}\" y=\"{}\">distance from the found outline, mm (+ outside)</text>",
      kW - 10, kBase + 34);
  svg += fmt::format("<text class=\"tick left\" x=\"{}\" y=\"{:.1f}\">{:.0f}</text>", kLeft - 6,
                     y_of(top) + 8, top);
  svg += fmt::format("<text class=\"tick left\" x=\"{}\" y=\"{}\">0</text></svg>\n", kLeft - 6, kBase);
  return figure(
      svg,
      fmt::format(
          "{} edge points that belong to the outline: mean {} mm, standard deviation {} mm; the line is the "
          "normal distribution of the same spread.",
          values.size(), signed_number(mean, 3), number(sigma, 3)));
}

}  // namespace weldcell::review
