#include <algorithm>
#include <array>
#include <string_view>

#include "weldcell/review/report.hpp"

namespace weldcell::review {

namespace {

using localize::Verdict;

struct Advice {
  std::string_view cause;  ///< the code, or its part before the dot with the dot
  std::string_view text;
};

/// First match counts: exact codes stand before their families.
constexpr std::array kAdvice{
    Advice{"too_few_points",
           "Scan with a smaller pitch, or look whether the part lies where it was planned at all."},
    Advice{"not_enough",
           "Scan the edge named above once more; a pass across it in both directions serves best."},
    Advice{"ambiguous",
           "Scan the member that tells one end of the part from the other, or turn the part as drawn."},
    Advice{"mirrored", "Turn the part over: it lies with its other face up."},
    Advice{"wrong_revision",
           "Check the drawing: the part on the table has other dimensions than the one of this job."},
    Advice{"member_missing", "Look whether the member named above is in place, then scan again."},
    Advice{"out_of_range", "Move the part closer to the planned place, or allow a larger offset in the job."},
    Advice{"clutter", "Clear the table of everything that is not the part, then scan again."},
    Advice{"no_fit",
           "Check that the part on the table is the one of this job, clear the table and scan again."},
    Advice{"laser.",
           "Check the laser's power, cable and window; then arm the cell again and resume the job."},
    Advice{"egm.",
           "Check the robot's network cable and that the controller is in automatic; then arm the cell again "
           "and resume the job."},
    Advice{"rws.",
           "Check that the controller is in automatic with motors on, then arm the cell again and resume the "
           "job."},
    Advice{
        "robot.",
        "Look at the controller's event log, clear the cause, then arm the cell again and resume the job."},
    Advice{"plc.", "Check the PLC and its network cable; then arm the cell again and resume the job."},
    Advice{"plan.",
           "Move the planned place towards the robot's middle, or lower the scan's speed in the job."},
    Advice{"weld.unreachable",
           "Move the part towards the robot's middle, or change the torch angles of the weld named above."},
    Advice{"weld.", "Weld the seam named above manually."},
    Advice{"cad.", "Correct the CAD file or the job as the message says, and drop the job again."},
    Advice{"workpiece.", "Correct the workpiece file as the message says, and drop the job again."},
};

std::string_view advice_for(std::string_view cause) {
  for (const Advice& a : kAdvice) {
    const bool family = a.cause.back() == '.';
    if (family ? cause.substr(0, a.cause.size()) == a.cause : cause == a.cause) return a.text;
  }
  // "localize.ambiguous" and "ambiguous" are the same cause.
  const auto dot = cause.find('.');
  return dot == std::string_view::npos ? std::string_view{} : advice_for(cause.substr(dot + 1));
}

}  // namespace

std::vector<std::string> advice(const ReportInput& input) {
  std::vector<std::string> out;
  const auto say = [&](std::string_view text) {
    if (!text.empty() && std::find(out.begin(), out.end(), text) == out.end()) out.emplace_back(text);
  };
  const bool failed = input.state == "failed" || input.state == "aborted" || !input.cause.empty();
  const bool doubted = input.found && input.verdict != Verdict::Weld;
  const bool finished = input.state == "done" && input.verdict == Verdict::Weld;
  if (finished || !(failed || doubted)) return out;
  say(advice_for(input.cause));
  if (input.found && input.found->verdict != Verdict::Weld && input.found->cause != input.cause) {
    say(advice_for(input.found->cause));
  }
  for (const Verdict grave : {Verdict::Reject, Verdict::Rescan}) {
    for (const weld::WeldCertificate& c : input.certificates) {
      if (c.verdict == grave && (!input.found || input.found->verdict == Verdict::Weld)) say(c.reason);
    }
  }
  if (doubted && input.verdict == Verdict::Rescan) say("Start the scan again; nothing has been welded.");
  // A device that failed says nothing about the part.
  const bool of_the_part = input.found || input.cause.find('.') == std::string::npos ||
                           input.cause.starts_with("weld.") || input.cause.starts_with("localize.");
  if (input.verdict == Verdict::Reject && of_the_part && !(input.cause.empty() && !input.found)) {
    say("Weld this part manually, or put it right and start the job anew.");
  }
  if (out.empty())
    say("Read the last events below, put the cause right, then arm the cell again and resume the job.");
  return out;
}

}  // namespace weldcell::review
