// Ours beside the Point Cloud Library's ICP on the same scans.
#include "book.hpp"
#include "pcl_icp.hpp"

namespace weldcell::bench {

void peers(Book& book) {
  if (!has_pcl()) {
    if (book.wanted("pcl") && !book.options.json)
      std::fprintf(stderr, "pcl: not built in; install libpcl-dev and build again to compare with its ICP\n");
    return;
  }
  Setting base, out30, extreme, late;
  out30.outliers = 0.3;
  extreme.shift_mm = 100, extreme.turn_deg = 180, extreme.outliers = 0.1;
  late.latency_s = 0.008, late.spiral = true;
  const std::pair<const char*, Setting> cases[] = {
      {"base", base}, {"out30", out30}, {"extreme", extreme}, {"lat8 spiral", late}};
  const int trials = std::min(book.options.trials, 100);
  for (const PartUnderTest* part : {&book.known.front(), &book.unseen.front()}) {
    const Solve icp = pcl_icp_of(*part);
    for (const auto& [what, setting] : cases) {
      const std::string name = std::string("pcl ICP ") + what + " " + part->workpiece.name;
      if (!book.wanted(name)) continue;
      const Tally theirs = run_cell(*part, setting, trials, book.options.seed, icp);
      const Tally ours = run_cell(*part, setting, trials, book.options.seed, solver_of(*part, setting));
      const double ratio = theirs.judged > 0 ? theirs.ratio() : NAN;
      book.add(name + " RMS/CRLB, ours beside", ratio, "1", ours.ratio(), NAN, Better::None);
      book.add(name + " success, ours beside", theirs.share(theirs.success), "%", ours.share(ours.success),
               NAN, Better::None);
      book.add(name + " time median, ours beside", theirs.milliseconds(0.5), "ms", ours.milliseconds(0.5),
               NAN, Better::None);
    }
  }
}

}  // namespace weldcell::bench
