// The parts of the sensing bench beside edges and clocks.
#pragma once

#include <vector>

#include "bench/rows.hpp"

namespace weldcell::bench {

/// Of this process, all threads.
double cpu_seconds();

/// Decoding, alignment and points of a scan of 50,000 readings a second: speed, and whether cost grows with
/// the readings alone.
void stream_rows(std::vector<Row>& rows);
/// The same stream for a simulated hour, a scan a minute: memory and allocations.
void hour_rows(std::vector<Row>& rows);
/// One byte in a hundred damaged, every dialect.
void damage_rows(std::vector<Row>& rows);
/// Latency from passes to and fro, by readings and poses through alignment and edges.
void latency_rows(std::vector<Row>& rows);

}  // namespace weldcell::bench
