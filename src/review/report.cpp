#include "weldcell/review/report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "figures.hpp"
#include "style.hpp"
#include "tables.hpp"
#include "weldcell/base/units.hpp"
#include "wording.hpp"

namespace weldcell::review {

namespace {

std::string tile(const std::string& name, const std::string& value, const std::string& unit) {
  return "<div><dt>" + name + "</dt><dd>" + value + " <span class=\"unit\">" + unit + "</span></dd></div>\n";
}

std::string section(const char* id, const char* title, const std::string& body, const char* when_empty = "") {
  if (body.empty() && !*when_empty) return "";
  return fmt::format("<section id=\"{}\"><h2>{}</h2>\n", id, title) +
         (body.empty() ? fmt::format("<p class=\"note\">{}</p>\n", when_empty) : body) + "</section>\n";
}

struct Headline {
  const char* words;
  const char* style;
};

/// The verdict, or how far the job came when there is none.
Headline headline(const ReportInput& in) {
  const bool failed = in.state == "failed" || in.state == "aborted";
  if (in.found && !(failed && in.verdict == localize::Verdict::Weld)) {
    return {in_words(in.verdict), css_class(in.verdict)};
  }
  if (failed) return {in.found ? "Not finished" : "Not welded", "reject"};
  if (in.state == "planned") return {"Planned", "open"};
  if (in.state == "done") return {"Done", "weld"};
  return {"Under way", "open"};
}

std::string head_of(const ReportInput& in) {
  std::string meta = escaped(in.workpiece.name);
  if (!in.state.empty()) meta += (meta.empty() ? "" : " &#183; ") + escaped(in.state);
  if (!in.accepted_at.empty())
    meta += (meta.empty() ? "" : " &#183; ") + ("accepted " + escaped(in.accepted_at));
  meta += (meta.empty() ? "" : " &#183; ") + ("weldcell " + escaped(in.program_version));
  const Headline top = headline(in);
  return "<header class=\"top\"><h1>Job " + escaped(in.job) + "</h1><p class=\"meta\">" + meta + "</p>\n" +
         fmt::format("<div class=\"verdict {}\" role=\"status\"><b>{}</b><span>{}</span></div>\n", top.style,
                     top.words, escaped(in.reason));
}

std::string todo(const ReportInput& in) {
  const std::vector<std::string> steps = advice(in);
  if (steps.empty()) return "";
  std::string out = "<div class=\"todo\"><h2>What to do</h2><ol>\n";
  for (const std::string& s : steps) out += "<li>" + escaped(s) + "</li>\n";
  return out + "</ol></div>\n";
}

std::string numbers(const ReportInput& in) {
  std::string out;
  if (in.found) {
    const localize::Localization& f = *in.found;
    const localize::Offset offset = [&] {
      if (in.outline.edges.empty()) {
        return localize::Offset{f.pose.x_mm - in.planned.x_mm, f.pose.y_mm - in.planned.y_mm,
                                wrap_pi(f.pose.theta_rad - in.planned.theta_rad)};
      }
      return localize::offset_from_planned(in.outline, in.planned, f.pose);
    }();
    out += tile("found x, y", number(f.pose.x_mm, 2) + ", " + number(f.pose.y_mm, 2), "mm");
    out += tile("found turn", number(deg(f.pose.theta_rad), 3), "deg");
    out += tile("off the plan, at the middle",
                signed_number(offset.dx_mm, 2) + ", " + signed_number(offset.dy_mm, 2),
                "mm, " + signed_number(deg(offset.dtheta_rad), 2) + " deg");
    out += tile("known to (1 sigma)",
                number(std::sqrt(std::max(0.0, f.covariance(0, 0))), 2) + ", " +
                    number(std::sqrt(std::max(0.0, f.covariance(1, 1))), 2),
                "mm, " + number(deg(std::sqrt(std::max(0.0, f.covariance(2, 2)))), 3) + " deg");
    out += tile("edge points used", fmt::format("{} of {}", f.inliers, f.points), "");
    out += tile("mean distance", number(f.mean_error_mm, 2), "mm");
    if (in.truth) {
      out += tile("error against the truth",
                  signed_number(f.pose.x_mm - in.truth->x_mm, 2) + ", " +
                      signed_number(f.pose.y_mm - in.truth->y_mm, 2),
                  "mm, " + signed_number(deg(wrap_pi(f.pose.theta_rad - in.truth->theta_rad)), 3) + " deg");
    }
  }
  if (!in.certificates.empty()) {
    const auto cleared = std::count_if(in.certificates.begin(), in.certificates.end(),
                                       [](const auto& c) { return c.verdict == localize::Verdict::Weld; });
    out += tile("welds cleared", fmt::format("{} of {}", cleared, in.certificates.size()), "");
  }
  return out.empty() ? "" : "<dl class=\"numbers\">\n" + out + "</dl>\n";
}

std::string alternatives(const ReportInput& in) {
  if (!in.found || in.found->alternatives.empty()) return "";
  std::string out = "<p>The same edges would also fit, less well or as well, at:</p><ul>\n";
  for (const localize::Alternative& a : in.found->alternatives) {
    out += fmt::format("<li>x {} mm, y {} mm, {} deg: mean distance {} mm</li>\n", number(a.pose.x_mm, 1),
                       number(a.pose.y_mm, 1), number(deg(a.pose.theta_rad), 2), number(a.mean_error_mm, 2));
  }
  return out + "</ul>\n";
}

std::string pictures(const ReportInput& in) {
  if (in.guidance.empty()) return "";
  std::string out = "<div class=\"pictures\">\n";
  for (const NamedDrawing& d : in.guidance) {
    out += "<figure>" + guidance::drawing_svg(d.drawing) + "<figcaption>" + escaped(d.title) +
           "</figcaption></figure>\n";
  }
  return out + "</div>\n";
}

std::string texts(const ReportInput& in) {
  std::string out;
  for (const NamedText& t : in.texts) {
    out +=
        "<details><summary>" + escaped(t.name) + "</summary><pre>" + escaped(t.text) + "</pre></details>\n";
  }
  return out;
}

}  // namespace

std::vector<SurfaceSample> decimated(std::span<const align::SurfacePoint> points, std::size_t at_most) {
  std::vector<SurfaceSample> out;
  if (points.empty() || at_most == 0) return out;
  const std::size_t n = std::min(points.size(), at_most);
  out.reserve(n);
  for (std::size_t k = 0; k < n; ++k) {
    const align::SurfacePoint& p = points[k * points.size() / n];
    out.push_back({p.x_mm, p.y_mm, p.z_mm, p.code == 0});
  }
  return out;
}

std::string report_html(const ReportInput& in) {
  const std::string residuals = arrow_figure(in) + residual_histogram(in);
  std::string body;
  body +=
      section("fit", "The fit", fit_figure(in) + alternatives(in), "The part was not measured in this job.");
  body += section("welds", "Welds", weld_table(in), "No weld was certified in this job.");
  body += section("members", "Members", member_table(in));
  body += section("height", "Height and tilt", height_table(in));
  body += section("residuals", "Residuals", residuals);
  body += section("edges", "Edges", edge_figure(in));
  body += section("scan", "Scan", scan_figure(in) + pass_table(in));
  body += section("plan", "Plan", plan_figure(in));
  body += section("guidance", "Guidance", pictures(in));
  body += section("timeline", "Timeline", event_table(in));
  body += section("figures", "Figures", figure_table(in));
  body += section("texts", "Files of this job", texts(in));
  std::string links;
  for (const auto& [id, name] : {std::pair{"fit", "Fit"},
                                 {"welds", "Welds"},
                                 {"members", "Members"},
                                 {"height", "Height"},
                                 {"residuals", "Residuals"},
                                 {"edges", "Edges"},
                                 {"scan", "Scan"},
                                 {"plan", "Plan"},
                                 {"guidance", "Guidance"},
                                 {"timeline", "Timeline"},
                                 {"figures", "Figures"},
                                 {"texts", "Files"}}) {
    if (body.find(fmt::format("<section id=\"{}\">", id)) != std::string::npos) {
      links += fmt::format("<a href=\"#{}\">{}</a>", id, name);
    }
  }
  return "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" "
         "content=\"width=device-width,initial-scale=1\"><title>Job " +
         escaped(in.job) + ": " + headline(in).words + "</title><style>" + kStyle +
         "</style></head>\n<body>\n" + head_of(in) + todo(in) + numbers(in) +
         "<nav aria-label=\"Parts of this page\">" + links + "</nav></header>\n<main>\n" + body +
         "</main>\n<footer>Written by weldcell " + escaped(in.program_version) +
         ". Lengths in mm, frame Base (the robot's base), x forward, y left.</footer>\n</body></html>\n";
}

}  // namespace weldcell::review
