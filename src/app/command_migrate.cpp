// weldcell migrate: a cell file of an older version brought to today's, with its diff and a backup.
#include <cstdio>
#include <filesystem>

#include "app/command_line.hpp"
#include "app/places.hpp"
#include "weldcell/files/cell_file.hpp"
#include "weldcell/files/cell_migration.hpp"

namespace weldcell::app {

namespace {

namespace fs = std::filesystem;

constexpr int kOlder = 1, kBad = 2, kSystem = 3, kFaults = 78;

/// The file as it was, beside it; a backup that holds the same already will do.
Result<std::string> keep_backup(const std::string& path, int version, const std::string& text) {
  const std::string stem = path + ".version-" + std::to_string(version);
  for (int n = 1;; ++n) {
    const std::string backup = n == 1 ? stem : stem + "-" + std::to_string(n);
    std::error_code error;
    if (fs::exists(fs::symlink_status(backup, error))) {
      if (const auto there = read_file(backup); there.ok() && *there == text) return backup;
      continue;
    }
    fs::copy_file(path, backup, error);
    if (error) return Error{"file.write", backup, error.message(), "check space and permissions"};
    return backup;
  }
}

/// Faults that are left by today's rules; a migration cannot know their mend.
int left_faults(const std::string& text, const std::string& path) {
  const auto read = files::parse_cell(text, path, (fs::path(path).parent_path() / "robots").string());
  const auto* faults = std::get_if<files::Faults>(&read);
  if (faults == nullptr) return 0;
  std::fprintf(stderr, "%sthese are left to be mended by hand\n", files::text(*faults).c_str());
  return kFaults;
}

}  // namespace

int command_migrate(Arguments arguments) {
  CommandLine line(
      arguments,
      "usage: weldcell migrate CELL [--write]\n"
      "Brings a cell file of an older version to today's; comments stay. Shows the change as a "
      "diff and writes nothing,\n"
      "with --write keeps the file as it was as CELL.version-N and writes. Exit code 0: of today's "
      "version (now); 1: older\n"
      "and not written; 2: cannot be migrated; 78: of today's version, with faults.\n",
      {}, {"write"});
  if (line.exit_code()) return *line.exit_code();
  if (line.plain().size() != 1) return line.refuse("migrate wants one cell file");
  const std::string named = line.plain()[0];
  const auto text = files::read_text_file(named);
  if (const auto* faults = std::get_if<files::Faults>(&text)) {
    std::fputs(files::text(*faults).c_str(), stderr);
    return kBad;
  }
  std::error_code error;
  // A link's target is written, not the link.
  const std::string path = fs::canonical(named, error).string();
  const std::string& before = std::get<std::string>(text);
  const auto migrated = files::migrate_cell(before, named);
  if (!migrated.ok()) {
    std::fprintf(stderr, "%s\n", migrated.error().text().c_str());
    return kBad;
  }
  if (migrated->from == files::kCellVersion) {
    std::printf("%s: version %d, nothing to migrate\n", named.c_str(), files::kCellVersion);
    return left_faults(before, path);
  }
  std::printf("--- %s (version %d)\n+++ %s (version %d)\n%s", named.c_str(), migrated->from, named.c_str(),
              files::kCellVersion, migrated->diff.c_str());
  const int left = left_faults(migrated->text, path);
  if (!line.has("write")) return kOlder;
  const auto backup = keep_backup(path, migrated->from, before);
  Status written = backup.ok() ? write_file_durably(path, migrated->text) : Status(backup.error());
  if (!written.ok()) {
    std::fprintf(stderr, "%s\n", written.error().text().c_str());
    return kSystem;
  }
  std::fprintf(stderr, "written; the file as it was is %s\n", backup->c_str());
  return left;
}

}  // namespace weldcell::app
