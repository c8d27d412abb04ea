#include "weldcell/localize/localize.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <iterator>

#include "checks.hpp"
#include "fields.hpp"
#include "paper.hpp"
#include "search.hpp"
#include "solver.hpp"
#include "strays.hpp"
#include "weldcell/base/units.hpp"
#include "weldcell/localize/localizer.hpp"

namespace weldcell::localize {

namespace {

constexpr std::size_t kMinPoints = 6;
constexpr std::size_t kMaxFitPoints = 6000;
/// With fewer of its points on the path, that is the path of another scan.
constexpr double kLeastOnPath = 0.3;

/// Points from which no pose can be had, however they fit.
std::optional<Localization> too_little(const std::vector<Crossing>& crossings, std::size_t points) {
  if (crossings.size() < kMinPoints) {
    return refused(
        Verdict::Rescan, "too_few_points",
        fmt::format("Too few different edge points were seen: {} of at least {}. Check that the part lies "
                    "under the scan and scan again.",
                    crossings.size(), kMinPoints),
        points);
  }
  if (on_one_line(crossings)) {
    return refused(Verdict::Rescan, "one_line",
                   fmt::format("All {} edge points lie on one straight line, which leaves the place along it "
                               "open. Scan across other sides of the part too.",
                               crossings.size()),
                   points);
  }
  return std::nullopt;
}

}  // namespace

const char* to_string(Verdict verdict) {
  switch (verdict) {
    case Verdict::Weld:
      return "weld";
    case Verdict::Rescan:
      return "rescan";
    case Verdict::Reject:
      return "reject";
  }
  return "reject";
}

Localizer::Localizer(workpiece::OutlineTemplate outline)
    : outline_(std::make_unique<workpiece::OutlineTemplate>(std::move(outline))),
      fields_(std::make_unique<TemplateFields>(*outline_)) {}
Localizer::~Localizer() = default;
Localizer::Localizer(Localizer&&) noexcept = default;
Localizer& Localizer::operator=(Localizer&&) noexcept = default;

std::size_t Localizer::memory_bytes() const { return fields_->memory_bytes(); }

Localization Localizer::localize(std::span<const EdgePoint> edges, std::span<const PathPiece> path,
                                 const LocalizeOptions& options, const StageDone& done) const {
  if (const std::string wrong = wrong_option(options); !wrong.empty()) {
    return refused(Verdict::Reject, "bad_options", "The option " + wrong + ". Correct the job.",
                   edges.size());
  }
  Crossings crossings = ready_crossings(edges, options.default_sigma_mm);
  if (10 * static_cast<std::size_t>(crossings.broken) > edges.size()) {
    return refused(Verdict::Reject, "bad_points",
                   std::to_string(crossings.broken) + " of " + std::to_string(edges.size()) +
                       " edge points are no numbers. Check the sensor and scan again.",
                   edges.size());
  }
  if (auto little = too_little(crossings.list, edges.size())) return *std::move(little);
  // A path that cannot be trusted would take its negative evidence along without a word.
  std::vector<PathPiece> sound_path;
  if (const auto broken = std::count_if(path.begin(), path.end(), std::not_fn(sound)); broken > 0) {
    if (10 * static_cast<std::size_t>(broken) > path.size()) {
      return refused(Verdict::Reject, "bad_path",
                     fmt::format("{} of {} pieces of the scan path are no numbers. Check the robot's pose "
                                 "stream and scan again.",
                                 broken, path.size()),
                     edges.size());
    }
    std::copy_if(path.begin(), path.end(), std::back_inserter(sound_path), sound);
    path = sound_path;
  }
  if (crossings.list.size() > kMaxFitPoints) crossings.list = sampled(crossings.list, kMaxFitPoints);
  if (options.method == Method::Robust && !path.empty()) {
    const std::size_t ready = crossings.list.size();
    drop_strays(path, edges.size(), crossings);
    if (static_cast<double>(crossings.list.size()) < kLeastOnPath * static_cast<double>(ready)) {
      return refused(Verdict::Reject, "bad_path",
                     fmt::format("{} of {} edge points do not lie on the scan path: the path is of another "
                                 "scan, or in another frame. Give the path of this scan.",
                                 ready - crossings.list.size(), ready),
                     edges.size());
    }
    if (auto little = too_little(crossings.list, edges.size())) return *std::move(little);
  }
  if (options.method == Method::Paper) {
    return paper::localize(*outline_, crossings.list, edges.size(), options);
  }
  Localization result;
  if (!solve_robust(*outline_, *fields_, crossings, edges, path, options, done, result)) {
    return refused(
        Verdict::Reject, "no_fit",
        "No place within the allowed range fits the edge points. Check that the right part lies there.",
        edges.size());
  }
  return result;
}

Localization localize(const workpiece::OutlineTemplate& outline, std::span<const EdgePoint> edges,
                      std::span<const PathPiece> path, const LocalizeOptions& options) {
  return Localizer(outline).localize(edges, path, options);
}

Offset offset_from_planned(const workpiece::OutlineTemplate& outline, const Pose2& planned,
                           const Pose2& found) {
  const Vec2 shift = found * outline.centroid - planned * outline.centroid;
  return {shift.x(), shift.y(), wrap_pi(found.theta_rad - planned.theta_rad)};
}

}  // namespace weldcell::localize
