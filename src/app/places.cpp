#include "app/places.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>

namespace weldcell::app {

namespace fs = std::filesystem;

std::string program_dir() {
  std::error_code error;
  const fs::path self = fs::read_symlink("/proc/self/exe", error);
  return error ? std::string(".") : self.parent_path().string();
}

std::string cad_program() { return program_dir() + "/weldcell-cad"; }

namespace {

std::array<fs::path, 3> shared_places() {
  const fs::path bin = program_dir();
  return {(bin / "../../../config").lexically_normal(), (bin / "../share/weldcell").lexically_normal(),
          "/usr/share/weldcell"};
}

}  // namespace

std::string shared_file(const std::string& relative) {
  for (const fs::path& root : shared_places()) {
    std::error_code error;
    const fs::path candidate = root / relative;
    if (fs::exists(candidate, error)) return fs::weakly_canonical(candidate, error).string();
  }
  return {};
}

Result<std::string> read_file(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  std::ostringstream text;
  if (!in || !(text << in.rdbuf() || in.peek() == std::ifstream::traits_type::eof())) {
    return Error{"file.read", path, std::strerror(errno), "check that the file is there and readable"};
  }
  return text.str();
}

Result<std::string> read_shared_file(const std::string& relative) {
  const std::string path = shared_file(relative);
  if (!path.empty()) return read_file(path);
  std::string places;
  for (const fs::path& root : shared_places()) places += (places.empty() ? "" : ", ") + root.string();
  return Error{"file.shared", relative, "is in none of " + places,
               "install weldcell whole, or run it from its build folder"};
}

Status write_file_durably(const std::string& path, const std::string& text) {
  const std::string draft = path + ".tmp";
  const auto failed = [&](const char* what) {
    return Error{"file.write", path, std::string(what) + ": " + std::strerror(errno),
                 "check space and permissions"};
  };
  const int fd = ::open(draft.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0640);
  if (fd < 0) return failed("cannot be opened");
  // Who could read the file before can read it still: a cell file is root's, and the daemon another user.
  struct stat before {};
  if (::stat(path.c_str(), &before) == 0) {
    [[maybe_unused]] const int owner = ::fchown(fd, before.st_uid, before.st_gid);
    ::fchmod(fd, before.st_mode & 07777);
  }
  std::size_t done = 0;
  while (done < text.size()) {
    const ssize_t n = ::write(fd, text.data() + done, text.size() - done);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) {
      ::close(fd);
      return failed("cannot be written");
    }
    done += static_cast<std::size_t>(n);
  }
  const bool synced = ::fsync(fd) == 0;
  ::close(fd);
  if (!synced) return failed("cannot be synced");
  if (::rename(draft.c_str(), path.c_str()) != 0) return failed("cannot be renamed into place");
  const int folder = ::open(fs::path(path).parent_path().c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (folder >= 0) {
    ::fsync(folder);
    ::close(folder);
  }
  return Done{};
}

}  // namespace weldcell::app
