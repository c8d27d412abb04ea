// weldcell-cad on the samples, compared with the truth that the CAD system wrote beside them, and on small
// drawings made here.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <random>
#include <sstream>

#include "weldcell/adapters/cad_child.hpp"
#include "weldcell/files/workpiece_file.hpp"

namespace weldcell::adapters {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

const std::string kProgram = std::string(WELDCELL_BIN) + "/weldcell-cad";
const std::string kParts = std::string(WELDCELL_CONFIG) + "/workpieces/";

job::CadImport dxf_options(double radius = 0) { return {"", 40, radius, ""}; }

workpiece::Workpiece import(const std::string& file, const job::CadImport& options = {}) {
  auto read = import_cad(kProgram, file, options, "");
  EXPECT_TRUE(read.ok()) << read.error().text();
  return read.ok() ? std::move(read).value() : workpiece::Workpiece{};
}

std::string refusal(const std::string& file, const job::CadImport& options = {}) {
  const auto read = import_cad_yaml(kProgram, file, options, "");
  return read.ok() ? "" : read.error().text();
}

std::string slurp(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  std::ostringstream out;
  out << in.rdbuf();
  return out.str();
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  EXPECT_NE(text.find(from), std::string::npos) << from;
  for (std::size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size())
    text.replace(at, from.size(), to);
  return text;
}

class CadFiles : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("weldcell-cad-test-" + std::to_string(::getpid()));
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }
  std::string write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name, std::ios::binary) << text;
    return (folder_ / name).string();
  }
  fs::path folder_;
};

double to_boundary(const Polygon& polygon, const Vec2& p) {
  double best = 1e9;
  for (std::size_t i = 0; i < polygon.size(); ++i)
    best = std::min(best, distance(p, {polygon[i], polygon[(i + 1) % polygon.size()]}));
  return best;
}

/// The silhouette fills the solid's box, and the flat top's edges lie where the radius says: on the ends, or
/// one radius in.
void expect_truth(const workpiece::Member& member, const nlohmann::json& truth) {
  SCOPED_TRACE(member.name);
  const Box2 box = bounds(member.outline);
  const auto& b = truth.at("bbox");
  EXPECT_NEAR(box.min.x(), b[0].get<double>(), 0.02);
  EXPECT_NEAR(box.min.y(), b[1].get<double>(), 0.02);
  EXPECT_NEAR(box.max.x(), b[3].get<double>(), 0.02);
  EXPECT_NEAR(box.max.y(), b[4].get<double>(), 0.02);
  EXPECT_NEAR(member.edge_radius_mm, 4, 0.01);
  EXPECT_EQ(member.outline.size(), 4u);
  int checked = 0;
  for (const auto& edge : truth.at("top_edges")) {
    const Vec2 a(edge[0].get<double>(), edge[1].get<double>()),
        c(edge[2].get<double>(), edge[3].get<double>());
    const double d = to_boundary(member.outline, (a + c) / 2);
    EXPECT_TRUE(d < 0.02 || std::abs(d - member.edge_radius_mm) < 0.02) << d;
    EXPECT_TRUE(contains(member.outline, (a + c) / 2) || d < 0.02);
    ++checked;
  }
  EXPECT_EQ(checked, 4);
}

