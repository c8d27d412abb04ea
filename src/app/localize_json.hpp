// A localization with its certificates in the form that INTERFACES promises to users and scripts. Pure.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <vector>

#include "weldcell/localize/localize.hpp"
#include "weldcell/weld/certificate.hpp"

namespace weldcell::app {

/// Verdict and reason are the job's: pose and every weld. `seconds` is the solver's own time.
nlohmann::json localize_json(const workpiece::OutlineTemplate& outline, const Pose2& planned,
                             const localize::Localization& found,
                             const std::vector<weld::WeldCertificate>& certificates, double seconds);

}  // namespace weldcell::app
