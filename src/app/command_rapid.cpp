// weldcell rapid: the files that a robot controller needs, with this cell's values in them.
#include <cstdio>
#include <filesystem>

#include "app/command_line.hpp"
#include "app/places.hpp"
#include "app/resident_modules.hpp"
#include "weldcell/files/cell_file.hpp"
#include "weldcell/weld/resident.hpp"

namespace weldcell::app {

namespace {

constexpr const char* kUsage =
    "usage: weldcell rapid --cell CELL.yaml --out FOLDER [--address IP]\n"
    "Writes what a robot controller needs: WeldcellEgm and WeldcellMain for RobotWare 6 (.mod) and 7\n"
    "(.modx), SIO.cfg and MOC.cfg for RobotWare 6, and tells the rows to enter by hand. --address is this\n"
    "computer as the controller sees it, when egm.listen names none. docs/COMMISSIONING.md says what to do\n"
    "with them.\n";

bool names_no_computer(const std::string& host) {
  return host.empty() || host == "0.0.0.0" || host == "::" || host.rfind("127.", 0) == 0;
}

/// The files' names and texts, in the order they are told.
Result<std::vector<std::pair<std::string, std::string>>> texts(const files::CellConfig& config,
                                                               const std::string& address) {
  const auto resident = resident_modules(config.setup);
  if (!resident.ok()) return resident.error();
  std::vector<std::pair<std::string, std::string>> out{{"WeldcellEgm.mod", resident->mod},
                                                       {"WeldcellEgm.modx", resident->modx}};
  for (const char* name : {"WeldcellMain.mod", "WeldcellMain.modx", "SIO.cfg", "MOC.cfg"}) {
    const auto read = read_shared_file(std::string("rapid/") + name);
    if (!read.ok()) return read.error();
    out.emplace_back(name, *read);
    if (out.back().first != "SIO.cfg") continue;
    const auto filled = weld::fill_transmission(*read, address, config.egm.port);
    if (!filled.ok()) return filled.error();
    out.back().second = *filled;
  }
  return out;
}

}  // namespace

int command_rapid(Arguments arguments) {
  CommandLine line(arguments, kUsage, {"cell", "out", "address"}, {});
  if (line.exit_code()) return *line.exit_code();
  if (!line.has("cell") || !line.has("out")) return line.refuse("--cell and --out are needed");
  auto cell = files::read_cell_file(line.value("cell"));
  if (const auto* faults = std::get_if<files::Faults>(&cell)) return line.refuse(files::text(*faults));
  const auto& config = std::get<files::CellConfig>(cell);
  const std::string address = line.value("address", config.egm.host);
  if (names_no_computer(address) && !line.has("address")) {
    return line.refuse("egm.listen " + address +
                       " is no address that the controller can send to: name this computer by --address");
  }
  if (config.egm.port == 0) return line.refuse("egm.listen has port 0: the controller needs a fixed one");
  const auto written = texts(config, address);
  if (!written.ok()) return line.refuse(written.error().text());
  std::error_code error;
  std::filesystem::create_directories(line.value("out"), error);
  for (const auto& [name, text] : *written) {
    const Status kept = write_file_durably(line.value("out") + "/" + name, text);
    if (!kept.ok()) {
      std::fprintf(stderr, "weldcell rapid: %s\n", kept.error().text().c_str());
      return 3;
    }
    std::printf("%s/%s\n", line.value("out").c_str(), name.c_str());
  }
  std::printf(
      "UDP device (RobotWare 6: Transmission Protocol, Type UDPUC; RobotWare 7: UDP Unicast Device): Name "
      "%s, Remote Address %s, Remote Port Number %d\n"
      "External Motion Interface Data: Name %s, Level 0, Do Not Restart after Motors Off yes, Default Ramp "
      "Time 0.1, Default Proportional Position Gain 20, Default Low Pass Filter Bandwidth 100\n",
      weld::kEgmDevice, address.c_str(), config.egm.port, weld::kEgmDevice);
  return 0;
}

}  // namespace weldcell::app
