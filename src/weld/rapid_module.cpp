#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "rapid_text.hpp"
#include "weldcell/base/units.hpp"

namespace weldcell::weld {

namespace {

using rapid::comment;
using rapid::number;

constexpr double kStraightMm = 0.05;  // how far the lines between written targets may leave the planned seam
constexpr double kStraightRad = rad(0.5);
constexpr int kAwaitTenths = 100;  // of a second, for weldcelld to let the next seam begin
constexpr const char* kSuffix = ",tWeldcellTorch\\WObj:=wWeldcell;";

/// Whether the target lies on the line, and its orientation on the slerp, from a to b at this share of the
/// way.
bool between(const TorchTarget& a, const TorchTarget& b, const TorchTarget& t) {
  const Eigen::Vector3d from = a.T_base_torch.position_mm(), way = b.T_base_torch.position_mm() - from;
  const double length2 = way.squaredNorm();
  if (length2 < 1e-12) return false;
  const double share = std::clamp((t.T_base_torch.position_mm() - from).dot(way) / length2, 0.0, 1.0);
  if ((from + share * way - t.T_base_torch.position_mm()).norm() > kStraightMm) return false;
  const Eigen::Quaterniond qa(a.T_base_torch.rotation()), qb(b.T_base_torch.rotation());
  return qa.slerp(share, qb).angularDistance(Eigen::Quaterniond(t.T_base_torch.rotation())) <= kStraightRad;
}

/// Targets that straight moves need between first and last: each as far ahead as the line still holds.
std::vector<std::size_t> written(const TorchPath& path) {
  std::vector<std::size_t> out{path.first_seam};
  while (out.back() < path.last_seam) {
    const std::size_t a = out.back();
    std::size_t reach = a + 1;
    for (std::size_t b = a + 2; b <= path.last_seam; ++b) {
      bool straight = true;
      for (std::size_t k = a + 1; k < b && straight; ++k)
        straight = between(path.targets[a], path.targets[b], path.targets[k]);
      if (!straight) break;
      reach = b;
    }
    out.push_back(reach);
  }
  return out;
}

/// The fastest of RAPID's own speeddata that does not exceed the speed.
std::string speed_name(double mm_s) {
  static constexpr std::array kSpeeds{5,   10,  20,  30,  40,  50,  60,   80,   100,  150,
                                      200, 300, 400, 500, 600, 800, 1000, 1500, 2000, 2500};
  int best = kSpeeds.front();
  for (const int v : kSpeeds) {
    if (v <= mm_s + 1e-9) best = v;
  }
  return fmt::format("v{}", best);
}

std::string arc_data(double voltage, double wirefeed) {
  return "[0,0," + number(voltage, 2) + "," + number(wirefeed, 2) + ",0,0,0,0,0]";
}

std::string header(const cell::CellSetup& cell, const std::string& job, std::size_t seams,
                   const RapidOptions& o) {
  const std::string none = "[0,0,0,0,0,0,0,0,0]";
  Eigen::Quaterniond like(0, 0, 0, 0);
  const auto& tool = cell.torch.T_flange_torch;
  const auto& cog = cell.torch.center_of_mass_mm;
  const std::string arc = arc_data(o.voltage_v, o.wirefeed);
  std::string out = "MODULE WeldcellJob\n";
  out += "  ! Job " + comment(job, 80) + ", " + std::to_string(seams) + (seams == 1 ? " seam" : " seams") +
         ". Written by weldcell " + comment(o.program_version, 40) + ".\n";
  out += "  ! Made for one part as it lay when it was measured: never run it for another.\n";
  out += "  ! Targets are absolute in the robot's base frame. Where the base frame is not the world frame,\n";
  out += "  ! write the base frame's pose into the user frame of wWeldcell.\n\n";
  out +=
      "  ! Seams welded and seams begun so far, read by weldcelld; seams to leave out, written before the "
      "start;\n  ! seams that may begin, written by weldcelld after each one that has ended.\n";
  out += "  PERS num nSeamsDone:=0;\n  PERS num nSeamsBegun:=0;\n  PERS num nSeamsToSkip:=0;\n";
  out += "  PERS num nSeamsAllowed:=0;\n\n";
  out += "  PERS tooldata tWeldcellTorch:=[TRUE,[" + rapid::position(tool.position_mm()) + "," +
         rapid::quaternion(tool.rotation(), like) + "],[" + number(std::max(0.1, cell.torch.mass_kg), 3) +
         "," + rapid::position({cog[0], cog[1], cog[2]}) + ",[1,0,0,0],0,0,0]];\n";
  out += "  PERS wobjdata wWeldcell:=[FALSE,TRUE,\"\",[[0,0,0],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];\n";
  out += "  ! Arc values follow the power source: set them with the welding engineer.\n";
  out += "  PERS seamdata smWeldcell:=[0," + number(o.preflow_s, 3) + "," + arc + ",0,0,0,0,0," + none +
         ",0," + number(o.crater_fill_s, 3) + "," + arc + ",0,0," + none + "," + number(o.postflow_s, 3) +
         "];\n";
  const std::string speed = number(cell.weld.speed_mm_s, 3);
  out += "  PERS welddata wdWeldcell:=[" + speed + "," + speed + "," + arc + "," + arc + "];\n\n";
  out += "  CONST jointtarget jWeldcellHome:=" + rapid::jointtarget(cell.home) + ";\n";
  return out;
}

std::string targets_of(const TorchPath& path, const std::string& id, const std::vector<std::size_t>& points) {
  Eigen::Quaterniond like(0, 0, 0, 0);
  const auto line = [&](const std::string& name, const TorchTarget& t) {
    return "  CONST robtarget p" + id + name + ":=" + rapid::robtarget(t, like) + ";\n";
  };
  std::string out = "\n  ! Weld " + comment(path.name, 80) + "\n";
  out += "  CONST jointtarget j" + id + "Over:=" + rapid::jointtarget(path.targets.front().joints) + ";\n";
  out += line("Approach", path.targets[path.first_seam - 1]);
  for (std::size_t i = 0; i < points.size(); ++i)
    out += line(fmt::format("_{:03}", i + 1), path.targets[points[i]]);
  out += line("Retract", path.targets[path.last_seam + 1]);
  out += line("Away", path.targets.back());
  return out;
}

std::string seam_proc(const cell::CellSetup& cell, const TorchPath& path, const std::string& id,
                      std::size_t points) {
  const std::string air = speed_name(cell.weld.air_speed_mm_s);
  const std::string near = speed_name(std::min(200.0, cell.weld.air_speed_mm_s));
  std::string out = "\n  ! Weld " + comment(path.name, 80) + "\n  PROC Seam" + id + "()\n";
  out += "    MoveAbsJ j" + id + "Over," + air + ",z10" + kSuffix + "\n";
  out += "    MoveL p" + id + "Approach," + near + ",z10" + kSuffix + "\n";
  out += "    nSeamsBegun:=nSeamsDone+1;\n";
  for (std::size_t i = 1; i <= points; ++i) {
    const bool ends = i == 1 || i == points;
    const std::string move = i == 1 ? "ArcLStart" : i == points ? "ArcLEnd" : "ArcL";
    out += fmt::format("    {} p{}_{:03},v100,smWeldcell,wdWeldcell,{}{}\n", move, id, i,
                       ends ? "fine" : "z1", kSuffix);
  }
  // Counted before the torch leaves: a fly-by point ahead of it would count the seam too early.
  out += "    nSeamsDone:=nSeamsDone+1;\n";
  out += "    MoveL p" + id + "Retract," + near + ",z10" + kSuffix + "\n";
  // A fine point: what comes next waits for weldcelld's word.
  out += "    MoveL p" + id + "Away," + air + ",fine" + kSuffix + "\n  ENDPROC\n";
  return out;
}

std::string main_proc(const cell::CellSetup& cell, std::size_t seams) {
  std::string out = "\n  PROC WeldcellWeld()\n    ConfJ\\On;\n    ConfL\\On;\n    SingArea\\Off;\n";
  out += "    nSeamsDone:=nSeamsToSkip;\n    nSeamsBegun:=nSeamsToSkip;\n";
  out += "    nSeamsAllowed:=nSeamsToSkip;\n";
  for (std::size_t i = 0; i < seams; ++i) {
    out += fmt::format("    IF nSeamsToSkip<{} THEN\n      WeldcellAwait;\n      Seam{:02};\n    ENDIF\n",
                       i + 1, i + 1);
  }
  out += "    MoveAbsJ jWeldcellHome," + speed_name(cell.weld.air_speed_mm_s) + ",fine" + kSuffix + "\n";
  return out + "  ENDPROC\n";
}

/// Waits for the word that lets the next seam begin, and ends the program when none comes.
std::string await_proc() {
  std::string out = "\n  ! No seam begins without a word of weldcelld that is newer than the seam before.\n";
  out += "  PROC WeldcellAwait()\n    VAR num nTenths:=0;\n    WHILE nSeamsAllowed<=nSeamsDone DO\n";
  out += fmt::format("      IF nTenths>={} THEN\n", kAwaitTenths);
  out += "        TPWrite \"weldcell: the cell controller is silent\";\n";
  out += "        TPWrite \"weldcell: ended before seam \"\\Num:=nSeamsDone+1;\n        EXIT;\n      ENDIF\n";
  out += "      WaitTime 0.1;\n      nTenths:=nTenths+1;\n    ENDWHILE\n  ENDPROC\n";
  return out;
}

}  // namespace

std::string rapid_module(const cell::CellSetup& cell, const std::string& job,
                         const std::vector<TorchPath>& paths, const RapidOptions& options) {
  std::string out = header(cell, job, paths.size(), options), procs;
  for (std::size_t i = 0; i < paths.size(); ++i) {
    const std::string id = fmt::format("{:02}", i + 1);
    const std::vector<std::size_t> points = written(paths[i]);
    out += targets_of(paths[i], id, points);
    procs += seam_proc(cell, paths[i], id, points.size());
  }
  return out + main_proc(cell, paths.size()) + await_proc() + procs + "ENDMODULE\n";
}

}  // namespace weldcell::weld
