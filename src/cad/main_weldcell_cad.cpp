// weldcell-cad: one STEP or DXF file -> a workpiece as YAML on stdout. Runs as a limited child of the other
// programs.
#include <unistd.h>

#include <Standard_Failure.hxx>
#include <array>
#include <charconv>
#include <csignal>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <string>

#include "cad/cad_part.hpp"
#include "cad/weldment.hpp"
#include "weldcell/files/workpiece_file.hpp"

namespace {

using namespace weldcell;

constexpr const char* kUsage =
    "usage: weldcell-cad FILE.step|FILE.stp|FILE.dxf [options]\n"
    "Prints a workpiece as YAML: each member's silhouette seen from above, and welds along the contact "
    "lines.\n"
    "  --units mm|inch|m         length of one unit of the file, whatever it declares\n"
    "  --plane xy|xz|yz          plane of a STEP file that lies on the table (default xy)\n"
    "  --height MM               height of the top above the table; a DXF needs it\n"
    "  --radius MM               DXF: round top edges along the members' long sides\n"
    "  --drawn flat|silhouette   DXF with --radius: which line is drawn; found out when not said\n"
    "Exit codes: 0 done, 2 bad input or usage.\n";

int refuse(const std::string& message) {
  std::fprintf(stderr, "%s\n", message.c_str());
  return 2;
}

bool read_millimetres(const std::string& text, double& value) {
  const auto [rest, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc{} && rest == text.data() + text.size() && value > 0 && value <= 2000;
}

/// One option and its value; the message of a fault, or "".
std::string take_option(const std::string& name, const std::string& value, cad::Options& options) {
  if (name == "--units") {
    options.units = value;
    return cad::mm_per_unit(value) > 0 ? "" : "--units '" + value + "': one of mm, inch, m";
  }
  if (name == "--plane") {
    if (value == "xy")
      options.plane = cad::Plane::Xy;
    else if (value == "xz")
      options.plane = cad::Plane::Xz;
    else if (value == "yz")
      options.plane = cad::Plane::Yz;
    else
      return "--plane '" + value + "': one of xy, xz, yz";
    return "";
  }
  if (name == "--height") {
    return read_millimetres(value, options.height_mm)
               ? ""
               : "--height '" + value + "': millimetres, above 0 to 2000";
  }
  if (name == "--radius") {
    if (value == "0") return "";
    return read_millimetres(value, options.edge_radius_mm)
               ? ""
               : "--radius '" + value + "': millimetres, 0 to 2000";
  }
  if (name == "--drawn") {
    if (value == "flat")
      options.drawn = cad::Drawn::Flat;
    else if (value == "silhouette")
      options.drawn = cad::Drawn::Silhouette;
    else
      return "--drawn '" + value + "': one of flat, silhouette";
    return "";
  }
  return "unknown option '" + name + "'; try --help";
}

std::string lower(std::string text) {
  for (char& c : text) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c + 32) : c;
  return text;
}

Result<cad::CadPart> read_any(const std::string& path, const cad::Options& options) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error))
    return cad::fault("cad.missing", "no such file", "check the path");
  if (std::filesystem::file_size(path, error) > 100'000'000) {
    return cad::fault("cad.limit", "is bigger than 100 MB", "export only the frame's members");
  }
  const std::string ending = lower(std::filesystem::path(path).extension().string());
  if (ending == ".step" || ending == ".stp") return cad::read_step(path, options);
  if (ending == ".dxf") return cad::read_dxf(path, options);
  return cad::fault("cad.kind", "'" + ending + "' is no CAD file that can be read",
                    "give a .step, .stp or .dxf file");
}

int run(const std::string& path, const cad::Options& options) {
  auto part = read_any(path, options);
  if (!part.ok()) return refuse(path + ": " + part.error().text());
  auto workpiece = cad::make_workpiece(*part, std::filesystem::path(path).stem().string());
  if (!workpiece.ok()) return refuse(path + ": " + workpiece.error().text());
  for (const std::string& note : part->notes) std::printf("# %s\n", note.c_str());
  const std::string yaml = files::workpiece_yaml(*workpiece);
  std::fwrite(yaml.data(), 1, yaml.size(), stdout);
  return std::fflush(stdout) == 0 ? 0 : 3;
}

/// The CAD library crashes on some damaged files; the user still gets one line.
extern "C" void on_crash(int) {
  static constexpr char kLine[] =
      "the CAD library crashed on this file: heal the model and export it again\n";
  const ssize_t written = ::write(2, kLine, sizeof kLine - 1);
  ::_exit(written > 0 ? 2 : 3);
}

void catch_crashes() {
  static std::array<char, 65536> stack;
  stack_t alternate{};
  alternate.ss_sp = stack.data();
  alternate.ss_size = stack.size();
  ::sigaltstack(&alternate, nullptr);
  struct sigaction action {};
  action.sa_handler = on_crash;
  action.sa_flags = SA_ONSTACK;
  for (const int signal : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT}) ::sigaction(signal, &action, nullptr);
}

}  // namespace

int main(int argc, char** argv) {
  std::string path;
  weldcell::cad::Options options;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    if (word == "--help" || word == "-h") {
      std::fputs(kUsage, stdout);
      return 0;
    }
    if (word.rfind("--", 0) == 0) {
      if (i + 1 >= argc) return refuse("weldcell-cad: " + word + " needs a value; try --help");
      const std::string message = take_option(word, argv[++i], options);
      if (!message.empty()) return refuse("weldcell-cad: " + message);
    } else if (path.empty()) {
      path = word;
    } else {
      return refuse("weldcell-cad: one file at a time, not also '" + word + "'");
    }
  }
  if (path.empty()) return refuse("weldcell-cad: which file? try --help");
  catch_crashes();
  try {
    return run(path, options);
  } catch (const Standard_Failure& failure) {
    const char* text = failure.GetMessageString();
    return refuse(
        path + ": the CAD library gave up: " + (text != nullptr && *text != '\0' ? text : "no reason given") +
        ": heal the model and export it again");
  } catch (const std::exception& failure) {
    return refuse(path + ": cannot be read: " + failure.what() + ": heal the model and export it again");
  }
}
