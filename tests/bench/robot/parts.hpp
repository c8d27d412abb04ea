// What bench_robot is made of: each part adds its rows.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "bench/rows.hpp"
#include "weldcell/files/cell_file.hpp"

namespace weldcell::bench {

inline constexpr std::uint64_t kSeed = 2600;

/// An arm file; ends the bench with its faults when there are any.
kinematics::ArmModel arm_of(const std::filesystem::path& path);
/// Sorted.
std::vector<std::filesystem::path> files_in(const std::filesystem::path& folder, const char* extension);

/// Forward kinematics and configurations against the reference vectors.
void against_references(std::vector<Row>& rows);
/// Forward kinematics against the chains of joints that others published for the remaining arms.
void against_chains(std::vector<Row>& rows);
/// Inverse kinematics of every arm file against its own forward kinematics, 10,000 joint sets each.
void against_itself(std::vector<Row>& rows);
/// The simulated controller follows the session: spirals, lines, a stop.
void tracking(std::vector<Row>& rows, const files::CellConfig& config);
/// Requests over Robot Web Services in a whole job.
void rws_rate(std::vector<Row>& rows, const files::CellConfig& config);
/// `count` random motions of every arm file in turn, judged by their references.
void random_plans(std::vector<Row>& rows, const cell::CellSetup& demo, int count);

}  // namespace weldcell::bench
