// weldcell arm: joints <-> tool0 poses of an arm model, as CSV.
#include <fmt/format.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <span>
#include <sstream>

#include "app/command_line.hpp"
#include "app/places.hpp"
#include "weldcell/base/units.hpp"
#include "weldcell/files/cell_file.hpp"

namespace weldcell::app {

namespace {

constexpr const char* kUsage =
    "usage: weldcell arm --model NAME (--fk | --ik) FILE.csv|-   [--robots DIR] [--margin DEG]\n"
    "\n"
    "  --fk     columns j1_deg..j6_deg: repeats them with x_mm,y_mm,z_mm,qw,qx,qy,qz,cf1,cf4,cf6,cfx of "
    "tool0\n"
    "  --ik     columns x_mm,y_mm,z_mm,qw,qx,qy,qz: every solution inside the limits, one a line, with the "
    "number of\n"
    "           the input's row (first row 1) in front\n"
    "  --margin room to keep from every joint limit, deg (default 0)\n"
    "  --robots folder of the arm models (default: config/robots)\n"
    "\n"
    "Angles in deg, lengths in mm, quaternion w x y z. '-' is standard input. Exit: 0 done, 2 bad input.\n";

constexpr const char* kJointHeader[] = {"j1_deg", "j2_deg", "j3_deg", "j4_deg", "j5_deg", "j6_deg"};
constexpr const char* kPoseHeader[] = {"x_mm", "y_mm", "z_mm", "qw", "qx", "qy", "qz"};

int fault(const std::string& where, const std::string& what) {
  fmt::print(stderr, "{}: {}\n", where, what);
  return 2;
}

std::vector<std::string> fields_of(const std::string& line) {
  std::vector<std::string> out;
  std::stringstream stream(line);
  std::string field;
  while (std::getline(stream, field, ',')) {
    const auto from = field.find_first_not_of(" \t\r\"");
    const auto to = field.find_last_not_of(" \t\r\"");
    out.push_back(from == std::string::npos ? "" : field.substr(from, to - from + 1));
  }
  return out;
}

/// The named columns of a CSV, in the order asked for.
class Columns {
 public:
  Columns(std::istream& in, std::string name, std::span<const char* const> wanted)
      : in_(in), name_(std::move(name)), wanted_(wanted) {}

  /// False, with the fault told, when the header lacks a column.
  bool header() {
    std::string line;
    if (!next_line(line)) return !fault(name_, "is empty: write a header line");
    const std::vector<std::string> names = fields_of(line);
    for (const char* want : wanted_) {
      std::size_t at = 0;
      while (at < names.size() && names[at] != want) ++at;
      if (at == names.size())
        return !fault(place(), fmt::format("{}: column is missing in the header", want));
      columns_.push_back(at);
    }
    return true;
  }

  /// False at the end, or with `bad` set and the fault told.
  bool row(std::vector<double>& values, bool& bad) {
    std::string line;
    if (!next_line(line)) return false;
    const std::vector<std::string> fields = fields_of(line);
    values.assign(columns_.size(), 0);
    for (std::size_t i = 0; i < columns_.size(); ++i) {
      const std::string text = columns_[i] < fields.size() ? fields[columns_[i]] : "";
      char* end = nullptr;
      values[i] = std::strtod(text.c_str(), &end);
      if (!text.empty() && *end == '\0' && std::isfinite(values[i])) continue;
      fault(place(), fmt::format("{}: '{}' is no number", wanted_[i], text));
      bad = true;
      return false;
    }
    return true;
  }
  std::string place() const { return fmt::format("{}:{}", name_, line_); }

 private:
  bool next_line(std::string& line) {
    while (std::getline(in_, line)) {
      ++line_;
      if (line.find_first_not_of(" \t\r") != std::string::npos) return true;
    }
    return false;
  }

