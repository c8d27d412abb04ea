#include "weldcell/app/record.hpp"

#include <cstring>
#include <nlohmann/json.hpp>

namespace weldcell::app {

namespace {

using nlohmann::json;

constexpr const char* kBinary = "application/octet-stream";
static_assert(std::is_trivially_copyable_v<robot::EgmReport>);

template <typename... Cases>
struct Overloaded : Cases... {
  using Cases::operator()...;
};
template <typename... Cases>
Overloaded(Cases...) -> Overloaded<Cases...>;

std::span<const std::byte> as_bytes(const std::string& text) {
  return std::as_bytes(std::span(text.data(), text.size()));
}

std::string as_text(const wire::Bytes& bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

json report_json(const robot::EgmReport& r) {
  return {static_cast<int>(r.phase),
          static_cast<int>(r.refusal),
          r.plan_id,
          r.plan_time_s,
          r.plan_done,
          r.session,
          r.limited,
          r.malformed,
          r.stale};
}

robot::EgmReport report_from(const json& j) {
  robot::EgmReport r;
  r.phase = static_cast<robot::EgmPhase>(j.at(0).get<int>());
  r.refusal = static_cast<robot::EgmRefusal>(j.at(1).get<int>());
  r.plan_id = j.at(2);
  r.plan_time_s = j.at(3);
  r.plan_done = j.at(4);
  r.session = j.at(5);
  r.limited = j.at(6);
  r.malformed = j.at(7);
  r.stale = j.at(8);
  return r;
}

/// The inputs that are neither raw wire bytes nor marks.
std::pair<std::string, json> small_input(const job::InputBody& body) {
  using namespace job;
  using Named = std::pair<std::string, json>;
  return std::visit(
      Overloaded{
          [](const Tick&) -> Named {
            return {"/cell/tick", json::object()};
          },
          [](const LinkChange& l) -> Named {
            return {"/cell/link", {{"link", static_cast<int>(l.link)}, {"up", l.up}, {"detail", l.detail}}};
          },
          [](const PlcInput& p) -> Named {
            return {"/plc/order",
                    {{"heartbeat", p.order.heartbeat},
                     {"sequence", p.order.command_sequence},
                     {"command", static_cast<int>(p.order.command)},
                     {"job_number", p.order.job_number}}};
          },
          [](const OperatorCommand& o) -> Named {
            return {"/operator/command", {{"command", static_cast<int>(o.command)}, {"who", o.who}}};
          },
          [](const JobArrived& a) -> Named {
            return {"/job/arrived",
                    {{"id", a.id},
                     {"number", a.number},
                     {"interrupted", a.interrupted},
                     {"seams_done", a.seams_done},
                     {"guidance_done", a.guidance_done},
                     {"weld_begun", a.weld_begun}}};
          },
          [](const RobotReply& r) -> Named {
            return {"/robot/reply",
                    {{"id", r.id},
                     {"ok", r.ok},
                     {"text", r.text},
                     {"running", r.running},
                     {"seams_done", r.seams_done},
                     {"seams_begun", r.seams_begun},
                     {"seams_allowed", r.seams_allowed}}};
          },
          [](const Overrun& o) -> Named {
            return {"/cell/overrun", {{"link", static_cast<int>(o.link)}, {"lost", o.lost}}};
          },
          [](const StorageLost& s) -> Named {
            return {"/cell/storage_lost", {{"text", s.text}}};
          },
          [](const auto&) -> Named {
            return {"", {}};
          },
      },
      body);
}

std::optional<job::InputBody> small_input_from(const std::string& topic, const json& j) {
  using namespace job;
  if (topic == "/cell/tick") return Tick{};
  if (topic == "/cell/link")
    return LinkChange{static_cast<Link>(j.at("link").get<int>()), j.at("up"), j.at("detail")};
  if (topic == "/plc/order") {
    wire::PlcOrder order;
    order.heartbeat = j.at("heartbeat");
    order.command_sequence = j.at("sequence");
    order.command = static_cast<wire::PlcCommand>(j.at("command").get<int>());
    order.job_number = j.at("job_number");
    return PlcInput{order};
  }
  if (topic == "/operator/command") {
    return OperatorCommand{static_cast<wire::PlcCommand>(j.at("command").get<int>()), j.at("who")};
  }
  if (topic == "/job/arrived") {
    JobArrived arrived;
    arrived.id = j.at("id");
    arrived.number = j.at("number");
    arrived.interrupted = j.at("interrupted");
    arrived.seams_done = j.at("seams_done");
    arrived.guidance_done = j.at("guidance_done");
    arrived.weld_begun = j.at("weld_begun");
    return arrived;
  }
  if (topic == "/robot/reply")
    return RobotReply{j.at("id"),
                      j.at("ok"),
                      j.at("text"),
                      j.at("running"),
                      j.at("seams_done"),
                      j.at("seams_begun"),
                      j.value("seams_allowed", 0)};
  if (topic == "/cell/storage_lost") return StorageLost{j.at("text")};
  if (topic == "/cell/overrun") return Overrun{static_cast<Link>(j.at("link").get<int>()), j.at("lost")};
  return std::nullopt;
}

/// Collects the messages of one sequence number until the input is whole.
class StepReader {
 public:
  void add(const wire::McapMessage& message, Record& record) {
    if (message.topic == "/cell/output") {
      if (!record.steps.empty()) record.steps.back().outputs.push_back(as_text(message.data));
      return;
    }
    if (message.topic == "/egm/rx") {
      cycle_.datagram = message.data;
      offset_ = message.file_offset;
      return;
    }
    if (message.topic == "/egm/tx") {
      cycle_.reply = message.data;
      return;
    }
    RecordedStep step;
    step.sequence = message.sequence;
    step.file_offset = message.file_offset;
    step.input.time = message.log_time;
    if (message.topic == "/egm/report") {
      cycle_.report = report_from(json::parse(as_text(message.data)));
      step.file_offset = offset_;
      step.input.body = std::exchange(cycle_, {});
    } else if (message.topic == "/laser/rx") {
      step.input.body = job::LaserBytes{message.data};
    } else if (message.topic.starts_with("/work/")) {
      step.mark = WorkMark{message.topic, as_text(message.data)};
    } else if (auto body = small_input_from(message.topic, json::parse(as_text(message.data)))) {
      step.input.body = std::move(*body);
    } else {
      record.damage.push_back({"record.topic", "byte " + std::to_string(message.file_offset),
                               "unknown topic '" + message.topic + "'",
                               "read it with the program version that wrote it"});
      return;
    }
    record.steps.push_back(std::move(step));
  }

 private:
  job::EgmCycle cycle_;
  std::uint64_t offset_ = 0;
};

}  // namespace

RecordWriter::RecordWriter(wire::McapWriter::Sink sink, const RecordHeader& header) : mcap_(std::move(sink)) {
  mcap_.begin("weldcell", "weldcelld " + header.program_version);
  const HostTime start{};
  mcap_.attachment("program", "text/plain", start, header.program_version);
  mcap_.attachment("cell.yaml", "application/yaml", start, header.cell_yaml);
  mcap_.attachment("arm.yaml", "application/yaml", start, header.arm_yaml);
  mcap_.attachment("job.yaml", "application/yaml", start, header.job_yaml);
  mcap_.attachment("initial.json", "application/json", start, header.initial_json);
}

void RecordWriter::workpiece(const std::string& yaml, HostTime now) {
  attachment("workpiece.yaml", "application/yaml", now, yaml);
}

void RecordWriter::attachment(const std::string& name, const std::string& media_type, HostTime now,
                              const std::string& text) {
  mcap_.attachment(name, media_type, now, text);
}

std::uint16_t RecordWriter::channel(const std::string& topic, const std::string& encoding) {
  const auto [it, fresh] = channels_.try_emplace(topic, std::uint16_t{0});
  if (fresh) it->second = mcap_.channel(topic, encoding);
  return it->second;
}

void RecordWriter::put(const std::string& topic, HostTime time, std::span<const std::byte> bytes) {
  mcap_.message(channel(topic, kBinary), sequence_, time, bytes);
}

void RecordWriter::put_json(const std::string& topic, HostTime time, const std::string& text) {
  mcap_.message(channel(topic, "json"), sequence_, time, as_bytes(text));
}

void RecordWriter::input(const job::Input& input) {
  ++sequence_;
  if (const auto* cycle = std::get_if<job::EgmCycle>(&input.body)) {
    put("/egm/rx", input.time, cycle->datagram);
    put("/egm/tx", input.time, cycle->reply);
    put_json("/egm/report", input.time, report_json(cycle->report).dump());
  } else if (const auto* laser = std::get_if<job::LaserBytes>(&input.body)) {
    put("/laser/rx", input.time, laser->bytes);
  } else if (const auto mark = work_mark(input.body)) {
    put_json(mark->topic, input.time, mark->json);
  } else {
    const auto [topic, body] = small_input(input.body);
    put_json(topic, input.time, body.dump());
  }
}

void RecordWriter::outputs(HostTime time, const job::Outputs& outputs) {
  for (const job::Output& output : outputs) put_json("/cell/output", time, output_json(output));
}

Result<Record> read_record(std::span<const std::byte> file) {
  auto mcap = wire::read_mcap(file);
  if (!mcap.ok()) return mcap.error();
  Record record;
  record.complete = mcap->complete;
  record.damage = mcap->damage;
  for (const auto& a : mcap->attachments) record.attachments[a.name] = a.text;
  const auto text = [&](const char* name) {
    const auto it = record.attachments.find(name);
    return it == record.attachments.end() ? std::string{} : it->second;
  };
  record.header = {text("program"),        text("cell.yaml"), text("job.yaml"),
                   text("workpiece.yaml"), text("arm.yaml"),  text("initial.json")};
  StepReader reader;
  for (const auto& message : mcap->messages) {
    try {
      reader.add(message, record);
    } catch (const json::exception& fault) {
      record.damage.push_back({"record.message",
                               "byte " + std::to_string(message.file_offset) + " (" + message.topic + ")",
                               fault.what(), "the record is damaged here"});
    }
  }
  return record;
}

}  // namespace weldcell::app
