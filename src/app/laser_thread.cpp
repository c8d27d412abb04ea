// The laser's thread: sets the sensor up, keeps it connected, hands its bytes on.
#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <chrono>
#include <optional>
#include <thread>

#include "app/device_threads.hpp"
#include "weldcell/adapters/host_clock.hpp"
#include "weldcell/adapters/laser_commands.hpp"
#include "weldcell/adapters/laser_push.hpp"
#include "weldcell/adapters/laser_tcp.hpp"
#include "weldcell/adapters/systemd.hpp"

namespace weldcell::app {

namespace {

constexpr Nanoseconds kPoll = 100 * kMillisecond;
constexpr int kRetry_ms = 500, kRetryRefused_ms = 5000;

bool stopping(const Wiring& wiring) { return wiring.stopping.load(std::memory_order_relaxed); }

/// Bytes to the cell while the link stands.
template <typename Link>
void pump(Wiring& wiring, Link& link) {
  LaserItem item;
  while (!stopping(wiring)) {
    const adapters::LaserArrival got = link.receive(item.bytes, kPoll);
    wiring.beat(ThreadName::Laser);
    if (got.event == adapters::LinkEvent::Timeout) continue;
    if (got.event != adapters::LinkEvent::Data) return;
    if (!wiring.wants_laser.load(std::memory_order_relaxed)) continue;
    item.arrival = got.arrival;
    item.size = static_cast<std::uint16_t>(got.bytes);
    wiring.laser.push(item);
  }
}

/// A sensor that is set otherwise than the cell file says stays so until somebody comes: it is asked seldom.
void wait_for_retry(Wiring& wiring, const Error& error) {
  const bool unreachable =
      error.code == "laser.unreachable" || error.code == "laser.timeout" || error.code == "laser.refused";
  for (int left = unreachable ? kRetry_ms : kRetryRefused_ms; left > 0 && !stopping(wiring); left -= 100) {
    wiring.beat(ThreadName::Laser);
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
}

template <typename Connect>
void keep_connected(Wiring& wiring, Connect connect) {
  const files::Endpoint& address = wiring.config.laser;
  std::string told;
  std::optional<HostTime> lost_at;
  while (!stopping(wiring)) {
    auto link = connect();
    wiring.beat(ThreadName::Laser);
    if (!link.ok()) {
      const std::string text = link.error().text();
      if (told != text) {
        spdlog::warn("laser: {}; trying again", text);
        report_link(wiring, job::Link::Laser, false, text);
      }
      told = text;
      wait_for_retry(wiring, link.error());
      continue;
    }
    told.clear();
    std::string detail = fmt::format("{}:{}", address.host, address.port);
    if (lost_at) detail += fmt::format(", after {:.1f} s without it", seconds(adapters::now() - *lost_at));
    report_link(wiring, job::Link::Laser, true, detail);
    pump(wiring, *link);
    lost_at = adapters::now();
    if (!stopping(wiring)) report_link(wiring, job::Link::Laser, false, link->reason());
  }
}

class LaserOverTcp {
 public:
  explicit LaserOverTcp(Wiring& wiring) : wiring_(wiring), config_(wiring.config) {
    limits_.beat = [this] { wiring_.beat(ThreadName::Laser); };
    if (config_.laser_commands == files::LaserCommands::None)
      spdlog::info(
          "laser: no command port (laser.command_port: none): its range, rate, averaging and outputs are "
          "believed");
  }

  Result<adapters::LaserSocket> operator()() {
    wire::LaserWanted wanted;
    wanted.format = config_.laser_format;
    wanted.data_port = config_.laser.port;
    wanted.device = fmt::format("laser {}:{}", config_.laser.host, config_.laser.port);
    if (!config_.laser_password_file.empty()) {
      auto secret = adapters::secret_file(config_.laser_password_file);
      if (!secret.ok()) return secret.error();
      wanted.password = *secret;
    }
    if (config_.laser_commands == files::LaserCommands::Port) {
      const auto notes =
          adapters::set_up_laser(config_.laser.host, config_.laser_command_port, wanted, limits_);
      if (!notes.ok()) return notes.error();
      tell(*notes);
    }
    auto link = adapters::LaserSocket::connect(config_.laser.host, config_.laser.port, kSecond);
    if (!link.ok() || config_.laser_commands != files::LaserCommands::InStream) return link;
    const auto setup = wire::laser_setup(wanted);
    const auto notes = adapters::talk_to_laser(link->fd(), wanted.device, *setup, limits_);
    if (!notes.ok()) return notes.error();
    tell(*notes);
    return link;
  }

 private:
  void tell(const std::vector<std::string>& notes) {
    if (notes == told_) return;
    for (const std::string& note : notes) spdlog::info("laser: the sensor {}", note);
    told_ = notes;
  }

  Wiring& wiring_;
  const files::CellConfig& config_;
  adapters::TalkLimits limits_;
  std::vector<std::string> told_;
};

}  // namespace

void run_laser(Wiring& wiring) {
  const files::CellConfig& c = wiring.config;
  if (c.laser_format.dialect == wire::LaserDialect::Od5000) {
    bool told = false;
    keep_connected(wiring, [&] {
      auto link = adapters::LaserPush::start(c.laser.host, c.laser.port, c.laser_listen.host,
                                             c.laser_listen.port, c.laser_format, 300 * kMillisecond);
      if (link.ok() && !told) {
        for (const std::string& note : link->notes()) spdlog::info("laser: the sensor {}", note);
        told = true;
      }
      return link;
    });
  } else {
    keep_connected(wiring, LaserOverTcp(wiring));
  }
}

}  // namespace weldcell::app
