// The resident RAPID module WeldcellEgm as the daemon relies on it, and its text with the cell's own values.
// Pure.
#pragma once

#include <string>
#include <string_view>

#include "weldcell/base/result.hpp"
#include "weldcell/cell/cell_setup.hpp"

namespace weldcell::weld {

inline constexpr const char* kResidentModule = "WeldcellEgm";
inline constexpr const char* kMoveRoutine = "WeldcellMove";  ///< joint move to kStartSymbol
inline constexpr const char* kScanRoutine = "WeldcellScan";  ///< the same, then follows EGM
inline constexpr const char* kStartSymbol = "jWeldcellStart";
inline constexpr const char* kStateSymbol = "nWeldcellState";
/// Name of the UdpUc device and of the external motion data that WeldcellScan sets EGM up with.
inline constexpr const char* kEgmDevice = "weldcell";

/// Values of kStateSymbol.
enum class ResidentState { Idle = 0, Moving = 1, There = 2, Following = 3, Ended = 4, Silent = 9 };

/// The module's text with tool load, time-out, speed deviation and low-pass filter of the cell instead of its
/// own. Error "rapid.resident" names the declaration that the text lacks.
Result<std::string> fill_resident(std::string_view text, const cell::CellSetup& cell);

/// SIO.cfg's text with the address and UDP port that the controller sends EGM frames to. Error
/// "rapid.configuration" names the key that the text lacks.
Result<std::string> fill_transmission(std::string_view text, std::string_view address, int port);

}  // namespace weldcell::weld
