// A job's record: every input that the cell consumed, as it came off the wire, and every output, as one MCAP.
// Writing is done by one thread; reading gives the inputs back, for replay.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "weldcell/job/cell.hpp"
#include "weldcell/wire/mcap.hpp"

namespace weldcell::app {

/// Answers of heavy steps are recorded as marks (what came out, as JSON); replay computes them again and
/// compares.
struct WorkMark {
  std::string topic;  ///< "/work/plan", "/work/pass", "/work/solve", "/work/import"
  std::string json;
};

/// Texts that make the record self-contained.
struct RecordHeader {
  std::string program_version;
  std::string cell_yaml, job_yaml, workpiece_yaml, arm_yaml;
  std::string initial_json;  ///< links, armed: what the cell knew when the record began
};

class RecordWriter {
 public:
  RecordWriter(wire::McapWriter::Sink sink, const RecordHeader& header);
  void workpiece(const std::string& yaml, HostTime now);
  void input(const job::Input& input);
  /// The outputs of the input just written.
  void outputs(HostTime time, const job::Outputs& outputs);
  void attachment(const std::string& name, const std::string& media_type, HostTime now,
                  const std::string& text);
  void flush() { mcap_.flush(); }
  void end() { mcap_.end(); }

 private:
  std::uint16_t channel(const std::string& topic, const std::string& encoding);
  void put(const std::string& topic, HostTime time, std::span<const std::byte> bytes);
  void put_json(const std::string& topic, HostTime time, const std::string& text);

  wire::McapWriter mcap_;
  std::map<std::string, std::uint16_t> channels_;
  std::uint32_t sequence_ = 0;
};

/// One consumed input with what the record says came of it.
struct RecordedStep {
  std::uint32_t sequence = 0;
  std::uint64_t file_offset = 0;
  job::Input input;  ///< for a work mark: a Tick stands in its place
  std::optional<WorkMark> mark;
  std::vector<std::string> outputs;  ///< JSON, in order
};

struct Record {
  RecordHeader header;
  std::vector<RecordedStep> steps;
  std::map<std::string, std::string> attachments;
  bool complete = false;
  std::vector<Error> damage;
};

/// Error only when the file is no record at all.
Result<Record> read_record(std::span<const std::byte> file);

/// What an output looks like in the record; equal text means equal output.
std::string output_json(const job::Output& output);
/// The mark of a heavy step's answer, or nothing for any other input.
std::optional<WorkMark> work_mark(const job::InputBody& body);

}  // namespace weldcell::app
