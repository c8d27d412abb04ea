// weldcell localize: edge points of one scan, or of a folder of scans, to pose, covariance and verdict.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <sstream>

#include "app/command_line.hpp"
#include "app/localize_json.hpp"
#include "weldcell/base/units.hpp"
#include "weldcell/files/edge_file.hpp"
#include "weldcell/files/workpiece_file.hpp"
#include "weldcell/localize/height.hpp"
#include "weldcell/localize/localizer.hpp"

namespace weldcell::app {

namespace {

namespace fs = std::filesystem;
using localize::Localization;

constexpr const char* kUsage =
    "usage: weldcell localize --workpiece W.yaml --edges E.csv|DIR [--path P.csv] [--planned X,Y,DEG]\n"
    "                         [--range MM,DEG] [--method robust|paper] [--json]\n"
    "Edge points of a scan -> pose of the part, its covariance, its members and whether to weld.\n"
    "  --edges DIR   every NNN.edges.csv of the folder, with NNN.path.csv beside it; one line each\n"
    "  --path        pieces of the beam's travel with valid readings: an edge not seen there counts\n"
    "  --planned     where the part should lie, mm and degrees (default 0,0,0)\n"
    "  --range       how far it may be from there (default 50,20; 180 degrees search the full circle)\n"
    "exit codes: 0 accepted (or the folder is done), 1 not accepted, 2 bad input\n";

/// "a,b,c" as exactly `count` finite numbers.
bool parse_numbers(const std::string& text, std::size_t count, std::vector<double>* out) {
  out->clear();
  std::stringstream in(text);
  for (std::string item; std::getline(in, item, ',');) {
    char* end = nullptr;
    const double value = std::strtod(item.c_str(), &end);
    if (item.empty() || *end != '\0' || !std::isfinite(value)) return false;
    out->push_back(value);
  }
  return out->size() == count;
}

bool read_text(const std::string& path, std::string* out) {
  std::ifstream in(path, std::ios::binary);
  if (!in) {
    std::fprintf(stderr, "%s: cannot be read: check the name\n", path.c_str());
    return false;
  }
  out->assign(std::istreambuf_iterator<char>(in), {});
  return true;
}

template <typename T>
bool kept(std::variant<T, files::Faults>&& parsed, T* out) {
  if (const auto* faults = std::get_if<files::Faults>(&parsed)) {
    std::fprintf(stderr, "%s\n", files::text(*faults).c_str());
    return false;
  }
  *out = std::get<T>(std::move(parsed));
  return true;
}

struct Job {
  workpiece::Workpiece workpiece;
  localize::Localizer localizer;
  localize::LocalizeOptions options;
  bool json = false;
};

void print_words(const Job& job, const nlohmann::json& result, const Localization& found) {
  const localize::Offset off =
      localize::offset_from_planned(job.localizer.outline(), job.options.planned, found.pose);
  std::printf("%s: %s\n", result["verdict"].get<std::string>().c_str(),
              result["reason"].get<std::string>().c_str());
  if (found.iterations == 0) return;  // refused before any pose was tried
  std::printf("  pose      x %.3f mm, y %.3f mm, theta %.4f deg\n", found.pose.x_mm, found.pose.y_mm,
              deg(found.pose.theta_rad));
  std::printf("  offset    %.3f mm, %.3f mm, %.4f deg from planned\n", off.dx_mm, off.dy_mm,
              deg(off.dtheta_rad));
  if (!result["covariance_mm_rad"].is_null()) {
    std::printf("  known to  %.3f mm, %.3f mm, %.4f deg (1 sigma)\n",
                result["centroid_sigma_mm"][0].get<double>(), result["centroid_sigma_mm"][1].get<double>(),
                result["theta_sigma_deg"].get<double>());
  }
  std::printf("  points    %d of %d on the part, mean error %.2f mm\n", found.inliers, found.points,
              found.mean_error_mm);
  if (found.latency_s) std::printf("  latency   %.2f ms\n", 1e3 * *found.latency_s);
  for (const char* name : {"top", "table"}) {
    const auto& plane = result[name];
    if (plane.is_null()) continue;
    std::printf("  %-9s z %.2f mm, roll %.3f deg, pitch %.3f deg (1 sigma %.2f mm, %.3f deg, %.3f deg)\n",
                name, plane["z_mm"].get<double>(), plane["roll_deg"].get<double>(),
                plane["pitch_deg"].get<double>(), plane["z_sigma_mm"].get<double>(),
                plane["roll_sigma_deg"].get<double>(), plane["pitch_sigma_deg"].get<double>());
  }
  for (const localize::MemberPose& m : found.members) {
    std::printf("  member    %-12s %+.2f mm, %+.2f mm, %+.3f deg (%.2f mm, %d points)\n", m.name.c_str(),
                m.dx_mm, m.dy_mm, deg(m.dtheta_rad), m.sigma_mm, m.points);
  }
  for (const auto& w : result["welds"]) {
    std::printf("  weld      %-12s %s: bound %.2f of %.2f mm, gap %+.2f mm\n",
                w["name"].get<std::string>().c_str(), w["verdict"].get<std::string>().c_str(),
                w["bound_mm"].get<double>(), w["tolerance_mm"].get<double>(), w["gap_mm"].get<double>());
  }
}

/// One edge file; `file` is named in the output of a folder. Returns the exit code.
int run_one(const Job& job, const std::string& edges_path, const std::string& path_path,
            const std::string& file) {
  std::string text;
  files::EdgeSet seen;
  std::vector<PathPiece> path;
  if (!read_text(edges_path, &text) || !kept(files::parse_edges(text, edges_path), &seen)) return 2;
  if (!path_path.empty()) {
    if (!read_text(path_path, &text) || !kept(files::parse_path(text, path_path), &path)) return 2;
  }
  const auto start = std::chrono::steady_clock::now();
  const auto [found, heights] = localize::localize_leaning(job.localizer, seen.edges, seen.top_z_mm,
                                                           seen.table_z_mm, path, job.options);
  const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - start;
  std::vector<weld::WeldCertificate> certificates;
  // Without a pose and its covariance there is nothing to certify a weld by.
  if (!found.covariance.isZero(0)) {
    certificates = weld::certify(job.workpiece, found, weld::CertifyOptions{});
  }
  nlohmann::json result =
      localize_json(job.localizer.outline(), job.options.planned, found, certificates, spent.count());
  result["top"] = plane_json(heights.top);
  result["table"] = plane_json(heights.table);
  if (!file.empty()) result["file"] = file;
  if (job.json) {
    std::printf("%s\n", result.dump().c_str());
  } else {
    if (!file.empty()) std::printf("%s: ", file.c_str());
    print_words(job, result, found);
  }
  return result["accepted"].get<bool>() ? 0 : 1;
}

int run_folder(const Job& job, const std::string& folder) {
  constexpr std::string_view kEnding = ".edges.csv";
  std::vector<std::string> stems;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    if (name.ends_with(kEnding)) stems.push_back(name.substr(0, name.size() - kEnding.size()));
  }
  if (stems.empty()) {
    std::fprintf(stderr, "%s: holds no file NNN.edges.csv\n", folder.c_str());
    return 2;
  }
  std::sort(stems.begin(), stems.end());
  int worst = 0;
  for (const std::string& stem : stems) {
    const std::string base = (fs::path(folder) / stem).string();
    const std::string path = fs::exists(base + ".path.csv") ? base + ".path.csv" : "";
    if (run_one(job, base + ".edges.csv", path, stem + ".edges.csv") == 2) worst = 2;
  }
  return worst;
}

}  // namespace

