#include "sim/laser_interpreter.hpp"

#include <cmath>
#include <cstdio>
#include <vector>

namespace weldcell::sim {

namespace {

using wire::LaserDialect;

std::string format(const char* pattern, double value) {
  char text[64];
  std::snprintf(text, sizeof text, pattern, value);
  return text;
}

/// Telnet lines: name, parameters; answer, prompt. optoNCDT 2300 manual A 6; confocalDT 24x1 manual A 5;
/// optoNCDT 1420 manual A 3.
class LineInterpreter final : public LaserInterpreter {
 public:
  LineInterpreter(const wire::LaserFormat& settings, int data_port)
      : serial_(settings.dialect == LaserDialect::ThreeByte),
        confocal_(settings.dialect == LaserDialect::Data28),
        professional_(serial_),
        range_mm_(settings.range_mm) {
    values_["MEASRATE"] = format("%.4g", settings.rate_hz * 1e-3);
    values_["AVERAGE"] = "NONE";
    values_["OUTHOLD"] = "NONE";
    values_["ECHO"] = "OFF";
    values_["OUTPUT"] = serial_ ? "RS422" : "ETHERNET";
    if (serial_) {
      values_["OUTREDUCEDEVICE"] = "NONE";
    } else {
      values_["OUTREDUCE"] = "1 NONE";
      values_["MEASTRANSFER"] = "SERVER/TCP " + std::to_string(data_port);
    }
    outputs_ = outputs_of(settings);
  }

  std::string hear(std::string_view bytes) override {
    std::string out;
    for (const char c : bytes) {
      if (c == '\r') continue;
      if (c != '\n') {
        if (line_.size() < 400) line_ += c;
        continue;
      }
      out += carry_out(line_);
      line_.clear();
    }
    return out;
  }
  void hang_up() override { line_.clear(); }
  bool sending() const override { return values_.at("OUTPUT") == (serial_ ? "RS422" : "ETHERNET"); }

 private:
  static std::string outputs_of(const wire::LaserFormat& settings) {
    if (settings.dialect == LaserDialect::ThreeByte) return "DIST1";
    std::string out;
    const auto add = [&out](const std::string& word) { out += (out.empty() ? "" : " ") + word; };
    if (settings.dialect == LaserDialect::Data28) {
      for (std::size_t i = 0; i < settings.words; ++i) {
        if (i == settings.distance_word)
          add("01DIST1");
        else if (static_cast<int>(i) == settings.timestamp_word)
          add("TIMESTAMP");
        else
          add("01INTENSITY");
      }
      return out;
    }
    const wire::Meas28Layout& on = settings.meas28;
    if (on.exposure) add("SHUTTER");
    if (on.counter) add("COUNTER");
    if (on.timestamp) add("TIMESTAMP");
    if (on.intensity) add("INTENSITY");
    add("DIST1");
    if (on.status) add("STATE");
    return out;
  }

  std::string info() const {
    std::string out = "Name: ";
    out += serial_ ? "ILD1420" : confocal_ ? "IFC2421" : "ILD2300";
    out += "\r\nSerial: 260021\r\nOption: 000\r\nArticle: 4120176\r\n";
    // The confocal controllers do not tell a range: it is their sensor's.
    if (!confocal_) out += "Measuring range: " + format("%.2fmm\r\n", range_mm_);
    return out + "Version: 0003.066.087\r\n";
  }

  std::string carry_out(const std::string& line) {
    const std::size_t blank = line.find(' ');
    const std::string name = line.substr(0, blank);
    const std::string rest = blank == std::string::npos ? "" : line.substr(blank + 1);
    std::string out;
    if (name.empty()) {
    } else if (name == "GETINFO") {
      out = info();
    } else if (name == "GETUSERLEVEL") {
      out = professional_ ? "GETUSERLEVEL PROFESSIONAL\r\n" : "GETUSERLEVEL USER\r\n";
    } else if (name == "LOGIN") {
      professional_ = rest == "000";
      if (!professional_) out = "E24 Wrong password\r\n";
    } else if (name == "LOGOUT") {
      professional_ = false;
    } else if (name == (serial_ ? "GETOUTINFO_RS422" : "GETOUTINFO_ETH")) {
      out = name + " " + outputs_ + "\r\n";
    } else if (values_.count(name) == 0) {
      out = "E01 Unknown command\r\n";
    } else if (rest.empty()) {
      out = name + " " + values_[name] + "\r\n";
    } else if (!professional_) {
      out = "E03 Access denied\r\n";
    } else {
      values_[name] = rest;
      if (values_["ECHO"] == "ON") out = line + " ok\r\n";
    }
    return out + "->";
  }

  bool serial_, confocal_;
  bool professional_;  ///< an optoNCDT 1420 is delivered without a password
  double range_mm_;
  std::map<std::string, std::string> values_;
  std::string outputs_, line_;
};

/// "$XXX" CR, echoed as it comes. capaNCDT 6200 manual 6.4, 6500 manual 6.4.23; IF1032/ETH manual 6.3.
class DollarInterpreter final : public LaserInterpreter {
 public:
  explicit DollarInterpreter(const wire::LaserFormat& settings) : settings_(settings) {
    sample_time_us_ = std::lround(1e6 / settings.rate_hz);
  }

