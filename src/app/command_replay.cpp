// weldcell replay, review, dump: what can be made of a record.
#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>

#include "app/command_line.hpp"
#include "app/places.hpp"
#include "weldcell/app/record.hpp"
#include "weldcell/app/replay.hpp"
#include "weldcell/base/units.hpp"
#include "weldcell/files/edge_file.hpp"

namespace weldcell::app {

namespace {

Result<Record> open_record(const std::string& path) {
  const auto bytes = read_file(path);
  if (!bytes.ok()) return bytes.error();
  auto record = read_record(std::as_bytes(std::span(bytes->data(), bytes->size())));
  if (!record.ok()) return Error{record.error().code, path, record.error().text(), ""};
  return record;
}

int tell(const Error& error) {
  std::fprintf(stderr, "%s\n", error.text().c_str());
  return 2;
}

void print_table(const std::string& recorded, const std::string& now) {
  using nlohmann::json;
  const json a = json::parse(recorded, nullptr, false), b = json::parse(now, nullptr, false);
  if (!a.is_object() || !b.is_object()) return;
  std::printf("%-22s %16s %16s %14s\n", "", "recorded", "what if", "difference");
  const auto row = [](const std::string& name, double x, double y) {
    std::printf("%-22s %16.4f %16.4f %+14.4f\n", name.c_str(), x, y, y - x);
  };
  row("x_mm", a["pose"][0], b["pose"][0]);
  row("y_mm", a["pose"][1], b["pose"][1]);
  row("theta_deg", deg(a["pose"][2].get<double>()), deg(b["pose"][2].get<double>()));
  row("mean_error_mm", a["mean_error_mm"], b["mean_error_mm"]);
  row("edge points", a["points"], b["points"]);
  row("inliers", a["inliers"], b["inliers"]);
  for (std::size_t i = 0; i < a["welds"].size() && i < b["welds"].size(); ++i) {
    row("bound_mm " + a["welds"][i]["name"].get<std::string>(), a["welds"][i]["bound_mm"],
        b["welds"][i]["bound_mm"]);
  }
  std::printf("%-22s %16s %16s\n", "verdict", a["verdict"].get<std::string>().c_str(),
              b["verdict"].get<std::string>().c_str());
}

/// The record cut behind the last answer of the named step.
void keep_until(Record& record, const std::string& stage) {
  const std::string topic = "/work/" + stage;
  for (std::size_t i = record.steps.size(); i-- > 0;) {
    if (record.steps[i].mark && record.steps[i].mark->topic == topic) {
      record.steps.resize(i + 1);
      return;
    }
  }
}

}  // namespace

int command_replay(Arguments arguments) {
  CommandLine line(
      arguments,
      "usage: weldcell replay RECORD [--until import|plan|pass|solve] [--set KEY=VALUE]... [--json]\n"
      "Runs the record through the same code and compares every output to the bit: exit 0 identical, 1 not.\n"
      "With --set (dotted key of the cell file, or job.KEY) it answers 'what if' with a difference table.\n",
      {"until", "set"}, {"json"});
  if (line.exit_code()) return *line.exit_code();
  if (line.plain().size() != 1) return line.refuse("replay wants one record");
  auto record = open_record(line.plain()[0]);
  if (!record.ok()) return tell(record.error());
  std::vector<Change> changes;
  for (const std::string& set : line.all("set")) {
    const std::size_t equals = set.find('=');
    if (equals == std::string::npos) return line.refuse("--set wants KEY=VALUE, not '" + set + "'");
    changes.push_back({set.substr(0, equals), set.substr(equals + 1)});
  }
  if (line.has("until")) keep_until(*record, line.value("until"));

  const auto outcome = replay(*record, changes);
  if (!outcome.ok()) return tell(outcome.error());
  if (!changes.empty()) {
    if (outcome->new_solve.empty()) {
      std::fprintf(stderr, "with these changes the job did not come to a localization\n");
      return 1;
    }
    print_table(outcome->recorded_solve, outcome->new_solve);
    return 0;
  }
  std::vector<Error> faults = record->damage;
  // What differs behind the first difference follows from it.
  if (!outcome->differences.empty()) faults.push_back(outcome->differences.front());
  if (!record->complete) {
    faults.push_back({"record.cut", "end of file",
                      "the record has no footer: its daemon ended in the middle of the job", ""});
  }
  if (line.has("json")) {
    nlohmann::json out{{"identical", faults.empty()}, {"steps", outcome->steps}, {"solves", outcome->solves}};
    for (const Error& fault : faults) out["differences"].push_back(fault.text());
    std::printf("%s\n", out.dump().c_str());
  } else if (faults.empty()) {
    std::printf("identical: %zu inputs, %zu localizations, every output equal\n", outcome->steps,
                outcome->solves);
  } else {
    std::printf("not identical: %zu fault(s)\n", faults.size());
    for (const Error& fault : faults) std::printf("%s\n", fault.text().c_str());
  }
  return faults.empty() ? 0 : 1;
}

int command_review(Arguments arguments) {
  std::vector<const char*> spelled(arguments.begin(), arguments.end());
  for (const char*& argument : spelled) {
    if (std::string_view(argument) == "-o") argument = "--output";
  }
  CommandLine whole(spelled,
                    "usage: weldcell review RECORD -o report.html\nOne self-contained page of the job.\n",
                    {"output"}, {});
  if (whole.exit_code()) return *whole.exit_code();
  if (whole.plain().size() != 1 || !whole.has("output"))
    return whole.refuse("review wants RECORD -o report.html");
  const auto record = open_record(whole.plain()[0]);
  if (!record.ok()) return tell(record.error());
  const auto outcome = replay(*record, {});
  if (!outcome.ok()) return tell(outcome.error());
  auto input = outcome->story.report(*outcome->cell, outcome->setup, record->header.program_version, "");
  input.texts = {{"job.yaml", record->header.job_yaml}, {"cell.yaml", record->header.cell_yaml}};
  const Status written = write_file_durably(whole.value("output"), review::report_html(input));
  if (!written.ok()) return tell(written.error());
  for (const Error& fault : record->damage) std::fprintf(stderr, "%s\n", fault.text().c_str());
  return 0;
}

namespace {

void dump_points(const job::Solution& solution) {
  std::puts("time_s,x_mm,y_mm,z_mm,vx_mm_s,vy_mm_s,code");
  for (const auto& p : solution.evidence.shown) {
    std::printf("%.6f,%.3f,%.3f,%.3f,%.1f,%.1f,%u\n", seconds(p.time.ns), static_cast<double>(p.x_mm),
                static_cast<double>(p.y_mm), static_cast<double>(p.z_mm), static_cast<double>(p.vx_mm_s),
                static_cast<double>(p.vy_mm_s), p.code);
  }
}

void dump_poses(const Record& record) {
  std::puts("arrival_s,seqno,time_us,j1_deg,j2_deg,j3_deg,j4_deg,j5_deg,j6_deg,plan_time_s");
  wire::EgmCodec codec;
  for (const RecordedStep& step : record.steps) {
    const auto* cycle = std::get_if<job::EgmCycle>(&step.input.body);
    wire::EgmFeedback f;
    if (cycle == nullptr || codec.decode(cycle->datagram, f) != wire::EgmDecode::Ok) continue;
    std::printf("%.6f,%u,%lld", seconds(step.input.time.ns), f.seqno, static_cast<long long>(f.time_us));
    for (const double q : f.joints_deg) std::printf(",%.5f", q);
    std::printf(",%.4f\n", cycle->report.plan_time_s);
  }
}

void dump_ranges(const Record& record, const wire::LaserFormat& format) {
  std::puts("arrival_s,counter,timestamp_us,distance_mm,code");
  wire::LaserDecoder decoder(format);
  for (const RecordedStep& step : record.steps) {
    const auto* laser = std::get_if<job::LaserBytes>(&step.input.body);
    if (laser == nullptr) continue;
    decoder.feed(laser->bytes, [&](const wire::LaserReading& r) {
      std::printf("%.6f,%u,%u,%.6f,%u\n", seconds(step.input.time.ns), r.counter, r.timestamp_us,
                  static_cast<double>(r.distance_mm), r.code);
    });
  }
}

void dump_events(const Record& record) {
  for (const RecordedStep& step : record.steps) {
    for (const std::string& output : step.outputs) {
      std::printf("%.6f,%u,%s\n", seconds(step.input.time.ns), step.sequence, output.c_str());
    }
  }
}

}  // namespace

int command_dump(Arguments arguments) {
  CommandLine line(arguments,
                   "usage: weldcell dump RECORD --topic poses|ranges|points|edges|path|welds|events\n"
                   "CSV on stdout. points are thinned; events are time, message, JSON.\n",
                   {"topic"}, {});
  if (line.exit_code()) return *line.exit_code();
  if (line.plain().size() != 1 || !line.has("topic")) return line.refuse("dump wants RECORD --topic T");
  const auto record = open_record(line.plain()[0]);
  if (!record.ok()) return tell(record.error());
  const std::string topic = line.value("topic");
  if (topic == "poses") {
    dump_poses(*record);
    return 0;
  }
  if (topic == "events") {
    dump_events(*record);
    return 0;
  }
  const auto outcome = replay(*record, {});
  if (!outcome.ok()) return tell(outcome.error());
  if (topic == "ranges") {
    dump_ranges(*record, outcome->laser_format);
    return 0;
  }
  const auto solution = outcome->cell->solution();
  if (topic != "points" && topic != "edges" && topic != "path" && topic != "welds") {
    return line.refuse("unknown topic '" + topic + "'");
  }
  if (!solution) {
    std::fprintf(stderr, "this job never came to a localization\n");
    return 1;
  }
  if (topic == "points") dump_points(*solution);
  if (topic == "edges") {
    const job::Evidence& evidence = solution->evidence;
    std::fputs(files::edges_csv(evidence.edges, evidence.top_z_mm, evidence.table_z_mm).c_str(), stdout);
  }
  if (topic == "path") std::fputs(files::path_csv(solution->evidence.path).c_str(), stdout);
  if (topic == "welds") {
    std::puts("name,bound_mm,tolerance_mm,gap_mm,verdict");
    for (const auto& c : solution->certificates) {
      std::printf("%s,%.4f,%.4f,%.4f,%s\n", c.name.c_str(), c.bound_mm, c.tolerance_mm, c.gap_mm,
                  localize::to_string(c.verdict));
    }
  }
  return 0;
}

}  // namespace weldcell::app
