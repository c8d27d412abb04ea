// A job's report input with everything in it, made up from a seeded scan of a ladder.
#pragma once

#include <random>

#include "weldcell/base/units.hpp"
#include "weldcell/review/report.hpp"

namespace weldcell::review::test {

inline workpiece::Workpiece sample_workpiece() {
  workpiece::Workpiece w;
  w.name = "ladder";
  w.height_mm = 40;
  const auto add = [&](const char* name, const char* tag, double x0, double y0, double x1, double y1) {
    workpiece::Member m;
    m.name = name;
    m.tag = tag;
    m.outline = {{x0, y0}, {x1, y0}, {x1, y1}, {x0, y1}};
    w.members.push_back(m);
  };
  add("rail_L", "1", 0, 0, 800, 40);
  add("rail_R", "2", 0, 360, 800, 400);
  add("rung_1", "3", 0, 40, 40, 360);
  add("rung_2", "4", 380, 40, 420, 360);
  add("rung_3", "5", 760, 40, 800, 360);
  for (int i = 0; i < 3; ++i) {
    const double x = i == 0 ? 0 : i == 1 ? 380 : 760;
    for (int side = 0; side < 2; ++side) {
      workpiece::Weld weld;
      weld.name = "w" + std::to_string(2 * i + side + 1);
      weld.joins = {side ? "rail_R" : "rail_L", "rung_" + std::to_string(i + 1)};
      const double y = side ? 360 : 40;
      weld.start = {x, y, 40};
      weld.pieces = {{false, Eigen::Vector3d::Zero(), {x + 40, y, 40}}};
      w.welds.push_back(weld);
    }
  }
  return w;
}

inline ReportInput sample_input(std::uint64_t seed = 20291) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> any(0, 1);
  ReportInput in;
  in.job = "demo-017";
  in.program_version = "0.1.0";
  in.accepted_at = "2026-03-14 09:26:53";
  in.state = "done";
  in.verdict = localize::Verdict::Weld;
  in.workpiece = sample_workpiece();
  const auto outline = workpiece::build_template(in.workpiece);
  if (outline) in.outline = *outline;
  in.planned = {700, -200, 0};
  in.table_z_mm = 500;
  const Pose2 truth{709.2, -211.7, rad(4.3)};
  in.truth = truth;
  localize::Localization f;
  f.verdict = localize::Verdict::Weld;
  f.cause = "ok";
  f.reason = "found";
  f.pose = {709.24, -211.66, rad(4.304)};
  f.centroid_base = f.pose * in.outline.centroid;
  f.covariance = Eigen::Vector3d(0.002, 0.003, 4e-9).asDiagonal();
  // Zigzag: passes across each member's axis, alternating.
  int pass = 0;
  for (const auto& m : in.workpiece.members) {
    const Box2 box = bounds(m.outline);
    const Vec2 size = box.max - box.min;
    const bool along_x = size.x() > size.y();
    for (double at = 20; at < std::max(size.x(), size.y()); at += 60) {
      const Vec2 middle = box.min + (along_x ? Vec2(at, size.y() / 2) : Vec2(size.x() / 2, at));
      Vec2 half = along_x ? Vec2(0, 45) : Vec2(45, 0);
      if (++pass % 2) half = -half;
      const Vec2 a = in.planned * Vec2(middle - half), b = in.planned * Vec2(middle + half);
      in.beam_paths.push_back({m.name + " zigzag", {a, b}, 0});
      in.passes.push_back({m.name + " zigzag " + std::to_string(pass), 0.9 * pass, 0.9 * pass + 0.45});
      in.path.push_back({a.x(), a.y(), b.x(), b.y()});
      const Vec2 d = (b - a).normalized();
      bool before = false;
      for (int k = 0; k <= 180; ++k) {
        const Vec2 p = a + (b - a) * (k / 180.0);
        bool on = false;
        for (const auto& other : in.workpiece.members)
          on = on || contains(other.outline, truth.inverse() * p);
        if (k % 4 == 0) {
          const bool lost = any(random) < 0.02;
          in.surface.push_back({static_cast<float>(p.x()), static_cast<float>(p.y()),
                                static_cast<float>((on ? 540 : 500) + 0.1 * normal(random)), !lost});
        }
        if (k > 0 && on != before) {
          in.edges.push_back({p.x() - 0.25 * d.x() + 0.15 * normal(random),
                              p.y() - 0.25 * d.y() + 0.15 * normal(random), d.x(), d.y(), on ? 1 : -1, 0.15,
                              200, false});
        } else if (any(random) < 0.002) {
          in.edges.push_back({p.x(), p.y(), d.x(), d.y(), 1, 0.3, 200, false});
        }
        before = on;
      }
    }
  }
  for (const EdgePoint& e : in.edges) {
    const Vec2 p = f.pose.inverse() * Vec2(e.x_mm, e.y_mm);
    int best = -1;
    double nearest = 3, residual = 0;
    for (std::size_t k = 0; k < in.outline.edges.size(); ++k) {
      const double d = distance(p, in.outline.edges[k].line);
      if (d >= nearest) continue;
      nearest = d;
      best = static_cast<int>(k);
      residual = in.outline.edges[k].outward.dot(p - in.outline.edges[k].line.a);
    }
    f.edge_of_point.push_back(best);
    f.residual_mm.push_back(residual);
    f.inliers += best >= 0;
    f.mean_error_mm += nearest / static_cast<double>(in.edges.size());
  }
  f.points = static_cast<int>(in.edges.size());
  for (const auto& m : in.workpiece.members) {
    localize::MemberPose p;
    p.name = m.name;
    p.dx_mm = 0.2 * normal(random);
    p.dy_mm = 0.2 * normal(random);
    p.dtheta_rad = 3e-4 * normal(random);
    p.covariance = Eigen::Vector3d(0.006, 0.008, 2e-7).asDiagonal();
    p.sigma_mm = 0.09;
    p.points = 18;
    f.members.push_back(p);
  }
  weld::CertifyOptions options;
  options.table_z_mm = 500;
  in.certificates = weld::certify(in.workpiece, f, options);
  for (std::size_t i = 0; i < in.certificates.size(); ++i)
    in.seam_error_mm.push_back(0.05 + 0.1 * any(random));
  in.found = f;
  in.reason = weld::decide(f, in.certificates).reason;
  in.events = {{0, "job accepted"},
               {0.8, "6 members imported from ladder.step"},
               {1.4, "planned: 62 passes"},
               {1.5, "guidance begins"},
               {14.2, "member 5 confirmed"},
               {14.9, "scan begins"},
               {52.3, "scan ends"},
               {52.31, "part found"},
               {52.4, "6 of 6 welds certified"},
               {53.1, "module WeldcellJob uploaded"},
               {97.8, "6 of 6 seams welded"}};
  cell::CellSetup cell;
  const auto steps = guidance::guide_steps(in.workpiece, in.planned);
  for (std::size_t s = 0; s < steps.size(); ++s) {
    Transform<Base, Projector> T;
    T.iso.translate(Eigen::Vector3d(steps[s].centre_base_mm.x(), steps[s].centre_base_mm.y(), 1300));
    T.iso.rotate(Eigen::AngleAxisd(kPi, Eigen::Vector3d::UnitX()));
    in.guidance.push_back({steps[s].title, guidance::draw_step(cell, in.workpiece, in.planned, steps, s, T)});
  }
  in.figures = {{"scan", "37.4", "s"}, {"laser readings", "187204", ""}, {"localization", "0.8", "ms"}};
  in.texts = {{"job.yaml", "job: demo-017\nworkpiece: ladder.yaml\n"},
              {"WeldcellJob.mod", "MODULE WeldcellJob\nENDMODULE\n"}};
  return in;
}

}  // namespace weldcell::review::test