  std::string hear(std::string_view bytes) override {
    std::string out;
    for (const char c : bytes) {
      out += c;
      if (c == '$') command_.clear();
      if (c == '\r') {
        out += "\n" + carry_out(command_);
        command_.clear();
      } else if (command_.size() < 400) {
        command_ += c;
      }
    }
    return out;
  }
  void hang_up() override { command_.clear(); }
  bool sending() const override { return true; }

 private:
  std::string carry_out(const std::string& text) {
    const std::string name = text.substr(0, 4), rest = text.size() > 4 ? text.substr(4) : "";
    if (name == "$CHS") {
      std::string channels;
      for (std::size_t i = 0; i < settings_.words; ++i) channels += i == 0 ? "1" : ",1";
      return text + channels + "OK\r\n";
    }
    if (name == "$CHI" && !rest.empty()) {
      const std::string range = format("%.0f", 1000 * settings_.range_mm);
      return text + ":ANO4120176,NAMIF1032,SNO260021,OFS0,RNG" + range + ",UNT\xC2\xB5m,DTY1OK\r\n";
    }
    if (text == "$STI?") return text + std::to_string(sample_time_us_) + "OK\r\n";
    if (text == "$AVT?") return text + std::to_string(averaging_) + "OK\r\n";
    if (name == "$AVT" && rest.size() == 1 && rest[0] >= '0' && rest[0] <= '4') {
      averaging_ = rest[0] - '0';
      return text + "OK\r\n";
    }
    return text + "$UNKNOWN COMMAND\r\n";
  }

  const wire::LaserFormat settings_;
  long sample_time_us_ = 0;
  int averaging_ = 0;
  std::string command_;
};

/// optoNCDT 1402 manual 8.3: "+++" CR, "ILD1", id and count of words, arguments.
class WordInterpreter final : public LaserInterpreter {
 public:
  explicit WordInterpreter(const wire::LaserFormat& settings)
      : range_mm_(settings.range_mm), rate_hz_(settings.rate_hz) {}

  std::string hear(std::string_view bytes) override {
    std::string out;
    heard_ += bytes;
    for (;;) {
      const std::size_t at = heard_.find("+++\rILD1");
      if (at == std::string::npos) {
        if (heard_.size() > 7) heard_.erase(0, heard_.size() - 7);
        return out;
      }
      heard_.erase(0, at);
      if (heard_.size() < 12) return out;
      const unsigned id = half(8), count = half(10);
      const std::size_t size = 4 + 4 * std::size_t{count};
      if (count < 2 || count > 20) {
        heard_.erase(0, 8);
        continue;
      }
      if (heard_.size() < size) return out;
      out += carry_out(id, heard_.substr(12, size - 12));
      heard_.erase(0, size);
    }
  }
  void hang_up() override { heard_.clear(); }
  bool sending() const override { return on_ && digital_; }

 private:
  unsigned half(std::size_t at) const {
    return static_cast<unsigned>(static_cast<unsigned char>(heard_[at])) << 8 |
           static_cast<unsigned char>(heard_[at + 1]);
  }

  static std::string reply(unsigned id, const std::string& body) {
    std::string padded = body;
    while (padded.size() % 4 != 0) padded += ' ';
    const auto count = static_cast<unsigned>(2 + padded.size() / 4);
    std::string out = "ILD1";
    for (const unsigned byte : {id >> 8, id & 0xFF, count >> 8, count & 0xFF}) out += static_cast<char>(byte);
    return out + padded + "  \r\n";
  }

  std::string carry_out(unsigned id, const std::string& arguments) {
    const unsigned value = arguments.empty() ? 0 : static_cast<unsigned char>(arguments.back());
    if (id == 0x2076) {
      on_ = false;
    } else if (id == 0x2077) {
      on_ = true;
    } else if (id == 0x2090) {
      digital_ = value == 1;
    } else if (id == 0x2049) {
      return reply(id | 0x8000, info());
    } else {
      return reply(id | 0xC000, std::string("\0\0\0\x01", 4));
    }
    return reply(id | 0x8000, "");
  }

  std::string info() const {
    return "ILD 1402: Standard\r\nA/N: 4120154\r\nO/N: 000\r\nS/N: 1234570\r\nMR: " +
           format("%.0f", range_mm_) +
           "\r\nSoftVer: 1.001.796\r\nOut Channel: " + (digital_ ? "digital" : "analog") +
           "\r\nFilter Type: moving average\r\nFilter Number: 1\r\nScanrate: " + format("%.0fHz", rate_hz_) +
           "\r\ntype of digital output: binary\r\nmode of analog/digital output: continuous\r\n";
  }

  double range_mm_, rate_hz_;
  bool on_ = true, digital_ = true;
  std::string heard_;
};

}  // namespace

std::unique_ptr<LaserInterpreter> make_interpreter(const wire::LaserFormat& settings, int data_port) {
  switch (settings.dialect) {
    case LaserDialect::Meas32:
      return std::make_unique<DollarInterpreter>(settings);
    case LaserDialect::TwoByte:
      return std::make_unique<WordInterpreter>(settings);
    case LaserDialect::Meas28:
    case LaserDialect::Data28:
    case LaserDialect::ThreeByte:
    case LaserDialect::Od5000:
      break;
  }
  return std::make_unique<LineInterpreter>(settings, data_port);
}

}  // namespace weldcell::sim
