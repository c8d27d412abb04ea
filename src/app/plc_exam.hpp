// Plays a cell that runs one job, and judges what the PLC does meanwhile: the PLC programmer's conformance
// test. Time is an argument. Pure.
#pragma once

#include <map>
#include <optional>
#include <string>

#include "app/plc_findings.hpp"
#include "weldcell/base/time.hpp"
#include "weldcell/wire/plc_map.hpp"

namespace weldcell::app {

struct PlcExamOptions {
  double patience_s = 120;       ///< how long each step waits for the PLC
  double ack_delay_s = 0.3;      ///< a command is echoed so late
  double silence_s = 4;          ///< the cell's heartbeat stands still so long, once
  double person_s = 0.5;         ///< faster than this nobody arms after a fault
  double heartbeat_limit_s = 1;  ///< the page says 0.5 s; twice that is a fault
};

/// The job that it plays has a number that needs both words of a DINT.
inline constexpr std::int32_t kPlcExamJob = 70001;

class PlcExam {
 public:
  explicit PlcExam(const PlcExamOptions& options) : options_(options) {}

  /// An image that the PLC wrote; `reserved` are the words that the map leaves free.
  void write(const wire::PlcOrder& order, bool reserved_zero, HostTime at);
  /// What the cell says now. Call it at least every 50 ms.
  wire::PlcStatus step(HostTime at);
  bool over() const { return over_; }
  /// In words for the person at the PLC: what the exam waits for.
  std::string waiting_for() const;
  /// Every rule, in a fixed order; rules that were never reached fail.
  PlcFindings findings() const;

 private:
  enum class Scene {
    Connect,
    Empty,
    Ready,
    Armed,
    Place1,
    Move,
    Place2,
    Scan,
    Silent,
    Faulted,
    Cleared,
    Rearmed,
    Weld,
    Complete,
    End
  };
  void blame(const char* rule, std::string cause);
  void pass(const char* rule) { reached_[rule]; }
  void enter(Scene scene, HostTime at);
  void command(const wire::PlcOrder& order, HostTime at);
  wire::PlcResult judge(const wire::PlcOrder& order, HostTime at);
  void advance(HostTime at);

  PlcExamOptions options_;
  Scene scene_ = Scene::Connect;
  HostTime since_, begun_{-1}, last_beat_, ack_at_;
  std::optional<wire::PlcOrder> last_;
  wire::PlcStatus status_;
  std::optional<std::pair<std::uint16_t, wire::PlcResult>> pending_;
  bool refused_once_ = false, over_ = false;
  bool ahead_ = false;  ///< a command stands there whose number has not come yet
  HostTime blame_from_;
  std::uint16_t own_beat_ = 0;
  HostTime next_beat_;
  std::map<std::string, std::string> reached_;  ///< rule -> cause; "" = kept so far
};

}  // namespace weldcell::app
