// Configuration rows of the simulated controller: topic / type / instance / attribute, and the .cfg text they
// are loaded from. Pure.
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "weldcell/base/result.hpp"

namespace weldcell::sim {

/// One row: attributes in the order of the file; a flag has the value "TRUE".
struct ConfigurationRow {
  std::vector<std::pair<std::string, std::string>> attributes;
  std::string name() const;  ///< of attribute Name (any case); empty when there is none
  std::string value(const std::string& attribute) const;
};

/// "SIO" -> "COM_TRP" -> rows.
using Configuration = std::map<std::string, std::map<std::string, std::vector<ConfigurationRow>>>;

/// Reads a .cfg text ("SIO:CFG_1.0:6:0::", "#" comments, "TYPE:" lines, rows "-Key value", "\" goes on).
/// Error "configuration.syntax" names the line.
Result<Configuration> parse_configuration(std::string_view text);
/// Adds rows; one of the same type and name is replaced.
void add_rows(Configuration& to, const Configuration& rows);
const ConfigurationRow* find_row(const Configuration& in, const std::string& topic, const std::string& type,
                                 const std::string& name);
/// UdpUc devices "weldcell" and "ROB_1" towards this address, external motion data "weldcell" and "default".
Configuration default_configuration(const std::string& egm_address, int egm_port);

}  // namespace weldcell::sim
