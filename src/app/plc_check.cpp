#include "app/plc_check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <optional>
#include <thread>

#include "app/plc_probe.hpp"
#include "weldcell/adapters/host_clock.hpp"
#include "weldcell/wire/plc_map.hpp"

namespace weldcell::app {

namespace {

using Words = std::vector<std::uint16_t>;

constexpr Nanoseconds kPatience = kSecond;
constexpr std::uint8_t kUnit = 1, kForeignUnit = 99;
constexpr std::uint16_t kNoCommand = 999;
constexpr int kIllegalFunction = 1, kIllegalAddress = 2, kIllegalValue = 3, kGatewayTarget = 11;

void pause(Nanoseconds time) { std::this_thread::sleep_for(std::chrono::nanoseconds(time)); }

std::string address_of(unsigned address) { return fmt::format("{} ({})", address, 40001 + address); }

class Exam {
 public:
  explicit Exam(const PlcCheckOptions& options) : options_(options) {}
  PlcFindings run();

 private:
  void note(const char* rule, std::string cause, std::string mend) {
    const bool passed = cause.empty();
    findings_.push_back({rule, passed, std::move(cause), passed ? std::string{} : std::move(mend)});
  }
  Result<PlcProbe> connect() { return PlcProbe::connect(options_.host, options_.port, 2 * kSecond); }
  /// The probe in use, made anew when the server has closed it.
  PlcProbe* probe();
  Words status() {
    return probe() != nullptr ? probe_->read_words(wire::kPlcReadBase, wire::kPlcReadWords) : Words{};
  }
  wire::PlcStatus decoded();
  ProbeReply ask(PlcBytes pdu, std::uint8_t unit = kUnit);
  bool write(std::uint16_t sequence, std::uint16_t command);

  void check_answers();
  void check_constants();
  void check_values();
  void check_heartbeat();
  void check_refusals();
  void check_functions();
  void check_frames();
  void check_half_header();
  void check_clients();
  void check_writes();
  void check_commands();

