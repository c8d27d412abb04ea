#include "weldcell/adapters/journal_log.hpp"

#include <sys/stat.h>
#include <sys/uio.h>
#include <systemd/sd-journal.h>

#include <cstdlib>
#include <vector>

namespace weldcell::adapters {

bool stderr_is_journal() {
  const char* named = std::getenv("JOURNAL_STREAM");
  struct stat facts {};
  if (named == nullptr || ::fstat(2, &facts) != 0) return false;
  return std::to_string(facts.st_dev) + ":" + std::to_string(facts.st_ino) == named;
}

bool journal_line(int priority, std::string_view message, std::span<const JournalField> fields) {
  std::vector<std::string> texts{"MESSAGE=" + std::string(message), "PRIORITY=" + std::to_string(priority),
                                 "SYSLOG_IDENTIFIER=weldcelld"};
  for (const JournalField& field : fields) {
    if (!field.value.empty()) texts.push_back(std::string(field.name) + "=" + std::string(field.value));
  }
  std::vector<iovec> pieces;
  for (std::string& text : texts) pieces.push_back({text.data(), text.size()});
  return ::sd_journal_sendv(pieces.data(), static_cast<int>(pieces.size())) == 0;
}

}  // namespace weldcell::adapters
