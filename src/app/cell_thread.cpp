#include "app/cell_thread.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <chrono>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <thread>

#include "app/job_bundle.hpp"
#include "app/log.hpp"
#include "app/places.hpp"
#include "weldcell/adapters/host_clock.hpp"
#include "weldcell/app/initial_state.hpp"
#include "weldcell/files/workpiece_file.hpp"
#include "weldcell/job/work_order.hpp"
#include "weldcell/review/report.hpp"

namespace weldcell::app {

namespace fs = std::filesystem;

namespace {

constexpr Nanoseconds kTick = 20 * kMillisecond;
constexpr std::chrono::milliseconds kIdlePause{5};

/// record.mcap, or record-2.mcap and so on when an earlier process left one.
std::string record_path(const std::string& folder) {
  for (int i = 1;; ++i) {
    const std::string path = folder + (i == 1 ? "/record.mcap" : fmt::format("/record-{}.mcap", i));
    if (!fs::exists(path)) return path;
  }
}

/// What must not happen before the state that allows it is durable.
bool sets_in_motion(const job::Output& output) {
  if (std::holds_alternative<job::StartMotion>(output)) return true;
  const auto* request = std::get_if<job::RobotRequest>(&output);
  return request != nullptr && request->task != job::RobotTask::Stop &&
         request->task != job::RobotTask::Query;
}

}  // namespace

CellThread::CellThread(Wiring& wiring, std::string arm_yaml)
    : wiring_(wiring),
      arm_yaml_(std::move(arm_yaml)),
      cell_(wiring.config.setup, wiring.config.laser_format, wiring.config.plc_required) {
  job::CellMemory memory = cell_.memory();
  memory.watches_latency = true;
  cell_.recall(memory);
}

void CellThread::run() {
  while (!wiring_.stopping.load(std::memory_order_relaxed)) {
    drain();
    wiring_.beat(ThreadName::Cell);
    std::this_thread::sleep_for(kIdlePause);
  }
  close_record();
}

void CellThread::drain() {
  for (Message& message : wiring_.inbox.take_all()) {
    if (message.job) begin_job(message.job);
    const bool imported = std::holds_alternative<job::ImportDone>(message.body);
    if (imported && record_) {
      const auto& done = std::get<job::ImportDone>(message.body);
      if (done.workpiece.ok()) record_->workpiece(files::workpiece_yaml(*done.workpiece), adapters::now());
    }
    if (std::holds_alternative<job::SolveDone>(message.body) && story_) {
      story_->note_solve_time(seconds(adapters::now() - solve_asked_));
    }
    feed(adapters::now(), std::move(message.body));
    if (message.outcome) message.outcome->set_value(cell_.refusal());
  }
  thread_local EgmItem egm;
  while (wiring_.egm.pop(egm)) {
    feed(egm.arrival, job::EgmCycle{{egm.datagram.begin(), egm.datagram.begin() + egm.size},
                                    {egm.reply.begin(), egm.reply.begin() + egm.reply_size},
                                    egm.report});
  }
  thread_local LaserItem laser;
  while (wiring_.laser.pop(laser)) {
    if (cell_.wants_laser())
      feed(laser.arrival, job::LaserBytes{{laser.bytes.begin(), laser.bytes.begin() + laser.size}});
  }
  if (const std::uint64_t lost = wiring_.laser.dropped(); lost != laser_lost_) {
    feed(adapters::now(), job::Overrun{job::Link::Laser, lost - laser_lost_});
    laser_lost_ = lost;
  }
  if (const std::uint64_t lost = wiring_.egm.dropped(); lost != egm_lost_) {
    feed(adapters::now(), job::Overrun{job::Link::Rws, lost - egm_lost_});
    egm_lost_ = lost;
  }
  const HostTime now = adapters::now();
  if (now - last_tick_ >= kTick) {
    last_tick_ = now;
    feed(now, job::Tick{});
  }
}

void CellThread::feed(HostTime time, job::InputBody body) {
  const job::Input input{time, std::move(body)};
  if (record_) record_->input(input);
  const job::Outputs outputs = cell_.step(input);
  if (record_) record_->outputs(time, outputs);
  if (story_) {
    story_->note(time, outputs);
    story_->note_input(input);
  }
  if (const auto* cycle = std::get_if<job::EgmCycle>(&input.body)) watch(*cycle);
  if (!outputs.empty()) label_log(cell_.status());
  dispatch(outputs);
  wiring_.wants_laser.store(cell_.wants_laser(), std::memory_order_relaxed);
  wiring_.takes_jobs.store(cell_.takes_jobs(), std::memory_order_relaxed);
  wiring_.publish(cell_.status());
}

void CellThread::watch(const job::EgmCycle& cycle) {
  egm_.on(cycle);
  for (const std::string& warning : egm_.take_warnings()) spdlog::warn("{}", warning);
  wiring_.publish(egm_.figures());
}

void CellThread::dispatch(const job::Outputs& outputs) {
  unsaved_.clear();
  bool held_back = false;
  for (const job::Output& output : outputs) {
    if (!unsaved_.empty() && sets_in_motion(output)) {
      held_back = true;
    } else {
      dispatch(output);
    }
  }
  if (held_back) feed(adapters::now(), job::StorageLost{unsaved_});
}

void CellThread::dispatch(const job::Output& output) {
  if (auto order = job::work_order(output, cell_, wiring_.setup)) {
    if (order->kind == job::WorkKind::Solve) solve_asked_ = adapters::now();
    wiring_.work.push([this, order = std::move(*order)] {
      wiring_.inbox.push({job::run(order), nullptr, nullptr});
    });
  } else if (std::holds_alternative<job::ImportRequest>(output)) {
    order_import();
  } else if (const auto* request = std::get_if<job::RobotRequest>(&output)) {
    wiring_.robot_requests.push(*request);
  } else if (const auto* motion = std::get_if<job::StartMotion>(&output)) {
    plans_.push_back(motion->plan);  // alive until the next job and as long as the egm thread uses it
    wiring_.offered_plan.store(motion->plan.get(), std::memory_order_release);
  } else if (std::holds_alternative<job::StopMotion>(output)) {
    wiring_.session.request_stop();
  } else if (const auto* arm = std::get_if<job::SetArmed>(&output)) {
    wiring_.session.set_armed(arm->armed);
  } else if (const auto* show = std::get_if<job::ShowDrawing>(&output)) {
    wiring_.shown.push({show->drawing, show->step, active_ ? active_->folder : ""});
  } else if (const auto* state = std::get_if<job::SaveState>(&output)) {
    save(*state);
  } else if (std::holds_alternative<job::ReturnJob>(output)) {
    close_record();
    story_.reset();
    wiring_.returned.push(std::exchange(active_, nullptr));
  } else if (const auto* choice = std::get_if<job::SelectJob>(&output)) {
    wiring_.selected_job.store(choice->number, std::memory_order_relaxed);
  } else if (const auto* finish = std::get_if<job::FinishJob>(&output)) {
    end_job(*finish);
  } else if (const auto* event = std::get_if<job::LogEvent>(&output)) {
    using Level = job::LogEvent::Level;
    const auto level = event->level == Level::Info      ? spdlog::level::info
                       : event->level == Level::Warning ? spdlog::level::warn
                                                        : spdlog::level::err;
    spdlog::log(level, "{}", event->text);
  }
}

void CellThread::order_import() {
  const auto active = active_;
  wiring_.work.push([this, active] {
    job::ImportDone done{load_workpiece(active->arrived.order, active->folder, wiring_.config.cad_cache_dir)};
    wiring_.inbox.push({std::move(done), nullptr, nullptr});
  });
}

void CellThread::begin_job(const std::shared_ptr<const ActiveJob>& job) {
  close_record();
  active_ = job;
  // The session may still ramp down along a plan of the job before; the last one may be on its way to it.
  std::erase_if(plans_, [this](const auto& plan) {
    return plan != plans_.back() && !wiring_.session.uses(plan.get());
  });
  story_ = std::make_shared<JobStory>();
  accepted_at_ = adapters::utc_text(adapters::unix_ms());
  auto file = adapters::JournalFile::create(record_path(job->folder));
  if (!file.ok()) {
    spdlog::error("no record of job '{}': {}", job->arrived.id, file.error().text());
    return;
  }
  journal_ = std::move(*file);
  RecordHeader header;
  header.program_version = WELDCELL_VERSION;
  header.cell_yaml = wiring_.config.text;
  header.arm_yaml = arm_yaml_;
  header.job_yaml = job->job_yaml;
  header.initial_json = memory_json(cell_.memory());
  record_ = std::make_unique<RecordWriter>(
      [journal = journal_](std::span<const std::byte> b) { journal->write(b); }, header);
}

void CellThread::save(const job::SaveState& state) {
  if (!active_) return;
  const nlohmann::json json{{"state", job::to_string(state.state)},
                            {"seams_done", state.seams_done},
                            {"guidance_done", state.guidance_done},
                            {"weld_begun", state.weld_begun}};
  const Status written = write_file_durably(active_->folder + "/state.json", json.dump() + "\n");
  if (!written.ok()) {
    unsaved_ = written.error().text();
    spdlog::error("{}", unsaved_);
  }
  if (journal_) {
    record_->flush();
    journal_->flush(false);
  }
}

void CellThread::close_record() {
  if (!record_) return;
  record_->end();
  if (!journal_->close()) {
    if (const auto fault = journal_->take_fault()) spdlog::error("record: {}", fault->text());
  }
  record_.reset();
  journal_.reset();
}

void CellThread::end_job(const job::FinishJob& finish) {
  if (const auto solution = cell_.solution(); record_ && solution && !solution->rapid.empty()) {
    record_->attachment("WeldcellJob.mod", "text/plain", adapters::now(), solution->rapid);
  }
  if (record_)
    record_->attachment("result.json", "application/json", adapters::now(), story_->result_json(cell_));
  // The outputs of this very step must be in the record too: feed() wrote them before dispatching.
  close_record();
  auto page = std::make_shared<review::ReportInput>(
      story_->report(cell_, *wiring_.setup, WELDCELL_VERSION, accepted_at_));
  page->texts = {{"job.yaml", active_->job_yaml}, {"cell.yaml", wiring_.config.text}};
  const auto solution = cell_.solution();
  wiring_.work.push([this, page, solution, finish, result = story_->result_json(cell_),
                     folder = active_->folder, id = active_->arrived.id] {
    const auto write = [&](const char* name, const std::string& text) {
      const Status written = write_file_durably(folder + "/" + name, text);
      if (!written.ok()) spdlog::error("{}", written.error().text());
    };
    write("report.html", review::report_html(*page));
    write("result.json", result + "\n");
    if (solution && !solution->rapid.empty()) write("WeldcellJob.mod", solution->rapid);
    wiring_.ended.push({id, finish.accepted});
  });
  story_.reset();
  active_.reset();
}

}  // namespace weldcell::app
