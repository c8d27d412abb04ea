// The bodies of RWS 1.0: states in JSON, errors in JSON or XHTML, and what an error code means. Private,
// pure.
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "weldcell/base/result.hpp"
#include "weldcell/ports/http.hpp"

namespace weldcell::adapters {

/// One entry of _state: "_type", "_title" and its fields, all as text.
using RwsState = std::map<std::string, std::string>;

/// The entries of a JSON body, of its _state and of the lists inside. Empty when it is no RWS body.
std::vector<RwsState> rws_states(std::string_view body);

/// What a reply of status 400 or more says; `request` stands in `where`.
Error rws_error(const ports::HttpReply& reply, const std::string& request);

/// Escapes a form value; brackets, commas, $ and / stay as they are.
std::string form_value(std::string_view text);

}  // namespace weldcell::adapters
