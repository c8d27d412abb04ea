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
                        {"selected_job", m.selected_job}}
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
  return m;
}

}  // namespace weldcell::app
