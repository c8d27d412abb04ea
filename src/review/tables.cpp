#include "tables.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "weldcell/base/units.hpp"
#include "wording.hpp"

namespace weldcell::review {

namespace {

std::string cell(const std::string& text) { return "<td>" + text + "</td>"; }
std::string value(const std::string& text) { return "<td class=\"n\">" + text + "</td>"; }
std::string head(const char* text, bool numeric = false) {
  return fmt::format("<th scope=\"col\"{}>{}</th>", numeric ? " class=\"n\"" : "", text);
}
std::string row_head(const std::string& text) { return "<th scope=\"row\">" + escaped(text) + "</th>"; }
std::string table(const std::string& caption, const std::string& heads, const std::string& rows) {
  return "<div class=\"scroll\"><table><caption>" + caption + "</caption><thead><tr>" + heads +
         "</tr></thead><tbody>\n" + rows + "</tbody></table></div>\n";
}

/// The bound as a bar against the tolerance, whose mark stands at two thirds.
std::string gauge(const weld::WeldCertificate& c) {
  if (!(c.tolerance_mm > 0) || !std::isfinite(c.bound_mm)) return "";
  constexpr double kWide = 120;
  const double fill = std::min(kWide, kWide * 2 / 3 * c.bound_mm / c.tolerance_mm);
  return fmt::format(
      "<svg viewBox=\"0 0 120 14\" width=\"120\" height=\"14\" role=\"img\" aria-label=\"{} of {} mm\"><rect "
      "class=\"gauge\" "
      "y=\"3\" width=\"120\" height=\"8\" rx=\"4\"/><rect class=\"fill {}\" y=\"3\" width=\"{:.1f}\" "
      "height=\"8\" rx=\"4\"/>"
      "<path class=\"limit\" d=\"M80,0V14\"/></svg>",
      number(c.bound_mm, 2), number(c.tolerance_mm, 2), css_class(c.verdict), fill);
}

std::string joins(const ReportInput& in, const std::string& name) {
  std::string out;
  for (const workpiece::Weld& w : in.workpiece.welds) {
    if (w.name != name) continue;
    for (const std::string& m : w.joins) out += (out.empty() ? "" : " + ") + escaped(m);
  }
  return out;
}

}  // namespace

std::string weld_table(const ReportInput& in) {
  if (in.certificates.empty()) return "";
  const bool measured = in.seam_error_mm.size() == in.certificates.size();
  std::string rows;
  for (std::size_t i = 0; i < in.certificates.size(); ++i) {
    const weld::WeldCertificate& c = in.certificates[i];
    const bool placed = !c.path.empty();
    rows +=
        "<tr>" + row_head(c.name) + cell(joins(in, c.name)) +
        cell(fmt::format("<span class=\"pill {}\">{}</span>", css_class(c.verdict), in_words(c.verdict))) +
        value(placed ? number(c.bound_mm, 2) : "-") + value(number(c.tolerance_mm, 2)) +
        cell(placed ? gauge(c) : "") +
        value(placed ? signed_number(c.gap_mm, 2) + " <span class=\"unit\">&#177;" +
                           number(weld::kSigmas95 * c.gap_sigma_mm, 2) + "</span>"
                     : "-") +
        (measured ? value(number(in.seam_error_mm[i], 2)) : "") + cell(escaped(c.reason)) + "</tr>\n";
  }
  return table(
      "Bound: 95 % bound of the lateral error at the worst point of the weld. Gap: opening of the joint "
      "against the "
      "drawing, + is open. All in mm.",
      head("weld") + head("joins") + head("verdict") + head("bound", true) + head("allowed", true) +
          head("bound against allowed") + head("gap", true) + (measured ? head("torch's error", true) : "") +
          head("in words"),
      rows);
}

std::string member_table(const ReportInput& in) {
  if (!in.found || in.found->members.empty()) return "";
  std::string rows;
  for (const localize::MemberPose& m : in.found->members) {
    rows += "<tr>" + row_head(m.name) + value(signed_number(m.dx_mm, 2)) + value(signed_number(m.dy_mm, 2)) +
            value(signed_number(deg(m.dtheta_rad), 3)) + value(number(m.sigma_mm, 2)) +
            value(std::to_string(m.points)) + "</tr>\n";
  }
  return table(
      "How each member lies against the drawing, beside the part's own pose (shift of its centroid, Base "
      "axes).",
      head("member") + head("x, mm", true) + head("y, mm", true) + head("turn, deg", true) +
          head("1 sigma, mm", true) + head("edge points", true),
      rows);
}

std::string height_table(const ReportInput& in) {
  std::string rows;
  for (const auto& [name, plane] :
       {std::pair{"top of the part", &in.heights.top}, {"table", &in.heights.table}}) {
    if (!*plane) continue;
    const localize::TiltedPlane& p = **plane;
    const auto sigma = [&p](int i) { return std::sqrt(std::max(0.0, p.covariance(i, i))); };
    const auto with_sigma = [](double v, double s, int digits) {
      return signed_number(v, digits) + " <span class=\"unit\">&#177;" + number(s, digits) + "</span>";
    };
    rows += "<tr>" + row_head(name) + value(with_sigma(p.z_mm, sigma(0), 2)) +
            value(with_sigma(deg(p.slope_y), deg(sigma(2)), 3)) +
            value(with_sigma(deg(-p.slope_x), deg(sigma(1)), 3)) + value(number(p.rms_mm, 2)) +
            value(std::to_string(p.points)) + "</tr>\n";
  }
  if (rows.empty()) return "";
  return table(
      "Height at the middle of the part and tilt against the robot's base, with 1 sigma, from the heights "
      "beside each "
      "edge. Welds follow the measured top.",
      head("surface") + head("height, mm", true) + head("roll about x, deg", true) +
          head("pitch about y, deg", true) + head("scatter, mm", true) + head("edge points", true),
      rows);
}

std::string pass_table(const ReportInput& in) {
  if (in.passes.empty()) return "";
  double end = 0;
  for (const plan::ScanPass& p : in.passes) end = std::max(end, p.to_s);
  std::string rows;
  for (const plan::ScanPass& p : in.passes) {
    const double x = end > 0 ? 300 * p.from_s / end : 0,
                 w = end > 0 ? std::max(1.5, 300 * (p.to_s - p.from_s) / end) : 0;
    rows +=
        "<tr>" + row_head(p.name) + value(number(p.from_s, 2)) + value(number(p.to_s, 2)) +
        value(number(p.to_s - p.from_s, 2)) +
        cell(fmt::format(
            "<svg viewBox=\"0 0 300 12\" width=\"300\" height=\"12\" aria-hidden=\"true\"><rect "
            "class=\"gauge\" "
            "y=\"2\" width=\"300\" height=\"8\"/><rect class=\"took\" x=\"{:.1f}\" y=\"2\" width=\"{:.1f}\" "
            "height=\"8\"/></svg>",
            x, w)) +
        "</tr>\n";
  }
  return "<details><summary>" + std::to_string(in.passes.size()) + " measured passes</summary>\n" +
         table("Stretches of the scan in which readings count.",
               head("pass") + head("from, s", true) + head("to, s", true) + head("length, s", true) +
                   head("in the scan"),
               rows) +
         "</details>\n";
}

std::string event_table(const ReportInput& in) {
  if (in.events.empty()) return "";
  double longest = 0;
  for (std::size_t i = 0; i + 1 < in.events.size(); ++i) {
    longest = std::max(longest, in.events[i + 1].time_s - in.events[i].time_s);
  }
  std::string rows;
  for (std::size_t i = 0; i < in.events.size(); ++i) {
    const ReportEvent& e = in.events[i];
    const double took = i + 1 < in.events.size() ? in.events[i + 1].time_s - e.time_s : 0;
    const std::string bar = took > 0 && longest > 0
                                ? fmt::format(
                                      "<svg viewBox=\"0 0 160 12\" width=\"160\" height=\"12\" "
                                      "aria-hidden=\"true\"><rect class=\"took\" y=\"2\" "
                                      "width=\"{:.1f}\" height=\"8\"/></svg>",
                                      std::max(1.0, 160 * took / longest))
                                : "";
    rows += (e.fault ? "<tr class=\"fault\">" : "<tr>") + value(number(e.time_s, 2)) + cell(escaped(e.text)) +
            value(took > 0 ? number(took, 2) : "") + cell(bar) + "</tr>\n";
  }
  return table("Times in seconds since the job was accepted.",
               head("at", true) + head("event") + head("until the next", true) + head(""), rows);
}

std::string figure_table(const ReportInput& in) {
  if (in.figures.empty()) return "";
  std::string rows;
  for (const Figure& f : in.figures) {
    rows += "<tr>" + row_head(f.name) + value(escaped(f.value)) + cell(escaped(f.unit)) + "</tr>\n";
  }
  return table("Measured during this job.", head("figure") + head("value", true) + head("unit"), rows);
}

}  // namespace weldcell::review
