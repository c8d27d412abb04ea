// weldcelld: the cell controller daemon. Reads its configuration, makes the threads, keeps spool and control
// socket, and stops in order.
#include <malloc.h>
#include <spdlog/spdlog.h>
#include <sysexits.h>

#include <csignal>
#include <cstdio>
#include <filesystem>

#include "app/cell_thread.hpp"
#include "app/command_line.hpp"
#include "app/control.hpp"
#include "app/device_threads.hpp"
#include "app/log.hpp"
#include "app/places.hpp"
#include "app/spool_keeper.hpp"
#include "app/threads.hpp"
#include "weldcell/adapters/host_clock.hpp"
#include "weldcell/adapters/process_facts.hpp"
#include "weldcell/adapters/systemd.hpp"
#include "weldcell/job/state_table.hpp"
#include "weldcell/rt/thread.hpp"

namespace weldcell::app {

namespace {

volatile std::sig_atomic_t g_signal = 0;
volatile std::sig_atomic_t g_reload = 0;

constexpr const char* kUsage =
    "usage: weldcelld --config cell.yaml [--check] [--ports-file FILE]\n"
    "       weldcelld --print-states\n"
    "The weld cell controller. --check validates the configuration and exits; --print-states prints the "
    "job's state\n"
    "machine as a Graphviz graph; --ports-file tells the ports that were taken, as JSON.\n";

/// The cell file or what it names is wrong: starting again would not mend it.
int refuse(const std::string& text) {
  std::fprintf(stderr, "weldcelld: %s\n", text.c_str());
  return EX_CONFIG;
}

/// The system does not give what is wanted now, such as an address that a slow network card gets later: the
/// service manager tries again.
int fail(const std::string& text) {
  std::fprintf(stderr, "weldcelld: %s\n", text.c_str());
  return 3;
}

/// The controller's password: credential, file, or none. The unit hands over an empty credential where
/// /etc/weldcell/rws-password is missing.
Result<std::string> password_of(const files::CellConfig& config) {
  auto credential = adapters::credential("rws-password");
  if (!credential.ok() && credential.error().code != "credential.absent") return credential;
  if (credential.ok() && !credential->empty()) return credential;
  if (!config.rws_password_file.empty()) return adapters::secret_file(config.rws_password_file);
  spdlog::warn(
      "no password for the robot controller: its credential rws-password is missing or empty; write "
      "/etc/weldcell/rws-password (mode 0600), then systemctl restart weldcelld");
  return std::string{};
}

/// Text of the arm's data file beside the cell file, for the record; empty when the cell file holds the arm
/// itself.
std::string arm_text(const files::CellConfig& config) {
  const auto folder =
      std::filesystem::absolute(config.path).parent_path() / "robots" / (config.setup.arm.name + ".yaml");
  const auto text = read_file(folder.string());
  return text.ok() ? *text : std::string{};
}

/// The cell file's section `modbus`, and the socket that systemd may have opened for it.
Result<adapters::ModbusOptions> modbus_options(const files::CellConfig& config) {
  adapters::ModbusOptions options;
  options.host = config.modbus.host;
  options.port = config.modbus.port;
  options.allowed_clients = config.modbus_allow;
  options.max_clients = config.modbus_max_clients;
  for (const adapters::ListenSocket& socket : adapters::listen_sockets()) {
    if (options.listen_fd >= 0 || socket.name != "modbus")
      return Error{"socket", "socket '" + socket.name + "' from systemd", "is not known here",
                   "pass one, with FileDescriptorName=modbus"};
    options.listen_fd = socket.fd;
    // The socket may listen anywhere, whatever modbus.listen says.
    if (config.modbus_allow.empty())
      return Error{"socket", "modbus.allow", "is empty, and systemd opened the port for everybody",
                   "name who may connect: allow: [<the PLC's address>]"};
  }
  return options;
}

/// SIGHUP: the cell file is read again; who may connect to Modbus counts from now on, everything else at the
/// next start. A file that is not sound changes nothing.
void reload(Wiring& wiring) {
  adapters::notify_reloading();
  auto read = files::read_cell_file(wiring.config.path);
  if (const auto* faults = std::get_if<files::Faults>(&read)) {
    spdlog::error("not reloaded, nothing changed: {}", files::text(*faults));
  } else {
    const auto& config = std::get<files::CellConfig>(read);
    if (config.modbus_allow.empty() && !wiring.config.modbus_allow.empty()) {
      spdlog::error("not reloaded: modbus.allow is empty now, the port would be open to everybody");
      adapters::notify_ready("not reloaded");
      return;
    }
    wiring.modbus_access.push({config.modbus_allow, config.modbus_max_clients});
    spdlog::info("reloaded modbus.allow and modbus.max_clients; {}",
                 config.text == wiring.config.text ? "the file is as it was at the start"
                                                   : "whatever else changed counts after a restart");
  }
  adapters::notify_ready("reloaded");
}

Status write_ports(const std::string& path, const Wiring& wiring) {
  if (path.empty()) return Done{};
  return write_file_durably(path, fmt::format("{{\"egm\": {}, \"modbus\": {}}}\n", wiring.egm_port.load(),
                                              wiring.modbus_port.load()));
}

/// Asks for a controlled stop when something moves, and waits until it rests.
void come_to_rest(Wiring& wiring, const SpoolKeeper&) {
  if (!job::under_way(wiring.status().state)) return;
  wiring.inbox.push({job::OperatorCommand{wire::PlcCommand::Stop, "daemon's end"}, nullptr, nullptr});
  for (int i = 0; i < 30 && job::under_way(wiring.status().state); ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  std::this_thread::sleep_for(std::chrono::milliseconds(700));  // the ramp to rest, and RAPID's stop over RWS
}

int serve(const files::CellConfig& config, const std::string& ports_file) {
  const auto password = password_of(config);
  if (!password.ok()) return refuse(password.error().text());
  const auto resident = resident_modules(config.setup);
  if (!resident.ok()) return refuse("the resident RAPID module: " + resident.error().text());

  std::error_code error;
  std::filesystem::create_directories(config.state_dir, error);
  auto spool = adapters::SpoolDir::open(config.spool_dir);
  if (!spool.ok()) return refuse(spool.error().text());

  const auto wiring = std::make_unique<Wiring>(config);
  auto egm = adapters::EgmSocket::bind(config.egm.host, config.egm.port, config.egm_peer);
  if (!egm.ok()) return fail(egm.error().text());
  const auto options = modbus_options(config);
  if (!options.ok()) return refuse(options.error().text());
  auto modbus = adapters::ModbusServer::listen(*options);
  if (!modbus.ok()) return fail(modbus.error().text());
  wiring->egm_port = egm->port();
  wiring->modbus_port = modbus->port();
  auto control = open_control(*wiring);
  if (!control.ok()) return fail(control.error().text());
  if (const Status told = write_ports(ports_file, *wiring); !told.ok()) return refuse(told.error().text());

  CellThread cell(*wiring, arm_text(config));
  auto threads = start_threads(*wiring, cell, *egm, *modbus, *password, *resident);
  if (!threads.ok())
    return threads.error().code == "realtime" ? refuse(threads.error().text()) : fail(threads.error().text());

  SpoolKeeper keeper(*wiring, std::move(*spool));
  spdlog::info("weldcelld {} serves cell '{}': EGM {}:{}, Modbus {}:{}, spool {}", WELDCELL_VERSION,
               config.setup.name, config.egm.host, wiring->egm_port.load(), config.modbus.host,
               wiring->modbus_port.load(), config.spool_dir);
  adapters::notify_ready("waiting for a job");
  Watchdog watchdog(adapters::now());
  while (g_signal == 0) {
    if (g_reload != 0) {
      g_reload = 0;
      reload(*wiring);
    }
    keeper.step(50 * kMillisecond);
    control->poll(50 * kMillisecond);
    watchdog.step(*wiring, adapters::now());
  }
  adapters::notify_stopping("stopping: the robot comes to rest");
  come_to_rest(*wiring, keeper);
  wiring->stopping = true;
  threads->clear();
  keeper.put_away();
  spdlog::info("ended; resident peak {} kB, cpu {:.1f} s", adapters::peak_rss_kb(), adapters::cpu_seconds());
  return 0;
}

}  // namespace

int weldcelld(Arguments arguments) {
  CommandLine line(arguments, kUsage, {"config", "ports-file"}, {"check", "print-states"});
  if (line.exit_code()) return *line.exit_code();
  if (line.has("print-states")) {
    std::fputs(job::states_dot().c_str(), stdout);
    return 0;
  }
  if (!line.has("config")) return line.refuse("--config is missing");
  auto read = files::read_cell_file(line.value("config"));
  if (const auto* faults = std::get_if<files::Faults>(&read)) {
    std::fprintf(stderr, "%s\n", files::text(*faults).c_str());
    return EX_CONFIG;
  }
  const auto& config = std::get<files::CellConfig>(read);
  if (line.has("check")) {
    std::printf("%s: fine\n", line.value("config").c_str());
    return 0;
  }
  return serve(config, line.value("ports-file"));
}

}  // namespace weldcell::app

int main(int argc, char** argv) {
  // Few arenas: the budget of the daemon is 100 MB resident.
  ::mallopt(M_ARENA_MAX, 2);
  weldcell::app::start_log();
  struct sigaction action {};
  action.sa_handler = [](int signal) { weldcell::app::g_signal = signal; };
  sigaction(SIGTERM, &action, nullptr);
  sigaction(SIGINT, &action, nullptr);
  action.sa_handler = [](int) { weldcell::app::g_reload = 1; };
  sigaction(SIGHUP, &action, nullptr);
  signal(SIGPIPE, SIG_IGN);
  try {
    return weldcell::app::weldcelld(weldcell::app::Arguments(const_cast<const char* const*>(argv) + 1,
                                                             static_cast<std::size_t>(argc - 1)));
  } catch (const std::exception& fault) {
    std::fprintf(stderr, "weldcelld: %s\n", fault.what());
    return 3;
  }
}
