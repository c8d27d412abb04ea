// "$XXX" commands: capaNCDT 6200 manual 6.4 (STI 6.4.1, AVT 6.4.4, CHS 6.4.6), capaNCDT 6500 manual 6.4.23
// (CHI), IF1032/ETH manual 6.3. What $MDF answers is in no public text: raw_min and raw_max are believed.
#include <algorithm>

#include "wire/laser_talks.hpp"

namespace weldcell::wire {
namespace {

class DollarTalk final : public LaserSetup {
 public:
  explicit DollarTalk(const LaserWanted& wanted)
      : LaserSetup(wanted), channel_(wanted.format.distance_word + 1) {
    ask(
        "$CHS", [this](const std::string& a) { read_channels(a); }, true);
    then({"", [this](const std::string& a) { read_channel(a); }, "", false,
          [this] { return "$CHI" + std::to_string(channel_) + "\r"; }});
    ask(
        "$STI?", [this](const std::string& a) { read_sample_time(a); }, false);
    ask(
        "$AVT?", [this](const std::string& a) { read_averaging(a); }, true);
    note("cannot be asked for its scale: laser.raw_min and raw_max are believed");
  }

 private:
  Framing frame(std::string& answer) override {
    const std::string_view sent = trimmed(current_.request);
    for (;;) {
      const std::size_t end = buffer_.find('\n');
      if (end == std::string::npos) return Framing::Incomplete;
      const std::string line(trimmed(std::string_view(buffer_).substr(0, end)));
      buffer_.erase(0, end + 1);
      if (line.empty() || line == sent) continue;
      if (line.size() < 2 || line.compare(line.size() - 2, 2, "OK") != 0) {
        answer = line;
        return Framing::Refused;
      }
      // The echo may stand on the answer's line. An answer to something else is left over from before.
      const std::size_t at = line.rfind(sent);
      if (at == std::string::npos) continue;
      answer = line.substr(at + sent.size(), line.size() - 2 - at - sent.size());
      return Framing::Answered;
    }
  }

  void ask(const std::string& text, std::function<void(const std::string&)> judge, bool may_refuse) {
    then({text + "\r", std::move(judge), "", may_refuse});
  }

  /// "1,0,2,1": 0 = no such channel.
  void read_channels(const std::string& answer) {
    std::size_t present = 0, number = 0;
    for (std::string_view rest = answer; !rest.empty();) {
      const std::size_t comma = std::min(rest.find(','), rest.size());
      const auto value = number_at(rest.substr(0, comma));
      if (!value) return not_understood(answer);
      ++number;
      if (*value != 0 && present++ == wanted_.format.distance_word) channel_ = number;
      rest.remove_prefix(std::min(comma + 1, rest.size()));
    }
    if (present != wanted_.format.words)
      differs("laser.frame", std::to_string(wanted_.format.words) + " channels",
              std::to_string(present) + " channels",
              "name every channel that the sensor sends in laser.frame");
  }

  void read_sample_time(const std::string& answer) {
    const auto us = number_at(answer);
    if (!us || *us <= 0) return not_understood(answer);
    check_rate(1e6 / *us);
  }

  void read_averaging(const std::string& answer) {
    const auto type = number_at(answer);
    if (!type) return not_understood(answer);
    if (*type == 0) return;
    note("had averaging type " + number_text(*type) + ", set to none");
    first({"$AVT?\r", [this](const std::string& now) {
             if (number_at(now) != 0.0)
               differs("averaging", "none", "type " + now, "switch it off in the sensor's own web page");
           }});
    first({"$AVT0\r"});
  }

  /// ":ANO..,NAM..,SNO..,OFS..,RNG..,UNT..,DTY.."
  void read_channel(const std::string& answer) {
    std::string fields = answer;
    std::replace(fields.begin(), fields.end(), ',', '\n');
    if (!fields.empty() && fields.front() == ':') fields.erase(0, 1);
    name_device(line_after(fields, "NAM").value_or("?") + ", channel " + std::to_string(channel_));
    const auto range = line_after(fields, "RNG"), unit = line_after(fields, "UNT");
    const auto length = range ? number_at(*range) : std::nullopt;
    if (!length || !unit || unit->size() < 2 || unit->back() != 'm') return not_understood(answer);
    // The micro sign comes in more than one encoding.
    check_range(*unit == "mm" ? *length : 1e-3 * *length);
  }

  std::size_t channel_;  ///< number of the distance's, from 1
};

}  // namespace

std::unique_ptr<LaserSetup> dollar_talk(const LaserWanted& wanted) {
  return std::make_unique<DollarTalk>(wanted);
}

}  // namespace weldcell::wire
