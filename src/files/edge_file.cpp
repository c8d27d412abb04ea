#include "weldcell/files/edge_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>

#include "weldcell/files/schema.hpp"

namespace weldcell::files {

namespace {

constexpr std::size_t kMaxRows = 1'000'000;
constexpr std::size_t kMaxFaults = 50;

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && (text.front() == ' ' || text.front() == '\t')) text.remove_prefix(1);
  while (!text.empty() && (text.back() == ' ' || text.back() == '\t' || text.back() == '\r'))
    text.remove_suffix(1);
  return text;
}

/// What a message may show of foreign text: at most 40 characters, none that a terminal would act upon.
std::string shown(std::string_view text) {
  std::string out(text.substr(0, 40));
  for (char& c : out) {
    if (c < ' ' || c > '~') c = '?';
  }
  return text.size() > 40 ? out + "..." : out;
}

struct Column {
  const char* name;
  bool required;
  bool may_be_empty = false;  ///< an empty field is NaN
};

/// A CSV of numbers with a header: the columns in any order, required and optional ones.
class Table {
 public:
  Table(std::string_view csv, std::string file, std::vector<Column> columns)
      : csv_(csv), file_(std::move(file)), columns_(std::move(columns)), place_(columns_.size(), -1) {
    // Spreadsheets put a byte order mark before UTF-8.
    if (csv_.starts_with("\xEF\xBB\xBF")) csv_.remove_prefix(3);
  }

  /// Calls row(values, line) for each row whose numbers are sound; values stand in the order of `columns`,
  /// NaN = absent.
  template <typename Row>
  void read(Row row) {
    int line = 0;
    bool header = true;
    std::size_t rows = 0;
    std::vector<double> values(columns_.size());
    while (!csv_.empty() && faults.size() < kMaxFaults) {
      const std::size_t end = csv_.find('\n');
      const std::string_view text = trimmed(csv_.substr(0, end));
      csv_ = end == std::string_view::npos ? std::string_view{} : csv_.substr(end + 1);
      ++line;
      if (text.empty() || text.front() == '#') continue;
      if (header) {
        header = false;
        if (!read_header(text, line)) return;
      } else if (++rows > kMaxRows) {
        fault(line, "", fmt::format("more than {} rows", kMaxRows), "split the file");
        return;
      } else if (read_row(text, line, values)) {
        row(values, line);
      }
    }
    if (header) fault(0, "", "is empty", "the first line names the columns: " + names());
  }

  bool fault(int line, const std::string& key, std::string what, std::string mend) {
    faults.push_back({file_, line, key, std::move(what), std::move(mend)});
    return false;
  }

  Faults faults;

 private:
  std::string names() const {
    std::string out;
    for (const Column& c : columns_) out += (out.empty() ? "" : ",") + std::string(c.name);
    return out;
  }

  template <typename Field>
  static std::size_t split(std::string_view text, Field field) {
    std::size_t count = 0;
    while (true) {
      const std::size_t comma = text.find(',');
      field(count++, trimmed(text.substr(0, comma)));
      if (comma == std::string_view::npos) return count;
      text = text.substr(comma + 1);
    }
  }

  bool read_header(std::string_view text, int line) {
    const std::size_t faults_before = faults.size();
    std::vector<std::string> known;
    for (const Column& c : columns_) known.emplace_back(c.name);
    fields_ = split(text, [&](std::size_t at, std::string_view name) {
      for (std::size_t c = 0; c < columns_.size(); ++c) {
        if (name != columns_[c].name) continue;
        if (place_[c] >= 0) fault(line, known[c], "stands twice in the header", "remove one of the two");
        place_[c] = static_cast<int>(at);
        return;
      }
      const std::string near = nearest_word(std::string(name), known);
      fault(line, shown(name), "unknown column",
            near.empty() ? "known: " + names() : "did you mean '" + near + "'?");
    });
    for (std::size_t c = 0; c < columns_.size(); ++c) {
      if (columns_[c].required && place_[c] < 0)
        fault(line, known[c], "the column is missing", "the header is " + names());
    }
    return faults.size() == faults_before;
  }

  bool read_row(std::string_view text, int line, std::vector<double>& values) {
    std::fill(values.begin(), values.end(), std::nan(""));
    const std::size_t faults_before = faults.size();
    const std::size_t count = split(text, [&](std::size_t at, std::string_view field) {
      for (std::size_t c = 0; c < columns_.size(); ++c) {
        if (place_[c] != static_cast<int>(at)) continue;
        if (field.empty() && columns_[c].may_be_empty) continue;
        if (field.size() > 1 && field.front() == '+') field.remove_prefix(1);
        const auto [rest, error] = std::from_chars(field.data(), field.data() + field.size(), values[c]);
        if (error != std::errc{} || rest != field.data() + field.size() || !std::isfinite(values[c])) {
          fault(line, columns_[c].name, "'" + shown(field) + "' is not a finite number", "write a number");
        } else if (std::abs(values[c]) > 1e6) {
          fault(line, columns_[c].name, "'" + shown(field) + "' is out of range", "-1e6 to 1e6");
        }
      }
    });
    if (count != fields_) {
      return fault(line, "", fmt::format("has {} fields", count), fmt::format("the header has {}", fields_));
    }
    return faults.size() == faults_before;
  }

  std::string_view csv_;
  std::string file_;
  std::vector<Column> columns_;
  std::vector<int> place_;
  std::size_t fields_ = 0;
};

