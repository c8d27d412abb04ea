// weldcell arm against the reference vectors, through the shipped arm files.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>

#include "app/commands.hpp"

namespace weldcell::app {
namespace {

struct Outcome {
  int code = 0;
  std::string out, err;
};

Outcome run(const std::vector<std::string>& arguments) {
  std::vector<const char*> raw;
  for (const std::string& a : arguments) raw.push_back(a.c_str());
  ::testing::internal::CaptureStdout();
  ::testing::internal::CaptureStderr();
  Outcome result;
  result.code = command_arm(raw);
  std::fflush(stdout);
  result.out = ::testing::internal::GetCapturedStdout();
  result.err = ::testing::internal::GetCapturedStderr();
  return result;
}

const std::string kRobots = WELDCELL_CONFIG "/robots";

using Row = std::map<std::string, double>;

std::vector<Row> table(std::istream& in) {
  std::string line, field;
  std::vector<std::string> names;
  std::getline(in, line);
  for (std::stringstream header(line); std::getline(header, field, ',');) names.push_back(field);
  std::vector<Row> rows;
  while (std::getline(in, line)) {
    std::stringstream fields(line);
    rows.emplace_back();
    for (const std::string& name : names) {
      std::getline(fields, field, ',');
      rows.back()[name] = std::stod(field);
    }
  }
  return rows;
}
std::vector<Row> table(const std::string& text) {
  std::stringstream in(text);
  return table(in);
}

class TemporaryFile {
 public:
  explicit TemporaryFile(const std::string& text) {
    static int count = 0;
    path_ = ::testing::TempDir() + "weldcell_arm_" + std::to_string(++count) + ".csv";
    std::ofstream(path_) << text;
  }
  ~TemporaryFile() { std::filesystem::remove(path_); }
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

TEST(CommandArm, ForwardAgreesWithTheReferenceOfEveryModel) {
  int models = 0;
  for (const auto& entry : std::filesystem::directory_iterator(WELDCELL_TEST_DATA "/kinematics")) {
    if (entry.path().extension() != ".csv") continue;
    const std::string model = entry.path().stem();
    SCOPED_TRACE(model);
    ++models;
    std::ifstream file(entry.path());
    const std::vector<Row> expected = table(file);
    const Outcome fk = run({"--model", model, "--robots", kRobots, "--fk", entry.path()});
    ASSERT_EQ(fk.code, 0) << fk.err;
    std::vector<Row> own = table(fk.out);
    ASSERT_EQ(own.size(), expected.size());
    for (std::size_t i = 0; i < own.size(); ++i) {
      for (const char* axis : {"x_mm", "y_mm", "z_mm"}) EXPECT_NEAR(own[i][axis], expected[i].at(axis), 1e-6);
      for (const auto& [mine, theirs] : std::map<std::string, std::string>{
               {"qw", "q1_w"}, {"qx", "q2_x"}, {"qy", "q3_y"}, {"qz", "q4_z"}}) {
        EXPECT_NEAR(own[i][mine], expected[i].at(theirs), 1e-9);
      }
    }
    // Back again: the joints are among the solutions of their row.
    const TemporaryFile poses(fk.out);
    const Outcome ik = run({"--model", model, "--robots", kRobots, "--ik", poses.path()});
    ASSERT_EQ(ik.code, 0) << ik.err;
    std::vector<int> found(expected.size(), 0);
    for (Row& solution : table(ik.out)) {
      const auto row = static_cast<std::size_t>(solution["row"]) - 1;
      double worst = 0;
      for (const char* j : {"j1_deg", "j2_deg", "j3_deg", "j4_deg", "j5_deg", "j6_deg"}) {
        worst = std::max(worst, std::abs(solution[j] - expected[row].at(j)));
      }
      found[row] += worst < 1e-4;
    }
    for (std::size_t i = 0; i < found.size(); ++i) {
      const bool singular = std::abs(expected[i].at("j5_deg")) < 1e-6;
      EXPECT_TRUE(found[i] == 1 || singular) << "row " << i + 1;
    }
  }
  EXPECT_EQ(models, 7);
}

TEST(CommandArm, EveryShippedArmReadsAndStandsAtItsZero) {
  const TemporaryFile zeros("j1_deg,j2_deg,j3_deg,j4_deg,j5_deg,j6_deg\n0,0,0,0,0,0\n");
  int models = 0;
  for (const auto& entry : std::filesystem::directory_iterator(kRobots)) {
    const std::string model = entry.path().stem();
    const Outcome fk = run({"--model", model, "--robots", kRobots, "--fk", zeros.path()});
    ASSERT_EQ(fk.code, 0) << model << ": " << fk.err;
    Row pose = table(fk.out).at(0);
    EXPECT_NEAR(pose["qw"], std::sqrt(0.5), 1e-9) << model;
    EXPECT_NEAR(pose["qy"], std::sqrt(0.5), 1e-9) << model;
    EXPECT_NEAR(pose["y_mm"], 0, 1e-9) << model;
    ++models;
  }
  EXPECT_GE(models, 18);
}

TEST(CommandArm, TellsWhatIsWrong) {
  const TemporaryFile no_column("j1_deg,j2_deg\n0,0\n"),
      no_number("j1_deg,j2_deg,j3_deg,j4_deg,j5_deg,j6_deg\n0,0,x,0,0,0\n"),
      no_unit("x_mm,y_mm,z_mm,qw,qx,qy,qz\n1000,0,1000,1,1,0,0\n"),
      out_of_reach("x_mm,y_mm,z_mm,qw,qx,qy,qz\n9000,0,0,1,0,0,0\n");
  const std::string model = "irb2600_12_185";
  Outcome r = run({"--model", model, "--robots", kRobots, "--fk", no_column.path()});
  EXPECT_EQ(r.code, 2);
  EXPECT_NE(r.err.find(":1: j3_deg"), std::string::npos) << r.err;
  r = run({"--model", model, "--robots", kRobots, "--fk", no_number.path()});
  EXPECT_EQ(r.code, 2);
  EXPECT_NE(r.err.find(":2: j3_deg: 'x'"), std::string::npos) << r.err;
  r = run({"--model", model, "--robots", kRobots, "--ik", no_unit.path()});
  EXPECT_EQ(r.code, 2);
  EXPECT_NE(r.err.find("unit quaternion"), std::string::npos) << r.err;
  r = run({"--model", model, "--robots", kRobots, "--ik", out_of_reach.path()});
  EXPECT_EQ(r.code, 0);
  EXPECT_TRUE(table(r.out).empty()) << "a pose out of reach has no solutions, and that is no fault";
  EXPECT_EQ(run({"--model", "irb9", "--robots", kRobots, "--fk", no_column.path()}).code, 2);
  EXPECT_EQ(run({"--model", model, "--fk", "--ik", no_column.path()}).code, 2);
  EXPECT_EQ(run({"--model", model, "--fk"}).code, 2);
  EXPECT_EQ(run({"--model", model, "--fk", "/nowhere/joints.csv"}).code, 2);
  EXPECT_EQ(run({"--help"}).code, 0);
}

}  // namespace
}  // namespace weldcell::app
