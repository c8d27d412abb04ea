// The sub-commands of `weldcell`. Each takes the arguments after its name and returns the exit code:
// 0 done, 1 done but not accepted, 2 bad input or usage, 3 device or system fault.
#pragma once

#include <span>

namespace weldcell::app {

using Arguments = std::span<const char* const>;

int command_check(Arguments arguments);
int command_import(Arguments arguments);
int command_plan(Arguments arguments);
int command_localize(Arguments arguments);
int command_trials(Arguments arguments);
int command_replay(Arguments arguments);
int command_review(Arguments arguments);
int command_dump(Arguments arguments);
int command_calibrate(Arguments arguments);
int command_arm(Arguments arguments);
int command_rapid(Arguments arguments);
int command_submit(Arguments arguments);
int command_status(Arguments arguments);
int command_jobs(Arguments arguments);
int command_show(Arguments arguments);
int command_operate(Arguments arguments);
int command_hold(Arguments arguments);
int command_release(Arguments arguments);
int command_cancel(Arguments arguments);
int command_plc_check(Arguments arguments);
int command_doctor(Arguments arguments);
int command_migrate(Arguments arguments);

}  // namespace weldcell::app
