#include <fmt/format.h>

#include "weldcell/base/units.hpp"
#include "weldcell/files/workpiece_file.hpp"
#include "weldcell/files/yaml_text.hpp"

namespace weldcell::files {

namespace {

std::string point(const Eigen::Vector3d& p) {
  return fmt::format("[{}, {}, {}]", yaml_number(p.x()), yaml_number(p.y()), yaml_number(p.z()));
}

void print_weld(std::string& out, const workpiece::Weld& w) {
  out += fmt::format("    - name: {}\n      joins: [", yaml_text(w.name));
  for (std::size_t i = 0; i < w.joins.size(); ++i) out += (i == 0 ? "" : ", ") + yaml_text(w.joins[i]);
  out += "]\n      path: [" + point(w.start);
  for (const workpiece::SeamPiece& piece : w.pieces) {
    out += piece.arc ? fmt::format(", {{via: {}, to: {}}}", point(piece.via), point(piece.to))
                     : ", " + point(piece.to);
  }
  out += fmt::format("]\n      tolerance_mm: {}\n      work_angle_deg: {}\n      travel_angle_deg: {}\n",
                     yaml_number(w.tolerance_mm), yaml_number(deg(w.work_angle_rad)),
                     yaml_number(deg(w.travel_angle_rad)));
}

}  // namespace

std::string yaml_text(const std::string& text) {
  bool plain = !text.empty() && text.size() < 64;
  for (const char& c : text) {
    const bool letter = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_';
    const bool inner = letter || (c >= '0' && c <= '9') || c == '-' || c == '.';
    plain = plain && (&c == text.data() ? letter : inner);
  }
  if (plain && text != "true" && text != "false" && text != "null" && text != "yes" && text != "no")
    return text;
  return yaml_quoted(text);
}

std::string yaml_quoted(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    out += c;
  }
  return out + "\"";
}

std::string yaml_number(double value) {
  std::string out = fmt::format("{:.6f}", value);
  while (out.back() == '0') out.pop_back();
  if (out.back() == '.') out.pop_back();
  return out == "-0" ? "0" : out;
}

std::string workpiece_yaml(const workpiece::Workpiece& workpiece) {
  std::string out = fmt::format("workpiece:\n  name: {}\n  units: mm\n  height_mm: {}\n  members:\n",
                                yaml_text(workpiece.name), yaml_number(workpiece.height_mm));
  for (const workpiece::Member& m : workpiece.members) {
    out +=
        fmt::format("    - name: {}\n      tag: {}\n      outline: [", yaml_text(m.name), yaml_quoted(m.tag));
    for (std::size_t i = 0; i < m.outline.size(); ++i) {
      out += fmt::format("{}[{}, {}]", i == 0 ? "" : ", ", yaml_number(m.outline[i].x()),
                         yaml_number(m.outline[i].y()));
    }
    out += "]\n";
    if (m.edge_radius_mm > 0) out += fmt::format("      edge_radius_mm: {}\n", yaml_number(m.edge_radius_mm));
  }
  if (!workpiece.fixtures.empty()) out += "  fixtures:\n";
  for (const workpiece::Fixture& f : workpiece.fixtures) {
    out += fmt::format("    - {{x: {}, y: {}, diameter_mm: {}, member: {}}}\n", yaml_number(f.x_mm),
                       yaml_number(f.y_mm), yaml_number(f.diameter_mm), yaml_text(f.member));
  }
  if (!workpiece.welds.empty()) out += "  welds:\n";
  for (const workpiece::Weld& w : workpiece.welds) print_weld(out, w);
  return out;
}

}  // namespace weldcell::files
