// The daemon's log: lines on standard error, or entries of systemd's journal with JOB_ID, STATE and FAULT.
#pragma once

#include "weldcell/job/cell.hpp"

namespace weldcell::app {

/// Once, before the first line.
void start_log();
/// What the following lines of every thread are about.
void label_log(const job::CellStatus& status);

}  // namespace weldcell::app