TEST(CadImport, StepAssembliesMatchTheirTruth) {
  const auto truth = nlohmann::json::parse(slurp(std::string(WELDCELL_TEST_DATA) + "/cad/truth.json"));
  for (const auto& [name, members, welds] :
       {std::tuple{"ladder_6x40x40", 6u, 8u}, std::tuple{"mitre_4x40x40", 4u, 4u}}) {
    SCOPED_TRACE(name);
    const workpiece::Workpiece w = import(kParts + name + ".step");
    EXPECT_EQ(w.name, name);
    EXPECT_NEAR(w.height_mm, 40, 0.001);
    ASSERT_EQ(w.members.size(), members);
    for (const workpiece::Member& m : w.members) {
      ASSERT_TRUE(truth.at(name).contains(m.name)) << m.name;
      expect_truth(m, truth.at(name).at(m.name));
    }
    ASSERT_EQ(w.welds.size(), welds);
    for (const workpiece::Weld& weld : w.welds) {
      EXPECT_EQ(weld.joins.size(), 2u);
      EXPECT_DOUBLE_EQ(weld.start.z(), w.height_mm);
      const double length = (weld.pieces.back().to - weld.start).norm();
      EXPECT_NEAR(length, members == 6u ? 40 : 40 * std::sqrt(2), 0.05) << weld.name;
    }
  }
}

/// Same outlines, whatever names and order: the sets of centroids and areas agree.
void expect_same_outlines(const workpiece::Workpiece& a, const workpiece::Workpiece& b) {
  ASSERT_EQ(a.members.size(), b.members.size());
  for (const workpiece::Member& m : a.members) {
    bool found = false;
    for (const workpiece::Member& n : b.members) {
      found = found || ((centroid(m.outline) - centroid(n.outline)).norm() < 0.05 &&
                        std::abs(signed_area(m.outline) - signed_area(n.outline)) < 10);
    }
    EXPECT_TRUE(found) << m.name;
  }
  EXPECT_EQ(a.welds.size(), b.welds.size());
}

TEST(CadImport, EveryFormOfTheSamePartGivesTheSameOutlines) {
  const workpiece::Workpiece ladder = import(kParts + "ladder_6x40x40.step");
  const workpiece::Workpiece flat = import(kParts + "ladder_6x40x40_flat.step");
  EXPECT_EQ(flat.members[0].name, "m1");
  expect_same_outlines(ladder, flat);
  expect_same_outlines(ladder, import(kParts + "ladder_6x40x40_lwpoly.dxf", dxf_options(4)));
  const workpiece::Workpiece inserts = import(kParts + "ladder_insert.dxf", dxf_options(4));
  EXPECT_EQ(inserts.members[0].name, "RAIL_1");
  EXPECT_EQ(inserts.members[5].name, "RUNG_4");
  expect_same_outlines(ladder, inserts);
  expect_same_outlines(import(kParts + "mitre_4x40x40.step"),
                       import(kParts + "mitre_4x40x40_lwpoly.dxf", dxf_options(4)));
}

TEST(CadImport, ShippedWorkpiecesAreWhatTheImportGives) {
  const auto yaml = import_cad_yaml(kProgram, kParts + "ladder_6x40x40.step", {}, "");
  ASSERT_TRUE(yaml.ok());
  EXPECT_EQ(replaced(*yaml, "name: ladder_6x40x40", "name: ladder"), slurp(kParts + "ladder.yaml"));
}

TEST(CadImport, ADrawingOfTheWholeIsRefusedInWords) {
  EXPECT_THAT(refusal(kParts + "ladder_6x40x40_techdraw.dxf", dxf_options()),
              HasSubstr("draw one closed outline a member"));
}

TEST(CadImport, WhichLineIsDrawnIsFoundOutOrAsked) {
  const std::string mitre = kParts + "mitre_4x40x40_lwpoly.dxf";
  EXPECT_NEAR(bounds(import(mitre, {"", 40, 4, ""}).members[0].outline).max.y(), 40, 1e-6);
  EXPECT_NEAR(bounds(import(mitre, {"", 40, 4, "silhouette"}).members[0].outline).max.y(), 36, 1e-6);
  EXPECT_THAT(refusal(mitre, {"", 60, 4, ""}), HasSubstr("--drawn flat or --drawn silhouette"));
  EXPECT_NEAR(bounds(import(mitre, {"", 60, 4, "flat"}).members[0].outline).max.y(), 40, 1e-6);
}

