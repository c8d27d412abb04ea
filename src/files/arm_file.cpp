#include <algorithm>

#include "weldcell/base/units.hpp"
#include "weldcell/files/arm_file.hpp"
#include "weldcell/files/cell_file.hpp"
#include "weldcell/files/schema.hpp"

namespace weldcell::files {

namespace {

void read_signs(Map& map, std::array<int, 6>& sign) {
  double read[6];
  if (!map.numbers("sign", read, 6, {-1, 1})) return;
  for (std::size_t i = 0; i < 6; ++i) {
    if (read[i] != 1 && read[i] != -1) {
      map.fault("sign", "each sign is 1 or -1", "write [1, 1, 1, 1, 1, 1] for a serial ABB arm");
      return;
    }
    sign[i] = static_cast<int>(read[i]);
  }
}

void read_limits(Map& map, kinematics::ArmModel& arm) {
  const Node* list = map.sequence("limits_deg", Need::Required);
  if (list == nullptr) return;
  if (list->items.size() != 6) {
    map.fault("limits_deg", "has " + std::to_string(list->items.size()) + " pairs",
              "write six [lower, upper]");
    return;
  }
  for (std::size_t i = 0; i < 6; ++i) {
    const Node& pair = list->items[i];
    const std::string key = map.dotted("limits_deg") + "[" + std::to_string(i) + "]";
    if (pair.kind != Node::Kind::Sequence || pair.items.size() != 2) {
      map.fault_at(pair.line, key, "is " + pair.describe(), "write [lower, upper]");
      continue;
    }
    double ends[2] = {0, 0};
    bool good = true;
    for (std::size_t k = 0; k < 2; ++k) {
      good = read_number(pair.items[k], map.file(), key, {-720, 720}, ends[k], map.faults()) && good;
    }
    if (good && ends[0] >= ends[1])
      map.fault_at(pair.line, key, "lower is not below upper", "write [lower, upper]");
    arm.lower[i] = rad(ends[0]);
    arm.upper[i] = rad(ends[1]);
  }
}

}  // namespace

kinematics::ArmModel read_arm(Map& map) {
  kinematics::ArmModel arm;
  std::string source;
  map.text("name", arm.name, Need::Required);
  map.text("source", source);
  if (const Node* node = map.node("lengths_mm", Need::Required)) {
    Map lengths(*node, map.file(), map.dotted("lengths_mm"), map.faults());
    constexpr Range kSigned{-5000, 5000}, kPositive{1, 5000}, kFlange{0, 5000};
    lengths.number("a1", arm.a1, kSigned, Need::Required);
    lengths.number("a2", arm.a2, kSigned, Need::Required);
    lengths.number("b", arm.b, kSigned);
    lengths.number("c1", arm.c1, kPositive, Need::Required);
    lengths.number("c2", arm.c2, kPositive, Need::Required);
    lengths.number("c3", arm.c3, kPositive, Need::Required);
    lengths.number("c4", arm.c4, kFlange, Need::Required);
    lengths.finish();
  }
  map.joints_degrees("offset_deg", arm.offset, {-360, 360}, Need::Required);
  read_signs(map, arm.sign);
  read_limits(map, arm);
  map.joints_degrees("max_speed_deg_s", arm.max_speed, {1, 2000}, Need::Required);
  map.number("j3_j2_coupling", arm.j3_j2_coupling, {-1, 1});
  map.finish();
  return arm;
}

std::variant<kinematics::ArmModel, Faults> parse_arm(std::string_view text, const std::string& name) {
  auto document = parse_document(text, name);
  if (auto* faults = std::get_if<Faults>(&document)) return std::move(*faults);
  Faults faults;
  Map top(std::get<Node>(document), name, "", faults);
  kinematics::ArmModel arm;
  if (const Node* node = top.node("arm", Need::Required)) {
    Map map(*node, name, "arm", faults);
    arm = read_arm(map);
  }
  top.finish();
  if (!faults.empty()) return in_order(std::move(faults));
  return arm;
}

std::variant<kinematics::ArmModel, Faults> read_arm_file(const std::string& path) {
  auto text = read_text_file(path);
  if (auto* faults = std::get_if<Faults>(&text)) return std::move(*faults);
  return parse_arm(std::get<std::string>(text), path);
}

}  // namespace weldcell::files
