#include "app/spool_keeper.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "app/job_signing.hpp"
#include "app/places.hpp"
#include "weldcell/adapters/host_clock.hpp"

namespace weldcell::app {

namespace {

using adapters::SpoolMark;

/// How long a job waits for a workpiece file that it names, and for its signature.
constexpr Nanoseconds kFileWait = 15 * kSecond;
/// How long an order to cancel waits for its job.
constexpr Nanoseconds kCancelWait = 10 * kSecond;

/// What the last process left behind in state.json.
struct Left {
  bool ended = false, accepted = false, begun = false, welding = false;
};

Left read_left(const std::string& folder, job::JobArrived& arrived) {
  const auto state = read_file(folder + "/state.json");
  if (!state.ok()) return {};  // killed before its first step: not begun
  const auto json = nlohmann::json::parse(*state, nullptr, false);
  if (!json.is_object()) {
    // Nobody knows how far it came; the controller is asked before any arc.
    arrived.weld_begun = true;
    return {false, false, true, true};
  }
  const std::string last = json.value("state", "");
  arrived.seams_done = json.value("seams_done", 0);
  arrived.guidance_done = json.value("guidance_done", false);
  arrived.weld_begun = json.value("weld_begun", false);
  const bool before_start = last == "Idle" || last == "Importing" || last == "Planning" || last == "Ready";
  const bool begun = !before_start || arrived.seams_done > 0 || arrived.guidance_done || arrived.weld_begun;
  return {last == "Done" || last == "Failed", last == "Done", begun, last == "Welding"};
}

/// Fewer than these of a job's own faults; everything else is the disk's or the folder's.
bool fault_of_the_disk(const Error& fault) {
  return fault.code == "spool.io" || fault.code == "spool.permission";
}

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
    auto read = read_job(found.job_file.string(), wiring_.config);
    if (!read.ok()) {
      spdlog::error("job '{}' in active/ cannot be run any more and stays there: look into {}: {}",
                    found.name, job->folder, read.error().text());
      continue;
    }
    job->arrived.order = read->order;
    job->arrived.number = job->arrived.order.number;
    job->job_yaml = read->text;
    const Left left = read_left(job->folder, job->arrived);
    if (left.ended) {
      // Only its move out of active/ was cut off.
      wiring_.ended.push({found.name, left.accepted});
      continue;
    }
    job->arrived.interrupted = left.begun;
    if (left.welding) {
      spdlog::warn(
          "job '{}' was left while it welded: RAPID may weld on at this moment, and is stopped as soon as "
          "the "
          "controller answers; stop it on the FlexPendant if it must not",
          found.name);
    }
    if (left.begun) {
      interrupted_.push_back(std::move(job));
    } else {
      const job::JobOrder& o = job->arrived.order;
      waiting_.push_back({{}, job, o.name, o.number, o.priority});
    }
  }
}

void SpoolKeeper::step(Nanoseconds timeout) {
  put_away();
  take_back();
  std::vector<adapters::SpoolEntry> entries = spool_.poll(timeout);
  if (const auto fault = spool_.fault()) {
    tell(fault->text());
  } else if (!told_.empty() && waiting_.empty()) {
    tell("");
  }
  for (adapters::SpoolEntry& entry : entries) offer(std::move(entry));
  obey_cancels(adapters::now());
  count_waiting();
  // handed_over_ holds back until the cell has seen the last one and says that it is busy.
  if (!wiring_.takes_jobs.load(std::memory_order_relaxed)) {
    handed_over_ = false;
    return;
  }
  if (handed_over_) return;
  if (!interrupted_.empty()) {
    if (hand_over(interrupted_.front())) interrupted_.pop_front();
  } else if (const auto first = next(); first != waiting_.end()) {
    const Waiting chosen = std::move(*first);
    waiting_.erase(first);
    take(chosen);
  }
}

void SpoolKeeper::offer(adapters::SpoolEntry entry) {
  std::erase_if(waiting_, [&](const Waiting& w) { return !w.taken && w.entry.name == entry.name; });
  if (!entry.problem.empty()) {
    reject(entry, entry.problem);
    return;
  }
  const auto read = read_job(entry.job_file.string(), wiring_.config);
  if (!read.ok()) {
    refuse(entry, read.error());
    return;
  }
  const job::JobOrder& order = read->order;
  waiting_.push_back({std::move(entry), nullptr, order.name, order.number, order.priority});
}

void SpoolKeeper::take_back() {
  for (const std::shared_ptr<const ActiveJob>& job : wiring_.returned.take_all()) {
    const job::JobOrder& order = job->arrived.order;
    waiting_.push_front({{}, job, order.name, order.number, order.priority});
    handed_over_ = false;
    spdlog::info("job '{}' waits again", order.name);
  }
}

