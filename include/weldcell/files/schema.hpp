// A strict reader of one YAML mapping: every fault is collected with its line, key and mend, none stops the
// reading. No file.
#pragma once

#include <limits>
#include <string>
#include <vector>

#include "weldcell/files/document.hpp"
#include "weldcell/geometry/transform.hpp"
#include "weldcell/kinematics/arm_model.hpp"

namespace weldcell::files {

enum class Need { Optional, Required };

/// Both ends belong to it.
struct Range {
  double min = -std::numeric_limits<double>::max();
  double max = std::numeric_limits<double>::max();
};

/// One word that stands for a value.
template <typename T>
struct Choice {
  const char* word;
  T value;
};

/// One mapping. Every read leaves the value as it was when the key is absent or faulty, so a field's default
/// stands in the struct; true = present and right. finish() then finds the keys that nobody asked for.
class Map {
 public:
  /// `key` is the dotted name of this mapping, "" for the file's top. A node that is no mapping is a fault.
  Map(const Node& node, std::string file, std::string key, Faults& faults);

  bool number(const char* key, double& value, Range range = {}, Need need = Need::Optional);
  bool integer(const char* key, int& value, Range range, Need need = Need::Optional);
  bool boolean(const char* key, bool& value, Need need = Need::Optional);
  /// Any scalar, unchanged. Empty text is a fault unless `may_be_empty`.
  bool text(const char* key, std::string& value, Need need = Need::Optional, bool may_be_empty = false);
  /// A key in degrees, kept in radians; range in degrees.
  bool degrees(const char* key, double& value_rad, Range range, Need need = Need::Optional);
  /// A list of exactly `count` numbers.
  bool numbers(const char* key, double* values, std::size_t count, Range range = {},
               Need need = Need::Optional);
  /// Six numbers in degrees, kept in radians.
  bool joints_degrees(const char* key, kinematics::Joints& joints, Range range, Need need = Need::Optional);

  template <typename T, std::size_t N>
  bool choice(const char* key, T& value, const Choice<T> (&choices)[N], Need need = Need::Optional) {
    std::string word;
    if (!text(key, word, need)) return false;
    std::string words;
    for (const Choice<T>& c : choices) {
      if (word == c.word) {
        value = c.value;
        return true;
      }
      words += (words.empty() ? "" : ", ") + std::string(c.word);
    }
    return fault(key, "'" + word + "' is no choice", "one of " + words);
  }

  /// The raw value, for what the readers above do not cover; nullptr when absent (a fault when required). An
  /// empty value ("key:" with nothing behind it) counts as absent with a fault.
  const Node* node(const char* key, Need need = Need::Optional);
  const Node* sequence(const char* key, Need need = Need::Optional);

  /// Adds a fault at a key of this mapping (or at the mapping itself when it has no such key). Returns false.
  bool fault(const char* key, std::string what, std::string mend);
  bool fault_at(int line, const std::string& dotted_key, std::string what, std::string mend);
  /// Unknown keys, each with the known one that is nearest.
  void finish();

  bool has(const char* key) const { return node_->find(key) != nullptr; }
  /// "parent.child".
  std::string dotted(const std::string& key) const;
  int line() const { return node_->line; }
  int line_of(const char* key) const;
  const std::string& file() const { return file_; }
  Faults& faults() { return *faults_; }

 private:
  bool is_map_ = true;
  const Node* node_;
  std::string file_, key_;
  Faults* faults_;
  std::vector<std::string> known_;
};

/// The number in a scalar; a fault (and false) for text, quoted numbers, NaN, infinity and values outside the
/// range.
bool read_number(const Node& node, const std::string& file, const std::string& key, Range range,
                 double& value, Faults& faults);

/// A mount as x_mm, y_mm, z_mm with either qw, qx, qy, qz (ABB's order) or rx_deg, ry_deg, rz_deg: R = Rz Ry
/// Rx, the axes fixed (ABB's Euler ZYX). The quaternion must be of length 1 within 1e-3 and is normalized.
bool read_mount(Map& map, Eigen::Isometry3d& pose);

/// The nearest of the known words, "" when none is near: for 'did you mean'.
std::string nearest_word(const std::string& word, const std::vector<std::string>& known);

}  // namespace weldcell::files
