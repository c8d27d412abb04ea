// A template made ready once for many localizations: distance fields and edge lists over the part's plane.
// Pure.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>

#include "weldcell/localize/localize.hpp"

namespace weldcell::localize {

class TemplateFields;

/// What the robust method does one after the other: modes found, polished and ordered, the best one refined,
/// the others weighed against it, the verdict reached.
enum class Stage : std::uint8_t { Search, Polish, Refine, Rivals, Verdict };
/// Called at the end of each stage that was reached, in the caller's thread; for a caller who measures.
using StageDone = std::function<void(Stage)>;

/// Holds what does not depend on the scan (a few MB, built in milliseconds). localize() is const,
/// deterministic and safe to call from several threads at once. At the same number of points 32 members take
/// about three times, 100 about six times as long as 2 (bench localize, time).
class Localizer {
 public:
  explicit Localizer(workpiece::OutlineTemplate outline);
  ~Localizer();
  Localizer(Localizer&&) noexcept;
  Localizer& operator=(Localizer&&) noexcept;

  const workpiece::OutlineTemplate& outline() const { return *outline_; }
  std::size_t memory_bytes() const;

  /// As the free function localize(), without building the fields anew.
  Localization localize(std::span<const EdgePoint> edges, std::span<const PathPiece> path,
                        const LocalizeOptions& options, const StageDone& done = {}) const;

 private:
  std::unique_ptr<workpiece::OutlineTemplate> outline_;
  std::unique_ptr<TemplateFields> fields_;
};

}  // namespace weldcell::localize
