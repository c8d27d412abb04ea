#include "weldcell/adapters/cad_child.hpp"

#include <Poco/DigestEngine.h>
#include <Poco/SHA2Engine.h>
#include <fmt/format.h>
#include <unistd.h>

#include <csignal>
#include <cstring>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "adapters/limited_child.hpp"
#include "weldcell/files/workpiece_file.hpp"

namespace weldcell::adapters {

namespace fs = std::filesystem;

namespace {

/// Part of the cache's key: raised whenever the same file may come out differently.
constexpr const char* kCacheForm = "weldcell-cad 1";
constexpr std::uintmax_t kMaxCadBytes = 100'000'000;

Error cad_error(const char* code, const std::string& where, std::string what, std::string mend) {
  return {code, where, std::move(what), std::move(mend)};
}

std::vector<std::string> command_of(const CadRequest& request) {
  std::vector<std::string> out{request.program, request.file};
  const auto add = [&](const char* name, const std::string& value) {
    if (value.empty()) return;
    out.emplace_back(name);
    out.push_back(value);
  };
  const auto millimetres = [](double value) { return value > 0 ? fmt::format("{}", value) : std::string(); };
  add("--units", request.options.units);
  add("--plane", request.plane);
  add("--height", millimetres(request.options.height_mm));
  add("--radius", millimetres(request.options.edge_radius_mm));
  add("--drawn", request.options.drawn);
  return out;
}

/// SHA-256 of the file's bytes, its stem (the workpiece's name), the options and the form of the cache.
Result<std::string> cache_key(const CadRequest& request) {
  std::error_code error;
  if (!fs::is_regular_file(request.file, error)) {
    return cad_error("cad.missing", request.file, "no such file", "check the path");
  }
  if (fs::file_size(request.file, error) > kMaxCadBytes) {
    return cad_error("cad.limit", request.file, "is bigger than 100 MB", "export only the frame's members");
  }
  std::ifstream stream(request.file, std::ios::binary);
  if (!stream) return cad_error("cad.unreadable", request.file, "cannot be opened", "check its permissions");
  Poco::SHA2Engine sha;
  std::vector<char> buffer(1 << 16);
  while (stream.read(buffer.data(), static_cast<std::streamsize>(buffer.size())), stream.gcount() > 0) {
    sha.update(buffer.data(), static_cast<std::size_t>(stream.gcount()));
  }
  std::vector<std::string> words = command_of(request);
  words[0] = kCacheForm;
  words[1] = fs::path(request.file).filename().string();
  for (const std::string& word : words) sha.update(word.c_str(), word.size() + 1);
  return Poco::DigestEngine::digestToHex(sha.digest());
}

/// A cached answer counts only when it still reads.
std::string cached(const fs::path& path) {
  std::error_code error;
  if (!fs::is_regular_file(path, error)) return "";
  std::ifstream stream(path, std::ios::binary);
  std::ostringstream text;
  text << stream.rdbuf();
  const auto parsed = files::parse_workpiece(text.str(), path.string());
  return std::holds_alternative<workpiece::Workpiece>(parsed) ? text.str() : "";
}

/// A cache that cannot be written costs time, not the job.
void keep(const fs::path& path, const std::string& text) {
  std::error_code error;
  fs::create_directories(path.parent_path(), error);
  const fs::path half = path.string() + "." + std::to_string(::getpid()) + ".half";
  {
    std::ofstream stream(half, std::ios::binary);
    stream << text;
    if (!stream.flush()) {
      fs::remove(half, error);
      return;
    }
  }
  fs::rename(half, path, error);
  if (error) fs::remove(half, error);
}

Error refusal(const CadRequest& request, const ChildOutcome& outcome) {
  if (outcome.timed_out || outcome.signal == SIGXCPU) {
    return cad_error("cad.timeout", request.file,
                     fmt::format("reading it took longer than {} s", request.timeout_s),
                     "simplify the model or export only the frame's members");
  }
  if (outcome.too_much_output) {
    return cad_error("cad.output", request.file, "comes out bigger than any workpiece",
                     "export only the frame's members");
  }
  if (outcome.signal != 0) {
    return cad_error("cad.crashed", request.file,
                     fmt::format("the CAD reader ended by signal {}", outcome.signal),
                     "heal the model and export it again; the file is kept for a bug report");
  }
  if (outcome.exit_code == 127) {
    return cad_error("cad.program", request.program, "cannot be started", "install weldcell whole");
  }
  std::string line = outcome.err;
  while (!line.empty() && (line.back() == '\n' || line.back() == ' ')) line.pop_back();
  line = line.substr(line.rfind('\n') == std::string::npos ? 0 : line.rfind('\n') + 1);
  if (line.rfind(request.file + ": ", 0) == 0) line = line.substr(request.file.size() + 2);
  if (line.empty()) line = fmt::format("the CAD reader ended with {} and said nothing", outcome.exit_code);
  return cad_error("cad.refused", request.file, line, "");
}

}  // namespace

Result<std::string> import_cad_yaml(const CadRequest& request) {
  if (::access(request.program.c_str(), X_OK) != 0) {
    return cad_error("cad.program", request.program, "the CAD reader is not there",
                     "install weldcell-cad beside weldcell");
  }
  auto key = cache_key(request);
  if (!key.ok()) return key.error();
  const fs::path at = request.cache_dir.empty() ? fs::path() : fs::path(request.cache_dir) / (*key + ".yaml");
  if (!at.empty()) {
    if (std::string text = cached(at); !text.empty()) return text;
  }
  ChildLimits limits;
  limits.timeout_s = request.timeout_s;
  limits.cpu_s = kCadCpuS;
  limits.memory_bytes = kCadMemoryBytes;
  auto outcome = run_limited(command_of(request), limits);
  if (!outcome.ok()) return outcome.error();
  if (outcome->network_errno != 0 && request.warning != nullptr) {
    *request.warning = fmt::format(
        "{}: read with the network in reach: the kernel refused weldcell-cad a network namespace of its own "
        "({}): "
        "allow user namespaces (sysctl user.max_user_namespaces; RestrictNamespaces=user net in the unit)",
        request.file, std::strerror(outcome->network_errno));
  }
  if (outcome->exit_code != 0 || outcome->timed_out || outcome->too_much_output)
    return refusal(request, *outcome);
  const auto parsed = files::parse_workpiece(outcome->out, request.file);
  if (const auto* faults = std::get_if<files::Faults>(&parsed)) {
    return cad_error("cad.output", request.file,
                     "the CAD reader's answer does not read: " + files::text(*faults), "");
  }
  if (!at.empty()) keep(at, outcome->out);
  return std::move(outcome->out);
}

Result<std::string> import_cad_yaml(const std::string& program, const std::string& cad_file,
                                    const job::CadImport& options, const std::string& cache_dir,
                                    std::string* warning) {
  return import_cad_yaml(CadRequest{program, cad_file, options, "", cache_dir, kCadTimeoutS, warning});
}

Result<workpiece::Workpiece> import_cad(const std::string& program, const std::string& cad_file,
                                        const job::CadImport& options, const std::string& cache_dir,
                                        std::string* warning) {
  auto yaml = import_cad_yaml(program, cad_file, options, cache_dir, warning);
  if (!yaml.ok()) return yaml.error();
  auto parsed = files::parse_workpiece(*yaml, cad_file);
  if (const auto* faults = std::get_if<files::Faults>(&parsed)) {
    return cad_error("cad.output", cad_file, "the CAD reader's answer does not read: " + files::text(*faults),
                     "");
  }
  return std::get<workpiece::Workpiece>(std::move(parsed));
}

}  // namespace weldcell::adapters
