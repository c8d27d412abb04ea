#include "weldcell/weld/resident.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "rapid_text.hpp"

namespace weldcell::weld {

namespace {

/// Puts `value` between the end of `before` and the next of `ends`.
bool put(std::string& text, const std::string& before, const std::string& value, const char* ends) {
  const std::size_t at = text.find(before);
  if (at == std::string::npos) return false;
  const std::size_t begin = at + before.size(), end = text.find_first_of(ends, begin);
  if (end == std::string::npos) return false;
  text.replace(begin, end - begin, value);
  return true;
}

std::string head_load(const cell::TorchSetup& head) {
  // The controller refuses a load without mass, and one whose centre of mass is the flange itself.
  auto cog = head.center_of_mass_mm;
  if (std::ranges::all_of(cog, [](double c) { return c == 0; })) cog[2] = 1;
  return "[TRUE,[[0,0,0],[1,0,0,0]],[" + rapid::number(std::max(0.1, head.mass_kg), 3) + "," +
         rapid::position({cog[0], cog[1], cog[2]}) + ",[1,0,0,0],0,0,0]]";
}

}  // namespace

Result<std::string> fill_resident(std::string_view text, const cell::CellSetup& cell) {
  std::string out(text);
  const std::pair<const char*, std::string> values[] = {
      {"PERS tooldata tWeldcellHead:=", head_load(cell.torch)},
      {"CONST num nWeldcellCommTimeout:=", rapid::number(cell.egm.comm_timeout_s, 3)},
      {"CONST num nWeldcellSpeedDeviation:=", rapid::number(cell.egm.max_speed_deviation_deg_s, 3)},
      {"CONST num nWeldcellLowPass:=", rapid::number(cell.egm.low_pass_hz, 3)}};
  for (const auto& [declaration, value] : values) {
    if (!put(out, declaration, value, ";")) {
      return Error{"rapid.resident", kResidentModule, fmt::format("has no '{}...;'", declaration),
                   "restore the installed config/rapid"};
    }
  }
  return out;
}

Result<std::string> fill_transmission(std::string_view text, std::string_view address, int port) {
  std::string out(text);
  if (!put(out, "-RemoteAdress \"", std::string(address), "\"") ||
      !put(out, "-RemotePortNumber ", std::to_string(port), " \n\\")) {
    return Error{"rapid.configuration", "SIO.cfg", "has no -RemoteAdress or no -RemotePortNumber",
                 "restore the installed config/rapid"};
  }
  return out;
}

}  // namespace weldcell::weld
