#include "weldcell/files/cell_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "weldcell/base/units.hpp"
#include "weldcell/files/arm_file.hpp"

namespace weldcell::files {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

const std::string kConfig = WELDCELL_CONFIG;

std::string slurp(const std::string& path) {
  std::ifstream in(path);
  std::ostringstream out;
  out << in.rdbuf();
  return out.str();
}

/// The demo cell with one line changed; `from` must stand in it.
std::string demo_with(const std::string& from, const std::string& to) {
  std::string cell = slurp(kConfig + "/cell-demo.yaml");
  const std::size_t at = cell.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return at == std::string::npos ? cell : cell.replace(at, from.size(), to);
}

std::string faults_of(const std::string& cell) {
  const auto read = parse_cell(cell, "cell.yaml", kConfig + "/robots");
  return std::holds_alternative<Faults>(read) ? text(std::get<Faults>(read)) : "";
}

TEST(CellFile, ReadsTheDemoCell) {
  const auto read = read_cell_file(kConfig + "/cell-demo.yaml");
  ASSERT_TRUE(std::holds_alternative<CellConfig>(read)) << text(std::get<Faults>(read));
  const CellConfig& c = std::get<CellConfig>(read);
  EXPECT_EQ(c.setup.name, "demo");
  EXPECT_EQ(c.setup.arm.name, "irb2600_12_185");
  EXPECT_DOUBLE_EQ(c.setup.arm.c2, 900);
  EXPECT_NEAR(c.setup.home[4], kPi / 2, 1e-12);
  EXPECT_EQ(c.egm.port, 6511);
  EXPECT_EQ(c.rws.host, "127.0.0.1");
  EXPECT_TRUE(std::filesystem::exists(c.rws_password_file)) << c.rws_password_file;
  EXPECT_TRUE(c.laser_format.meas28.counter && c.laser_format.meas28.timestamp);
  EXPECT_FALSE(c.laser_format.meas28.status || c.laser_format.meas28.exposure ||
               c.laser_format.meas28.intensity);
  EXPECT_NEAR(c.setup.laser.triangulation_rad, 0.3, 1e-7);
  EXPECT_LT((c.setup.laser.T_flange_laser.position_mm() - Eigen::Vector3d(0, -80, 200)).norm(), 1e-12);
  const Eigen::Matrix3d torch = c.setup.torch.T_flange_torch.rotation();
  EXPECT_LT((torch - Eigen::AngleAxisd(kPi / 4, Eigen::Vector3d::UnitY()).toRotationMatrix()).norm(), 1e-12);
  EXPECT_DOUBLE_EQ(c.setup.table.area.max.x(), 1500);
  EXPECT_EQ(c.spool_dir,
            (std::filesystem::absolute(kConfig) / "../build/demo/spool").lexically_normal().string());
  EXPECT_EQ(c.cad_cache_dir, c.state_dir + "/cad");
  EXPECT_EQ(c.realtime, RealTime::Try);
}

TEST(CellFile, ReadsTheCommentedCell) {
  const auto read = read_cell_file(kConfig + "/cell.yaml");
  ASSERT_TRUE(std::holds_alternative<CellConfig>(read)) << text(std::get<Faults>(read));
}

TEST(CellFile, EulerAnglesTurnAboutFixedAxesXThenYThenZ) {
  const std::string cell =
      demo_with("rx_deg: 0, ry_deg: 45, rz_deg: 0", "rx_deg: 10, ry_deg: 20, rz_deg: 30");
  const auto read = parse_cell(cell, "cell.yaml", kConfig + "/robots");
  ASSERT_TRUE(std::holds_alternative<CellConfig>(read)) << text(std::get<Faults>(read));
  // ABB's Euler ZYX with (30, 20, 10) deg, OrientZYX: w x y z computed by hand from the half angles.
  const Eigen::Quaterniond q(std::get<CellConfig>(read).setup.torch.T_flange_torch.rotation());
  const double sign = q.w() < 0 ? -1 : 1;
  EXPECT_NEAR(sign * q.w(), 0.951549, 1e-6);
  EXPECT_NEAR(sign * q.x(), 0.0381346, 1e-6);
  EXPECT_NEAR(sign * q.y(), 0.189308, 1e-6);
  EXPECT_NEAR(sign * q.z(), 0.239298, 1e-6);
}

TEST(CellFile, NamesEveryFaultWithItsLine) {
  const std::string found = faults_of(demo_with("  rate_hz: 5000\n  latency_ms: 2.7\n",
                                                "  rate_hz: 120000\n  latency: 2.7\n  latency_ms: .nan\n"));
  EXPECT_THAT(found, HasSubstr("laser.rate_hz: 120000 is out of range: 50 to 70000"));
  EXPECT_THAT(found, HasSubstr("laser.latency: unknown key: did you mean 'latency_ms'?"));
  EXPECT_THAT(found, HasSubstr("laser.latency_ms: '.nan' is not finite"));
  EXPECT_THAT(found, HasSubstr("cell.yaml:33: laser.rate_hz"));
}

TEST(CellFile, RefusesAPasswordInTheFile) {
  const std::string found =
      faults_of(demo_with("  user: Default User\n", "  user: Default User\n  password: robotics\n"));
  EXPECT_THAT(found, HasSubstr("rws.password: a password must not stand in a cell file"));
  EXPECT_THAT(found, HasSubstr("0600"));
  EXPECT_THAT(found, Not(HasSubstr("unknown key")));
}

TEST(CellFile, ChecksWhatTwoKeysSayTogether) {
  EXPECT_THAT(faults_of(demo_with("standoff_mm: 230", "standoff_mm: 400")),
              HasSubstr("outside the measuring range"));
  EXPECT_THAT(faults_of(demo_with("home_deg: [0, 0, 0, 0, 90, 0]", "home_deg: [0, 0, 74.5, 0, 90, 0]")),
              HasSubstr("axis 3 at 74.5 deg is outside"));
  EXPECT_THAT(faults_of(demo_with("x_mm: [400, 1500]", "x_mm: [1500, 400]")),
              HasSubstr("table.area.x_mm: is empty"));
  EXPECT_THAT(faults_of(demo_with("qw: 1, qx: 0, qy: 0, qz: 0", "qw: 0.9, qx: 0, qy: 0, qz: 0")),
              HasSubstr("length 0.9000"));
  EXPECT_THAT(faults_of(demo_with("qw: 1, qx: 0, qy: 0, qz: 0", "qw: 1, qx: 0, qy: 0, qz: 0, rx_deg: 3")),
              HasSubstr("stands twice"));
  EXPECT_THAT(
      faults_of(demo_with("y_mm: -80, z_mm: 200, qw: 1, qx: 0, qy: 0, qz: 0", "y_mm: -80, z_mm: 200")),
      HasSubstr("the rotation is missing"));
}

TEST(CellFile, TheToolsNameMustBeARapidName) {
  for (const char* bad : {"1tool", "tool-1", "\"t t\"", "_t"}) {
    EXPECT_THAT(faults_of(demo_with("torch_tool: tWeldcellTorch", std::string("torch_tool: ") + bad)),
                HasSubstr("weld.torch_tool"))
        << bad;
  }
}

TEST(CellFile, ReadsAddresses) {
  EXPECT_EQ(faults_of(demo_with("listen: 127.0.0.1:6511", "listen: 127.0.0.1:0")), "");
  EXPECT_EQ(faults_of(demo_with("listen: 127.0.0.1:6511", "listen: \"[::1]:6511\"")), "");
  for (const char* bad :
       {"6511", "127.0.0.1", "127.0.0.1:65536", "127.0.0.1:-1", ":6511", "a b:1", "::1:6511", "x:1x"}) {
    EXPECT_THAT(faults_of(demo_with("listen: 127.0.0.1:6511", std::string("listen: \"") + bad + "\"")),
                HasSubstr("egm.listen"))
        << bad;
  }
}

TEST(CellFile, SuggestsTheArmThatIsMeant) {
  EXPECT_THAT(faults_of(demo_with("model: irb2600_12_185", "model: irb2600_12_186")),
              HasSubstr("did you mean 'irb2600_1"));
  EXPECT_THAT(faults_of(demo_with("model: irb2600_12_185", "model: ../cell")),
              HasSubstr("robot.model: no arm model"));
}

TEST(ArmFile, EveryArmOfTheConfigurationReads) {
  int arms = 0;
  for (const auto& entry : std::filesystem::directory_iterator(kConfig + "/robots")) {
    const auto read = read_arm_file(entry.path().string());
    ASSERT_TRUE(std::holds_alternative<kinematics::ArmModel>(read)) << text(std::get<Faults>(read));
    EXPECT_EQ(std::get<kinematics::ArmModel>(read).name, entry.path().stem().string());
    ++arms;
  }
  EXPECT_GE(arms, 10);
}

TEST(ArmFile, SaysWhatIsWrong) {
  const std::string good = slurp(kConfig + "/robots/irb2600_12_185.yaml");
  const auto changed = [&](const std::string& from, const std::string& to) {
    std::string arm = good;
    const std::size_t at = arm.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    const auto read = parse_arm(arm.replace(at, from.size(), to), "arm.yaml");
    return std::holds_alternative<Faults>(read) ? text(std::get<Faults>(read)) : std::string();
  };
  EXPECT_THAT(changed("[-95, 155]", "[155, -95]"), HasSubstr("arm.limits_deg[1]: lower is not below upper"));
  EXPECT_THAT(changed("sign: [1, 1", "sign: [1, 0"), HasSubstr("arm.sign: each sign is 1 or -1"));
  EXPECT_THAT(changed("c2: 900", "c2: -900"), HasSubstr("arm.lengths_mm.c2: -900 is out of range"));
  EXPECT_THAT(changed("c2: 900, ", ""), HasSubstr("arm.lengths_mm.c2: is missing: add 'c2:'"));
  EXPECT_THAT(changed("max_speed_deg_s: [175, ", "max_speed_deg_s: ["), HasSubstr("has 5 values: write 6"));
}

TEST(CellFile, ReadsEveryLaserDialect) {
  const auto format_of = [](const std::string& lines) {
    const auto read = parse_cell(demo_with("  dialect: meas28\n", lines), "cell.yaml", kConfig + "/robots");
    EXPECT_TRUE(std::holds_alternative<CellConfig>(read)) << text(std::get<Faults>(read));
    return std::get<CellConfig>(read).laser_format;
  };
  const std::string old_frame = "  frame: [counter, timestamp]\n", command_port = "  command_port: 10241\n";
  EXPECT_EQ(format_of("").dialect, wire::LaserDialect::Meas28);
  EXPECT_EQ(format_of("  dialect: meas28\n").dialect, wire::LaserDialect::Meas28);
  const auto with = [&](const std::string& lines) {
    std::string cell = demo_with("  dialect: meas28\n", lines);
    cell.erase(cell.find(old_frame), old_frame.size());
    cell.erase(cell.find(command_port), command_port.size());
    const auto read = parse_cell(cell, "cell.yaml", kConfig + "/robots");
    EXPECT_TRUE(std::holds_alternative<CellConfig>(read)) << text(std::get<Faults>(read));
    return std::get<CellConfig>(read).laser_format;
  };
  wire::LaserFormat f = with("  dialect: data28\n  frame: [other, distance, timestamp]\n");
  EXPECT_EQ(f.dialect, wire::LaserDialect::Data28);
  EXPECT_EQ(f.words, 3U);
  EXPECT_EQ(f.distance_word, 1U);
  EXPECT_EQ(f.timestamp_word, 2);
  f = with("  dialect: meas32\n  frame: [other, distance]\n  raw_min: 15853\n  raw_max: 3261\n");
  EXPECT_EQ(f.dialect, wire::LaserDialect::Meas32);
  EXPECT_EQ(f.words, 2U);
  EXPECT_EQ(f.distance_word, 1U);
  EXPECT_DOUBLE_EQ(f.raw_min, 15853);
  EXPECT_DOUBLE_EQ(f.raw_max, 3261);
  EXPECT_DOUBLE_EQ(f.range_mm, 200);
  for (const char* name : {"two_byte", "three_byte"}) {
    f = with(std::string("  dialect: ") + name + "\n");
    EXPECT_STREQ(wire::to_string(f.dialect), name);
    EXPECT_DOUBLE_EQ(f.range_mm, 200);
    EXPECT_DOUBLE_EQ(f.rate_hz, 5000);
    EXPECT_EQ(wire::laser_format_fault(f), nullptr);
  }
}

TEST(CellFile, WhereTheLasersCommandsAreTaken) {
  const auto read = [](const std::string& dialect, const std::string& frame, const std::string& port) {
    std::string cell = demo_with("  dialect: meas28\n", "  dialect: " + dialect + "\n");
    for (const auto& [old, now] : {std::pair{std::string("  frame: [counter, timestamp]\n"), frame},
                                   {std::string("  command_port: 10241\n"), port}})
      cell.replace(cell.find(old), old.size(), now);
    return parse_cell(cell, "cell.yaml", kConfig + "/robots");
  };
  const auto config = [&](const std::string& dialect, const std::string& frame, const std::string& port) {
    const auto got = read(dialect, frame, port);
    EXPECT_TRUE(std::holds_alternative<CellConfig>(got)) << text(std::get<Faults>(got));
    return std::get<CellConfig>(got);
  };
  EXPECT_EQ(config("meas28", "", "").laser_command_port, 23);
  EXPECT_EQ(config("meas28", "", "").laser_commands, LaserCommands::Port);
  EXPECT_EQ(config("data28", "", "  command_port: 2300\n").laser_command_port, 2300);
  EXPECT_EQ(config("meas28", "", "  command_port: none\n").laser_commands, LaserCommands::None);
  EXPECT_EQ(config("two_byte", "", "").laser_commands, LaserCommands::InStream);
  EXPECT_EQ(config("three_byte", "", "  command_port: none\n").laser_commands, LaserCommands::None);
  EXPECT_EQ(config("three_byte", "", "  command_port: in_stream\n").laser_commands, LaserCommands::InStream);
  EXPECT_FALSE(config("three_byte", "", "  password_file: laser-password\n").laser_password_file.empty());

  const auto fault = [&](const std::string& dialect, const std::string& frame, const std::string& port) {
    const auto got = read(dialect, frame, port);
    EXPECT_TRUE(std::holds_alternative<Faults>(got));
    return std::holds_alternative<Faults>(got) ? text(std::get<Faults>(got)) : std::string();
  };
  EXPECT_THAT(fault("meas28", "", "  command_port: in_stream\n"), HasSubstr("usually 23, or none"));
  EXPECT_THAT(fault("meas28", "", "  command_port: 70000\n"), HasSubstr("'70000' is no way"));
  EXPECT_THAT(fault("two_byte", "", "  command_port: 23\n"), HasSubstr("in_stream, where the device server"));
  EXPECT_THAT(fault("two_byte", "", "  password_file: x\n"), HasSubstr("know no login"));
  EXPECT_THAT(fault("od5000", "  listen: 127.0.0.1:0\n", "  command_port: none\n"),
              HasSubstr("address is its command port"));
}

}  // namespace
}  // namespace weldcell::files
