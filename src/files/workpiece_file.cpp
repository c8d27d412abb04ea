#include "weldcell/files/workpiece_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "weldcell/base/units.hpp"
#include "weldcell/files/schema.hpp"

namespace weldcell::files {

namespace {

constexpr std::size_t kMaxMembers = 200;
constexpr std::size_t kMaxWelds = 1000;
constexpr std::size_t kMaxVertices = 2000;
constexpr double kMaxCoordinateMm = 20'000;

/// Reads one workpiece; keeps the line of every member and weld, so that what validated() finds can be shown
/// there.
class WorkpieceReader {
 public:
  WorkpieceReader(std::string file, Faults& faults) : file_(std::move(file)), faults_(faults) {}

  workpiece::Workpiece read(Map& map) {
    map.text("name", out_.name, Need::Required);
    static constexpr Choice<double> kUnits[] = {{"mm", 1.0}, {"inch", 25.4}, {"m", 1000.0}};
    map.choice("units", scale_, kUnits, Need::Required);
    map.number("height_mm", out_.height_mm, {0.5, 2000}, Need::Required);
    each(map, "members", Need::Required, kMaxMembers,
         [&](const Node& node, const std::string& key) { member(node, key); });
    each(map, "fixtures", Need::Optional, 1000,
         [&](const Node& node, const std::string& key) { fixture(node, key); });
    each(map, "welds", Need::Optional, kMaxWelds,
         [&](const Node& node, const std::string& key) { weld(node, key); });
    map.finish();
    check_geometry(map);
    return std::move(out_);
  }

 private:
  template <typename Read>
  void each(Map& map, const char* key, Need need, std::size_t most, Read read_one) {
    const Node* list = map.sequence(key, need);
    if (list == nullptr) return;
    if (list->items.size() > most) {
      map.fault(key, fmt::format("has {} entries", list->items.size()), fmt::format("at most {}", most));
      return;
    }
    for (std::size_t i = 0; i < list->items.size(); ++i) {
      read_one(list->items[i], fmt::format("{}[{}]", map.dotted(key), i));
    }
  }

  void member(const Node& node, const std::string& key) {
    Map map(node, file_, key, faults_);
    const std::size_t faults_before = faults_.size();
    workpiece::Member m;
    m.tag = std::to_string(out_.members.size() + 1);
    if (map.text("name", m.name, Need::Required) && !member_names_.insert(m.name).second) {
      map.fault("name", "two members are named '" + m.name + "'", "give each its own name");
    }
    map.text("tag", m.tag);
    if (const Node* outline = map.sequence("outline", Need::Required))
      polygon(*outline, map.dotted("outline"), m.outline);
    map.number("edge_radius_mm", m.edge_radius_mm, {0, 200});
    map.finish();
    member_at_.push_back({node.line, key, faults_.size() == faults_before});
    out_.members.push_back(std::move(m));
  }

  void polygon(const Node& list, const std::string& key, Polygon& outline) {
    if (list.items.size() > kMaxVertices) {
      fault(list.line, key, fmt::format("has {} vertices", list.items.size()),
            fmt::format("at most {}", kMaxVertices));
      return;
    }
    for (std::size_t i = 0; i < list.items.size(); ++i) {
      double p[2];
      if (point(list.items[i], fmt::format("{}[{}]", key, i), p, 2)) outline.emplace_back(p[0], p[1]);
    }
  }

  bool point(const Node& node, const std::string& key, double* values, std::size_t count) {
    if (node.kind != Node::Kind::Sequence || node.items.size() != count) {
      return fault(node.line, key, "is " + node.describe(), count == 2 ? "write [x, y]" : "write [x, y, z]");
    }
    const double most = kMaxCoordinateMm / scale_;
    for (std::size_t i = 0; i < count; ++i) {
      if (!read_number(node.items[i], file_, key, {-most, most}, values[i], faults_)) return false;
      values[i] *= scale_;
    }
    return true;
  }

  bool point3(const Node& node, const std::string& key, Eigen::Vector3d& p) {
    double values[3];
    if (!point(node, key, values, 3)) return false;
    p = {values[0], values[1], values[2]};
    return true;
  }

  void fixture(const Node& node, const std::string& key) {
    Map map(node, file_, key, faults_);
    workpiece::Fixture f;
    const double most = kMaxCoordinateMm / scale_;
    map.number("x", f.x_mm, {-most, most}, Need::Required);
    map.number("y", f.y_mm, {-most, most}, Need::Required);
    f.x_mm *= scale_;
    f.y_mm *= scale_;
    map.number("diameter_mm", f.diameter_mm, {1, 500});
    if (map.text("member", f.member, Need::Required)) known_member(map, "member", f.member);
    map.finish();
    out_.fixtures.push_back(std::move(f));
  }

  void known_member(Map& map, const char* key, const std::string& name) {
    if (member_names_.count(name) != 0) return;
    const std::string near = nearest_word(name, {member_names_.begin(), member_names_.end()});
    map.fault(key, "no member is named '" + name + "'",
              near.empty() ? "name one of the members above" : "did you mean '" + near + "'?");
  }

