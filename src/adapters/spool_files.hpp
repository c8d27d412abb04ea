// File steps that the spool is made of: refusing renames, durable copies, look-ups that follow no link.
// Private.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "weldcell/base/result.hpp"

namespace weldcell::adapters {

/// Renames unless the target exists; 0 or an errno.
int rename_fresh(const std::filesystem::path& from, const std::filesystem::path& to) noexcept;
/// Makes the entries of a folder durable.
void sync_folder(const std::filesystem::path& folder) noexcept;
/// Durable copy of a plain file that follows no link and overwrites nothing. 0 or an errno.
int copy_file_durably(const std::filesystem::path& from, const std::filesystem::path& to) noexcept;
/// Durable new text file. 0 or an errno.
int write_text_durably(const std::filesystem::path& path, std::string_view text,
                       unsigned mode = 0640) noexcept;
/// At most `limit` bytes of a plain file; empty when it cannot be read. Follows no link.
std::string read_text(const std::filesystem::path& path, std::size_t limit);

/// `relative` below `folder` if each step is a folder and the last a plain file, none of them a link. Errors:
/// "spool.path", "spool.missing".
Result<std::filesystem::path> plain_file_below(const std::filesystem::path& folder,
                                               const std::string& relative);

/// "name", else "name-2", "name-3", ... : the first that is free in the folder, for all the suffixes given.
std::string free_name(const std::filesystem::path& folder, const std::string& stem,
                      const std::vector<std::string>& suffixes);

/// What a look at an entry shows: equal marks mean that nothing changed.
struct EntryMark {
  std::uint64_t hash = 0;
  std::int64_t newest_ns = 0;  ///< latest mtime
  bool operator==(const EntryMark&) const = default;
};
EntryMark mark_of(const std::filesystem::path& path);

/// Whether a YAML text is a job (top-level key "job"), or a workpiece and no job.
enum class YamlKind { Job, Workpiece, Other };
YamlKind yaml_kind(std::string_view text);
/// The job files of a folder: those with the key "job"; if none has it, every YAML file that is no workpiece.
std::vector<std::filesystem::path> job_files_in(const std::filesystem::path& folder,
                                                std::size_t max_job_bytes);
bool has_yaml_name(const std::filesystem::path& path);
bool has_cad_name(const std::filesystem::path& path);
/// NAME.yaml.minisig
bool has_signature_name(const std::filesystem::path& path);
/// Names that are never looked at: hidden, or of a copy under way.
bool is_passing_name(const std::string& name);

}  // namespace weldcell::adapters
