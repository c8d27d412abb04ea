// The sections of a cell file, each read from its mapping into its struct. Pure but for the faults they add.
#pragma once

#include "weldcell/files/cell_file.hpp"
#include "weldcell/files/schema.hpp"

namespace weldcell::files {

void read_limits(Map& map, cell::MotionLimits& limits);
void read_egm(Map& map, CellConfig& config);
void read_rws(Map& map, CellConfig& config);
void read_laser(Map& map, CellConfig& config);
void read_projector(Map& map, CellConfig& config);
void read_torch(Map& map, cell::TorchSetup& torch);
void read_table(Map& map, cell::TableSetup& table);
void read_weld(Map& map, cell::WeldSetup& weld);
void read_modbus(Map& map, CellConfig& config);
void read_plc(Map& map, CellConfig& config);
void read_jobs(Map& map, CellConfig& config);

/// Faults where the calibrated latency's conditions differ from what the cell runs: it holds for nothing
/// else.
void check_latency_conditions(const Node& document, const CellConfig& config, const std::string& file,
                              Faults& faults);

/// The required key "mount" as a frame.
template <typename To, typename From>
void read_mount_of(Map& map, Transform<To, From>& mount) {
  const Node* node = map.node("mount", Need::Required);
  if (node == nullptr) return;
  Map inner(*node, map.file(), map.dotted("mount"), map.faults());
  if (node->kind == Node::Kind::Map) read_mount(inner, mount.iso);
}

/// "host:port" or "[v6]:port"; port 0 = a free one where `zero_is_free`.
bool read_endpoint(Map& map, const char* key, Endpoint& endpoint, bool zero_is_free);

}  // namespace weldcell::files
