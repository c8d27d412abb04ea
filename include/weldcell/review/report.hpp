// One job as one self-contained page: what was planned, seen, found, decided and done. Pure; text in, text
// out.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "weldcell/align/aligner.hpp"
#include "weldcell/geometry/edge_point.hpp"
#include "weldcell/guidance/drawing.hpp"
#include "weldcell/localize/height.hpp"
#include "weldcell/localize/localize.hpp"
#include "weldcell/plan/scan_plan.hpp"
#include "weldcell/weld/certificate.hpp"
#include "weldcell/workpiece/outline_template.hpp"
#include "weldcell/workpiece/workpiece.hpp"

namespace weldcell::review {

/// A surface point as the page draws it: Base, mm. Not valid: the sensor saw nothing there (z is
/// meaningless).
struct SurfaceSample {
  float x_mm = 0, y_mm = 0, z_mm = 0;
  bool valid = true;
};

/// At most `at_most` of the points, evenly in order, drop-outs kept in proportion.
std::vector<SurfaceSample> decimated(std::span<const align::SurfacePoint> points, std::size_t at_most = 6000);

/// Something that happened, in order of time.
struct ReportEvent {
  double time_s = 0;  ///< since the job was accepted
  std::string text;
  bool fault = false;
};

/// A measured figure, as text so that its digits are the author's: {"scan", "41.2", "s"}.
struct Figure {
  std::string name, value, unit;
};

struct NamedDrawing {
  std::string title;  ///< of the guidance step
  guidance::Drawing drawing;
};

/// A file kept with the job: configuration, job, workpiece, RAPID module.
struct NamedText {
  std::string name, text;
};

/// Everything that the page shows. What is empty or absent is left out of the page, with a word why.
struct ReportInput {
  std::string job;
  std::string program_version;
  std::string accepted_at;  ///< date and time of acceptance as text; may be empty
  std::string state;        ///< how the job ended: "done", "failed", "stopped", ...
  localize::Verdict verdict = localize::Verdict::Reject;
  std::string reason;  ///< of the verdict or the failure, in a welder's words
  std::string
      cause;  ///< stable code of the failure ("localize.ambiguous", "laser.lost", ...); chooses the advice

  workpiece::Workpiece workpiece;
  workpiece::OutlineTemplate outline;
  Pose2 planned;  ///< Part in Base
  double table_z_mm = 0;

  std::vector<plan::BeamPath> beam_paths;  ///< planned scan, Base
  std::vector<plan::ScanPass> passes;      ///< as carried out, time of the scan
  std::vector<SurfaceSample> surface;
  std::vector<EdgePoint> edges;
  std::vector<PathPiece> path;
  std::optional<localize::Localization> found;
  localize::HeightFit heights;  ///< of the part's top and of the table
  std::optional<Pose2> truth;   ///< simulated cells only: where the part really lay
  std::vector<weld::WeldCertificate> certificates;
  std::vector<double>
      seam_error_mm;  ///< simulated cells only: torch's worst lateral error, one a weld; may be empty

  std::vector<ReportEvent> events;
  std::vector<NamedDrawing> guidance;
  std::vector<Figure> figures;
  std::vector<NamedText> texts;
};

/// What the operator should do now, one sentence each, gravest first; empty when there is nothing to do.
std::vector<std::string> advice(const ReportInput& input);

/// The whole page: UTF-8 HTML with inline SVG; no script, no reference to anything outside itself. Every text
/// of the input is escaped; bytes that are not UTF-8 become U+FFFD.
std::string report_html(const ReportInput& input);

}  // namespace weldcell::review
