#include "weldcell/files/schema.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>

#include "weldcell/base/units.hpp"

namespace weldcell::files {

namespace {

std::size_t edit_distance(const std::string& a, const std::string& b) {
  std::vector<std::size_t> row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) row[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t change = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
      diagonal = row[j];
      row[j] = std::min({row[j] + 1, row[j - 1] + 1, change});
    }
  }
  return row[b.size()];
}

std::string words(const std::vector<std::string>& known) {
  std::string out;
  for (const std::string& word : known) out += (out.empty() ? "" : ", ") + word;
  return out;
}

std::string range_words(Range range) {
  const double unlimited = std::numeric_limits<double>::max();
  if (range.min == -unlimited) return fmt::format("at most {:g}", range.max);
  if (range.max == unlimited) return fmt::format("at least {:g}", range.min);
  return fmt::format("{:g} to {:g}", range.min, range.max);
}

bool looks_infinite(std::string word) {
  if (!word.empty() && (word[0] == '+' || word[0] == '-')) word.erase(0, 1);
  if (!word.empty() && word[0] == '.') word.erase(0, 1);
  std::transform(word.begin(), word.end(), word.begin(),
                 [](char c) { return c >= 'A' && c <= 'Z' ? char(c + 32) : c; });
  return word == "nan" || word == "inf" || word == "infinity";
}

}  // namespace

std::string nearest_word(const std::string& word, const std::vector<std::string>& known) {
  std::string best;
  std::size_t best_distance = (word.size() + 2) / 3 + 1;
  for (const std::string& candidate : known) {
    // A unit left out or the wrong one ("speed", "speed_m_s") is the commonest slip with names that carry
    // units.
    const bool stem = (word.size() >= 3 && candidate.rfind(word + "_", 0) == 0) ||
                      word.rfind(candidate + "_", 0) == 0 ||
                      (word.size() >= 4 && candidate.rfind(word, 0) == 0);
    const std::size_t distance = stem ? 1 : edit_distance(word, candidate);
    if (distance < best_distance) {
      best_distance = distance;
      best = candidate;
    }
  }
  return best;
}

bool read_number(const Node& node, const std::string& file, const std::string& key, Range range,
                 double& value, Faults& faults) {
  const auto fault = [&](std::string what, std::string mend) {
    faults.push_back({file, node.line, key, std::move(what), std::move(mend)});
    return false;
  };
  if (node.kind != Node::Kind::Scalar) return fault("is " + node.describe(), "write a number");
  if (node.quoted) return fault("is " + node.describe(), "write the number without quotes");
  const std::string& text = node.text;
  const char* begin = text.data();
  const char* end = begin + text.size();
  if (begin != end && *begin == '+') ++begin;
  if (looks_infinite(text)) return fault(node.describe() + " is not finite", "write a number");
  double number = 0;
  const auto [rest, error] = std::from_chars(begin, end, number);
  if (error == std::errc::result_out_of_range)
    return fault(node.describe() + " is no usable number", "write a number");
  if (error != std::errc{} || rest != end) {
    const bool comma = text.find(',') != std::string::npos;
    return fault("is " + node.describe() + ", not a number",
                 comma ? "use a decimal point" : "write a number; the unit stands in the key's name");
  }
  if (number < range.min || number > range.max) {
    return fault(fmt::format("{} is out of range", text), range_words(range));
  }
  value = number;
  return true;
}

Map::Map(const Node& node, std::string file, std::string key, Faults& faults)
    : node_(&node), file_(std::move(file)), key_(std::move(key)), faults_(&faults) {
  if (node.kind == Node::Kind::Map) return;
  is_map_ = false;
  faults.push_back({file_, node.line, key_, "is " + node.describe(), "write keys and values here"});
}

std::string Map::dotted(const std::string& key) const {
  return key_.empty() || key.empty() ? key_ + key : key_ + "." + key;
}

int Map::line_of(const char* key) const {
  for (const Node::Key& k : node_->keys) {
    if (k.text == key) return k.line;
  }
  return node_->line;
}

bool Map::fault(const char* key, std::string what, std::string mend) {
  return fault_at(line_of(key), dotted(key), std::move(what), std::move(mend));
}

bool Map::fault_at(int line, const std::string& dotted_key, std::string what, std::string mend) {
  faults_->push_back({file_, line, dotted_key, std::move(what), std::move(mend)});
  return false;
}

const Node* Map::node(const char* key, Need need) {
  if (std::find(known_.begin(), known_.end(), key) == known_.end()) known_.emplace_back(key);
  if (!is_map_) return nullptr;
  const Node* found = node_->find(key);
  if (found == nullptr) {
    if (need == Need::Required)
      fault_at(node_->line, dotted(key), "is missing", fmt::format("add '{}:'", key));
    return nullptr;
  }
  if (found->kind == Node::Kind::Null) {
    fault(key, "has no value", need == Need::Required ? "write one" : "write one or remove the key");
    return nullptr;
  }
  return found;
}

const Node* Map::sequence(const char* key, Need need) {
  const Node* found = node(key, need);
  if (found == nullptr || found->kind == Node::Kind::Sequence) return found;
  fault(key, "is " + found->describe(), "write a list: [..., ...]");
  return nullptr;
}

bool Map::number(const char* key, double& value, Range range, Need need) {
  const Node* found = node(key, need);
  return found != nullptr && read_number(*found, file_, dotted(key), range, value, *faults_);
}