TEST_F(CadFiles, StepUnitsAreReadOrSaid) {
  const std::string step = slurp(kParts + "mitre_4x40x40.step");
  const std::string metres =
      write("metres.step", replaced(step, "SI_UNIT(.MILLI.,.METRE.)", "SI_UNIT($,.METRE.)"));
  EXPECT_THAT(refusal(metres), HasSubstr("8e+05 x 5e+05 mm"));
  const workpiece::Workpiece said = import(metres, {"mm", 0, 0, ""});
  EXPECT_NEAR(bounds(said.members[0].outline).max.x(), 800, 0.02);
  const std::string centi =
      write("centi.step", replaced(step, "SI_UNIT(.MILLI.,.METRE.)", "SI_UNIT(.CENTI.,.METRE.)"));
  EXPECT_NEAR(bounds(import(centi).members[0].outline).max.x(), 8000, 0.2);
}

TEST_F(CadFiles, BrokenStepFilesAreRefusedNotCrashed) {
  const std::string step = slurp(kParts + "mitre_4x40x40.step");
  for (const double share : {0.02, 0.3, 0.5, 0.9}) {
    const std::string cut =
        write("cut.step", step.substr(0, static_cast<std::size_t>(static_cast<double>(step.size()) * share)));
    EXPECT_NE(refusal(cut), "") << share;
  }
  EXPECT_NE(refusal(write("empty.step", "")), "");
  EXPECT_NE(refusal(write("noise.step", std::string(5000, '\x7f'))), "");
  EXPECT_NE(refusal(write("part.pdf", "x")), "");
}

TEST_F(CadFiles, DamagedFilesEndInAWorkpieceOrOneLine) {
  constexpr unsigned kSeed = 5;
  std::mt19937 random(kSeed);
  int refused = 0;
  for (const char* name : {"mitre_4x40x40.step", "mitre_4x40x40_lwpoly.dxf", "ladder_insert.dxf"}) {
    const std::string whole = slurp(kParts + name);
    for (int round = 0; round < 12; ++round) {
      std::string hurt = whole;
      for (int k = 0; k < 20; ++k) hurt[random() % hurt.size()] = static_cast<char>(random() % 256);
      const std::string file = write(std::string("hurt") + fs::path(name).extension().string(), hurt);
      SCOPED_TRACE("seed " + std::to_string(kSeed) + " " + name + " round " + std::to_string(round));
      const auto read = import_cad_yaml(kProgram, file, dxf_options(), "");
      if (read.ok()) continue;
      ++refused;
      EXPECT_EQ(read.error().code, "cad.refused") << read.error().text();
      EXPECT_EQ(read.error().text().find('\n'), std::string::npos);
    }
  }
  EXPECT_GE(refused, 12);
}

TEST_F(CadFiles, AStepThatLostAReferenceIsRefusedNotShortened) {
  const std::string step = slurp(kParts + "mitre_4x40x40.step");
  const std::size_t at = step.find("EDGE_CURVE('',#");
  ASSERT_NE(at, std::string::npos);
  std::string hurt = step;
  hurt.replace(at, 15, "EDGE_CURVE('',$");
  EXPECT_THAT(refusal(write("lost.step", hurt)), HasSubstr("damaged"));
}

