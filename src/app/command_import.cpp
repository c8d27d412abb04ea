// weldcell import: STEP or DXF -> workpiece.yaml, through the limited child weldcell-cad.
#include <fmt/format.h>

#include <cstdio>
#include <cstring>
#include <vector>

#include "app/command_line.hpp"
#include "app/places.hpp"
#include "weldcell/adapters/cad_child.hpp"
#include "weldcell/base/markup.hpp"
#include "weldcell/files/workpiece_file.hpp"
#include "weldcell/geometry/boxes.hpp"

namespace weldcell::app {

namespace {

/// The workpiece from above, y up: outlines, round edges dashed, welds red.
std::string svg_of(const workpiece::Workpiece& workpiece) {
  Box2 all = bounds(workpiece.members.front().outline);
  for (const workpiece::Member& m : workpiece.members) all = united(all, bounds(m.outline));
  const Vec2 size = all.max - all.min;
  const double margin = 0.06 * size.maxCoeff(), letter = 0.025 * size.maxCoeff();
  std::string out = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"{:.3f} {:.3f} {:.3f} {:.3f}\" width=\"1000\" "
      "font-family=\"sans-serif\" "
      "font-size=\"{:.2f}\">\n<title>{}</title>\n<g stroke-width=\"1.2\" "
      "vector-effect=\"non-scaling-stroke\">\n",
      all.min.x() - margin, -all.max.y() - margin, size.x() + 2 * margin, size.y() + 2 * margin, letter,
      escaped(workpiece.name));
  for (const workpiece::Member& m : workpiece.members) {
    out += "<polygon fill=\"#dfe7ee\" stroke=\"#234\" vector-effect=\"non-scaling-stroke\" points=\"";
    for (const Vec2& p : m.outline) out += fmt::format("{:.3f},{:.3f} ", p.x(), -p.y());
    const Vec2 c = centroid(m.outline);
    out += fmt::format(
        "\"/>\n<text x=\"{:.3f}\" y=\"{:.3f}\" text-anchor=\"middle\" dominant-baseline=\"middle\">{} "
        "{}</text>\n",
        c.x(), -c.y(), escaped(m.tag), escaped(m.name));
  }
  for (const workpiece::Weld& w : workpiece.welds) {
    out +=
        "<polyline fill=\"none\" stroke=\"#c22\" stroke-width=\"3\" vector-effect=\"non-scaling-stroke\" "
        "points=\"";
    for (const Eigen::Vector3d& p : workpiece::sample_path(w, 2))
      out += fmt::format("{:.3f},{:.3f} ", p.x(), -p.y());
    out += fmt::format("\"><title>{}</title></polyline>\n", escaped(w.name));
  }
  return out + "</g>\n</svg>\n";
}

int refuse(const std::string& message) {
  std::fprintf(stderr, "%s\n", message.c_str());
  return 2;
}

int write(const std::string& path, const std::string& text) {
  const Status written = write_file_durably(path, text);
  return written.ok() ? 0 : refuse(written.error().text());
}

}  // namespace

int command_import(Arguments arguments) {
  std::vector<const char*> words(arguments.begin(), arguments.end());
  for (const char*& word : words) {
    if (std::strcmp(word, "-o") == 0) word = "--output";
  }
  CommandLine line(
      words,
      "usage: weldcell import CAD -o WORKPIECE.yaml [options]\n"
      "Reads a STEP or DXF file into members (silhouettes seen from above) and proposed welds.\n"
      "  -o, --output FILE         where the workpiece goes; - is stdout (default)\n"
      "  --units mm|inch|m         length of one unit of the file, whatever it declares\n"
      "  --plane xy|xz|yz          plane of a STEP file that lies on the table (default xy)\n"
      "  --height MM               height of the top above the table; a DXF needs it\n"
      "  --radius MM               DXF: round top edges along the members' long sides\n"
      "  --drawn flat|silhouette   DXF with --radius: which line is drawn; found out when not said\n"
      "  --svg FILE                draws what was read\n",
      {"output", "units", "plane", "height", "radius", "drawn", "svg"}, {});
  if (line.exit_code()) return *line.exit_code();
  if (line.plain().size() != 1) return line.refuse("import wants one CAD file");
  adapters::CadRequest request;
  request.program = cad_program();
  request.file = line.plain()[0];
  request.options.units = line.value("units");
  request.options.drawn = line.value("drawn");
  request.plane = line.value("plane");
  const auto height = line.number("height", 0), radius = line.number("radius", 0);
  if (!height || !radius) return line.exit_code().value_or(2);
  if (*height < 0 || *radius < 0) return line.refuse("--height and --radius are millimetres above 0");
  request.options.height_mm = *height;
  request.options.edge_radius_mm = *radius;
  std::string warning;
  request.warning = &warning;
  const auto yaml = adapters::import_cad_yaml(request);
  if (!warning.empty()) std::fprintf(stderr, "%s\n", warning.c_str());
  if (!yaml.ok()) return refuse(yaml.error().text());
  const auto read = files::parse_workpiece(*yaml, request.file);
  if (const auto* faults = std::get_if<files::Faults>(&read)) return refuse(files::text(*faults));
  const auto& workpiece = std::get<workpiece::Workpiece>(read);
  if (line.has("svg")) {
    if (const int code = write(line.value("svg"), svg_of(workpiece)); code != 0) return code;
  }
  const std::string output = line.value("output", "-");
  if (output == "-") {
    std::fwrite(yaml->data(), 1, yaml->size(), stdout);
    return 0;
  }
  if (const int code = write(output, *yaml); code != 0) return code;
  std::fprintf(stderr, "%s: %zu members, %zu welds, %g mm high\n", output.c_str(), workpiece.members.size(),
               workpiece.welds.size(), workpiece.height_mm);
  return 0;
}

}  // namespace weldcell::app