  void weld(const Node& node, const std::string& key) {
    Map map(node, file_, key, faults_);
    const std::size_t faults_before = faults_.size();
    workpiece::Weld w;
    if (map.text("name", w.name, Need::Required) && !weld_names_.insert(w.name).second) {
      map.fault("name", "two welds are named '" + w.name + "'", "give each its own name");
    }
    if (const Node* joins = map.sequence("joins", Need::Required)) {
      for (const Node& item : joins->items) {
        if (item.kind != Node::Kind::Scalar) {
          map.fault("joins", "holds " + item.describe(), "write the members' names: [a, b]");
          continue;
        }
        known_member(map, "joins", item.text);
        w.joins.push_back(item.text);
      }
      if (joins->items.empty() || joins->items.size() > 8)
        map.fault("joins", "is " + joins->describe(), "name the members it joins");
    }
    if (const Node* path = map.sequence("path", Need::Required)) read_path(map, *path, w);
    map.number("tolerance_mm", w.tolerance_mm, {0.01, 10});
    map.degrees("work_angle_deg", w.work_angle_rad, {-80, 80});
    map.degrees("travel_angle_deg", w.travel_angle_rad, {-60, 60});
    map.finish();
    weld_at_.push_back({node.line, key, faults_.size() == faults_before});
    out_.welds.push_back(std::move(w));
  }

  void read_path(Map& weld_map, const Node& path, workpiece::Weld& w) {
    const std::string key = weld_map.dotted("path");
    if (path.items.size() < 2 || path.items.size() > kMaxVertices) {
      weld_map.fault("path", fmt::format("has {} points", path.items.size()), "write two at least");
      return;
    }
    point3(path.items[0], key + "[0]", w.start);
    for (std::size_t i = 1; i < path.items.size(); ++i) {
      const Node& item = path.items[i];
      const std::string item_key = fmt::format("{}[{}]", key, i);
      workpiece::SeamPiece piece;
      if (item.kind == Node::Kind::Map) {
        Map arc(item, file_, item_key, faults_);
        piece.arc = true;
        if (const Node* via = arc.sequence("via", Need::Required)) point3(*via, item_key + ".via", piece.via);
        if (const Node* to = arc.sequence("to", Need::Required)) point3(*to, item_key + ".to", piece.to);
        arc.finish();
      } else {
        point3(item, item_key, piece.to);
      }
      w.pieces.push_back(piece);
    }
  }

  /// What the workpiece's own rules say, one member and one weld at a time, so that each fault has its line.
  void check_geometry(Map& map) {
    const double height_mm = out_.height_mm > 0 ? out_.height_mm : 1;
    for (std::size_t i = 0; i < out_.members.size(); ++i) {
      if (!member_at_[i].sound) continue;
      member_at_[i].sound = refused(member_at_[i], {"w", height_mm, {out_.members[i]}, {}, {}}) == false;
    }
    for (std::size_t i = 0; i < out_.welds.size(); ++i) {
      if (!weld_at_[i].sound) continue;
      workpiece::Workpiece alone{"w", height_mm, {}, {}, {out_.welds[i]}};
      bool sound = true;
      for (std::size_t m = 0; m < out_.members.size(); ++m) {
        const auto& joins = out_.welds[i].joins;
        if (std::find(joins.begin(), joins.end(), out_.members[m].name) == joins.end()) continue;
        sound = sound && member_at_[m].sound;
        alone.members.push_back(out_.members[m]);
      }
      if (sound) refused(weld_at_[i], std::move(alone));
    }
    if (!faults_.empty()) return;
    auto whole = workpiece::validated(std::move(out_));
    if (whole.ok()) {
      out_ = std::move(whole).value();
    } else {
      fault(map.line(), "workpiece", whole.error().what, whole.error().mend);
    }
  }

  struct Place {
    int line = 0;
    std::string key;
    bool sound = false;
  };

  bool refused(const Place& place, workpiece::Workpiece part) {
    const auto result = workpiece::validated(std::move(part));
    if (!result.ok()) fault(place.line, place.key, result.error().what, result.error().mend);
    return !result.ok();
  }

  bool fault(int line, const std::string& key, std::string what, std::string mend) {
    faults_.push_back({file_, line, key, std::move(what), std::move(mend)});
    return false;
  }

  std::string file_;
  Faults& faults_;
  double scale_ = 1;
  workpiece::Workpiece out_;
  std::set<std::string> member_names_, weld_names_;
  std::vector<Place> member_at_, weld_at_;
};

}  // namespace

std::variant<workpiece::Workpiece, Faults> parse_workpiece(std::string_view text, const std::string& name) {
  auto document = parse_document(text, name);
  if (auto* faults = std::get_if<Faults>(&document)) return std::move(*faults);
  Faults faults;
  Map top(std::get<Node>(document), name, "", faults);
  workpiece::Workpiece out;
  if (const Node* node = top.node("workpiece", Need::Required)) {
    Map map(*node, name, "", faults);
    if (node->kind == Node::Kind::Map) out = WorkpieceReader(name, faults).read(map);
  }
  top.finish();
  if (!faults.empty()) return in_order(std::move(faults));
  return out;
}

std::variant<workpiece::Workpiece, Faults> read_workpiece_file(const std::string& path) {
  auto text = read_text_file(path);
  if (auto* faults = std::get_if<Faults>(&text)) return std::move(*faults);
  return parse_workpiece(std::get<std::string>(text), path);
}

}  // namespace weldcell::files
