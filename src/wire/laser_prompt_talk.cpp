// Micro-Epsilon's text commands. optoNCDT 2300 manual, appendix A 6 (answers A 6.1, GETINFO A 6.3.1.2, LOGIN
// A 6.3.2, MEASRATE A 6.4.1.4, AVERAGE A 6.4.4.1, outputs A 6.5); confocalDT 24x1 manual, appendix A 5;
// optoNCDT 1420 manual, appendix A 3. MEASTRANSFER's arguments are known from public clients only.
#include <cctype>

#include "wire/laser_talks.hpp"

namespace weldcell::wire {
namespace {

std::vector<std::string> words_of(std::string_view text) {
  std::vector<std::string> out;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t from = text.find_first_not_of(" \t\r\n,:;", at);
    if (from == std::string_view::npos) break;
    std::size_t to = text.find_first_of(" \t\r\n,:;", from);
    if (to == std::string_view::npos) to = text.size();
    out.emplace_back(text.substr(from, to - from));
    at = to;
  }
  return out;
}

/// "01DIST1" of the newer controllers is sensor 1's DIST1.
std::string bare(const std::string& word) {
  const std::size_t from = word.find_first_not_of("0123456789");
  return from == std::string::npos ? word : word.substr(from);
}

std::string listed(const std::vector<std::string>& words) {
  std::string out = "[";
  for (const std::string& word : words) out += (out.size() > 1 ? ", " : "") + word;
  return out + "]";
}

class PromptTalk final : public LaserSetup {
 public:
  explicit PromptTalk(const LaserWanted& wanted)
      : LaserSetup(wanted), serial_(wanted.format.dialect == LaserDialect::ThreeByte) {
    const Step level{"GETUSERLEVEL\r\n", [this](const std::string& a) { log_in(a); }, "", true};
    const Step info{"GETINFO\r\n", [this](const std::string& a) { read_info(a); }, "Name:"};
    // In the readings' own stream, they must stop before a long answer can be read.
    if (serial_) then(level), command("OUTPUT NONE");
    then(info);
    if (!serial_) then(level);
    ask("MEASRATE", [this](const std::string& a) { read_rate(a); });
    force("AVERAGE", "NONE");
    force("OUTHOLD", "NONE");
    if (serial_) {
      force("OUTREDUCEDEVICE", "NONE");
    } else {
      ask(
          "OUTREDUCE", [this](const std::string& a) { read_reduction(a); }, true);
    }
    const std::string outputs = serial_ ? "GETOUTINFO_RS422" : "GETOUTINFO_ETH";
    then({outputs + "\r\n", [this](const std::string& a) { read_outputs(a); }, "DIST"});
    if (!serial_) {
      ask(
          "MEASTRANSFER", [this](const std::string& a) { read_transfer(a); }, true);
      force("OUTPUT", "ETHERNET");
    } else {
      command("OUTPUT RS422");
    }
  }

 private:
  Framing frame(std::string& answer) override {
    const std::size_t prompt = buffer_.find("->");
    if (prompt == std::string::npos) return Framing::Incomplete;
    const std::string text = buffer_.substr(0, prompt);
    buffer_.erase(0, prompt + 2);
    const std::string_view echo = trimmed(current_.request);
    std::size_t at = 0;
    while (at < text.size()) {
      std::size_t end = text.find('\n', at);
      if (end == std::string::npos) end = text.size();
      const std::string_view line = trimmed(std::string_view(text).substr(at, end - at));
      at = end + 1;
      const bool digits = line.size() > 2 && std::isdigit(static_cast<unsigned char>(line[1])) != 0 &&
                          std::isdigit(static_cast<unsigned char>(line[2])) != 0;
      if (digits && line[0] == 'E') {
        answer = line;
        return Framing::Refused;
      }
      if (digits && line[0] == 'W') note("warns: " + std::string(line));
      if (line == echo || line.empty()) continue;
      answer += std::string(line) + "\n";
    }
    return Framing::Answered;
  }

  void command(const std::string& text) { then({text + "\r\n"}); }

  /// A setting's own value: the sensor repeats the name with its parameters.
  void ask(const std::string& name, std::function<void(const std::string&)> judge, bool may_refuse = false) {
    then({name + "\r\n",
          [this, name, judge = std::move(judge)](const std::string& answer) {
            const auto value = line_after(answer, name);
            if (value)
              judge(*value);
            else
              not_understood(answer);
          },
          name, may_refuse});
  }

