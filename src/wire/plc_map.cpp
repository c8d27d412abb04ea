#include "weldcell/wire/plc_map.hpp"

#include <bit>
#include <type_traits>

namespace weldcell::wire {
namespace {

/// One register with its codec: how its bits are taken from, and given to, the struct.
template <typename Image>
struct Row {
  PlcRegister reg;
  std::uint32_t (*get)(const Image&);
  void (*set)(Image&, std::uint32_t);
};

template <typename T>
constexpr PlcType type_of() {
  if constexpr (std::is_same_v<T, float>)
    return PlcType::Real;
  else if constexpr (std::is_same_v<T, std::int32_t>)
    return PlcType::Long;
  else {
    static_assert(sizeof(T) == 2, "a register is a word, a long or a real");
    return PlcType::Word;
  }
}

template <typename Image, typename T, T Image::*Field>
struct Codec {
  static std::uint32_t get(const Image& image) {
    if constexpr (std::is_same_v<T, float>)
      return std::bit_cast<std::uint32_t>(image.*Field);
    else
      return static_cast<std::uint32_t>(image.*Field);
  }
  static void set(Image& image, std::uint32_t bits) {
    if constexpr (std::is_same_v<T, float>)
      image.*Field = std::bit_cast<float>(bits);
    else if constexpr (std::is_same_v<T, std::int32_t>)
      image.*Field = static_cast<std::int32_t>(bits);
    else
      image.*Field = static_cast<T>(static_cast<std::uint16_t>(bits));
  }
};

template <typename Image, typename T>
constexpr T field_type(T Image::*);

template <auto Field>
constexpr Row<PlcOrder> order_row(const char* name, std::uint16_t offset, const char* unit,
                                  const char* meaning) {
  using T = decltype(field_type(Field));
  using C = Codec<PlcOrder, T, Field>;
  return {{name, offset, type_of<T>(), unit, meaning}, &C::get, &C::set};
}

template <auto Field>
constexpr Row<PlcStatus> status_row(const char* name, std::uint16_t offset, const char* unit,
                                    const char* meaning) {
  using T = decltype(field_type(Field));
  using C = Codec<PlcStatus, T, Field>;
  return {{name, offset, type_of<T>(), unit, meaning}, &C::get, &C::set};
}

template <PlcType Type, std::uint32_t Bits>
constexpr Row<PlcStatus> constant_row(const char* name, std::uint16_t offset, const char* meaning) {
  return {{name, offset, Type, "", meaning},
          [](const PlcStatus&) { return Bits; },
          [](PlcStatus&, std::uint32_t) {}};
}

constexpr std::array kOrderRows{
    order_row<&PlcOrder::heartbeat>(
        "heartbeat", 0, "", "changes at least every 500 ms; standing still is a lost PLC: controlled stop"),
    order_row<&PlcOrder::command_sequence>("command_sequence", 1, "",
                                           "a command counts once, when this number changes"),
    order_row<&PlcOrder::command>("command", 2, "", "see the commands below"),
    order_row<&PlcOrder::job_number>("job_number", 4, "",
                                     "job that Start and Select mean; 0 = whichever comes first"),
};

constexpr std::array kStatusRows{
    constant_row<PlcType::Word, kPlcTestWord>("test_word", 0, "always 16#1234: the offset is right"),
    status_row<&PlcStatus::heartbeat>("heartbeat", 1, "",
                                      "counts up while the cell runs; standing still is a lost cell"),
    constant_row<PlcType::Real, std::bit_cast<std::uint32_t>(kPlcTestReal)>(
        "test_real", 2, "always 123.456: the word order is right"),
    status_row<&PlcStatus::command_ack>("command_ack", 4, "", "sequence number of the command taken last"),
    status_row<&PlcStatus::command_result>("command_result", 5, "", "of that command, see the results below"),
    status_row<&PlcStatus::state>("state", 6, "", "PackML state, see below"),
    status_row<&PlcStatus::mode>("mode", 7, "", "PackML mode, see below"),
    status_row<&PlcStatus::phase>("phase", 8, "", "phase of the job, see below"),
    status_row<&PlcStatus::armed>("armed", 9, "", "1 = a person has allowed motion"),
    status_row<&PlcStatus::guide_step>("guide_step", 10, "", "step of the guidance shown, from 1; 0 = none"),
    status_row<&PlcStatus::guide_member>("guide_member", 11, "", "number of the member to place; 0 = none"),
    status_row<&PlcStatus::fault_code>("fault_code", 12, "", "number in the alarm list, see below; 0 = none"),
    status_row<&PlcStatus::progress_percent>("progress", 13, "%", "of the job, 0 to 100"),
    status_row<&PlcStatus::fault_detail>("fault_detail", 14, "", "phase of the job in which the fault came"),
    status_row<&PlcStatus::job_number>("job_number", 16, "",
                                       "of the active or last job; 0 = none, -1 = one without a number"),
    status_row<&PlcStatus::x_um>("x", 18, "um", "found position of the part, robot base"),
    status_row<&PlcStatus::y_um>("y", 20, "um", "found position of the part, robot base"),
    status_row<&PlcStatus::theta_mdeg>("theta", 22, "0.001 deg", "found rotation of the part about z"),
    status_row<&PlcStatus::worst_weld_margin_mm>(
        "worst_weld_margin", 24, "mm", "tolerance minus error bound of the worst weld; negative = refused"),
    status_row<&PlcStatus::seams_done>("seams_done", 26, "", "seams welded of this job"),
    constant_row<PlcType::Word, kPlcMapVersion>("map_version", 27, "version of this map"),
    status_row<&PlcStatus::fault_severity>("fault_severity", 28, "",
                                           "of fault_code: 0 none, 1 message, 2 warning, 3 fault"),
    status_row<&PlcStatus::jobs_waiting>("jobs_waiting", 29, "",
                                         "jobs that wait in the spool, those on hold left out"),
    status_row<&PlcStatus::selected_job>("selected_job", 30, "",
                                         "number chosen by Select and not yet come; 0 = none"),
};

constexpr std::uint16_t words_of(PlcType type) { return type == PlcType::Word ? 1 : 2; }

template <typename Rows>
constexpr bool in_order_and_inside(const Rows& rows, std::uint16_t words) {
  std::uint16_t free = 0;
  for (const auto& row : rows) {
    if (row.reg.offset < free) return false;
    free = static_cast<std::uint16_t>(row.reg.offset + words_of(row.reg.type));
  }
  return free <= words;
}
static_assert(in_order_and_inside(kOrderRows, kPlcWriteWords));
static_assert(in_order_and_inside(kStatusRows, kPlcReadWords));

template <typename Rows>
constexpr auto registers_of(const Rows& rows) {
  std::array<PlcRegister, std::tuple_size_v<Rows>> out{};
  for (std::size_t i = 0; i < rows.size(); ++i) out[i] = rows[i].reg;
  return out;
}

constexpr auto kOrderRegisters = registers_of(kOrderRows);
constexpr auto kStatusRegisters = registers_of(kStatusRows);

std::uint32_t take_bits(const PlcRegister& reg, std::span<const std::uint16_t> words, WordOrder order) {
  const std::uint32_t first = words[reg.offset];
  if (reg.type == PlcType::Word) return first;
  const std::uint32_t second = words[reg.offset + 1U];
  return order == WordOrder::Abcd ? first << 16 | second : second << 16 | first;
}

void put_bits(const PlcRegister& reg, std::uint32_t bits, std::span<std::uint16_t> words, WordOrder order) {
  const auto low = static_cast<std::uint16_t>(bits & 0xFFFF), high = static_cast<std::uint16_t>(bits >> 16);
  if (reg.type == PlcType::Word) {
    words[reg.offset] = low;
    return;
  }
  words[reg.offset] = order == WordOrder::Abcd ? high : low;
  words[reg.offset + 1U] = order == WordOrder::Abcd ? low : high;
}

template <typename Image, typename Rows>
Image decode(const Rows& rows, std::span<const std::uint16_t> words, WordOrder order) {
  Image image;
  for (const auto& row : rows) row.set(image, take_bits(row.reg, words, order));
  return image;
}

template <std::size_t Words, typename Image, typename Rows>
std::array<std::uint16_t, Words> encode(const Rows& rows, const Image& image, WordOrder order) {
  std::array<std::uint16_t, Words> words{};
  for (const auto& row : rows) put_bits(row.reg, row.get(image), words, order);
  return words;
}

}  // namespace

std::span<const PlcRegister> plc_write_registers() { return kOrderRegisters; }
std::span<const PlcRegister> plc_read_registers() { return kStatusRegisters; }

PlcOrder decode_plc_order(std::span<const std::uint16_t, kPlcWriteWords> words, WordOrder order) {
  return decode<PlcOrder>(kOrderRows, words, order);
}

std::array<std::uint16_t, kPlcReadWords> encode_plc_status(const PlcStatus& status, WordOrder order) {
  return encode<kPlcReadWords>(kStatusRows, status, order);
}

std::array<std::uint16_t, kPlcWriteWords> encode_plc_order(const PlcOrder& order, WordOrder words) {
  return encode<kPlcWriteWords>(kOrderRows, order, words);
}

PlcStatus decode_plc_status(std::span<const std::uint16_t, kPlcReadWords> words, WordOrder order) {
  return decode<PlcStatus>(kStatusRows, words, order);
}

std::optional<WordOrder> find_word_order(std::span<const std::uint16_t, kPlcReadWords> words) {
  if (words[0] != kPlcTestWord) return {};
  for (const WordOrder order : {WordOrder::Abcd, WordOrder::Cdab}) {
    if (take_bits(kStatusRegisters[2], words, order) == std::bit_cast<std::uint32_t>(kPlcTestReal))
      return order;
  }
  return {};
}

}  // namespace weldcell::wire
