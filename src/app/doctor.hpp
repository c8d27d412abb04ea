// What weldcell doctor finds: the machine's facts judged against what the cell needs. Pure.
#pragma once

#include <string>
#include <vector>

#include "weldcell/adapters/host_facts.hpp"

namespace weldcell::app {

enum class Health { Ok, Warn, Fail };

struct Ailment {
  std::string check;  ///< short name, e.g. "port modbus"
  Health health = Health::Ok;
  std::string seen;  ///< what is so, with its figure; and why it matters when it is not well
  std::string mend;  ///< empty when well
};
using Ailments = std::vector<Ailment>;

/// A port that the daemon listens on.
struct NeededPort {
  std::string name, host;
  int port = 0;
  bool udp = false;
  adapters::PortFacts facts;
};
/// A card that the daemon's devices are behind. `own`: the address is the machine's own and must be there.
struct NeededCard {
  std::string name, address;
  bool own = false;
  adapters::CardFacts facts;
};
struct NeededDisk {
  std::string name, folder;
  adapters::DiskFacts facts;
};

/// With a running daemon its own threads tell what it was granted, otherwise what this process may have.
Ailments judge_real_time(const adapters::KernelFacts& kernel,
                         const std::optional<adapters::ProcessFacts>& daemon,
                         const adapters::RealTimeRights& rights, bool root);
Ailments judge_kernel(const adapters::KernelFacts& kernel);
Ailment judge_port(const NeededPort& port);
Ailments judge_card(const NeededCard& card);
Ailment judge_disk(const NeededDisk& disk);
Ailments judge_clock(const adapters::ClockFacts& clock, const adapters::KernelFacts& kernel);

/// One line an ailment with its mend below, and a count; or one JSON object {"ok", "warned", "failed",
/// "checks": [...]}.
std::string ailments_text(const Ailments& ailments);
std::string ailments_json(const Ailments& ailments);
bool any_failed(const Ailments& ailments);

}  // namespace weldcell::app
