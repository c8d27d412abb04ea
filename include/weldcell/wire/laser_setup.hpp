// The talk over a laser's command port: what to ask, what the answers mean, whether the sensor is set as the
// cell file says. Averaging and hold are switched off; range, rate and outputs must be the configured ones.
// Pure. docs/LASERS.md lists the commands of each dialect.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "weldcell/base/result.hpp"
#include "weldcell/wire/laser_dialects.hpp"

namespace weldcell::wire {

/// How the sensor should be set.
struct LaserWanted {
  LaserFormat format;            ///< dialect, frame, range and rate of the cell file
  std::string device = "laser";  ///< stands first in every message, e.g. "laser 192.168.125.60:23"
  int data_port = 0;             ///< TCP port at which the readings are fetched; 0 = not to be compared
  std::string password = "000";  ///< for LOGIN, as delivered; sent only to a sensor that wants it
  std::uint32_t push_ip = 0;     ///< Od5000: where to send, 192.0.2.1 = 0xC0000201
  int push_port = 0;             ///< Od5000
};

/// One talk. request() gives what to send, take() what came back, in any pieces (Od5000: one datagram each);
/// the next request is due when take() returned true.
class LaserSetup {
 public:
  virtual ~LaserSetup() = default;
  LaserSetup(const LaserSetup&) = delete;
  LaserSetup& operator=(const LaserSetup&) = delete;

  /// "" when the talk is over.
  std::string request();
  /// True when the answer is complete. An answer longer than 16 KiB is a fault.
  bool take(std::string_view bytes);
  /// What the last request asked, in words for "no answer to ...".
  const std::string& asked() const { return current_.request; }

  /// After the talk: nothing when the sensor fits. "laser.mismatch": every setting that differs, with both
  /// values; "laser.refused": the sensor did not carry a command out; "laser.answer": not understood.
  std::optional<Error> fault() const;
  /// What was switched in the sensor and what it could not be asked, one sentence each.
  const std::vector<std::string>& notes() const { return notes_; }

 protected:
  enum class Framing : std::uint8_t { Incomplete, Answered, Refused };
  struct Step {
    std::string request;
    std::function<void(const std::string&)> judge = nullptr;  ///< the answer; may add steps in front
    std::string expects = {};  ///< an answer without it belongs to something sent before
    bool may_refuse = false;   ///< not every sensor of the family knows it: a note instead of a fault
    std::function<std::string()> compose = nullptr;  ///< the request, where earlier answers decide on it
  };

  explicit LaserSetup(const LaserWanted& wanted) : wanted_(wanted), device_(wanted.device) {}
  /// Looks for a complete answer in `buffer_`, moves it into `answer` and removes what was used.
  virtual Framing frame(std::string& answer) = 0;

  void then(Step step) { steps_.push_back(std::move(step)); }
  void first(Step step) { steps_.push_front(std::move(step)); }
  void name_device(const std::string& name);
  void note(const std::string& text);
  /// A setting that differs: key of the cell file, its value, the sensor's, what to do.
  void differs(const std::string& setting, const std::string& configured, const std::string& found,
               const std::string& mend);
  void check_range(double found_mm);
  void check_rate(double found_hz);
  void refused(const std::string& what);
  void not_understood(const std::string& answer);

  const LaserWanted wanted_;
  std::string buffer_;
  Step current_;

 private:
  std::string device_;
  std::deque<Step> steps_;
  std::vector<std::string> notes_, differences_, mends_;
  std::optional<Error> broken_;
};

/// The talk of a dialect. Needs a format without a fault.
std::unique_ptr<LaserSetup> laser_setup(const LaserWanted& wanted);

}  // namespace weldcell::wire
