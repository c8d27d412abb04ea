// The cookies of the session on the robot controller, kept through a crash so that the next run can end that
// session. They are secrets like the password. Private to the RWS carrier.
#pragma once

#include <map>
#include <string>

#include "weldcell/base/result.hpp"

namespace weldcell::adapters {

using RwsCookies = std::map<std::string, std::string>;

/// The cookies kept for this controller ("host:port generation"); empty when there are none, when they belong
/// to another controller, or when the file is not a plain one of this user's that nobody else may read.
RwsCookies read_rws_session(const std::string& path, const std::string& controller);
/// Durable, mode 0600, never half. Error "rws.session_file".
Status write_rws_session(const std::string& path, const std::string& controller, const RwsCookies& cookies);
/// The session has ended: there is nothing to keep.
void remove_rws_session(const std::string& path) noexcept;

}  // namespace weldcell::adapters