  std::istream& in_;
  std::string name_;
  std::span<const char* const> wanted_;
  std::vector<std::size_t> columns_;
  int line_ = 0;
};

std::string joints_text(const kinematics::Joints& q) {
  std::string out;
  for (const double angle : q) {
    // What would print as -0.000000000 is 0.
    const double shown = std::abs(deg(angle)) < 5e-10 ? 0 : deg(angle);
    out += fmt::format("{}{:.9f}", out.empty() ? "" : ",", shown);
  }
  return out;
}

int forward_rows(const kinematics::ArmModel& arm, Columns& in) {
  fmt::print("{},{},cf1,cf4,cf6,cfx\n", fmt::join(kJointHeader, ","), fmt::join(kPoseHeader, ","));
  std::vector<double> row;
  bool bad = false;
  while (in.row(row, bad)) {
    kinematics::Joints q{};
    for (std::size_t i = 0; i < 6; ++i) q[i] = rad(row[i]);
    const Transform<Base, Flange> pose = kinematics::forward(arm, q);
    Eigen::Quaterniond turn(pose.rotation());
    if (turn.w() < 0) turn.coeffs() = -turn.coeffs();
    const Eigen::Vector3d p = pose.position_mm();
    const kinematics::Configuration cf = kinematics::configuration(arm, q);
    fmt::print("{},{:.9f},{:.9f},{:.9f},{:.12f},{:.12f},{:.12f},{:.12f},{},{},{},{}\n", joints_text(q), p.x(),
               p.y(), p.z(), turn.w(), turn.x(), turn.y(), turn.z(), cf.cf1, cf.cf4, cf.cf6, cf.cfx);
  }
  return bad ? 2 : 0;
}

int inverse_rows(const kinematics::ArmModel& arm, Columns& in, double margin_rad) {
  fmt::print("row,{},cf1,cf4,cf6,cfx\n", fmt::join(kJointHeader, ","));
  std::vector<double> row;
  bool bad = false;
  for (int number = 1; in.row(row, bad); ++number) {
    const Eigen::Quaterniond turn(row[3], row[4], row[5], row[6]);
    if (std::abs(turn.norm() - 1) > 0.01) return fault(in.place(), "qw,qx,qy,qz: is no unit quaternion");
    Transform<Base, Flange> pose;
    pose.iso.linear() = turn.normalized().toRotationMatrix();
    pose.iso.translation() = Eigen::Vector3d(row[0], row[1], row[2]);
    for (const kinematics::Joints& q : kinematics::inverse(arm, pose, kinematics::Joints{}, margin_rad)) {
      const kinematics::Configuration cf = kinematics::configuration(arm, q);
      fmt::print("{},{},{},{},{},{}\n", number, joints_text(q), cf.cf1, cf.cf4, cf.cf6, cf.cfx);
    }
  }
  return bad ? 2 : 0;
}

}  // namespace

int command_arm(Arguments arguments) {
  CommandLine line(arguments, kUsage, {"model", "robots", "margin"}, {"fk", "ik"});
  if (line.exit_code()) return *line.exit_code();
  const std::optional<double> margin_deg = line.number("margin", 0);
  if (!margin_deg) return *line.exit_code();
  if (!line.has("model")) return line.refuse("--model is missing");
  if (line.has("fk") == line.has("ik")) return line.refuse("say either --fk or --ik");
  if (line.plain().size() != 1) return line.refuse("name one CSV file, or - for standard input");

  const std::string file_name = line.value("model") + ".yaml";
  const std::string path =
      line.has("robots") ? line.value("robots") + "/" + file_name : shared_file("robots/" + file_name);
  if (path.empty()) {
    return fault(line.value("model"),
                 "no such arm model in config/robots: name one of its files, or --robots DIR");
  }
  const auto arm = files::read_arm_file(path);
  if (const auto* faults = std::get_if<files::Faults>(&arm)) {
    fmt::print(stderr, "{}\n", files::text(*faults));
    return 2;
  }

  const std::string& input = line.plain().front();
  std::ifstream file;
  if (input != "-") {
    file.open(input);
    if (!file) return fault(input, "cannot be read");
  }
  Columns in(input == "-" ? std::cin : file, input == "-" ? "stdin" : input,
             line.has("fk") ? std::span<const char* const>(kJointHeader)
                            : std::span<const char* const>(kPoseHeader));
  if (!in.header()) return 2;
  const kinematics::ArmModel& model = std::get<kinematics::ArmModel>(arm);
  return line.has("fk") ? forward_rows(model, in) : inverse_rows(model, in, rad(*margin_deg));
}

}  // namespace weldcell::app
