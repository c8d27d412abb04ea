#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <regex>
#include <sstream>

#include "ladder.hpp"
#include "rapid_lint.hpp"
#include "test_cell.hpp"
#include "weldcell/weld/rapid.hpp"

namespace weldcell::weld {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

struct Made {
  cell::CellSetup cell = test::test_cell();
  workpiece::Workpiece part = test::ladder();
  std::vector<TorchPath> paths;
  std::string text;
  test::Module module;

  explicit Made(const std::string& job = "demo-017") {
    CertifyOptions options;
    options.table_z_mm = cell.table.z_mm;
    auto planned = plan_torch(cell, part, assume_exact(part, {900, 0, rad(8)}, options), cell.home);
    EXPECT_TRUE(planned.ok());
    paths = std::move(planned).value();
    text = rapid_module(cell, job, paths, {.program_version = "0.1.0"});
    module = test::lint(text);
  }
};

Eigen::Quaterniond quaternion(const test::Literal& l) {
  return {l.items[0].number, l.items[1].number, l.items[2].number, l.items[3].number};
}

void expect_same(const test::Declared& declared, const TorchTarget& target) {
  const auto& items = declared.value.items;
  const Eigen::Vector3d p(items[0].items[0].number, items[0].items[1].number, items[0].items[2].number);
  EXPECT_LT((p - target.T_base_torch.position_mm()).norm(), 1e-3) << declared.name;
  EXPECT_LT(quaternion(items[1]).angularDistance(Eigen::Quaterniond(target.T_base_torch.rotation())), 1e-6);
  const kinematics::Configuration c{
      static_cast<int>(items[2].items[0].number), static_cast<int>(items[2].items[1].number),
      static_cast<int>(items[2].items[2].number), static_cast<int>(items[2].items[3].number)};
  EXPECT_EQ(c, target.configuration) << declared.name;
}

TEST(RapidModule, ReadsBackWithoutAFaultAndKeepsEveryTarget) {
  const Made made;
  EXPECT_THAT(made.module.faults, IsEmpty());
  EXPECT_EQ(made.module.name, "WeldcellJob");
  for (std::size_t i = 0; i < made.paths.size(); ++i) {
    const TorchPath& path = made.paths[i];
    const std::string id = "0" + std::to_string(i + 1);
    const auto* over = made.module.find("j" + id + "Over");
    ASSERT_TRUE(over);
    for (std::size_t j = 0; j < 6; ++j) {
      EXPECT_NEAR(over->value.items[0].items[j].number, deg(path.targets[0].joints[j]), 1e-5);
    }
    const auto check = [&](const std::string& name, const TorchTarget& target) {
      const auto* declared = made.module.find("p" + id + name);
      ASSERT_TRUE(declared) << name;
      expect_same(*declared, target);
    };
    check("Approach", path.targets[path.first_seam - 1]);
    check("_001", path.targets[path.first_seam]);
    check("_002", path.targets[path.last_seam]);
    EXPECT_FALSE(made.module.find("p" + id + "_003")) << "a straight seam needs its ends only";
    check("Retract", path.targets[path.last_seam + 1]);
    check("Away", path.targets.back());
  }
}

TEST(RapidModule, DeclaresToolAndCountersAsTheCellStatesThem) {
  const Made made;
  for (const char* name : {"nSeamsDone", "nSeamsBegun", "nSeamsToSkip", "nSeamsAllowed"}) {
    const auto* counter = made.module.find(name);
    ASSERT_TRUE(counter);
    EXPECT_EQ(counter->kind + " " + counter->type + " " + counter->text, "PERS num 0");
  }
  const auto* tool = made.module.find("tWeldcellTorch");
  ASSERT_TRUE(tool);
  const auto& frame = tool->value.items[1];
  EXPECT_DOUBLE_EQ(frame.items[0].items[0].number, 320);
  EXPECT_LT(quaternion(frame.items[1])
                .angularDistance(Eigen::Quaterniond(made.cell.torch.T_flange_torch.rotation())),
            1e-7);
  EXPECT_DOUBLE_EQ(tool->value.items[2].items[0].number, 4.5);
  EXPECT_DOUBLE_EQ(made.module.find("wdWeldcell")->value.items[0].number, made.cell.weld.speed_mm_s);
}

TEST(RapidModule, CountsASeamOnceItsArcIsOutAndSkipsThoseDone) {
  const Made made;
  std::vector<std::string> seam;
  for (const auto& i : made.module.instructions) {
    if (i.routine == "Seam03") seam.push_back(i.text.substr(0, i.text.find(',')));
  }
  EXPECT_THAT(seam, ElementsAre("MoveAbsJ j03Over", "MoveL p03Approach", "nSeamsBegun:=nSeamsDone+1",
                                "ArcLStart p03_001", "ArcLEnd p03_002", "nSeamsDone:=nSeamsDone+1",
                                "MoveL p03Retract", "MoveL p03Away"));
  for (int i = 1; i <= 6; ++i) {
    EXPECT_THAT(made.text, HasSubstr("IF nSeamsToSkip<" + std::to_string(i) +
                                     " THEN\n      WeldcellAwait;\n      Seam0" + std::to_string(i)));
  }
  EXPECT_THAT(made.text, HasSubstr("WHILE nSeamsAllowed<=nSeamsDone DO\n      IF nTenths>=100 THEN"));
  EXPECT_THAT(made.text, HasSubstr("ConfL\\On;"));
  EXPECT_THAT(made.text, HasSubstr("SingArea\\Off;"));
  EXPECT_THAT(made.text, HasSubstr("MoveAbsJ jWeldcellHome,v500,fine"));
}

TEST(RapidModule, AnArcBecomesAsFewLinesAsItsShapeAllows) {
  Made made;
  workpiece::Weld arc = made.part.welds[0];
  arc.start = {60, 0, 40};
  arc.pieces = {{true, {0, 60, 40}, {-60, 0, 40}}};
  made.part.welds = {arc};
  CertifyOptions options;
  options.table_z_mm = 500;
  const auto planned =
      plan_torch(made.cell, made.part, assume_exact(made.part, {900, 0, 0}, options), made.cell.home);
  ASSERT_TRUE(planned.ok()) << planned.error().text();
  const auto module = test::lint(rapid_module(made.cell, "arc", *planned));
  EXPECT_THAT(module.faults, IsEmpty());
  std::vector<Eigen::Vector3d> points;
  for (const auto& d : module.data) {
    if (!std::regex_match(d.name, std::regex("p01_[0-9]{3}"))) continue;
    const auto& p = d.value.items[0].items;
    points.push_back({p[0].number, p[1].number, p[2].number});
  }
  EXPECT_LT(points.size(), planned->front().targets.size() * 6 / 10);
  ASSERT_GT(points.size(), 10u);
  for (std::size_t k = 1; k < points.size(); ++k) {
    const Eigen::Vector3d middle = (points[k] + points[k - 1]) / 2;
    EXPECT_NEAR((middle.head<2>() - Eigen::Vector2d(900, 0)).norm(), 60, 0.08);
  }
}

TEST(RapidModule, ForeignTextCannotBreakOut) {
  const Made made("evil\nENDMODULE \xc3\xa9\x80 \"; " + std::string(300, 'x'));
  EXPECT_THAT(made.module.faults, IsEmpty());
}

TEST(RapidModule, AnEmptyJobGoesHome) {
  const auto module = test::lint(rapid_module(test::test_cell(), "none", {}));
  EXPECT_THAT(module.faults, IsEmpty());
  EXPECT_THAT(module.routines, ElementsAre("WeldcellWeld", "WeldcellAwait"));
}

TEST(ResidentModule, ReadsBackWithoutAFault) {
  for (const char* name : {"WeldcellEgm.mod", "WeldcellEgm.modx", "WeldcellMain.mod", "WeldcellMain.modx"}) {
    std::ifstream file(std::string(WELDCELL_CONFIG) + "/rapid/" + name);
    std::stringstream text;
    text << file.rdbuf();
    const auto module = test::lint(text.str());
    EXPECT_THAT(module.faults, IsEmpty()) << name;
    EXPECT_EQ(module.name, std::string(name).substr(0, std::string(name).find('.')));
  }
}

}  // namespace
}  // namespace weldcell::weld
