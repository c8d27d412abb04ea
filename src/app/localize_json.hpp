// A localization with its certificates in the form that INTERFACES promises to users and scripts. Pure.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <vector>

#include "weldcell/localize/height.hpp"
#include "weldcell/localize/localize.hpp"
#include "weldcell/weld/certificate.hpp"

namespace weldcell::app {

/// Verdict and reason are the job's: pose and every weld. `seconds` is the solver's own time.
nlohmann::json localize_json(const workpiece::OutlineTemplate& outline, const Pose2& planned,
                             const localize::Localization& found,
                             const std::vector<weld::WeldCertificate>& certificates, double seconds);

/// Members against the drawing, one object each.
nlohmann::json members_json(const localize::Localization& found);
nlohmann::json welds_json(const std::vector<weld::WeldCertificate>& certificates);
/// Height at the part's centroid (Base, mm) and tilt (roll about Base x, pitch about Base y, deg), each with
/// its sigma; null where too few heights were seen.
nlohmann::json plane_json(const std::optional<localize::TiltedPlane>& plane);

}  // namespace weldcell::app
