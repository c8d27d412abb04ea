#include "app/log.hpp"

#include <spdlog/sinks/base_sink.h>
#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

#include <array>
#include <memory>
#include <mutex>
#include <string>

#include "weldcell/adapters/journal_log.hpp"
#include "weldcell/job/state_table.hpp"

namespace weldcell::app {

namespace {

struct Labels {
  std::string job, state, fault;
};
std::mutex g_labels_mutex;
Labels g_labels;

int syslog_priority(spdlog::level::level_enum level) {
  switch (level) {
    case spdlog::level::critical:
      return 2;
    case spdlog::level::err:
      return 3;
    case spdlog::level::warn:
      return 4;
    case spdlog::level::info:
      return 6;
    default:
      return 7;
  }
}

class JournalSink final : public spdlog::sinks::base_sink<std::mutex> {
 protected:
  void sink_it_(const spdlog::details::log_msg& line) override {
    Labels labels;
    {
      const std::lock_guard lock(g_labels_mutex);
      labels = g_labels;
    }
    const std::array<adapters::JournalField, 3> fields{
        {{"JOB_ID", labels.job}, {"STATE", labels.state}, {"FAULT", labels.fault}}};
    adapters::journal_line(syslog_priority(line.level), {line.payload.data(), line.payload.size()}, fields);
  }
  void flush_() override {}
};

}  // namespace

void start_log() {
  std::shared_ptr<spdlog::logger> logger;
  if (adapters::stderr_is_journal()) {
    logger = std::make_shared<spdlog::logger>("weldcelld", std::make_shared<JournalSink>());
  } else {
    logger = spdlog::stderr_logger_mt("weldcelld");
    logger->set_pattern("%Y-%m-%dT%H:%M:%S.%e %l %v");
  }
  logger->flush_on(spdlog::level::info);
  spdlog::set_default_logger(logger);
}

void label_log(const job::CellStatus& status) {
  // The number that the PLC reads: of a fault, of an interrupted job, of a failed one.
  const std::uint16_t number = status.plc.fault_code;
  const std::string fault = number == 0 ? std::string{} : std::to_string(number);
  const std::lock_guard lock(g_labels_mutex);
  g_labels = {status.job, job::to_string(status.state), fault};
}

}  // namespace weldcell::app
