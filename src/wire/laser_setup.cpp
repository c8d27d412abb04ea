#include "weldcell/wire/laser_setup.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "wire/laser_talks.hpp"

namespace weldcell::wire {
namespace {

constexpr std::size_t kLongestAnswer = 16384;
/// Sensors round what they say of themselves: 49 for 49.02 kHz.
constexpr double kSame = 1e-3;

std::string joined(const std::vector<std::string>& parts) {
  std::string out;
  for (const std::string& part : parts) out += (out.empty() ? "" : "; ") + part;
  return out;
}

}  // namespace

std::string readable(const std::string& text) {
  std::string out;
  for (const char c : text.substr(0, 200)) {
    const bool plain = c >= 0x20 && c < 0x7F;
    if (plain || (!out.empty() && out.back() != ' ')) out += plain ? c : ' ';
  }
  return out;
}

std::string number_text(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.6g", value);
  return text;
}

std::string LaserSetup::request() {
  if (broken_ || steps_.empty()) return {};
  current_ = std::move(steps_.front());
  steps_.pop_front();
  if (current_.compose) current_.request = current_.compose();
  return current_.request;
}

bool LaserSetup::take(std::string_view bytes) {
  buffer_ += bytes;
  for (;;) {
    std::string answer;
    const Framing framing = frame(answer);
    if (framing == Framing::Incomplete) {
      if (buffer_.size() <= kLongestAnswer) return false;
      not_understood(buffer_);
      return true;
    }
    if (framing == Framing::Refused) {
      if (current_.may_refuse) {
        note("does not know " + readable(current_.request) + " (" + readable(answer) + ")");
      } else {
        refused(answer);
      }
      return true;
    }
    if (!current_.expects.empty() && answer.find(current_.expects) == std::string::npos) continue;
    const auto judge = std::move(current_.judge);
    if (judge) judge(answer);
    return true;
  }
}

std::optional<Error> LaserSetup::fault() const {
  if (broken_) return broken_;
  if (differences_.empty()) return std::nullopt;
  return Error{"laser.mismatch", device_, joined(differences_), joined(mends_)};
}

void LaserSetup::name_device(const std::string& name) {
  device_ = wanted_.device + " (" + readable(name) + ")";
}

void LaserSetup::note(const std::string& text) { notes_.push_back(readable(text)); }

void LaserSetup::differs(const std::string& setting, const std::string& configured, const std::string& found,
                         const std::string& mend) {
  differences_.push_back(setting + " is " + configured + ", the sensor has " + readable(found));
  if (std::find(mends_.begin(), mends_.end(), mend) == mends_.end()) mends_.push_back(mend);
}

void LaserSetup::check_range(double found_mm) {
  if (std::abs(found_mm - wanted_.format.range_mm) <= kSame * wanted_.format.range_mm) return;
  differs(
      "laser.range_mm", number_text(wanted_.format.range_mm), number_text(found_mm) + " mm",
      "write the sensor's range into laser.range_mm, and its start of range, or connect the sensor meant");
}

void LaserSetup::check_rate(double found_hz) {
  if (std::abs(found_hz - wanted_.format.rate_hz) <= kSame * wanted_.format.rate_hz) return;
  differs("laser.rate_hz", number_text(wanted_.format.rate_hz), number_text(found_hz) + " Hz",
          "set the sensor to the rate of the cell file, or write its rate into laser.rate_hz and measure the "
          "latency again");
}

void LaserSetup::refused(const std::string& what) {
  broken_ = Error{"laser.refused", device_,
                  "the sensor refused " + readable(current_.request) + ": " + readable(what),
                  "is it a sensor of laser.dialect " + std::string(to_string(wanted_.format.dialect)) +
                      "? If its commands cannot be had, set it by hand and write laser.command_port: none"};
}

void LaserSetup::not_understood(const std::string& answer) {
  broken_ = Error{"laser.answer", device_,
                  "cannot read the answer to " + readable(current_.request) + ": " + readable(answer),
                  "is laser.command_port the sensor's, and laser.dialect right? If its commands cannot be "
                  "had, set it by hand and write laser.command_port: none"};
}

std::unique_ptr<LaserSetup> laser_setup(const LaserWanted& wanted) {
  switch (wanted.format.dialect) {
    case LaserDialect::Meas28:
    case LaserDialect::Data28:
    case LaserDialect::ThreeByte:
      return prompt_talk(wanted);
    case LaserDialect::Meas32:
      return dollar_talk(wanted);
    case LaserDialect::TwoByte:
      return ild1402_talk(wanted);
    case LaserDialect::Od5000:
      return od5000_talk(wanted);
  }
  return prompt_talk(wanted);
}

}  // namespace weldcell::wire
