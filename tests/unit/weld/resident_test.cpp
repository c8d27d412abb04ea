// The shipped RAPID files against each other and against what the daemon relies on.
#include "weldcell/weld/resident.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <regex>
#include <set>
#include <sstream>

#include "test_cell.hpp"

namespace weldcell::weld {
namespace {

std::string shipped(const std::string& name) {
  std::ifstream in(std::string(WELDCELL_CONFIG) + "/rapid/" + name, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  EXPECT_TRUE(in.good()) << name;
  return text.str();
}

/// Without comments, blanks at the ends and empty lines.
std::vector<std::string> statements(const std::string& module) {
  std::vector<std::string> out;
  std::istringstream lines(module);
  for (std::string line; std::getline(lines, line);) {
    const std::size_t begin = line.find_first_not_of(' ');
    if (begin == std::string::npos || line[begin] == '!') continue;
    out.push_back(line.substr(begin));
  }
  return out;
}

bool declares(const std::string& module, const std::string& text) {
  for (const std::string& line : statements(module)) {
    if (line.rfind(text, 0) == 0) return true;
  }
  return false;
}

/// The value behind `key` in a configuration row.
std::string row_value(const std::string& text, const std::string& key) {
  std::smatch found;
  const std::regex value(key + " \"?([^\" \\\\\\n]+)");
  return std::regex_search(text, found, value) ? found[1].str() : "";
}

TEST(Resident, BothGenerationsRunTheSameStatements) {
  for (const char* name : {"WeldcellEgm", "WeldcellMain"}) {
    const std::string mod = shipped(std::string(name) + ".mod"), modx = shipped(std::string(name) + ".modx");
    EXPECT_EQ(statements(mod), statements(modx)) << name;
    for (const std::string& text : {mod, modx}) {
      std::istringstream lines(text);
      for (std::string line; std::getline(lines, line);) {
        EXPECT_LT(line.size(), 255U) << line;
        for (const char c : line) EXPECT_TRUE(c >= ' ' && c < 127) << line;
      }
    }
  }
  EXPECT_NE(shipped("WeldcellEgm.mod").find("689-1"), std::string::npos);
  EXPECT_NE(shipped("WeldcellEgm.modx").find("3124-1"), std::string::npos);
}

TEST(Resident, DeclaresWhatTheDaemonCallsAndReads) {
  const std::string text = shipped("WeldcellEgm.mod");
  EXPECT_TRUE(declares(text, std::string("MODULE ") + kResidentModule));
  EXPECT_TRUE(declares(text, std::string("PROC ") + kMoveRoutine + "()"));
  EXPECT_TRUE(declares(text, std::string("PROC ") + kScanRoutine + "()"));
  EXPECT_TRUE(declares(text, std::string("PERS jointtarget ") + kStartSymbol + ":="));
  EXPECT_TRUE(declares(text, std::string("PERS num ") + kStateSymbol + ":=0;"));
  std::set<int> set;
  const std::regex assigned(std::string(kStateSymbol) + ":=([0-9]+);");
  for (std::sregex_iterator m(text.begin(), text.end(), assigned), end; m != end; ++m)
    set.insert(std::stoi((*m)[1].str()));
  const auto number = [](ResidentState s) { return static_cast<int>(s); };
  EXPECT_EQ(set, (std::set<int>{number(ResidentState::Idle), number(ResidentState::Moving),
                                number(ResidentState::There), number(ResidentState::Following),
                                number(ResidentState::Ended), number(ResidentState::Silent)}));
  EXPECT_TRUE(declares(text, std::string("EGMSetupUC ROB_1,egmWeldcell,\"") + kEgmDevice + "\",\"" +
                                 kEgmDevice + "\"\\Joint"));
}

TEST(Resident, ConfigurationRowsNameTheSameDeviceDataAndPort) {
  const std::string sio = shipped("SIO.cfg"), moc = shipped("MOC.cfg");
  EXPECT_EQ(sio.rfind("SIO:CFG_1.0:6:0::\n", 0), 0U);
  EXPECT_EQ(moc.rfind("MOC:CFG_1.0:6:0::\n", 0), 0U);
  EXPECT_EQ(row_value(sio, "-Name"), kEgmDevice);
  EXPECT_EQ(row_value(sio, "-Type"), "UDPUC");
  EXPECT_EQ(row_value(moc, "-name"), kEgmDevice);
  EXPECT_EQ(row_value(moc, "-ext_motion_level"), "0");
  std::ifstream in(std::string(WELDCELL_CONFIG) + "/cell.yaml");
  std::ostringstream cell;
  cell << in.rdbuf();
  std::smatch listen;
  const std::string text = cell.str();
  ASSERT_TRUE(std::regex_search(text, listen, std::regex("egm:[^]*?listen: ([0-9.]+):([0-9]+)")));
  EXPECT_EQ(row_value(sio, "-RemoteAdress"), listen[1].str());
  EXPECT_EQ(row_value(sio, "-RemotePortNumber"), listen[2].str());
}

TEST(Resident, TakesTheCellsValues) {
  cell::CellSetup cell = test::test_cell();
  cell.egm = {4.0, 0.75, 120, 60};
  cell.torch.mass_kg = 7.25;
  cell.torch.center_of_mass_mm = {10, 0, 120};
  const auto filled = fill_resident(shipped("WeldcellEgm.mod"), cell);
  ASSERT_TRUE(filled.ok()) << filled.error().text();
  EXPECT_TRUE(declares(*filled, "CONST num nWeldcellCommTimeout:=0.75;"));
  EXPECT_TRUE(declares(*filled, "CONST num nWeldcellSpeedDeviation:=120;"));
  EXPECT_TRUE(declares(*filled, "CONST num nWeldcellLowPass:=60;"));
  EXPECT_TRUE(declares(*filled,
                       "PERS tooldata tWeldcellHead:=[TRUE,[[0,0,0],[1,0,0,0]],[7.25,[10,0,120],[1,0,0,0],0,"
                       "0,0]];"));
  cell.torch.center_of_mass_mm = {0, 0, 0};
  EXPECT_NE(fill_resident(shipped("WeldcellEgm.mod"), cell)->find("[7.25,[0,0,1],"), std::string::npos);
  const auto refused = fill_resident("MODULE WeldcellEgm\nENDMODULE\n", cell);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, "rapid.resident");
}

TEST(Resident, ShippedValuesAreTheDefaults) {
  // So that a module loaded by hand does what one that the daemon loads does for a cell of defaults.
  cell::CellSetup cell;
  const auto filled = fill_resident(shipped("WeldcellEgm.mod"), cell);
  ASSERT_TRUE(filled.ok());
  EXPECT_EQ(*filled, shipped("WeldcellEgm.mod"));
}

TEST(Resident, TransmissionRowTakesAddressAndPort) {
  const auto filled = fill_transmission(shipped("SIO.cfg"), "10.1.2.3", 6599);
  ASSERT_TRUE(filled.ok());
  EXPECT_EQ(row_value(*filled, "-RemoteAdress"), "10.1.2.3");
  EXPECT_EQ(row_value(*filled, "-RemotePortNumber"), "6599");
  EXPECT_EQ(fill_transmission("SIO:CFG_1.0:6:0::\n", "10.1.2.3", 6599).error().code, "rapid.configuration");
}

}  // namespace
}  // namespace weldcell::weld
