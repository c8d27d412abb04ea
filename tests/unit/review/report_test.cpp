#include "weldcell/review/report.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <regex>
#include <set>

#include "review/plane_svg.hpp"
#include "review/wording.hpp"
#include "sample.hpp"

namespace weldcell::review {
namespace {

using localize::Verdict;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

/// Walks the page as a strict reader would: tags closed in order, attributes quoted, no bare & or <, ids
/// unique.
std::string first_fault(const std::string& html) {
  static const std::set<std::string> kVoid{"meta",    "br",       "rect",   "path",
                                           "polygon", "polyline", "circle", "!DOCTYPE"};
  std::vector<std::string> open;
  std::set<std::string> ids;
  std::size_t at = 0;
  const auto near = [&] { return " near: " + html.substr(at, 60); };
  while (at < html.size()) {
    if (html[at] == '&') {
      static const std::regex kEntity("&(amp|lt|gt|quot|#[0-9]+);");
      std::smatch m;
      const std::string rest = html.substr(at, 12);
      if (!std::regex_search(rest, m, kEntity, std::regex_constants::match_continuous))
        return "bare &" + near();
      at += static_cast<std::size_t>(m.length());
      continue;
    }
    if (html[at] == '>') return "bare >" + near();
    if (html[at] != '<') {
      ++at;
      continue;
    }
    const auto end = html.find('>', at);
    if (end == std::string::npos) return "tag without end" + near();
    std::string tag = html.substr(at + 1, end - at - 1);
    if (tag.find('<') != std::string::npos) return "< inside a tag" + near();
    if (std::count(tag.begin(), tag.end(), '"') % 2) return "unbalanced quotes" + near();
    std::smatch m;
    if (std::regex_search(tag, m, std::regex(" id=\"([^\"]*)\"")) && !ids.insert(m[1]).second)
      return "id twice" + near();
    const bool closing = tag.front() == '/', alone = tag.back() == '/';
    const std::string name = tag.substr(closing, tag.find_first_of(" /", closing) - closing);
    if (closing) {
      if (open.empty() || open.back() != name)
        return "</" + name + "> closes " + (open.empty() ? "nothing" : open.back()) + near();
      open.pop_back();
    } else if (!alone && !kVoid.count(name)) {
      open.push_back(name);
    }
    at = end + 1;
    if (name == "style" && !closing) at = html.find("</style>", at);
  }
  return open.empty() ? "" : "<" + open.back() + "> is not closed";
}

TEST(Number, PrintsNoNegativeZeroAndNoNan) {
  EXPECT_EQ(number(-0.001, 2), "0.00");
  EXPECT_EQ(number(-0.5, 1), "-0.5");
  EXPECT_EQ(number(std::nan(""), 2), "-");
  EXPECT_EQ(signed_number(0.25, 2), "+0.25");
  EXPECT_EQ(signed_number(0, 2), "0.00");
}

TEST(RoundStep, IsOneTwoOrFiveTimesAPowerOfTen) {
  EXPECT_DOUBLE_EQ(round_step(0.013), 0.02);
  EXPECT_DOUBLE_EQ(round_step(51), 100);
  EXPECT_DOUBLE_EQ(round_step(100), 100);
  EXPECT_DOUBLE_EQ(round_step(0), 1);
}

TEST(Report, IsWellFormedAndSelfContained) {
  const std::string html = report_html(test::sample_input());
  EXPECT_EQ(first_fault(html), "");
  EXPECT_EQ(html.find("<script"), std::string::npos);
  EXPECT_FALSE(std::regex_search(html, std::regex("(src|href|url)\\s*=?\\s*[\"(](?!#)")));
  EXPECT_FALSE(std::regex_search(html, std::regex("[^a-z](nan|inf)[^a-z]")));
  EXPECT_LT(html.size(), 400'000u);
}

TEST(Report, ShowsEveryPartOfTheJob) {
  const std::string html = report_html(test::sample_input());
  for (const char* id : {"fit", "welds", "members", "residuals", "edges", "scan", "plan", "guidance",
                         "timeline", "figures", "texts"}) {
    EXPECT_THAT(html, HasSubstr("<section id=\"" + std::string(id) + "\">"));
  }
  EXPECT_THAT(html, AllOf(HasSubstr("709.24"), HasSubstr("class=\"planned\""), HasSubstr("class=\"found\""),
                          HasSubstr("class=\"dot edge\""), HasSubstr("class=\"dot lost\"")));
  EXPECT_THAT(html, HasSubstr("6 of 6 welds certified"));
  EXPECT_THAT(html, Not(HasSubstr("What to do"))) << "a finished job asks for nothing";
}

TEST(Report, ShowsHeightAndTiltOfPartAndTable) {
  ReportInput in = test::sample_input();
  EXPECT_THAT(report_html(in), Not(HasSubstr("id=\"height\""))) << "without heights there is nothing to show";
  localize::TiltedPlane plane;
  plane.z_mm = 541.25;
  plane.slope_x = rad(0.5);
  plane.slope_y = rad(0.25);
  plane.covariance = Eigen::Vector3d(0.0004, rad(0.01) * rad(0.01), rad(0.02) * rad(0.02)).asDiagonal();
  plane.points = 321;
  in.heights.top = plane;
  const std::string html = report_html(in);
  EXPECT_EQ(first_fault(html), "");
  const auto row = html.substr(html.find("top of the part"), 400);
  EXPECT_THAT(row, HasSubstr("+541.25 <span class=\"unit\">&#177;0.02"));
  EXPECT_THAT(row, HasSubstr("+0.250 <span class=\"unit\">&#177;0.020"));
  EXPECT_THAT(row, HasSubstr("-0.500 <span class=\"unit\">&#177;0.010"));
  EXPECT_THAT(row, HasSubstr("321"));
  EXPECT_THAT(html, Not(HasSubstr("<th scope=\"row\">table</th>")));
}

TEST(Report, DrawsTheFoundOutlineWhereItWasFound) {
  auto in = test::sample_input();
  in.workpiece.members.resize(1);
  in.planned = in.found->pose = Pose2{0, 0, 0};
  in.workpiece.members[0].outline = {{0, 0}, {100, 0}, {100, 50}, {0, 50}};
  in.edges.clear();
  in.beam_paths.clear();
  in.workpiece.welds.clear();
  in.certificates.clear();
  const std::string html = report_html(in);
  std::smatch m;
  ASSERT_TRUE(std::regex_search(
      html, m,
      std::regex("class=\"found\" points=\"([0-9.]+),([0-9.]+) ([0-9.]+),([0-9.]+) ([0-9.]+),([0-9.]+)")));
  const double width = std::stod(m[3]) - std::stod(m[1]), height = std::stod(m[4]) - std::stod(m[6]);
  EXPECT_GT(width, 100) << "x to the right";
  EXPECT_NEAR(height / width, 0.5, 1e-3) << "y up, same scale";
}

TEST(Report, KeepsForeignTextInert) {
  auto in = test::sample_input();
  const std::string evil = "<script>alert(1)</script>\"'&\xFF";
  in.job = in.reason = in.state = in.accepted_at = in.program_version = evil;
  in.verdict = Verdict::Reject;
  in.workpiece.name = evil;
  for (auto& m : in.workpiece.members) m.name = m.tag = evil;
  for (auto& m : in.found->members) m.name = evil;
  for (auto& w : in.workpiece.welds) w.joins = {evil};
  for (auto& c : in.certificates) c.reason = evil;
  for (auto& p : in.passes) p.name = evil;
  for (auto& e : in.events) e.text = evil;
  for (auto& d : in.guidance) d.title = evil;
  for (auto& d : in.guidance) d.drawing.texts.push_back({{1, 1}, evil, 10, guidance::Colour::Text});
  in.figures = {{evil, evil, evil}};
  in.texts = {{evil, evil}};
  const std::string html = report_html(in);
  EXPECT_EQ(html.find("<script"), std::string::npos);
  EXPECT_EQ(first_fault(html), "");
}

TEST(Report, StandsAnEmptyJobAndNumbersThatAreNone) {
  const std::string empty = report_html({});
  EXPECT_EQ(first_fault(empty), "");
  EXPECT_THAT(empty, HasSubstr("was not measured"));
  auto in = test::sample_input();
  const double nan = std::nan("");
  in.found->pose.x_mm = nan;
  in.found->residual_mm[0] = nan;
  in.edges[0].x_mm = std::numeric_limits<double>::infinity();
  in.certificates[0].bound_mm = nan;
  in.surface[0].z_mm = std::numeric_limits<float>::quiet_NaN();
  const std::string html = report_html(in);
  EXPECT_EQ(first_fault(html), "");
  EXPECT_FALSE(std::regex_search(html, std::regex("[^a-z](nan|inf)[^a-z]")));
}

TEST(Advice, SaysWhatToDoForEachEnd) {
  ReportInput in;
  in.state = "done";
  in.verdict = Verdict::Weld;
  EXPECT_THAT(advice(in), IsEmpty());
  in.state = "failed";
  in.cause = "laser.lost";
  ASSERT_FALSE(advice(in).empty());
  EXPECT_THAT(advice(in)[0], HasSubstr("laser's power"));
  in.verdict = Verdict::Reject;
  in.cause = "localize.mirrored";
  EXPECT_THAT(advice(in)[0], HasSubstr("Turn the part over"));
  EXPECT_THAT(advice(in).back(), HasSubstr("manually"));
  in.cause = "a_code_nobody_knows";
  EXPECT_FALSE(advice(in).empty());
  in.cause = "laser.lost";
  EXPECT_EQ(advice(in).size(), 1u) << "a lost laser says nothing about the part";
  in = {};
  in.state = "planned";
  EXPECT_THAT(advice(in), IsEmpty());
  in = test::sample_input();
  in.verdict = Verdict::Rescan;
  in.certificates[2].verdict = Verdict::Rescan;
  in.certificates[2].reason = "weld w3: scan rung_2";
  EXPECT_EQ(advice(in)[0], "weld w3: scan rung_2");
  EXPECT_THAT(report_html(in), HasSubstr("What to do"));
}

TEST(Report, ItsHeadlineSaysHowFarTheJobCame) {
  const auto words = [](ReportInput in) {
    const std::string html = report_html(in);
    std::smatch m;
    return std::regex_search(html, m, std::regex("<b>([^<]*)</b>")) ? m[1].str() : "";
  };
  ReportInput none;
  none.state = "planned";
  EXPECT_EQ(words(none), "Planned");
  none.state = "failed";
  EXPECT_EQ(words(none), "Not welded");
  auto in = test::sample_input();
  EXPECT_EQ(words(in), "Weld");
  in.state = "failed";
  EXPECT_EQ(words(in), "Not finished") << "cleared, but the robot stopped";
  in.verdict = Verdict::Rescan;
  EXPECT_EQ(words(in), "Scan again");
}

TEST(Decimated, KeepsOrderEndsAndDropOuts) {
  std::vector<align::SurfacePoint> points(10'000);
  for (std::size_t i = 0; i < points.size(); ++i) {
    points[i].x_mm = static_cast<float>(i);
    points[i].code = i % 10 == 0 ? 262075 : 0;
  }
  const auto few = decimated(points, 999);
  ASSERT_EQ(few.size(), 999u);
  std::size_t lost = 0;
  for (std::size_t i = 1; i < few.size(); ++i) {
    EXPECT_GT(few[i].x_mm, few[i - 1].x_mm);
    lost += !few[i].valid;
  }
  EXPECT_GT(lost, 50u);
  EXPECT_LT(lost, 200u);
  EXPECT_EQ(decimated(points, 50'000).size(), points.size());
  EXPECT_THAT(decimated({}, 10), IsEmpty());
}

}  // namespace
}  // namespace weldcell::review