double or_zero(double value) { return std::isnan(value) ? 0 : value; }

}  // namespace

std::variant<EdgeSet, Faults> parse_edges(std::string_view csv, const std::string& name) {
  Table table(csv, name,
              {{"x_mm", true},
               {"y_mm", true},
               {"dir_x", true},
               {"dir_y", true},
               {"step", true},
               {"sigma_mm", false},
               {"speed_mm_s", false},
               {"shadowed", false},
               {"top_z_mm", false, true},
               {"table_z_mm", false, true}});
  EdgeSet out;
  table.read([&](const std::vector<double>& v, int line) {
    EdgePoint e{
        v[0], v[1], v[2], v[3], static_cast<int>(v[4]), or_zero(v[5]), or_zero(v[6]), or_zero(v[7]) != 0};
    const double length = std::hypot(e.dir_x, e.dir_y);
    if (length > 0 && std::abs(length - 1) > 0.01) {
      table.fault(line, "dir_x", fmt::format("the direction has length {:.4f}", length),
                  "length 1, or 0,0 when unknown");
    } else if (length > 0) {
      e.dir_x /= length;
      e.dir_y /= length;
    }
    if (v[4] != -1 && v[4] != 0 && v[4] != 1)
      table.fault(line, "step", fmt::format("{:g} is no step", v[4]), "1, 0 or -1");
    if (e.sigma_mm < 0) table.fault(line, "sigma_mm", "is negative", "0 = unknown");
    if (e.speed_mm_s < 0) table.fault(line, "speed_mm_s", "is negative", "0 = unknown");
    out.edges.push_back(e);
    out.top_z_mm.push_back(v[8]);
    out.table_z_mm.push_back(v[9]);
  });
  if (!table.faults.empty()) return table.faults;
  for (std::vector<double>* heights : {&out.top_z_mm, &out.table_z_mm}) {
    if (std::ranges::all_of(*heights, [](double z) { return std::isnan(z); })) heights->clear();
  }
  return out;
}

std::variant<std::vector<PathPiece>, Faults> parse_path(std::string_view csv, const std::string& name) {
  Table table(csv, name, {{"x0_mm", true}, {"y0_mm", true}, {"x1_mm", true}, {"y1_mm", true}});
  std::vector<PathPiece> out;
  table.read([&](const std::vector<double>& v, int) { out.push_back({v[0], v[1], v[2], v[3]}); });
  if (!table.faults.empty()) return table.faults;
  return out;
}

std::variant<std::vector<calibrate::GaugeCrossing>, Faults> parse_gauge(std::string_view csv,
                                                                        const std::string& name) {
  Table table(csv, name,
              {{"pass", false},
               {"direction", true},
               {"speed_mm_s", true},
               {"x_mm", true},
               {"sigma_mm", false},
               {"edge", false},
               {"along_mm", false}});
  std::vector<calibrate::GaugeCrossing> out;
  table.read([&](const std::vector<double>& v, int line) {
    calibrate::GaugeCrossing c;
    c.direction = v[1];
    c.speed_mm_s = v[2];
    c.across_mm = v[3];
    c.sigma_mm = or_zero(v[4]);
    c.edge = static_cast<int>(or_zero(v[5]));
    c.along_mm = or_zero(v[6]);
    if (v[1] != 1 && v[1] != -1)
      table.fault(line, "direction", fmt::format("{:g} is no direction", v[1]), "1 or -1");
    if (!(c.speed_mm_s > 0)) table.fault(line, "speed_mm_s", "is not above 0", "the speed of the pass, mm/s");
    if (c.sigma_mm < 0) table.fault(line, "sigma_mm", "is negative", "0 = unknown");
    out.push_back(c);
  });
  if (!table.faults.empty()) return table.faults;
  return out;
}

std::string edges_csv(std::span<const EdgePoint> edges, std::span<const double> top_z_mm,
                      std::span<const double> table_z_mm) {
  const bool shadows = std::ranges::any_of(edges, &EdgePoint::shadowed);
  std::string out = "x_mm,y_mm,dir_x,dir_y,step,sigma_mm,speed_mm_s";
  if (shadows) out += ",shadowed";
  if (!top_z_mm.empty()) out += ",top_z_mm";
  if (!table_z_mm.empty()) out += ",table_z_mm";
  out += "\n";
  for (std::size_t i = 0; i < edges.size(); ++i) {
    const EdgePoint& e = edges[i];
    out += fmt::format("{:.4f},{:.4f},{:.6f},{:.6f},{},{:.4f},{:.3f}", e.x_mm, e.y_mm, e.dir_x, e.dir_y,
                       e.step, e.sigma_mm, e.speed_mm_s);
    if (shadows) out += e.shadowed ? ",1" : ",0";
    for (const std::span<const double> heights : {top_z_mm, table_z_mm}) {
      // An empty field = unknown.
      if (!heights.empty()) out += std::isfinite(heights[i]) ? fmt::format(",{:.4f}", heights[i]) : ",";
    }
    out += "\n";
  }
  return out;
}

std::string path_csv(const std::vector<PathPiece>& path) {
  std::string out = "x0_mm,y0_mm,x1_mm,y1_mm\n";
  for (const PathPiece& p : path) {
    out += fmt::format("{:.4f},{:.4f},{:.4f},{:.4f}\n", p.x0_mm, p.y0_mm, p.x1_mm, p.y1_mm);
  }
  return out;
}

}  // namespace weldcell::files
