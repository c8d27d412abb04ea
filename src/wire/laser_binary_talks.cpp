// The talks in bytes. optoNCDT 1402 manual 8.3 (words, GET_INFO, SET_OUTPUT_CHANNEL, DAT_OUT_ON/OFF); what
// arguments SET_AV takes is in no public text, so a filter is refused, not switched. SICK OD5000 operating
// instructions 8021391, 7.4: reading and writing (tables 26 to 31), sampling rate (0x0C10, code 3 = 100 us is
// the only one that is public), filters and hold of a channel (table 32 of 2017), data push (table 46),
// errors (table 50).
#include <array>

#include "wire/laser_talks.hpp"

namespace weldcell::wire {
namespace {

void put(std::string& out, std::uint32_t value, int bytes) {
  for (int shift = 8 * (bytes - 1); shift >= 0; shift -= 8) out += static_cast<char>(value >> shift & 0xFF);
}

std::uint32_t number(std::string_view bytes) {
  std::uint32_t out = 0;
  for (const char c : bytes) out = out << 8 | static_cast<unsigned char>(c);
  return out;
}

std::string hex(std::uint32_t value) {
  constexpr const char* kDigits = "0123456789ABCDEF";
  std::string out = "0x";
  for (int shift = 12; shift >= 0; shift -= 4) out += kDigits[value >> shift & 0xF];
  return out;
}

class Ild1402Talk final : public LaserSetup {
 public:
  explicit Ild1402Talk(const LaserWanted& wanted) : LaserSetup(wanted) {
    then({words(kOutputOff)});
    then({words(kGetInfo), [this](const std::string& a) { read_info(a); }});
    then({words(kOutputOn)});
  }

 private:
  static constexpr std::uint32_t kOutputOff = 0x2076, kOutputOn = 0x2077, kGetInfo = 0x2049,
                                 kOutputChannel = 0x2090;

  static std::string words(std::uint32_t id, std::optional<std::uint32_t> argument = std::nullopt) {
    std::string out = "+++\rILD1";
    put(out, id << 16 | (argument ? 3U : 2U), 4);
    if (argument) put(out, *argument, 4);
    return out;
  }

  /// "ILD1", id with bit 15 (and bit 14 of an error), count of words from "ILD1" on, words, "  CR LF".
  Framing frame(std::string& answer) override {
    const std::uint32_t asked = number(std::string_view(current_.request).substr(8, 2)) | 0x8000;
    for (;;) {
      const std::size_t at = buffer_.find("ILD1");
      if (at == std::string::npos) {
        // Readings; the beginning of an answer may stand at their end.
        if (buffer_.size() > 3) buffer_.erase(0, buffer_.size() - 3);
        return Framing::Incomplete;
      }
      buffer_.erase(0, at);
      if (buffer_.size() < 8) return Framing::Incomplete;
      const std::uint32_t id = number(std::string_view(buffer_).substr(4, 2));
      const std::size_t count = number(std::string_view(buffer_).substr(6, 2));
      const bool ours = (id & ~0x4000U) == asked && count >= 2 && count <= 1024;
      if (ours && buffer_.size() < 4 * count + 4) return Framing::Incomplete;
      if (!ours || buffer_.compare(4 * count, 4, "  \r\n") != 0) {
        buffer_.erase(0, 4);
        continue;
      }
      answer = buffer_.substr(8, 4 * count - 8);
      buffer_.erase(0, 4 * count + 4);
      if ((id & 0x4000) == 0) return Framing::Answered;
      answer = "error " + hex(number(std::string_view(answer).substr(0, 4)));
      return Framing::Refused;
    }
  }

  void read_info(const std::string& answer) {
    name_device(line_after(answer, "ILD").value_or("?") + ", serial " +
                line_after(answer, "S/N:").value_or("?"));
    const auto range = line_after(answer, "MR:"), rate = line_after(answer, "Scanrate:");
    const auto mm = range ? number_at(*range) : std::nullopt, hz = rate ? number_at(*rate) : std::nullopt;
    const auto filter = line_after(answer, "Filter Type:"), depth = line_after(answer, "Filter Number:");
    if (!mm || !hz || !filter || !depth) return not_understood(answer);
    check_range(*mm);
    check_rate(*hz);
    if (number_at(*depth) != 1.0 || *filter != "moving average")
      differs("averaging", "a moving average of 1, none", *filter + " of " + *depth,
              "set the sensor's averaging to a moving average of 1 (SET_AV)");
    must_be(answer, "type of digital output:", "binary");
    must_be(answer, "mode of analog/digital output:", "continuous");
    if (line_after(answer, "Out Channel:") == "digital") return;
    note("sent its readings to the analog output, set to RS422");
    first({words(kOutputChannel, 1)});
  }