/// A DXF of the given entities and blocks, in millimetres.
std::string dxf(const std::string& entities, const std::string& blocks = "", const std::string& units = "4") {
  return "0\nSECTION\n2\nHEADER\n9\n$INSUNITS\n70\n" + units + "\n0\nENDSEC\n0\nSECTION\n2\nBLOCKS\n" +
         blocks + "0\nENDSEC\n0\nSECTION\n2\nENTITIES\n" + entities + "0\nENDSEC\n0\nEOF\n";
}
std::string line(double x0, double y0, double x1, double y1) {
  std::ostringstream out;
  out << "0\nLINE\n8\nBAR\n10\n" << x0 << "\n20\n" << y0 << "\n11\n" << x1 << "\n21\n" << y1 << "\n";
  return out.str();
}
std::string arc(double cx, double cy, double r, double a0, double a1, const std::string& more = "") {
  std::ostringstream out;
  out << "0\nARC\n8\nBAR\n10\n"
      << cx << "\n20\n"
      << cy << "\n40\n"
      << r << "\n50\n"
      << a0 << "\n51\n"
      << a1 << "\n"
      << more;
  return out.str();
}
std::string insert(const std::string& block, double x, double y, const std::string& more = "") {
  std::ostringstream out;
  out << "0\nINSERT\n8\n0\n2\n" << block << "\n10\n" << x << "\n20\n" << y << "\n" << more;
  return out.str();
}
const std::string kBarBlock =
    "0\nBLOCK\n8\n0\n2\nBAR\n70\n0\n10\n5\n20\n0\n0\nLWPOLYLINE\n8\n0\n90\n4\n70\n1\n10\n5\n20\n0\n10\n105\n2"
    "0\n0\n10\n105\n20\n20\n"
    "10\n5\n20\n20\n0\nENDBLK\n8\n0\n";

TEST_F(CadFiles, LinesAndArcsChainInAnyOrderAndDirection) {
  const workpiece::Workpiece w =
      import(write("slot.dxf", dxf(line(0, 0, 100, 0) + arc(0, 20, 20, 90, 270) + line(0, 40, 100, 40) +
                                   arc(100, 20, 20, 270, 90))),
             dxf_options());
  ASSERT_EQ(w.members.size(), 1u);
  EXPECT_EQ(w.members[0].name, "BAR");
  EXPECT_NEAR(signed_area(w.members[0].outline), 4000 + 400 * M_PI, 5);
  const Box2 box = bounds(w.members[0].outline);
  EXPECT_NEAR(box.min.x(), -20, 0.02);
  EXPECT_NEAR(box.max.x(), 120, 0.02);
}

TEST_F(CadFiles, BulgesOfPolylinesAreArcs) {
  const std::string slot =
      "0\nLWPOLYLINE\n8\nSLOT\n90\n4\n70\n1\n10\n0\n20\n0\n10\n100\n20\n0\n42\n1\n10\n100\n20\n40\n10\n0\n20"
      "\n40\n42\n1\n";
  const workpiece::Workpiece w = import(write("bulge.dxf", dxf(slot)), dxf_options());
  EXPECT_NEAR(signed_area(w.members.at(0).outline), 4000 + 400 * M_PI, 5);
}

TEST_F(CadFiles, BlocksAreScaledTurnedMirroredAndNested) {
  const std::string pair = "0\nBLOCK\n8\n0\n2\nPAIR\n70\n0\n10\n0\n20\n0\n" + insert("BAR", 0, 0) +
                           insert("BAR", 0, 30, "41\n-1\n") + "0\nENDBLK\n8\n0\n";
  const std::string model = insert("PAIR", 1000, 0, "50\n90\n41\n2\n42\n2\n");
  const workpiece::Workpiece w = import(write("nested.dxf", dxf(model, kBarBlock + pair)), dxf_options());
  ASSERT_EQ(w.members.size(), 2u);
  // BAR from its base point: x 0..100, y 0..20; twice as big and turned by 90 deg about (1000, 0).
  const Box2 a = bounds(w.members[0].outline), b = bounds(w.members[1].outline);
  EXPECT_LT((a.min - Vec2(960, 0)).norm(), 1e-6);
  EXPECT_LT((a.max - Vec2(1000, 200)).norm(), 1e-6);
  EXPECT_LT((b.min - Vec2(900, -200)).norm(), 1e-6);
  EXPECT_LT((b.max - Vec2(940, 0)).norm(), 1e-6);
  EXPECT_EQ(w.members[0].name, "BAR_1");
}

