#include "plane_svg.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "wording.hpp"

namespace weldcell::review {

namespace {
constexpr double kWidestPx = 1080, kHighestPx = 640;
constexpr double kLeftPx = 46, kBottomPx = 34, kEdgePx = 8;
}  // namespace

PlaneSvg::PlaneSvg(const Box2& view, std::string id, std::string title, std::string description)
    : view_(view), id_(std::move(id)), title_(std::move(title)), description_(std::move(description)) {
  const Vec2 size = (view.max - view.min).cwiseMax(Vec2(1, 1));
  scale_ =
      std::min((kWidestPx - kLeftPx - kEdgePx) / size.x(), (kHighestPx - kBottomPx - kEdgePx) / size.y());
  width_px_ = size.x() * scale_ + kLeftPx + kEdgePx;
  height_px_ = size.y() * scale_ + kBottomPx + kEdgePx;
}

Vec2 PlaneSvg::px(const Vec2& mm) const {
  return {kLeftPx + (mm.x() - view_.min.x()) * scale_, kEdgePx + (view_.max.y() - mm.y()) * scale_};
}

std::string PlaneSvg::at(const Vec2& mm) const {
  const Vec2 p = px(mm);
  return number(p.x(), 1) + "," + number(p.y(), 1);
}

void PlaneSvg::polygon(const Polygon& mm, std::string_view style) {
  std::string points;
  for (const Vec2& p : mm) {
    if (p.allFinite()) points += (points.empty() ? "" : " ") + at(p);
  }
  if (!points.empty()) body_ += fmt::format("<polygon class=\"{}\" points=\"{}\"/>\n", style, points);
}

void PlaneSvg::line(const std::vector<Vec2>& mm, std::string_view style) {
  std::string points;
  for (const Vec2& p : mm) {
    if (p.allFinite()) points += (points.empty() ? "" : " ") + at(p);
  }
  if (!points.empty()) body_ += fmt::format("<polyline class=\"{}\" points=\"{}\"/>\n", style, points);
}

void PlaneSvg::dots(const std::vector<Vec2>& mm, std::string_view style) {
  std::string path;
  for (const Vec2& p : mm) {
    if (p.allFinite()) path += "M" + at(p) + "h0";
  }
  if (!path.empty()) body_ += fmt::format("<path class=\"{}\" d=\"{}\"/>\n", style, path);
}

void PlaneSvg::strokes(const std::vector<Segment>& mm, std::string_view style) {
  std::string path;
  for (const Segment& s : mm) {
    if (s.a.allFinite() && s.b.allFinite()) path += "M" + at(s.a) + "L" + at(s.b);
  }
  if (!path.empty()) body_ += fmt::format("<path class=\"{}\" d=\"{}\"/>\n", style, path);
}

void PlaneSvg::text(const Vec2& mm, std::string_view text, std::string_view style, double dx_px,
                    double dy_px) {
  if (!mm.allFinite()) return;
  const Vec2 p = px(mm) + Vec2(dx_px, dy_px);
  body_ += fmt::format("<text class=\"{}\" x=\"{}\" y=\"{}\">{}</text>\n", style, number(p.x(), 1),
                       number(p.y(), 1), escaped(text));
}

void PlaneSvg::marker(const Vec2& mm, std::string_view label, std::string_view style) {
  if (!mm.allFinite()) return;
  const Vec2 p = px(mm);
  const double half = std::max(10.0, 4.2 * static_cast<double>(label.size()) + 5);
  body_ += fmt::format(
      "<g class=\"marker {}\"><rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"20\" rx=\"10\"/><text x=\"{}\" "
      "y=\"{}\">{}</text></g>\n",
      style, number(p.x() - half, 1), number(p.y() - 10, 1), number(2 * half, 1), number(p.x(), 1),
      number(p.y(), 1), escaped(label));
}

void PlaneSvg::arrow(const Vec2& from_mm, const Vec2& to_mm, std::string_view style) {
  const Vec2 a = px(from_mm), b = px(to_mm);
  if (!a.allFinite() || !b.allFinite() || (b - a).norm() < 1) return;
  const Vec2 d = (b - a).normalized(), n(-d.y(), d.x());
  const Vec2 left = b - 7 * d + 3.5 * n, right = b - 7 * d - 3.5 * n;
  body_ += fmt::format(
      "<path class=\"{}\" d=\"M{:.1f},{:.1f}L{:.1f},{:.1f}M{:.1f},{:.1f}L{:.1f},{:.1f}L{:.1f},{:.1f}\"/>\n",
      style, a.x(), a.y(), b.x(), b.y(), left.x(), left.y(), b.x(), b.y(), right.x(), right.y());
}

std::string PlaneSvg::grid() const {
  const double step = round_step(70 / scale_);
  const Vec2 low = px(view_.min), high = px(view_.max);
  std::string lines, texts;
  for (double x = std::ceil(view_.min.x() / step) * step; x <= view_.max.x(); x += step) {
    const double at_px = px({x, 0}).x();
    lines += fmt::format("M{:.1f},{:.1f}V{:.1f}", at_px, low.y(), high.y());
    texts += fmt::format("<text class=\"tick\" x=\"{:.1f}\" y=\"{:.1f}\">{:.0f}</text>", at_px, low.y() + 15,
                         x + 0.0);
  }
  for (double y = std::ceil(view_.min.y() / step) * step; y <= view_.max.y(); y += step) {
    const double at_px = px({0, y}).y();
    lines += fmt::format("M{:.1f},{:.1f}H{:.1f}", low.x(), at_px, high.x());
    texts += fmt::format("<text class=\"tick left\" x=\"{:.1f}\" y=\"{:.1f}\">{:.0f}</text>", low.x() - 6,
                         at_px + 4, std::abs(y) < 1e-9 ? 0.0 : y);
  }
  texts +=
      fmt::format("<text class=\"tick end\" x=\"{:.1f}\" y=\"{:.1f}\">x, mm</text>", high.x(), low.y() + 29);
  texts += fmt::format("<text class=\"tick start\" x=\"2\" y=\"{:.1f}\">y, mm</text>", low.y() + 29);
  return fmt::format(
             "<rect class=\"ground\" x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\"/>\n",
             low.x(), high.y(), high.x() - low.x(), low.y() - high.y()) +
         "<path class=\"grid\" d=\"" + lines + "\"/>\n" + texts + "\n";
}

std::string PlaneSvg::finish() const {
  const Vec2 low = px(view_.min), high = px(view_.max);
  return fmt::format(
             "<svg viewBox=\"0 0 {0:.0f} {1:.0f}\" style=\"max-width:{0:.0f}px\" role=\"img\" "
             "aria-labelledby=\"{2}-t {2}-d\">\n"
             "<title id=\"{2}-t\">{3}</title><desc id=\"{2}-d\">{4}</desc>\n",
             width_px_, height_px_, id_, escaped(title_), escaped(description_)) +
         grid() +
         fmt::format(
             "<clipPath id=\"{}-c\"><rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" "
             "height=\"{:.1f}\"/></clipPath>\n",
             id_, low.x(), high.y(), high.x() - low.x(), low.y() - high.y()) +
         fmt::format("<g clip-path=\"url(#{}-c)\">\n", id_) + body_ + "</g>\n</svg>\n";
}

double round_step(double least) {
  if (!(least > 0) || !std::isfinite(least)) return 1;
  const double power = std::pow(10.0, std::floor(std::log10(least)));
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (factor * power >= least * (1 - 1e-9)) return factor * power;
  }
  return 10 * power;
}

}  // namespace weldcell::review