  void must_be(const std::string& answer, const char* label, const std::string& wanted) {
    const std::string found = line_after(answer, label).value_or("nothing");
    if (found != wanted) differs(std::string("the sensor's ") + label, wanted, found, "set it in the sensor");
  }
};

class Od5000Talk final : public LaserSetup {
 public:
  explicit Od5000Talk(const LaserWanted& wanted) : LaserSetup(wanted) {
    const std::uint32_t channel = kPerChannel * static_cast<std::uint32_t>(wanted.format.distance_word);
    name_device("OD5000");
    write(kPushChannels, 0, 4);
    read(kSamplingRate, [this](std::uint32_t code) { read_rate(code); });
    force(kMedian + channel, 0, "a median filter");
    force(kMovingAverage + channel, 1, "a moving average");
    force(kHold + channel, 0, "a hold mode");
    write(kPushIp, wanted.push_ip, 4);
    write(kPushPort, static_cast<std::uint32_t>(wanted.push_port), 2);
    write(kPushChannels, (1U << wanted.format.words) - 1, 4);
  }

 private:
  static constexpr std::uint32_t kPushPort = 0x10E2, kPushIp = 0x10E4, kPushChannels = 0x01E0;
  static constexpr std::uint32_t kSamplingRate = 0x0C10, kRate100us = 3;
  static constexpr std::uint32_t kMedian = 0x0210, kMovingAverage = 0x0214, kHold = 0x022C,
                                 kPerChannel = 0x80;

  static std::string write_request(std::uint32_t command, std::uint32_t value, std::uint32_t bytes) {
    std::string out;
    for (const std::uint32_t word : {0x4002U, command, bytes}) put(out, word, 2);
    put(out, value, static_cast<int>(bytes));
    return out;
  }
  void write(std::uint32_t command, std::uint32_t value, std::uint32_t bytes) {
    then({write_request(command, value, bytes)});
  }
  static Step read_step(std::uint32_t command, std::function<void(std::uint32_t)> judge) {
    std::string request;
    put(request, 0x3002, 2);
    put(request, command, 2);
    return {request, [judge = std::move(judge)](const std::string& a) { judge(number(a)); }, "", true};
  }
  void read(std::uint32_t command, std::function<void(std::uint32_t)> judge) {
    then(read_step(command, std::move(judge)));
  }
  void force(std::uint32_t command, std::uint32_t value, const char* what) {
    read(command, [this, command, value, what](std::uint32_t found) {
      if (found == value) return;
      note(std::string("had ") + what + " (" + hex(command) + " = " + std::to_string(found) +
           "), switched off");
      first(read_step(command, [this, value, what](std::uint32_t now) {
        if (now != value) differs(what, "off", std::to_string(now), "switch it off in the sensor");
      }));
      first({write_request(command, value, 4)});
    });
  }

  void read_rate(std::uint32_t code) {
    if (code == kRate100us) return check_rate(10'000);
    note("samples at code " + std::to_string(code) +
         ", whose time is in no public text: laser.rate_hz is "
         "believed, and held against the readings' own stamps");
  }

  /// One datagram: 0xB and the length of what was read, or 0xC and 0, or 0xC and an error.
  Framing frame(std::string& answer) override {
    const std::string datagram = std::move(buffer_);
    buffer_.clear();
    const bool reading = current_.request.substr(0, 2) == std::string("\x30\x02", 2);
    const std::uint32_t head = number(std::string_view(datagram).substr(0, 2));
    if (datagram.size() < 2 || head >> 12 != (reading ? 0xBU : 0xCU)) return Framing::Incomplete;
    const std::uint32_t command = number(std::string_view(current_.request).substr(2, 2));
    if (reading ? head == 0xB004 && datagram.size() == 6 : head == 0xC000) {
      answer = datagram.substr(2);
      // Table 50 gives an unknown command's number where its value would stand.
      if (!reading || number(answer) != 0xE1) return Framing::Answered;
    }
    answer = "command " + hex(command);
    return Framing::Refused;
  }
};

}  // namespace

std::unique_ptr<LaserSetup> ild1402_talk(const LaserWanted& wanted) {
  return std::make_unique<Ild1402Talk>(wanted);
}

std::unique_ptr<LaserSetup> od5000_talk(const LaserWanted& wanted) {
  return std::make_unique<Od5000Talk>(wanted);
}

}  // namespace weldcell::wire