TEST_F(CadFiles, EntitiesSeenFromBelowAreMirrored) {
  const std::string slot =
      "0\nLWPOLYLINE\n8\nSLOT\n90\n4\n70\n1\n10\n0\n20\n0\n10\n100\n20\n0\n10\n100\n20\n40\n10\n0\n20\n40\n21"
      "0\n0\n220\n0\n230\n-1\n";
  const Box2 box = bounds(import(write("below.dxf", dxf(slot)), dxf_options()).members.at(0).outline);
  EXPECT_NEAR(box.min.x(), -100, 1e-9);
  EXPECT_NEAR(box.max.x(), 0, 1e-9);
}

TEST_F(CadFiles, InchesScaleAndSmallOpeningsAreLeftOut) {
  const std::string plate =
      "0\nLWPOLYLINE\n8\nPLATE\n90\n4\n70\n1\n10\n0\n20\n0\n10\n20\n20\n0\n10\n20\n20\n8\n10\n0\n20\n8\n"
      "0\nCIRCLE\n8\nPLATE\n10\n5\n20\n4\n40\n1\n";
  const auto yaml = import_cad_yaml(kProgram, write("plate.dxf", dxf(plate, "", "1")), dxf_options(), "");
  ASSERT_TRUE(yaml.ok()) << yaml.error().text();
  EXPECT_THAT(*yaml, HasSubstr("# PLATE: 1 opening(s) inside an outline were left out"));
  EXPECT_THAT(*yaml, HasSubstr("[508, 203.2]"));
}

TEST_F(CadFiles, TheCacheAnswersForTheSameBytesAndOptionsOnly) {
  const std::string cache = (folder_ / "cache").string();
  const std::string file = write("part.dxf", slurp(kParts + "mitre_4x40x40_lwpoly.dxf"));
  const auto first = import_cad_yaml(kProgram, file, dxf_options(4), cache);
  ASSERT_TRUE(first.ok()) << first.error().text();
  const auto again = import_cad_yaml("/bin/false", file, dxf_options(4), cache);
  ASSERT_TRUE(again.ok());
  EXPECT_EQ(*again, *first);
  EXPECT_FALSE(import_cad_yaml("/bin/false", file, dxf_options(0), cache).ok());
  std::ofstream(file, std::ios::app) << "999\nchanged\n";
  EXPECT_FALSE(import_cad_yaml("/bin/false", file, dxf_options(4), cache).ok());
  // An entry that was spoilt is not believed.
  write("part.dxf", slurp(kParts + "mitre_4x40x40_lwpoly.dxf"));
  for (const auto& entry : fs::directory_iterator(cache))
    std::ofstream(entry.path()) << "workpiece: {name: x\n";
  EXPECT_FALSE(import_cad_yaml("/bin/false", file, dxf_options(4), cache).ok());
  EXPECT_TRUE(import_cad_yaml(kProgram, file, dxf_options(4), cache).ok());
}

TEST_F(CadFiles, AChildThatHangsOrLiesIsTold) {
  const std::string file = write("part.dxf", "x");
  const auto script = [&](const std::string& text) {
    const std::string path = write("reader", "#!/bin/sh\n" + text + "\n");
    fs::permissions(path, fs::perms::owner_all);
    return path;
  };
  CadRequest request;
  request.file = file;
  request.timeout_s = 1;
  request.program = script("sleep 100");
  EXPECT_THAT(import_cad_yaml(request).error().text(), HasSubstr("longer than 1 s"));
  request.program = script("kill -ABRT $$");
  EXPECT_EQ(import_cad_yaml(request).error().code, "cad.crashed");
  request.program = script("echo 'workpiece: {name: x}'");
  EXPECT_EQ(import_cad_yaml(request).error().code, "cad.output");
  request.program = (folder_ / "nowhere").string();
  EXPECT_EQ(import_cad_yaml(request).error().code, "cad.program");
}

}  // namespace
}  // namespace weldcell::adapters
