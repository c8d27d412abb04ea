#include "weldcell/app/replay.hpp"

#include <unistd.h>
#include <yaml-cpp/yaml.h>

#include <deque>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "app/places.hpp"
#include "weldcell/app/initial_state.hpp"
#include "weldcell/files/cell_file.hpp"
#include "weldcell/files/cell_migration.hpp"
#include "weldcell/files/job_file.hpp"
#include "weldcell/files/workpiece_file.hpp"
#include "weldcell/job/work_order.hpp"

namespace weldcell::app {

namespace {

namespace fs = std::filesystem;

/// The YAML text with the dotted keys set.
Result<std::string> changed(const std::string& yaml, const std::vector<Change>& changes) {
  if (changes.empty()) return yaml;
  try {
    const YAML::Node top = YAML::Load(yaml);
    for (const Change& change : changes) {
      YAML::Node node = top;
      std::string rest = change.key;
      for (std::size_t dot = rest.find('.'); dot != std::string::npos; dot = rest.find('.')) {
        node.reset(node[rest.substr(0, dot)]);
        rest = rest.substr(dot + 1);
      }
      node[rest] = YAML::Load(change.value);
    }
    return YAML::Dump(top);
  } catch (const YAML::Exception& fault) {
    return Error{"replay.set", "--set", fault.what(),
                 "use KEY=VALUE with a dotted key of the cell or, as job.KEY, the job file"};
  }
}

/// The arm's data as the record keeps them, laid out as the cell file's reader wants them.
class RobotsDir {
 public:
  explicit RobotsDir(const std::string& arm_yaml) {
    path_ = fs::temp_directory_path() / ("weldcell-replay-" + std::to_string(::getpid()));
    fs::create_directories(path_);
    if (arm_yaml.empty()) return;
    const YAML::Node arm = YAML::Load(arm_yaml)["arm"];
    std::ofstream(path_ / (arm["name"].as<std::string>() + ".yaml")) << arm_yaml;
  }
  ~RobotsDir() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  RobotsDir(const RobotsDir&) = delete;
  RobotsDir& operator=(const RobotsDir&) = delete;
  std::string path() const { return path_.string(); }

 private:
  fs::path path_;
};

struct Context {
  files::CellConfig config;
  job::JobOrder order;
  std::optional<workpiece::Workpiece> workpiece;
};

template <typename T>
Result<T> parsed(std::variant<T, files::Faults> read) {
  if (const auto* faults = std::get_if<files::Faults>(&read))
    return Error{"replay.header", "", files::text(*faults), ""};
  return std::get<T>(std::move(read));
}

Result<Context> context_of(const Record& record, const std::vector<Change>& changes) {
  std::vector<Change> to_cell, to_job;
  for (const Change& change : changes) {
    if (change.key.starts_with("job.")) {
      to_job.push_back({change.key.substr(4), change.value});
    } else {
      to_cell.push_back(change);
    }
  }
  // The record keeps the file as it was then.
  const auto migrated = files::migrate_cell(record.header.cell_yaml, "cell.yaml in the record");
  if (!migrated.ok()) return migrated.error();
  auto cell_yaml = changed(migrated->text, to_cell);
  if (!cell_yaml.ok()) return cell_yaml.error();
  auto job_yaml = changed(record.header.job_yaml, to_job);
  if (!job_yaml.ok()) return job_yaml.error();
  const RobotsDir robots(record.header.arm_yaml);
  auto config = parsed(files::parse_cell(*cell_yaml, "cell.yaml in the record", robots.path()));
  if (!config.ok()) return config.error();
  auto order = parsed(files::parse_job(*job_yaml, "job.yaml in the record"));
  if (!order.ok()) return order.error();
  Context context{*config, *order, std::nullopt};
  if (!record.header.workpiece_yaml.empty()) {
    auto workpiece =
        parsed(files::parse_workpiece(record.header.workpiece_yaml, "workpiece.yaml in the record"));
    if (!workpiece.ok()) return workpiece.error();
    context.workpiece = *workpiece;
  }
  return context;
}

class Replayer {
 public:
  Replayer(const Record& record, const Context& context, bool compare)
      : record_(record),
        context_(context),
        compare_(compare),
        setup_(std::make_shared<const cell::CellSetup>(context.config.setup)) {
    outcome_.setup = context.config.setup;
    outcome_.laser_format = context.config.laser_format;
    outcome_.cell = std::make_unique<job::Cell>(context.config.setup, context.config.laser_format,
                                                context.config.plc_required);
    outcome_.cell->recall(memory_from_json(record.header.initial_json));
  }