int command_localize(Arguments arguments) {
  CommandLine line(arguments, kUsage, {"workpiece", "edges", "path", "planned", "range", "method"}, {"json"});
  if (line.exit_code()) return *line.exit_code();
  if (!line.plain().empty()) return line.refuse("unexpected argument '" + line.plain().front() + "'");
  if (!line.has("workpiece") || !line.has("edges"))
    return line.refuse("localize wants --workpiece and --edges");
  std::vector<double> planned, range;
  if (!parse_numbers(line.value("planned", "0,0,0"), 3, &planned))
    return line.refuse("--planned wants X,Y,DEG");
  if (!parse_numbers(line.value("range", "50,20"), 2, &range) || range[0] < 0 || range[1] < 0) {
    return line.refuse("--range wants MM,DEG, both at least 0");
  }
  const std::string method = line.value("method", "robust");
  if (method != "robust" && method != "paper")
    return line.refuse("--method is robust or paper, not '" + method + "'");

  auto workpiece = files::read_workpiece_file(line.value("workpiece"));
  if (const auto* faults = std::get_if<files::Faults>(&workpiece)) {
    std::fprintf(stderr, "%s\n", files::text(*faults).c_str());
    return 2;
  }
  auto outline = workpiece::build_template(std::get<workpiece::Workpiece>(workpiece));
  if (!outline.ok()) {
    std::fprintf(stderr, "%s\n", outline.error().text().c_str());
    return 2;
  }
  localize::LocalizeOptions options;
  options.method = method == "paper" ? localize::Method::Paper : localize::Method::Robust;
  options.planned = {planned[0], planned[1], rad(planned[2])};
  options.range_mm = options.max_offset_mm = range[0];
  options.range_rad = options.max_rotation_rad = rad(range[1]);
  const Job job{std::get<workpiece::Workpiece>(std::move(workpiece)),
                localize::Localizer(std::move(*outline)), options, line.has("json")};
  const std::string edges = line.value("edges");
  if (fs::is_directory(edges)) return run_folder(job, edges);
  return run_one(job, edges, line.value("path"), "");
}

}  // namespace weldcell::app