  PlcCheckOptions options_;
  PlcFindings findings_;
  std::optional<PlcProbe> probe_;
  wire::WordOrder order_ = wire::WordOrder::Abcd;
  std::uint16_t beat_ = 1;
  std::uint16_t command_ = 0;  ///< repeated with every heartbeat while an echo is waited for
};

PlcProbe* Exam::probe() {
  if (!probe_) {
    if (auto made = connect(); made.ok()) probe_.emplace(std::move(*made));
  }
  return probe_ ? &*probe_ : nullptr;
}

wire::PlcStatus Exam::decoded() {
  const Words words = status();
  std::array<std::uint16_t, wire::kPlcReadWords> block{};
  std::ranges::copy(words, block.begin());
  return wire::decode_plc_status(block, order_);
}

ProbeReply Exam::ask(PlcBytes pdu, std::uint8_t unit) {
  if (probe() == nullptr) return {};
  ProbeReply reply = probe_->ask(pdu, unit, kPatience);
  // After a missing answer the next one might be late and belong to this request.
  if (!reply.came()) probe_.reset();
  return reply;
}

bool Exam::write(std::uint16_t sequence, std::uint16_t command) {
  wire::PlcOrder order;
  order.heartbeat = ++beat_;
  order.command_sequence = sequence;
  order.command = static_cast<wire::PlcCommand>(command);
  return probe() != nullptr &&
         probe_->write_words(wire::kPlcWriteBase, wire::encode_plc_order(order, order_));
}

void Exam::check_answers() {
  const PlcBytes pdu{3, 0, wire::kPlcReadBase, 0, 1};
  ProbeReply reply = ask(pdu);
  std::string cause;
  if (!reply.came())
    cause = reply.describe() + " to FC3";
  else if (reply.transaction != probe_->transaction())
    cause = fmt::format("transaction {} for {}", reply.transaction, probe_->transaction());
  else if (reply.protocol != 0)
    cause = fmt::format("protocol {}", reply.protocol);
  else if (reply.unit != kUnit)
    cause = fmt::format("unit {} for {}", reply.unit, kUnit);
  note("frame.header_echoed", cause, "copy transaction and unit of the request into the answer, protocol 0");
}

void Exam::check_constants() {
  const Words words = status();
  note("map.one_read",
       words.size() == wire::kPlcReadWords ? "" : fmt::format("no {} words in one FC3", wire::kPlcReadWords),
       fmt::format("serve {} to {} in one FC3", address_of(wire::kPlcReadBase),
                   address_of(wire::kPlcReadBase + wire::kPlcReadWords - 1)));
  if (words.size() != wire::kPlcReadWords) return;
  std::array<std::uint16_t, wire::kPlcReadWords> block{};
  std::ranges::copy(words, block.begin());
  note("map.test_word",
       words[0] == wire::kPlcTestWord
           ? ""
           : fmt::format("16#{:04X} at {}", words[0], address_of(wire::kPlcReadBase)),
       "16#1234 stands at the block's first word: the addresses may be off by one");
  // The test word has its own rule: the order of words is judged with the right one in its place.
  block[0] = wire::kPlcTestWord;
  const auto order = wire::find_word_order(block);
  note("map.word_order", order ? "" : fmt::format("test_real is 16#{:04X} 16#{:04X}", words[2], words[3]),
       "send 123.456 as 16#42F6 16#E979 (abcd) or 16#E979 16#42F6 (cdab); bytes in a word high byte first");
  if (order) order_ = *order;
  const std::uint16_t version = words[27];
  note("map.version", version == wire::kPlcMapVersion ? "" : fmt::format("version {}", version),
       fmt::format("this program knows version {}: use the two of one release", wire::kPlcMapVersion));
  std::string used;
  std::uint16_t free = 0;
  const auto look = [&](std::uint16_t until) {
    for (; free < until; ++free) {
      if (words[free] != 0 && used.empty())
        used = fmt::format("{} holds {}", address_of(wire::kPlcReadBase + free), words[free]);
    }
  };
  for (const wire::PlcRegister& reg : wire::plc_read_registers()) {
    look(reg.offset);
    free = static_cast<std::uint16_t>(reg.offset + (reg.type == wire::PlcType::Word ? 1 : 2));
  }
  look(wire::kPlcReadWords);
  note("map.reserved_zero", used, "keep reserved words 0");
}

void Exam::check_values() {
  const wire::PlcStatus s = decoded();
  std::string cause;
  const auto most = [&](const char* name, unsigned value, unsigned limit) {
    if (value > limit && cause.empty()) cause = fmt::format("{} is {}", name, value);
  };
  most("state", static_cast<unsigned>(s.state), static_cast<unsigned>(wire::PackState::Complete));
  most("mode", static_cast<unsigned>(s.mode), static_cast<unsigned>(wire::PackMode::Manual));
  most("phase", s.phase, 15);
  most("armed", s.armed, 1);
  most("progress", s.progress_percent, 100);
  most("command_result", s.command_result, static_cast<unsigned>(wire::PlcResult::OtherJob));
  if (s.fault_code != 0 && wire::plc_alarm(s.fault_code) == nullptr && cause.empty())
    cause = fmt::format("fault_code {} is not in the alarm list", s.fault_code);
  note("values.in_range", cause, "keep to the numbers in the tables of docs/PLC.md");
}

void Exam::check_heartbeat() {
  constexpr int kLooks = 13;
  int changes = 0;
  std::string cause;
  std::uint16_t last = decoded().heartbeat;
  for (int i = 0; i < kLooks; ++i) {
    pause(200 * kMillisecond);
    const std::uint16_t beat = decoded().heartbeat;
    const auto step = static_cast<std::uint16_t>(beat - last);
    if (step > 1000) cause = fmt::format("it went from {} to {}", last, beat);
    changes += step != 0 ? 1 : 0;
    last = beat;
  }
  if (changes < 2) cause = fmt::format("{} changes in {:.1f} s", changes, kLooks * 0.2);
  note("heartbeat.counts_up", cause, "add 1 at least once a second for as long as the cell runs");
}

void Exam::check_refusals() {
  struct Case {
    const char* what;
    PlcBytes pdu;
  };
  const auto judge = [&](const char* rule, int expected, const std::vector<Case>& cases, const char* mend) {
    std::string cause;
    for (const Case& c : cases) {
      const ProbeReply reply = ask(c.pdu);
      if (reply.exception() != expected && cause.empty())
        cause = fmt::format("{} to {}, not exception {}", reply.describe(), c.what, expected);
    }
    note(rule, cause, mend);
  };
  judge("refuse.read_outside", kIllegalAddress,
        {{"FC3 of 140", {3, 0, 140, 0, 1}},
         {"FC3 of 50", {3, 0, 50, 0, 1}},
         {"FC3 of 139 and 140", {3, 0, 139, 0, 2}},
         {"FC3 of 65535", {3, 0xFF, 0xFF, 0, 1}}},
        "answer exception 2 for a word that is not in the map");
  if (!options_.read_only)
    judge("refuse.write_outside", kIllegalAddress,
          {{"FC16 into the cell's block", {16, 0, 106, 0, 1, 2, 0, 6}},
           {"FC6 into the cell's block", {6, 0, 106, 0, 6}},
           {"FC16 behind the PLC's block", {16, 0, 9, 0, 2, 4, 0, 0, 0, 0}}},
          "only the PLC's own block may be written: exception 2");
  judge("refuse.bad_count", kIllegalValue,
        {{"FC3 of 0 words", {3, 0, 100, 0, 0}}, {"FC3 of 126 words", {3, 0, 100, 0, 126}}},
        "answer exception 3 for a count outside 1 to 125");
}

void Exam::check_functions() {
  std::string cause;
  constexpr std::uint8_t kCodes[] = {1, 2, 4, 5, 7, 8, 11, 12, 15, 17, 20, 21, 22, 24, 43, 90};
  for (const std::uint8_t code : kCodes) {
    const ProbeReply reply = ask({code, 0, 0, 0, 1});
    if (reply.exception() != kIllegalFunction && cause.empty())
      cause = fmt::format("{} to FC{}", reply.describe(), static_cast<int>(code));
  }
  note("refuse.other_functions", cause, "answer exception 1 to everything but FC3, FC6, FC16 and FC23");
  const ProbeReply reply = ask({3, 0, wire::kPlcReadBase, 0, 1}, kForeignUnit);
  note(
      "unit.foreign_refused",
      reply.exception() == kGatewayTarget ? "" : fmt::format("{} to unit {}", reply.describe(), kForeignUnit),
      "answer exception 11 to every unit but 0, 1 and 255");
}

void Exam::check_frames() {
  const PlcBytes pdu{3, 0, wire::kPlcReadBase, 0, 1};
  probe_.reset();
  std::string cause = "the connection was refused";
  if (probe() != nullptr) {
    cause.clear();
    for (const std::uint8_t byte : probe_->frame(pdu, kUnit)) {
      probe_->send({&byte, 1});
      pause(2 * kMillisecond);
    }
    if (const ProbeReply reply = probe_->receive(kPatience); !reply.came())
      cause = reply.describe() + " to a request sent byte by byte";
  }
  note("frame.pieces_joined", cause, "collect bytes until the length field is satisfied");
  probe_.reset();
  cause = "the connection was refused";
  if (probe() != nullptr) {
    PlcBytes both = probe_->frame(pdu, kUnit);
    const std::uint16_t first = probe_->transaction();
    const PlcBytes second = probe_->frame(pdu, kUnit);
    both.insert(both.end(), second.begin(), second.end());
    probe_->send(both);
    const ProbeReply a = probe_->receive(kPatience), b = probe_->receive(kPatience);
    cause = a.came() && b.came() && a.transaction == first && b.transaction == probe_->transaction()
                ? ""
                : fmt::format("{} and {} to two requests in one packet", a.describe(), b.describe());
  }
  note("frame.two_in_one_packet", cause, "answer every whole frame of what was received, in order");
  probe_.reset();
  cause = "the connection was refused";
  if (probe() != nullptr) {
    PlcBytes foreign = probe_->frame(pdu, kUnit);
    foreign[3] = 7;
    probe_->send(foreign);
    const ProbeReply reply = probe_->receive(kPatience);
    cause = reply.closed ? "" : reply.describe() + " to protocol 7";
  }
  note("frame.foreign_closed", cause, "close a connection whose protocol field is not 0");
  probe_.reset();
}

void Exam::check_half_header() {
  // Three times, so that one stall of a busy machine is not taken for a rule.
  constexpr int kTries = 3;
  constexpr double kSlow_s = 0.25;
  int blocked = 0;
  std::string cause;
  for (int i = 0; i < kTries; ++i) {
    auto stuck = connect();
    if (!stuck.ok() || probe() == nullptr) {
      cause = "the second connection was refused";
      break;
    }
    stuck->send(PlcBytes{0, 1, 0});
    pause(20 * kMillisecond);
    const HostTime begin = adapters::now();
    const bool answered = ask({3, 0, wire::kPlcReadBase, 0, 1}).came();
    blocked += !answered || seconds(adapters::now() - begin) > kSlow_s ? 1 : 0;
  }
  if (blocked == kTries) cause = "another client's request had to wait behind half a header, three times";
  note("frame.half_header_blocks_nobody", cause,
       "never wait for the rest of one client's frame while others ask");
}

void Exam::check_clients() {
  std::vector<PlcProbe> probes;
  std::string cause;
  for (int i = 0; i < 3; ++i) {
    if (auto one = connect(); one.ok()) probes.push_back(std::move(*one));
  }
  std::size_t served = 0;
  for (PlcProbe& one : probes) served += one.read_words(wire::kPlcReadBase, 1).size();
  if (served < 3) cause = fmt::format("{} of 3 clients served at once", served);
  note("clients.three_at_once", cause, "serve a PLC, a panel and a test program at the same time");
}

void Exam::check_writes() {
  std::string cause;
  const wire::PlcStatus s = decoded();
  if (!write(s.command_ack, 0)) cause = "FC16 of the PLC's block is not confirmed";
  const Words back =
      probe() != nullptr ? probe_->read_words(wire::kPlcWriteBase, wire::kPlcWriteWords) : Words{};
  if (cause.empty() && (back.size() != wire::kPlcWriteWords || back[0] != beat_ || back[1] != s.command_ack))
    cause = "FC3 gives back other words than FC16 wrote";
  note("write.reads_back", cause, "keep the PLC's block readable as it was written");
  ++beat_;
  const auto h = static_cast<std::uint8_t>(beat_ >> 8), l = static_cast<std::uint8_t>(beat_ & 0xFF);
  ProbeReply one = ask({6, 0, 0, h, l});
  cause = one.pdu == PlcBytes{6, 0, 0, h, l} ? "" : one.describe() + " to FC6";
  ++beat_;
  const auto l2 = static_cast<std::uint8_t>(beat_ & 0xFF);
  one = ask({23, 0, wire::kPlcReadBase, 0, 1, 0, 0, 0, 1, 2, h, l2});
  if (cause.empty() && (one.pdu.size() != 4 || one.pdu[0] != 23)) cause = one.describe() + " to FC23";
  note("write.other_ways", cause, "serve FC6 and FC23 on the PLC's block");
}

void Exam::check_commands() {
  // What stands in the block when a PLC connects is history: the first write must change nothing.
  std::uint16_t sequence = decoded().command_ack;
  write(sequence, 0);
  pause(300 * kMillisecond);
  const auto wait_ack = [&](std::uint16_t wanted) {
    wire::PlcStatus s;
    for (int i = 0; i < 20; ++i) {
      s = decoded();
      if (s.command_ack == wanted) break;
      pause(50 * kMillisecond);
      write(wanted, command_);
    }
    return s;
  };
  command_ = 0;
  write(++sequence, 0);
  wire::PlcStatus s = wait_ack(sequence);
  note("command.echoed",
       s.command_ack == sequence ? ""
                                 : fmt::format("command_ack {} after {} was sent", s.command_ack, sequence),
       "echo command_sequence in command_ack within a second");
  command_ = kNoCommand;
  for (int i = 0; i < 5; ++i) {
    write(sequence, kNoCommand);
    pause(100 * kMillisecond);
  }
  s = decoded();
  note("command.counts_once",
       s.command_result == 0 && s.command_ack == sequence
           ? ""
           : fmt::format("result {} without a new command_sequence", s.command_result),
       "act only when command_sequence changes; a level does nothing");
  write(++sequence, kNoCommand);
  s = wait_ack(sequence);
  note("command.unknown_refused",
       s.command_result == 2 ? "" : fmt::format("result {} for command {}", s.command_result, kNoCommand),
       "answer a number that is no command with result 2");
  command_ = 0;
  write(++sequence, 0);
  wait_ack(sequence);
}

PlcFindings Exam::run() {
  auto first = connect();
  note("connection.accepted", first.ok() ? "" : first.error().text(), "see docs/PLC.md, 'Who may connect'");
  if (!first.ok()) return findings_;
  probe_.emplace(std::move(*first));
  check_answers();
  check_constants();
  check_values();
  check_heartbeat();
  check_refusals();
  check_functions();
  check_frames();
  check_half_header();
  check_clients();
  if (options_.read_only) return findings_;
  check_writes();
  check_commands();
  return findings_;
}

}  // namespace

PlcFindings check_plc_server(const PlcCheckOptions& options) { return Exam(options).run(); }

}  // namespace weldcell::app
