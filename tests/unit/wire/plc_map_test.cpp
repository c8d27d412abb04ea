#include "weldcell/wire/plc_map.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

namespace weldcell::wire {
namespace {

using ReadWords = std::array<std::uint16_t, kPlcReadWords>;

std::uint16_t offset_of(std::span<const PlcRegister> registers, std::string_view name) {
  for (const PlcRegister& reg : registers) {
    if (reg.name == name) return reg.offset;
  }
  ADD_FAILURE() << "no register " << name;
  return 0;
}

PlcStatus distinct_status() {
  PlcStatus s;
  s.heartbeat = 1001;
  s.command_ack = 1002;
  s.command_result = 2;
  s.state = PackState::Execute;
  s.mode = PackMode::Manual;
  s.phase = 11;
  s.armed = 1;
  s.guide_step = 4;
  s.guide_member = 6;
  s.fault_code = 501;
  s.fault_detail = -70001;
  s.job_number = 1234567;
  s.progress_percent = 42;
  s.x_um = 1200500;
  s.y_um = -350250;
  s.theta_mdeg = -20125;
  s.worst_weld_margin_mm = -0.375F;
  s.seams_done = 7;
  s.fault_severity = PlcSeverity::Fault;
  s.jobs_waiting = 5;
  s.selected_job = -99000;
  return s;
}

bool same(const PlcStatus& a, const PlcStatus& b) {
  return a.heartbeat == b.heartbeat && a.command_ack == b.command_ack &&
         a.command_result == b.command_result && a.state == b.state && a.mode == b.mode &&
         a.phase == b.phase && a.armed == b.armed && a.guide_step == b.guide_step &&
         a.guide_member == b.guide_member && a.fault_code == b.fault_code &&
         a.fault_detail == b.fault_detail && a.job_number == b.job_number &&
         a.progress_percent == b.progress_percent && a.x_um == b.x_um && a.y_um == b.y_um &&
         a.theta_mdeg == b.theta_mdeg && a.worst_weld_margin_mm == b.worst_weld_margin_mm &&
         a.seams_done == b.seams_done && a.fault_severity == b.fault_severity &&
         a.jobs_waiting == b.jobs_waiting && a.selected_job == b.selected_job;
}

TEST(PlcMap, ConstantsStandWhereTheTableSays) {
  const auto abcd = encode_plc_status({}, WordOrder::Abcd);
  const auto cdab = encode_plc_status({}, WordOrder::Cdab);
  const auto real = offset_of(plc_read_registers(), "test_real");
  EXPECT_EQ(abcd[offset_of(plc_read_registers(), "test_word")], 0x1234);
  EXPECT_EQ(abcd[real], 0x42F6);  // 123.456F is 42 F6 E9 79
  EXPECT_EQ(abcd[real + 1], 0xE979);
  EXPECT_EQ(cdab[real], 0xE979);
  EXPECT_EQ(cdab[real + 1], 0x42F6);
  EXPECT_EQ(abcd[offset_of(plc_read_registers(), "map_version")], kPlcMapVersion);
}

TEST(PlcMap, WordOrderShowsInTheTestReal) {
  auto words = encode_plc_status(distinct_status(), WordOrder::Abcd);
  EXPECT_EQ(find_word_order(words), WordOrder::Abcd);
  EXPECT_EQ(find_word_order(encode_plc_status(distinct_status(), WordOrder::Cdab)), WordOrder::Cdab);
  words[2] ^= 1;
  EXPECT_FALSE(find_word_order(words));
  EXPECT_FALSE(find_word_order(ReadWords{}));
}

TEST(PlcMap, LongsAreTwoWordsInTheOrderAsked) {
  PlcStatus status;
  status.job_number = 0x12345678;
  const auto at = offset_of(plc_read_registers(), "job_number");
  const auto abcd = encode_plc_status(status, WordOrder::Abcd),
             cdab = encode_plc_status(status, WordOrder::Cdab);
  EXPECT_EQ(abcd[at], 0x1234);
  EXPECT_EQ(abcd[at + 1], 0x5678);
  EXPECT_EQ(cdab[at], 0x5678);
  EXPECT_EQ(cdab[at + 1], 0x1234);
}

TEST(PlcMap, StatusComesBackWhole) {
  for (const WordOrder order : {WordOrder::Abcd, WordOrder::Cdab}) {
    EXPECT_TRUE(
        same(decode_plc_status(encode_plc_status(distinct_status(), order), order), distinct_status()));
    EXPECT_TRUE(same(decode_plc_status(encode_plc_status({}, order), order), {}));
  }
}

TEST(PlcMap, EveryStatusRegisterIsWrittenByItsOwnField) {
  const auto zero = encode_plc_status({}, WordOrder::Abcd),
             full = encode_plc_status(distinct_status(), WordOrder::Abcd);
  for (const PlcRegister& reg : plc_read_registers()) {
    const std::string_view name = reg.name;
    const bool constant = name == "test_word" || name == "test_real" || name == "map_version";
    const bool two = reg.type != PlcType::Word;
    const bool changed =
        zero[reg.offset] != full[reg.offset] || (two && zero[reg.offset + 1U] != full[reg.offset + 1U]);
    EXPECT_EQ(changed, !constant) << name;
  }
}

TEST(PlcMap, OrderGoldenWords) {
  const PlcOrder order{7, 258, PlcCommand::Confirm, -2};
  const std::array<std::uint16_t, kPlcWriteWords> words{7, 258, 21, 0, 0xFFFF, 0xFFFE, 0, 0, 0, 0};
  EXPECT_EQ(encode_plc_order(order, WordOrder::Abcd), words);
  const PlcOrder back = decode_plc_order(words, WordOrder::Abcd);
  EXPECT_EQ(back.heartbeat, 7);
  EXPECT_EQ(back.command_sequence, 258);
  EXPECT_EQ(back.command, PlcCommand::Confirm);
  EXPECT_EQ(back.job_number, -2);
  EXPECT_EQ(decode_plc_order(encode_plc_order(order, WordOrder::Cdab), WordOrder::Cdab).job_number, -2);
}

TEST(PlcMap, UnknownCommandNumberIsKeptForRefusal) {
  std::array<std::uint16_t, kPlcWriteWords> words{};
  words[2] = 999;
  EXPECT_EQ(static_cast<std::uint16_t>(decode_plc_order(words, WordOrder::Abcd).command), 999);
}

TEST(PlcMap, PageHoldsTheTables) {
  std::ifstream file(std::string(WELDCELL_CONFIG) + "/../docs/PLC.md");
  ASSERT_TRUE(file) << "docs/PLC.md is missing";
  std::stringstream text;
  text << file.rdbuf();
  const std::string page = text.str(), begin = "<!-- registers:begin -->\n", end = "<!-- registers:end -->";
  const auto from = page.find(begin), to = page.find(end);
  ASSERT_NE(from, std::string::npos);
  ASSERT_NE(to, std::string::npos);
  EXPECT_EQ(page.substr(from + begin.size(), to - from - begin.size()), plc_map_markdown())
      << "copy the tables above into docs/PLC.md";
}

}  // namespace
}  // namespace weldcell::wire
