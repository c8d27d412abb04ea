// weldcell doctor: is this machine fit to run the cell? Looks, and changes nothing.
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>

#include "app/command_line.hpp"
#include "app/doctor.hpp"
#include "weldcell/files/cell_file.hpp"

namespace weldcell::app {

namespace {

constexpr int kEgmPriority = 70;
constexpr const char* kDefaultPassword = "/etc/weldcell/rws-password";

/// The password is looked at from outside only.
Ailment judge_password(const files::CellConfig& config) {
  const std::string path = config.rws_password_file.empty() ? kDefaultPassword : config.rws_password_file;
  struct stat facts {};
  if (::stat(path.c_str(), &facts) != 0) {
    return {"password", Health::Warn,
            path + ": " + std::strerror(errno) + ": the robot controller is asked without a password",
            "write it there, mode 0600, then: systemctl restart weldcelld"};
  }
  if ((facts.st_mode & S_IRWXO) != 0)
    return {"password", Health::Fail, path + ": everybody may read this secret", "chmod 0600 " + path};
  return {"password", Health::Ok, path + " is there", ""};
}

void look_at_cell(const files::CellConfig& config, Ailments& out) {
  const auto add = [&](const Ailments& more) { out.insert(out.end(), more.begin(), more.end()); };
  out.push_back(judge_password(config));
  out.push_back(judge_port({"egm", config.egm.host, config.egm.port, true,
                            adapters::port_facts(true, config.egm.host, config.egm.port)}));
  out.push_back(judge_port({"modbus", config.modbus.host, config.modbus.port, false,
                            adapters::port_facts(false, config.modbus.host, config.modbus.port)}));
  add(judge_card({"egm", config.egm.host, true, adapters::card_of(config.egm.host)}));
  add(judge_card({"modbus", config.modbus.host, true, adapters::card_of(config.modbus.host)}));
  add(judge_card({"robot", config.rws.host, false, adapters::card_towards(config.rws.host)}));
  add(judge_card({"laser", config.laser.host, false, adapters::card_towards(config.laser.host)}));
  out.push_back(judge_disk({"spool", config.spool_dir, adapters::disk_facts(config.spool_dir)}));
  out.push_back(judge_disk({"state", config.state_dir, adapters::disk_facts(config.state_dir)}));
}

}  // namespace

int command_doctor(Arguments arguments) {
  CommandLine line(
      arguments,
      "usage: weldcell doctor [--config CELL] [--json]\n"
      "Is this machine fit to run the cell? Real-time rights, kernel, network cards, ports, disks, "
      "clock: each line\n"
      "ok, warn or fail with its cause and what to do. Looks, and changes nothing; as root it sees "
      "more.\n"
      "  --config CELL   the daemon's cell file (default /etc/weldcell/cell.yaml)\n"
      "exit codes: 0 nothing failed, 1 something failed, 2 bad usage\n",
      {"config"}, {"json"});
  if (line.exit_code()) return *line.exit_code();
  const std::string path = line.value("config", "/etc/weldcell/cell.yaml");
  Ailments out;
  const auto read = files::read_cell_file(path);
  const auto* config = std::get_if<files::CellConfig>(&read);
  if (config != nullptr) {
    out.push_back({"cell file", Health::Ok, path + " is sound", ""});
  } else {
    out.push_back(
        {"cell file", Health::Fail,
         files::text(std::get<files::Faults>(read)) + " (ports, cards and disks were not looked at)",
         "weldcell check " + path});
  }
  const auto add = [&](const Ailments& more) { out.insert(out.end(), more.begin(), more.end()); };
  const adapters::KernelFacts kernel = adapters::kernel_facts();
  add(judge_real_time(kernel, adapters::process_named("weldcelld"), adapters::try_real_time(kEgmPriority),
                      ::geteuid() == 0));
  add(judge_kernel(kernel));
  add(judge_clock(adapters::clock_facts(), kernel));
  if (config != nullptr) look_at_cell(*config, out);
  std::fputs((line.has("json") ? ailments_json(out) : ailments_text(out)).c_str(), stdout);
  return any_failed(out) ? 1 : 0;
}

}  // namespace weldcell::app