  /// A setting that must have this value: written where it has not, and read again.
  void force(const std::string& name, const std::string& value) {
    ask(name, [this, name, value](const std::string& found) {
      if (found == value) return;
      const std::string set = name + " " + value;
      first({name + "\r\n",
             [this, name, value](const std::string& answer) {
               const auto now = line_after(answer, name);
               if (!now || *now != value)
                 differs(name, value, now.value_or("no value"), "set it in the sensor's own web page");
             },
             name});
      first({set + "\r\n"});
      note("had " + name + " " + found + ", set to " + value);
    });
  }

  void read_info(const std::string& answer) {
    const std::string serial = line_after(answer, "Serial:").value_or("?");
    name_device(line_after(answer, "Name:").value_or("?") + ", serial " + serial);
    const auto range = line_after(answer, "Measuring range:");
    if (!range) {
      note("does not tell its measuring range: laser.range_mm is believed");
    } else if (const auto mm = number_at(*range)) {
      check_range(*mm);
    } else {
      not_understood(answer);
    }
  }

  void log_in(const std::string& answer) {
    if (answer.find("PROFESSIONAL") != std::string::npos) return;
    first({"LOGIN " + wanted_.password + "\r\n"});
  }

  void read_rate(const std::string& value) {
    const auto khz = number_at(value);
    if (!khz) return not_understood(value);
    rate_hz_ = 1e3 * *khz;
    if (serial_) check_rate(rate_hz_);
    rate_known_ = true;
    // Over Ethernet the reduction decides with it; a sensor that knows none is checked by its rate alone.
    reduction_ = 1;
  }

  void read_reduction(const std::string& value) {
    const auto n = number_at(value);
    if (!n || *n < 1) return not_understood(value);
    const bool elsewhere = value.find_first_of("ABCDEFGHIJKLMNOPQRSTUVWXYZ") != std::string::npos &&
                           value.find("ETHERNET") == std::string::npos;
    if (!elsewhere) reduction_ = *n;
  }

  void read_outputs(const std::string& answer) {
    if (rate_known_ && !serial_) check_rate(rate_hz_ / reduction_);
    std::vector<std::string> sent;
    for (const std::string& word : words_of(answer)) {
      if (word.rfind("GETOUTINFO", 0) != 0) sent.push_back(bare(word));
    }
    std::vector<std::string> wanted, found;
    const LaserFormat& format = wanted_.format;
    if (format.dialect == LaserDialect::Data28) {
      for (const std::string& word : sent)
        found.push_back(word == "DIST1" ? "distance" : word == "TIMESTAMP" ? "timestamp" : "other");
      for (std::size_t i = 0; i < format.words; ++i)
        wanted.push_back(i == format.distance_word                      ? "distance"
                         : static_cast<int>(i) == format.timestamp_word ? "timestamp"
                                                                        : "other");
    } else {
      for (const std::string& word : sent) found.push_back(item_of(word));
      if (format.dialect == LaserDialect::Meas28) {
        const Meas28Layout& on = format.meas28;
        // In the sensor's fixed order, 2300 manual 7.2.
        for (const auto& [is, name] : {std::pair{on.exposure, "exposure"},
                                       {on.counter, "counter"},
                                       {on.timestamp, "timestamp"},
                                       {on.intensity, "intensity"},
                                       {true, "distance"},
                                       {on.status, "status"}})
          if (is) wanted.emplace_back(name);
      } else {
        wanted.emplace_back("distance");
      }
    }
    if (wanted != found)
      differs("laser.frame", listed(wanted), listed(found),
              "write what the sensor sends into laser.frame, or select its outputs (OUTADD_ETH, OUT_ETH)");
  }

  static std::string item_of(const std::string& word) {
    if (word == "SHUTTER") return "exposure";
    if (word == "COUNTER") return "counter";
    if (word == "TIMESTAMP") return "timestamp";
    if (word == "INTENSITY") return "intensity";
    if (word == "DIST1") return "distance";
    if (word == "STATE") return "status";
    return word;
  }

  void read_transfer(const std::string& value) {
    if (wanted_.data_port == 0) return;
    const std::string wanted = "SERVER/TCP " + std::to_string(wanted_.data_port);
    if (value != wanted)
      differs("laser.address' port", wanted, value.empty() ? "nothing" : value,
              "set MEASTRANSFER in the sensor, or correct the port in laser.address");
  }

  bool serial_, rate_known_ = false;
  double rate_hz_ = 0, reduction_ = 1;
};

}  // namespace

std::unique_ptr<LaserSetup> prompt_talk(const LaserWanted& wanted) {
  return std::make_unique<PromptTalk>(wanted);
}

}  // namespace weldcell::wire
