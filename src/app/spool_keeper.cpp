#include "app/spool_keeper.hpp"

#include <spdlog/spdlog.h>

#include <nlohmann/json.hpp>

#include "app/places.hpp"
#include "weldcell/files/job_file.hpp"

namespace weldcell::app {

namespace {

/// How long a job waits for a workpiece file that it names.
constexpr Nanoseconds kFileWait = 15 * kSecond;

}  // namespace

SpoolKeeper::SpoolKeeper(Wiring& wiring, adapters::SpoolDir spool)
    : wiring_(wiring), spool_(std::move(spool)) {
  find_interrupted();
}

void SpoolKeeper::find_interrupted() {
  for (const adapters::SpoolJob& found : spool_.active()) {
    auto job = std::make_shared<ActiveJob>();
    job->folder = found.folder.string();
    job->arrived.id = found.name;
    job->arrived.interrupted = true;
    const auto text = read_file(found.job_file.string());
    auto order = text.ok() ? files::parse_job(*text, found.job_file.string())
                           : std::variant<job::JobOrder, files::Faults>(files::Faults{});
    if (!std::holds_alternative<job::JobOrder>(order)) {
      spdlog::error("job '{}' in active/ cannot be read any more and stays there: look into {}", found.name,
                    job->folder);
      continue;
    }
    job->arrived.order = std::get<job::JobOrder>(order);
    job->arrived.number = job->arrived.order.number;
    job->job_yaml = *text;
    if (const auto state = read_file(job->folder + "/state.json"); state.ok()) {
      const auto json = nlohmann::json::parse(*state, nullptr, false);
      if (json.is_object()) {
        const std::string last = json.value("state", "");
        if (last == "Done" || last == "Failed") {
          // It had ended; only its move out of active/ was cut off.
          wiring_.ended.push({found.name, last == "Done"});
          continue;
        }
        job->arrived.seams_done = json.value("seams_done", 0);
        job->arrived.guidance_done = json.value("guidance_done", false);
        job->arrived.weld_begun = json.value("weld_begun", false);
      }
    }
    interrupted_.push_back(std::move(job));
  }
}

void SpoolKeeper::step(Nanoseconds timeout) {
  put_away();
  for (adapters::SpoolEntry& entry : spool_.poll(timeout)) {
    if (!entry.problem.empty()) {
      reject(entry, entry.problem);
    } else {
      waiting_.push_back(std::move(entry));
    }
  }
  // handed_over_ holds back until the cell has seen the last one and says that it is busy.
  if (!wiring_.takes_jobs.load(std::memory_order_relaxed)) {
    handed_over_ = false;
    return;
  }
  if (handed_over_) return;
  if (!interrupted_.empty()) {
    if (hand_over(interrupted_.front())) interrupted_.pop_front();
  } else if (!waiting_.empty()) {
    const adapters::SpoolEntry entry = std::move(waiting_.front());
    waiting_.pop_front();
    look_at(entry);
  }
}

void SpoolKeeper::look_at(const adapters::SpoolEntry& entry) {
  auto read = files::read_job_file(entry.job_file.string());
  if (const auto* faults = std::get_if<files::Faults>(&read)) {
    reject(entry, files::text(*faults));
    return;
  }
  const auto& order = std::get<job::JobOrder>(read);
  const std::vector<std::string> needed{order.workpiece_file};
  auto job = std::make_shared<ActiveJob>();
  if (const auto text = read_file(entry.job_file.string()); text.ok()) job->job_yaml = *text;
  auto taken = spool_.take(entry, order.name, needed);
  if (!taken.ok()) {
    const Error& fault = taken.error();
    if (fault.code == "spool.missing" && entry.waited < kFileWait) {
      spool_.put_back(entry);
    } else {
      reject(entry, fault.text());
    }
    return;
  }
  job->folder = taken->folder.string();
  job->arrived.id = taken->name;
  job->arrived.order = order;
  job->arrived.number = order.number;
  spdlog::info("job '{}' taken from the spool", order.name);
  if (!hand_over(job)) interrupted_.push_back(job);
}

bool SpoolKeeper::hand_over(std::shared_ptr<const ActiveJob> job) {
  const job::JobArrived arrived = job->arrived;
  handed_over_ = wiring_.inbox.push({arrived, std::move(job), nullptr});
  return handed_over_;
}

void SpoolKeeper::reject(const adapters::SpoolEntry& entry, const std::string& reason) {
  spdlog::error("rejected {}: {}", entry.name, reason);
  const Status status = spool_.reject(entry, reason);
  if (!status.ok()) spdlog::error("{}", status.error().text());
}

void SpoolKeeper::put_away() {
  for (const EndedJob& ended : wiring_.ended.take_all()) {
    const auto place = ended.accepted ? adapters::SpoolPlace::Done : adapters::SpoolPlace::Failed;
    const auto moved = spool_.finish(ended.id, place);
    if (moved.ok()) {
      spdlog::info("job '{}' is {}: {}", ended.id, adapters::to_string(place), moved->folder.string());
    } else {
      spdlog::error("{}", moved.error().text());
    }
  }
}

}  // namespace weldcell::app
