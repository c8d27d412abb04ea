#include "rws_session_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <sstream>

#include "spool_files.hpp"
#include "weldcell/adapters/fd.hpp"

namespace weldcell::adapters {
namespace {

constexpr const char* kTitle = "weldcell rws session 1";
constexpr std::size_t kMostBytes = 16 * 1024;
constexpr mode_t kMode = 0600;

bool printable(const std::string& text) {
  return std::ranges::all_of(text, [](char c) { return c > ' ' && c < 0x7F; });
}

/// A file that others can write could make the daemon send anything; one that they can read is no secret.
bool own_and_private(const std::string& path) {
  struct stat facts {};
  return ::lstat(path.c_str(), &facts) == 0 && S_ISREG(facts.st_mode) && facts.st_uid == ::geteuid() &&
         (facts.st_mode & (S_IRWXG | S_IRWXO)) == 0;
}

}  // namespace

RwsCookies read_rws_session(const std::string& path, const std::string& controller) {
  if (!own_and_private(path)) return {};
  std::istringstream in(read_text(path, kMostBytes));
  std::string line;
  if (!std::getline(in, line) || line != kTitle) return {};
  if (!std::getline(in, line) || line != "controller " + controller) return {};
  RwsCookies out;
  while (std::getline(in, line)) {
    const std::size_t equals = line.find('=');
    if (equals == std::string::npos || equals == 0 || !printable(line)) return {};
    out[line.substr(0, equals)] = line.substr(equals + 1);
  }
  return out;
}

Status write_rws_session(const std::string& path, const std::string& controller, const RwsCookies& cookies) {
  std::string text = std::string(kTitle) + "\ncontroller " + controller + "\n";
  for (const auto& [name, value] : cookies) {
    if (printable(name + value)) text += name + "=" + value + "\n";
  }
  const std::string draft = path + ".tmp";
  ::unlink(draft.c_str());
  int fault = write_text_durably(draft, text, kMode);
  if (fault == 0 && ::rename(draft.c_str(), path.c_str()) != 0) fault = errno;
  if (fault != 0) {
    ::unlink(draft.c_str());
    return Error{
        "rws.session_file", path, std::strerror(fault),
        "check space and rights of the state folder; after a crash the controller may refuse commands "
        "for up to five minutes"};
  }
  sync_folder(std::filesystem::path(path).parent_path());
  return Done{};
}

void remove_rws_session(const std::string& path) noexcept {
  if (::unlink(path.c_str()) == 0) sync_folder(std::filesystem::path(path).parent_path());
}

}  // namespace weldcell::adapters
