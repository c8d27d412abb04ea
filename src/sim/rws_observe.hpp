// What a subscription sees of the simulated controller: one resource, one value. Pure.
#pragma once

#include <optional>
#include <string>

#include "weldcell/sim/controller.hpp"

namespace weldcell::sim {

/// The resource as a client subscribes to it, e.g. "/rw/panel/ctrlstate;ctrlstate"; empty when this
/// generation has none of that name.
std::optional<RwsObserved> rws_observed(ControllerState& state, const std::string& uri);

}  // namespace weldcell::sim
