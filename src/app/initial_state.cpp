#include "weldcell/app/initial_state.hpp"

#include <nlohmann/json.hpp>

namespace weldcell::app {

std::string memory_json(const job::CellMemory& m) {
  return nlohmann::json{{"state", static_cast<int>(m.state)},
                        {"armed", m.armed},
                        {"links", m.links},
                        {"next_request", m.next_request},
                        {"last_sequence", m.last_sequence},
                        {"sequence_known", m.sequence_known},
                        {"selected_job", m.selected_job},
                        {"watches_latency", m.watches_latency},
                        {"latency_drift_ms", m.latency_drift_ms},
                        {"latency_jobs", m.latency_jobs}}
      .dump();
}

job::CellMemory memory_from_json(const std::string& text) {
  job::CellMemory m;
  const auto json = nlohmann::json::parse(text, nullptr, false);
  if (!json.is_object()) return m;
  m.state = static_cast<job::State>(json.value("state", 0));
  m.armed = json.value("armed", false);
  m.links = json.value("links", m.links);
  m.next_request = json.value("next_request", m.next_request);
  m.last_sequence = json.value("last_sequence", m.last_sequence);
  m.sequence_known = json.value("sequence_known", false);
  m.selected_job = json.value("selected_job", 0);
  m.watches_latency = json.value("watches_latency", false);
  m.latency_drift_ms = json.value("latency_drift_ms", 0.0);
  m.latency_jobs = json.value("latency_jobs", 0);
  return m;
}

}  // namespace weldcell::app