  ReplayOutcome run() {
    for (const RecordedStep& step : record_.steps) {
      if (compare_ && outcome_.differences.size() >= kMostDifferences) break;
      ++outcome_.steps;
      play(step);
    }
    return std::move(outcome_);
  }

 private:
  static constexpr std::size_t kMostDifferences = 20;

  void play(const RecordedStep& step) {
    job::Input input = step.input;
    if (step.mark) {
      auto answer = take_answer(*step.mark);
      if (!answer) {
        differ(step, "the record has an answer " + step.mark->topic + " that this run did not ask for", "",
               "");
        return;
      }
      input.body = std::move(*answer);
      const auto mark = work_mark(input.body);
      if (mark->topic == "/work/solve") {
        ++outcome_.solves;
        outcome_.recorded_solve = step.mark->json;
        outcome_.new_solve = mark->json;
      }
      if (mark->json != step.mark->json) differ(step, "answer " + mark->topic, step.mark->json, mark->json);
    }
    if (auto* arrived = std::get_if<job::JobArrived>(&input.body)) arrived->order = context_.order;
    const job::Outputs outputs = outcome_.cell->step(input);
    outcome_.story.note(input.time, outputs);
    outcome_.story.note_input(input);
    for (const job::Output& output : outputs) serve(output);
    compare(step, outputs);
  }

  void serve(const job::Output& output) {
    if (const auto order = job::work_order(output, *outcome_.cell, setup_)) {
      answers_.push_back(job::run(*order));
    } else if (std::holds_alternative<job::ImportRequest>(output) && context_.workpiece) {
      answers_.push_back(job::ImportDone{*context_.workpiece});
    }
  }

  std::optional<job::InputBody> take_answer(const WorkMark& mark) {
    for (auto it = answers_.begin(); it != answers_.end(); ++it) {
      if (work_mark(*it)->topic != mark.topic) continue;
      job::InputBody body = std::move(*it);
      answers_.erase(it);
      return body;
    }
    // An import that failed left no workpiece behind; its words are all that the cell saw of it.
    if (mark.topic == "/work/import") {
      const auto json = nlohmann::json::parse(mark.json);
      if (!json.value("ok", true)) return job::ImportDone{Error{"import", "", json.value("error", ""), ""}};
    }
    return std::nullopt;
  }

  void compare(const RecordedStep& step, const job::Outputs& outputs) {
    const std::size_t most = std::max(outputs.size(), step.outputs.size());
    for (std::size_t i = 0; i < most; ++i) {
      const std::string now = i < outputs.size() ? output_json(outputs[i]) : "(nothing)";
      const std::string then = i < step.outputs.size() ? step.outputs[i] : "(nothing)";
      if (now != then) differ(step, "output " + std::to_string(i + 1), then, now);
    }
  }

  void differ(const RecordedStep& step, const std::string& what, const std::string& then,
              const std::string& now) {
    if (!compare_) return;
    constexpr std::size_t kShown = 300;
    outcome_.differences.push_back(
        {"replay.differs",
         "message " + std::to_string(step.sequence) + " at byte " + std::to_string(step.file_offset),
         what + (then.empty() && now.empty()
                     ? ""
                     : "\n  recorded: " + then.substr(0, kShown) + "\n  this run: " + now.substr(0, kShown)),
         ""});
  }

  const Record& record_;
  const Context& context_;
  bool compare_;
  std::shared_ptr<const cell::CellSetup> setup_;
  std::deque<job::InputBody> answers_;
  ReplayOutcome outcome_;
};

}  // namespace

Result<ReplayOutcome> replay(const Record& record, const std::vector<Change>& changes) {
  const auto context = context_of(record, changes);
  if (!context.ok()) return context.error();
  return Replayer(record, *context, changes.empty()).run();
}

}  // namespace weldcell::app
