// Lines for systemd's journal with fields of their own, so that `journalctl JOB_ID=...` finds them. Any
// thread.
#pragma once

#include <span>
#include <string>
#include <string_view>

namespace weldcell::adapters {

struct JournalField {
  std::string_view name;  ///< upper case, digits and underscores
  std::string_view value;
};

/// True when standard error leads to the journal (JOURNAL_STREAM names its device and inode,
/// systemd.exec(5)).
bool stderr_is_journal();

/// One entry: MESSAGE, PRIORITY (0 emergency to 7 debug, as in syslog) and the fields; those with an empty
/// value are left out. False when the journal did not take it.
bool journal_line(int priority, std::string_view message, std::span<const JournalField> fields);

}  // namespace weldcell::adapters
