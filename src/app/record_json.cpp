// Outputs and answers of heavy steps as JSON: full digits, so that equal text means equal bits.
#include <nlohmann/json.hpp>

#include "app/localize_json.hpp"
#include "weldcell/app/record.hpp"
#include "weldcell/base/units.hpp"

namespace weldcell::app {

namespace {

using nlohmann::json;

template <typename... Cases>
struct Overloaded : Cases... {
  using Cases::operator()...;
};
template <typename... Cases>
Overloaded(Cases...) -> Overloaded<Cases...>;

std::uint64_t text_digest(const std::string& text) {
  std::uint64_t hash = 14695981039346656037ULL;
  for (const char c : text) hash = (hash ^ static_cast<unsigned char>(c)) * 1099511628211ULL;
  return hash;
}

json joints_json(const kinematics::Joints& q) { return json(q); }

json drawing_json(const guidance::Drawing& drawing) {
  json lines = json::array();
  for (const auto& line : drawing.lines) {
    json points = json::array();
    for (const Vec2& p : line.px) points.push_back({p.x(), p.y()});
    lines.push_back({{"px", points}, {"closed", line.closed}, {"colour", static_cast<int>(line.colour)}});
  }
  json texts = json::array();
  for (const auto& text : drawing.texts) texts.push_back({text.px.x(), text.px.y(), text.text});
  return {{"lines", lines}, {"texts", texts}};
}

json pose_json(const Pose2& pose) { return {pose.x_mm, pose.y_mm, pose.theta_rad}; }

json solution_json(const job::Solution& solution) {
  json edges = json::array();
  for (const EdgePoint& e : solution.evidence.edges)
    edges.push_back({e.x_mm, e.y_mm, e.dir_x, e.dir_y, e.step, e.sigma_mm});
  json covariance = json::array();
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 3; ++k) covariance.push_back(solution.found.covariance(i, k));
  }
  return {{"verdict", localize::to_string(solution.verdict.verdict)},
          {"reason", solution.verdict.reason},
          {"cause", solution.found.cause},
          {"pose", pose_json(solution.found.pose)},
          {"covariance", covariance},
          {"points", solution.found.points},
          {"inliers", solution.found.inliers},
          {"mean_error_mm", solution.found.mean_error_mm},
          {"latency_s", solution.found.latency_s ? json(*solution.found.latency_s) : json()},
          {"edges", edges},
          {"welds", welds_json(solution.certificates)},
          {"rapid_digest", text_digest(solution.rapid)}};
}

template <typename T>
json failed(const Result<T>& result) {
  return {{"ok", false}, {"error", result.error().text()}};
}

}  // namespace

std::string output_json(const job::Output& output) {
  using namespace job;
  return std::visit(Overloaded{
                        [](const RobotRequest& r) -> json {
                          return {
                              {"output", "robot"},          {"id", r.id},
                              {"task", to_string(r.task)},  {"joints_rad", joints_json(r.joints)},
                              {"skip_seams", r.skip_seams}, {"allowed_seams", r.allowed_seams},
                              {"own_only", r.own_only},     {"module_digest", text_digest(r.module_text)}};
                        },
                        [](const ImportRequest&) -> json {
                          return {{"output", "import"}};
                        },
                        [](const PlanRequest&) -> json {
                          return {{"output", "plan"}};
                        },
                        [](const PassRequest&) -> json {
                          return {{"output", "plan_pass"}};
                        },
                        [](const SolveRequest& r) -> json {
                          return {{"output", "solve"},
                                  {"readings", r.scan->readings.size()},
                                  {"frames", r.scan->feedback.size()}};
                        },
                        [](const StartMotion& m) -> json {
                          return {{"output", "motion"}, {"plan", m.plan->id}, {"digest", digest(*m.plan)}};
                        },
                        [](const StopMotion&) -> json {
                          return {{"output", "stop_motion"}};
                        },
                        [](const SetArmed& a) -> json {
                          return {{"output", "armed"}, {"armed", a.armed}};
                        },
                        [](const ShowDrawing& d) -> json {
                          return {{"output", "drawing"},
                                  {"step", d.step},
                                  {"drawing", d.drawing ? drawing_json(*d.drawing) : json()}};
                        },
                        [](const SaveState& s) -> json {
                          return {{"output", "state"},
                                  {"state", to_string(s.state)},
                                  {"seams_done", s.seams_done},
                                  {"guidance_done", s.guidance_done},
                                  {"weld_begun", s.weld_begun}};
                        },
                        [](const ReturnJob&) -> json {
                          return {{"output", "return_job"}};
                        },
                        [](const SelectJob& s) -> json {
                          return {{"output", "select_job"}, {"number", s.number}};
                        },
                        [](const FinishJob& f) -> json {
                          return {{"output", "finish"},
                                  {"accepted", f.accepted},
                                  {"verdict", f.verdict},
                                  {"reason", f.reason}};
                        },
                        [](const LogEvent& e) -> json {
                          return {{"output", "log"}, {"level", static_cast<int>(e.level)}, {"text", e.text}};
                        },
                    },
                    output)
      .dump();
}

std::optional<WorkMark> work_mark(const job::InputBody& body) {
  using namespace job;
  if (const auto* done = std::get_if<ImportDone>(&body)) {
    const json mark =
        done->workpiece.ok() ? json{{"ok", true}, {"name", done->workpiece->name}} : failed(done->workpiece);
    return WorkMark{"/work/import", mark.dump()};
  }
  if (const auto* done = std::get_if<PlanDone>(&body)) {
    if (!done->prepared.ok()) return WorkMark{"/work/plan", failed(done->prepared).dump()};
    const Prepared& prepared = **done->prepared;
    return WorkMark{"/work/plan", json{{"ok", true},
                                       {"planned", pose_json(prepared.planned)},
                                       {"steps", prepared.steps.size()},
                                       {"scan_s", prepared.scan->duration_s()},
                                       {"digest", digest(*prepared.scan)}}
                                      .dump()};
  }
  if (const auto* done = std::get_if<PassPlanned>(&body)) {
    if (!done->pass.ok()) return WorkMark{"/work/pass", failed(done->pass).dump()};
    return WorkMark{"/work/pass", json{{"ok", true}, {"digest", digest(*(*done->pass)->scan)}}.dump()};
  }
  if (const auto* done = std::get_if<SolveDone>(&body))
    return WorkMark{"/work/solve", solution_json(*done->solution).dump()};
  return std::nullopt;
}

}  // namespace weldcell::app