void SpoolKeeper::obey_cancels(HostTime now) {
  const std::vector<std::string> ordered = adapters::marked_jobs(spool_.root(), SpoolMark::Cancel);
  for (const std::string& job : ordered) {
    const HostTime first = cancels_.try_emplace(job, now).first->second;
    const bool over = cancel(job);
    if (!over && now - first < kCancelWait) continue;
    if (!over) spdlog::warn("no job '{}' to cancel", job);
    adapters::unmark_job(spool_.root(), SpoolMark::Cancel, job);
    adapters::unmark_job(spool_.root(), SpoolMark::Hold, job);
    cancels_.erase(job);
  }
}

bool SpoolKeeper::cancel(const std::string& job) {
  const auto found = std::ranges::find(waiting_, job, &Waiting::job);
  if (found != waiting_.end()) {
    const Waiting chosen = std::move(*found);
    waiting_.erase(found);
    spdlog::info("job '{}' cancelled", job);
    if (chosen.taken) {
      wiring_.ended.push({chosen.taken->arrived.id, false});
    } else {
      reject(chosen.entry, "cancelled by a person");
    }
    return true;
  }
  if (wiring_.status().job != job || wiring_.takes_jobs.load(std::memory_order_relaxed)) return false;
  wiring_.inbox.push({job::OperatorCommand{wire::PlcCommand::Abort, "cancel"}, nullptr, nullptr});
  return true;
}

bool SpoolKeeper::held(const Waiting& waiting) const {
  return adapters::job_marked(spool_.root(), SpoolMark::Hold, waiting.job);
}

std::deque<SpoolKeeper::Waiting>::iterator SpoolKeeper::next() {
  const std::int32_t selected = wiring_.selected_job.load(std::memory_order_relaxed);
  auto best = waiting_.end();
  for (auto at = waiting_.begin(); at != waiting_.end(); ++at) {
    if (selected != 0 && (at->number > 0 ? at->number : -1) != selected) continue;
    if (best != waiting_.end() && at->priority <= best->priority) continue;
    if (!held(*at)) best = at;
  }
  return best;
}

void SpoolKeeper::take(const Waiting& waiting) {
  if (waiting.taken) {
    if (!hand_over(waiting.taken)) waiting_.push_front(waiting);
    return;
  }
  const adapters::SpoolEntry& entry = waiting.entry;
  const auto read = read_job(entry.job_file.string(), wiring_.config);
  if (!read.ok()) {
    refuse(entry, read.error());
    return;
  }
  const job::JobOrder& order = read->order;
  std::vector<std::string> needed{order.workpiece_file};
  if (read->signature_there) needed.push_back(signature_file_of(entry.job_file.filename().string()));
  auto job = std::make_shared<ActiveJob>();
  job->job_yaml = read->text;
  auto taken = spool_.take(entry, order.name, needed);
  if (!taken.ok()) {
    const Error& fault = taken.error();
    if (fault_of_the_disk(fault)) {
      // No fault of the job's: it waits until the disk is well again.
      tell(fault.text());
      spool_.put_back(entry);
    } else if (fault.code == "spool.missing" && entry.waited < kFileWait) {
      spool_.put_back(entry);
    } else {
      reject(entry, fault.text());
    }
    return;
  }
  tell("");
  job->folder = taken->folder.string();
  job->arrived.id = taken->name;
  job->arrived.order = order;
  job->arrived.number = order.number;
  spdlog::info("job '{}' taken from the spool{}{}", order.name, read->signer.empty() ? "" : ", ",
               read->signer);
  if (!hand_over(job)) waiting_.push_front({{}, job, order.name, order.number, order.priority});
}

bool SpoolKeeper::hand_over(std::shared_ptr<const ActiveJob> job) {
  const job::JobArrived arrived = job->arrived;
  handed_over_ = wiring_.inbox.push({arrived, std::move(job), nullptr});
  return handed_over_;
}

void SpoolKeeper::refuse(const adapters::SpoolEntry& entry, const Error& fault) {
  if (fault.code == "job.unsigned" && entry.waited < kFileWait) {
    if (entry.waited == 0)
      spdlog::warn("{} waits {:.0f} s for its signature: {}", entry.name, seconds(kFileWait), fault.text());
    spool_.put_back(entry);
  } else {
    reject(entry, fault.text());
  }
}

void SpoolKeeper::reject(const adapters::SpoolEntry& entry, const std::string& reason) {
  const Status status = spool_.reject(entry, reason);
  if (status.ok()) {
    spdlog::error("rejected {}: {}", entry.name, reason);
  } else if (status.error().code != "spool.missing") {
    tell(status.error().text());
    spool_.put_back(entry);
  }
}

void SpoolKeeper::count_waiting() {
  std::size_t count = 0;
  for (const Waiting& waiting : waiting_) count += held(waiting) ? 0 : 1;
  wiring_.jobs_waiting.store(static_cast<std::uint16_t>(std::min<std::size_t>(count, 0xFFFF)),
                             std::memory_order_relaxed);
}

void SpoolKeeper::tell(const std::string& fault) {
  if (fault == told_) return;
  told_ = fault;
  wiring_.publish_spool_fault(fault);
  if (fault.empty()) {
    spdlog::info("the spool is well again");
  } else {
    spdlog::error("{}; what waits there keeps waiting", fault);
  }
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
