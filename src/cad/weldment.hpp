// Members -> a whole workpiece: extent, overlaps, proposed welds along the contact lines. Pure.
#pragma once

#include "cad/cad_part.hpp"

namespace weldcell::cad {

/// Tags 1..n, welds w1.. where members touch for 5 mm or more; checked by workpiece::validated().
/// Errors "cad.overlap" and "workpiece.*".
Result<workpiece::Workpiece> make_workpiece(const CadPart& part, const std::string& name);

}  // namespace weldcell::cad