bool Map::integer(const char* key, int& value, Range range, Need need) {
  double number_value = 0;
  if (!number(key, number_value, range, need)) return false;
  if (number_value != std::floor(number_value))
    return fault(key, "is not a whole number", "write a whole number");
  value = static_cast<int>(number_value);
  return true;
}

bool Map::boolean(const char* key, bool& value, Need need) {
  const Node* found = node(key, need);
  if (found == nullptr) return false;
  if (found->kind == Node::Kind::Scalar && !found->quoted &&
      (found->text == "true" || found->text == "false")) {
    value = found->text == "true";
    return true;
  }
  return fault(key, "is " + found->describe(), "write true or false");
}

bool Map::text(const char* key, std::string& value, Need need, bool may_be_empty) {
  const Node* found = node(key, need);
  if (found == nullptr) return false;
  if (found->kind != Node::Kind::Scalar)
    return fault(key, "is " + found->describe(), "write one word or text");
  if (found->text.empty() && !may_be_empty) return fault(key, "is empty", "write a text");
  if (found->text.size() > 1000) return fault(key, "is longer than 1000 characters", "shorten it");
  for (const char c : found->text) {
    if (static_cast<unsigned char>(c) < 0x20)
      return fault(key, "holds a control character", "one line of plain text");
  }
  value = found->text;
  return true;
}

bool Map::degrees(const char* key, double& value_rad, Range range, Need need) {
  double value_deg = 0;
  if (!number(key, value_deg, range, need)) return false;
  value_rad = rad(value_deg);
  return true;
}

bool Map::numbers(const char* key, double* values, std::size_t count, Range range, Need need) {
  const Node* list = sequence(key, need);
  if (list == nullptr) return false;
  if (list->items.size() != count) {
    return fault(key, fmt::format("has {} values", list->items.size()), fmt::format("write {}", count));
  }
  bool good = true;
  std::vector<double> read(count);
  for (std::size_t i = 0; i < count; ++i) {
    good =
        read_number(list->items[i], file_, fmt::format("{}[{}]", dotted(key), i), range, read[i], *faults_) &&
        good;
  }
  if (good) std::copy(read.begin(), read.end(), values);
  return good;
}

bool Map::joints_degrees(const char* key, kinematics::Joints& joints, Range range, Need need) {
  kinematics::Joints read{};
  if (!numbers(key, read.data(), read.size(), range, need)) return false;
  for (std::size_t i = 0; i < read.size(); ++i) joints[i] = rad(read[i]);
  return true;
}

void Map::finish() {
  if (!is_map_) return;
  for (const Node::Key& key : node_->keys) {
    if (std::find(known_.begin(), known_.end(), key.text) != known_.end()) continue;
    const std::string near = nearest_word(key.text, known_);
    fault_at(key.line, dotted(key.text), "unknown key",
             near.empty() ? "known here: " + words(known_) : "did you mean '" + near + "'?");
  }
}

bool read_mount(Map& map, Eigen::Isometry3d& pose) {
  const std::size_t faults_before = map.faults().size();
  constexpr Range kReach{-5000, 5000};
  double x = 0, y = 0, z = 0;
  map.number("x_mm", x, kReach, Need::Required);
  map.number("y_mm", y, kReach, Need::Required);
  map.number("z_mm", z, kReach, Need::Required);
  const bool quaternion = map.has("qw") || map.has("qx") || map.has("qy") || map.has("qz");
  const bool angles = map.has("rx_deg") || map.has("ry_deg") || map.has("rz_deg");
  const Need need_q = quaternion && !angles ? Need::Required : Need::Optional;
  double q[4] = {1, 0, 0, 0}, r[3] = {0, 0, 0};
  const char* const q_keys[] = {"qw", "qx", "qy", "qz"};
  const char* const r_keys[] = {"rx_deg", "ry_deg", "rz_deg"};
  for (int i = 0; i < 4; ++i) map.number(q_keys[i], q[i], {-1.001, 1.001}, need_q);
  for (int i = 0; i < 3; ++i) map.degrees(r_keys[i], r[i], {-360, 360});
  if (quaternion && angles)
    map.fault("qw", "the rotation stands twice", "either qw, qx, qy, qz or rx_deg, ry_deg, rz_deg");
  if (!quaternion && !angles) {
    map.fault_at(map.line(), map.dotted("qw"), "the rotation is missing",
                 "qw, qx, qy, qz or rx_deg, ry_deg, rz_deg");
  }
  const double length = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  if (quaternion && map.faults().size() == faults_before && std::abs(length - 1) > 1e-3) {
    map.fault("qw", fmt::format("the quaternion has length {:.4f}", length), "its length must be 1");
  }
  map.finish();
  if (map.faults().size() != faults_before) return false;
  pose = Eigen::Isometry3d::Identity();
  pose.translate(Eigen::Vector3d(x, y, z));
  if (quaternion) {
    pose.rotate(Eigen::Quaterniond(q[0], q[1], q[2], q[3]).normalized());
  } else {
    pose.rotate(Eigen::AngleAxisd(r[2], Eigen::Vector3d::UnitZ()) *
                Eigen::AngleAxisd(r[1], Eigen::Vector3d::UnitY()) *
                Eigen::AngleAxisd(r[0], Eigen::Vector3d::UnitX()));
  }
  return true;
}

}  // namespace weldcell::files
