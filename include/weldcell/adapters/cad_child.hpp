// CAD file -> workpiece through the program weldcell-cad, run as a limited child with a cache by content.
// Blocks; any thread but the real-time ones.
#pragma once

#include <string>

#include "weldcell/base/result.hpp"
#include "weldcell/job/job_order.hpp"
#include "weldcell/workpiece/workpiece.hpp"

namespace weldcell::adapters {

/// Limits of the child: it reads files that strangers made.
inline constexpr int kCadTimeoutS = 60;
inline constexpr int kCadCpuS = 45;
inline constexpr unsigned long kCadMemoryBytes = 2UL << 30;

struct CadRequest {
  std::string program;  ///< path of weldcell-cad
  std::string file;     ///< STEP or DXF
  job::CadImport options;
  std::string plane;      ///< "" = xy; xy | xz | yz
  std::string cache_dir;  ///< "" = no cache; made when absent
  int timeout_s = kCadTimeoutS;
  /// Not null: gets a sentence when the child could not be cut off from the network; it has read all the
  /// same.
  std::string* warning = nullptr;
};

/// The workpiece file as text. Same bytes and options give the cached answer without a child.
/// Errors: "cad.program" (not there), "cad.missing", "cad.refused" (the child's own line), "cad.timeout",
/// "cad.crashed", "cad.output".
Result<std::string> import_cad_yaml(const CadRequest& request);
Result<std::string> import_cad_yaml(const std::string& program, const std::string& cad_file,
                                    const job::CadImport& options, const std::string& cache_dir,
                                    std::string* warning = nullptr);
/// The same, read. Its name is the CAD file's stem.
Result<workpiece::Workpiece> import_cad(const std::string& program, const std::string& cad_file,
                                        const job::CadImport& options, const std::string& cache_dir,
                                        std::string* warning = nullptr);

}  // namespace weldcell::adapters
