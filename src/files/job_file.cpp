#include "weldcell/files/job_file.hpp"

#include <filesystem>

#include "weldcell/base/units.hpp"
#include "weldcell/files/schema.hpp"

namespace weldcell::files {

namespace {

using plan::Pattern;

void read_planned(Map& map, job::JobOrder& order) {
  Pose2 pose;
  map.number("x_mm", pose.x_mm, {-10'000, 10'000}, Need::Required);
  map.number("y_mm", pose.y_mm, {-10'000, 10'000}, Need::Required);
  map.degrees("theta_deg", pose.theta_rad, {-360, 360});
  map.finish();
  order.planned = pose;
}

void read_inspection(Map& map, plan::Inspection& inspection) {
  static constexpr Choice<Pattern> kPatterns[] = {
      {"zigzag", Pattern::Zigzag}, {"spiral", Pattern::Spiral}, {"adaptive", Pattern::Adaptive}};
  map.choice("pattern", inspection.pattern, kPatterns);
  map.number("span_mm", inspection.span_mm, {10, 2000});
  map.number("pitch_mm", inspection.pitch_mm, {5, 2000});
  map.number("speed_mm_s", inspection.speed_mm_s, {10, 1000});
  map.number("margin_mm", inspection.margin_mm, {0, 500});
  map.degrees("margin_deg", inspection.margin_rad, {0, 90});
  map.integer("passes_per_member", inspection.passes_per_member, {0, 200});
  map.finish();
}

void read_acceptance(Map& map, job::Acceptance& acceptance) {
  map.number("max_mean_error_mm", acceptance.max_mean_error_mm, {0.01, 100});
  map.number("max_offset_mm", acceptance.max_offset_mm, {0, 1000});
  map.degrees("max_rotation_deg", acceptance.max_rotation_rad, {0, 180});
  map.finish();
}

void read_cad(Map& map, job::CadImport& cad) {
  std::string units;
  if (map.text("units", units)) {
    if (units == "mm" || units == "inch" || units == "m") {
      cad.units = units;
    } else {
      map.fault("units", "'" + units + "' is no choice", "one of mm, inch, m");
    }
  }
  map.number("height_mm", cad.height_mm, {0.5, 2000});
  map.number("edge_radius_mm", cad.edge_radius_mm, {0, 200});
  static constexpr Choice<const char*> kDrawn[] = {{"flat", "flat"}, {"silhouette", "silhouette"}};
  const char* drawn = "";
  map.choice("drawn", drawn, kDrawn);
  cad.drawn = drawn;
  map.finish();
}

void read_revision(Map& map, job::JobOrder& order) {
  std::string revision;
  if (!map.text("revision", revision)) return;
  const bool form = revision.size() == 7 + 64 && revision.rfind("sha256:", 0) == 0 &&
                    revision.find_first_not_of("0123456789abcdef", 7) == std::string::npos;
  if (form) {
    order.revision = revision;
  } else {
    map.fault("revision", "is no SHA-256",
              "write sha256: and 64 hexadecimal digits, as sha256sum prints them");
  }
}

void read_workpiece_name(Map& map, job::JobOrder& order) {
  if (!map.text("workpiece", order.workpiece_file, Need::Required)) return;
  const std::filesystem::path path(order.workpiece_file);
  std::string ending = path.extension().string();
  for (char& c : ending) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c + 32) : c;
  for (const char* known : {".yaml", ".yml", ".step", ".stp", ".dxf"}) {
    if (ending == known) return;
  }
  map.fault("workpiece", "'" + order.workpiece_file + "' is no file that can be read",
            "name a .yaml, .step, .stp or .dxf file");
}

/// The name becomes a folder of the spool.
void read_name(Map& map, job::JobOrder& order) {
  if (!map.text("job", order.name, Need::Required)) return;
  bool good = order.name.size() <= 64 && order.name[0] != '.' && order.name[0] != '-';
  for (const char c : order.name) {
    good = good && ((c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' ||
                    c == '_' || c == '.');
  }
  if (!good) {
    map.fault("job", "'" + order.name + "' cannot name a folder",
              "letters, digits, - _ . and at most 64 of them");
  }
}

template <typename Read, typename Into>
void section(Map& top, const char* key, Read read, Into& into) {
  const Node* node = top.node(key);
  if (node == nullptr) return;
  Map map(*node, top.file(), key, top.faults());
  if (node->kind == Node::Kind::Map) read(map, into);
}

}  // namespace

std::variant<job::JobOrder, Faults> parse_job(std::string_view text, const std::string& name) {
  auto document = parse_document(text, name);
  if (auto* faults = std::get_if<Faults>(&document)) return std::move(*faults);
  Faults faults;
  Map top(std::get<Node>(document), name, "", faults);
  job::JobOrder order;
  read_name(top, order);
  top.integer("number", order.number, {0, 1'000'000});
  top.integer("priority", order.priority, {0, 9});
  read_workpiece_name(top, order);
  read_revision(top, order);
  section(top, "cad", read_cad, order.cad);
  section(top, "planned", read_planned, order);
  section(
      top, "guidance", [](Map& map, bool& on) { map.boolean("enabled", on), map.finish(); }, order.guidance);
  section(top, "inspection", read_inspection, order.inspection);
  section(top, "acceptance", read_acceptance, order.acceptance);
  section(
      top, "weld", [](Map& map, bool& on) { map.boolean("execute", on), map.finish(); }, order.execute_weld);
  top.finish();
  if (!faults.empty()) return in_order(std::move(faults));
  return order;
}

std::variant<job::JobOrder, Faults> read_job_file(const std::string& path) {
  auto text = read_text_file(path);
  if (auto* faults = std::get_if<Faults>(&text)) return std::move(*faults);
  return parse_job(std::get<std::string>(text), path);
}

}  // namespace weldcell::files
