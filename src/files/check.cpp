#include "weldcell/files/check.hpp"

#include <filesystem>

#include "weldcell/files/arm_file.hpp"
#include "weldcell/files/cell_file.hpp"
#include "weldcell/files/job_file.hpp"
#include "weldcell/files/schema.hpp"
#include "weldcell/files/workpiece_file.hpp"

namespace weldcell::files {

namespace fs = std::filesystem;

namespace {

template <typename T>
Faults faults_of(const std::variant<T, Faults>& read) {
  const auto* faults = std::get_if<Faults>(&read);
  return faults == nullptr ? Faults{} : *faults;
}

int line_of(const Node& document, const char* key) {
  for (const Node::Key& k : document.keys) {
    if (k.text == key) return k.line;
  }
  return 0;
}

void check_job(const std::string& path, const std::string& text, const Node& document, Checked& out) {
  const auto read = parse_job(text, path);
  out.faults = faults_of(read);
  if (!out.faults.empty()) return;
  const auto& order = std::get<job::JobOrder>(read);
  const fs::path named = fs::path(path).parent_path() / order.workpiece_file;
  out.workpiece_line = line_of(document, "workpiece");
  std::error_code error;
  if (!fs::is_regular_file(named, error)) {
    out.faults.push_back({path, out.workpiece_line, "workpiece",
                          "'" + order.workpiece_file + "' is not there", "put it beside the job file"});
    return;
  }
  const std::string ending = named.extension().string();
  if (ending == ".yaml" || ending == ".yml") {
    out.faults = faults_of(read_workpiece_file(named.string()));
  } else {
    out.cad_file = named.string();
    out.cad = order.cad;
  }
}

void check_password_file(const std::string& path, const Node& document, const CellConfig& config,
                         Faults& faults) {
  if (config.rws_password_file.empty()) return;
  const Node* rws = document.find("rws");
  const int line = rws == nullptr ? 0 : line_of(*rws, "password_file");
  std::error_code error;
  if (!fs::is_regular_file(config.rws_password_file, error)) {
    faults.push_back({path, line, "rws.password_file", "'" + config.rws_password_file + "' is not there",
                      "write the password into it, alone, with mode 0600"});
  }
}

}  // namespace

const char* kind_word(FileKind kind) {
  switch (kind) {
    case FileKind::Cell:
      return "cell";
    case FileKind::Workpiece:
      return "workpiece";
    case FileKind::Job:
      return "job";
    case FileKind::Arm:
      return "arm";
    case FileKind::Scene:
      return "scene";
    case FileKind::Unknown:
      break;
  }
  return "unknown";
}

Checked check_file(const std::string& path) {
  Checked out;
  const auto text = read_text_file(path);
  out.faults = faults_of(text);
  if (!out.faults.empty()) return out;
  const std::string& yaml = std::get<std::string>(text);
  const auto parsed = parse_document(yaml, path);
  out.faults = faults_of(parsed);
  if (!out.faults.empty()) {
    // The kind decides the exit code even where the text does not parse.
    if (yaml.rfind("cell:", 0) == 0 || yaml.find("\ncell:") != std::string::npos) out.kind = FileKind::Cell;
    return out;
  }
  const Node& document = std::get<Node>(parsed);
  out.kind = file_kind(document);
  switch (out.kind) {
    case FileKind::Cell: {
      const auto read = read_cell_file(path);
      out.faults = faults_of(read);
      if (const auto* config = std::get_if<CellConfig>(&read))
        check_password_file(path, document, *config, out.faults);
      break;
    }
    case FileKind::Workpiece:
      out.faults = faults_of(parse_workpiece(yaml, path));
      break;
    case FileKind::Arm:
      out.faults = faults_of(parse_arm(yaml, path));
      break;
    case FileKind::Job:
      check_job(path, yaml, document, out);
      break;
    case FileKind::Scene:
      out.faults.push_back(
          {path, 0, "scene", "scenes are the simulator's", "weldcell-sim checks them when it starts"});
      break;
    case FileKind::Unknown: {
      std::vector<std::string> kinds{"cell", "workpiece", "job", "arm"};
      const Node::Key first = document.keys.empty() ? Node::Key{} : document.keys.front();
      const std::string near = nearest_word(first.text, kinds);
      out.faults.push_back({path, first.line, first.text, "is no cell, workpiece, job or arm",
                            near.empty() ? "its top must hold cell:, workpiece:, job: or arm:"
                                         : "did you mean '" + near + "'?"});
    }
  }
  return out;
}

}  // namespace weldcell::files
