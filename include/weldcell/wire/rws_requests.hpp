// What ABB's Robot Web Services are asked, in both generations: method, path, body and the types of content.
// Pure.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace weldcell::wire {

/// 1: IRC5, RobotWare 6 (http, digest, actions in the query). 2: OmniCore, RobotWare 7 (https, basic, actions
/// in the path).
enum class RwsGeneration : std::uint8_t { One = 1, Two = 2 };

/// What writing needs. Generation 2 has one right for configuration and program, `edit`.
enum class MastershipDomain : std::uint8_t { Cfg, Motion, Rapid };

const char* to_string(RwsGeneration);
const char* to_string(MastershipDomain);

/// One request, complete but for authentication and cookies.
struct RwsAsk {
  std::string method;        ///< GET, POST, PUT, DELETE
  std::string path;          ///< from the root, with query
  std::string body;          ///< form, or a file's bytes
  std::string content_type;  ///< of the body; "" with GET
  std::string accept;        ///< "" in generation 1
};

/// How soon the controller tells of a change.
enum class RwsPriority : std::uint8_t { Low = 0, Medium = 1, High = 2 };

struct RwsResource {
  std::string uri;  ///< with its ";suffix"
  RwsPriority priority = RwsPriority::Medium;
};

/// Builds the requests of one generation. Names of tasks, modules, symbols and files go in as they are and
/// are escaped here; `$`, brackets and slashes stay literal, as the controllers want them.
class RwsDialect {
 public:
  explicit RwsDialect(RwsGeneration generation) : generation_(generation) {}
  RwsGeneration generation() const { return generation_; }
  /// Early RobotWare 7 answers HAL with 406: from now on ask for XHTML. No effect in generation 1.
  void without_hal() { hal_ = false; }
  bool hal() const { return hal_; }

  RwsAsk system() const;
  RwsAsk controller_state() const;
  RwsAsk set_motors(bool on) const;
  RwsAsk operation_mode() const;
  RwsAsk speed_ratio() const;
  /// `percent` 0 to 100.
  RwsAsk set_speed_ratio(int percent) const;
  RwsAsk execution() const;
  RwsAsk start(bool forever) const;
  RwsAsk stop() const;
  RwsAsk reset_pp() const;
  RwsAsk tasks() const;
  RwsAsk program_pointer(std::string_view task) const;
  RwsAsk set_pp_to_routine(std::string_view task, std::string_view module, std::string_view routine) const;

  RwsAsk mastership(MastershipDomain domain) const;
  RwsAsk request_mastership(MastershipDomain domain) const;
  RwsAsk release_mastership(MastershipDomain domain) const;

  RwsAsk read_file(std::string_view path) const;
  RwsAsk write_file(std::string_view path, std::string_view bytes) const;
  RwsAsk delete_file(std::string_view path) const;
  RwsAsk make_folder(std::string_view parent, std::string_view name) const;
  RwsAsk modules(std::string_view task) const;
  RwsAsk module_text(std::string_view task, std::string_view module) const;
  RwsAsk load_module(std::string_view task, std::string_view path, bool replace) const;
  RwsAsk unload_module(std::string_view task, std::string_view module) const;

  RwsAsk read_symbol(std::string_view task, std::string_view module, std::string_view symbol) const;
  RwsAsk write_symbol(std::string_view task, std::string_view module, std::string_view symbol,
                      std::string_view literal) const;
  /// Data of a module (or of the whole task when it is empty) whose name matches the regular expression.
  RwsAsk search_symbols(std::string_view task, std::string_view module, std::string_view pattern) const;

  /// A page of signals: the first, or the one that `next` of the page before names.
  RwsAsk signals(std::string_view next = {}) const;
  /// `signal` is "net/device/name"; generation 1 also takes the bare name.
  RwsAsk read_signal(std::string_view signal) const;
  RwsAsk write_signal(std::string_view signal, std::string_view value) const;
  RwsAsk joints(std::string_view mechanical_unit) const;
  /// The log, newest first where the generation can; `count` limits it where it can.
  RwsAsk event_log(int count) const;
  RwsAsk event(std::uint32_t number) const;
  RwsAsk logout() const;

  RwsAsk subscribe(const std::vector<RwsResource>& resources) const;
  RwsAsk unsubscribe(std::string_view group) const;
  /// Sub-protocol of the WebSocket.
  const char* websocket_protocol() const;
  RwsResource controller_state_resource() const;
  RwsResource operation_mode_resource() const;
  RwsResource execution_resource() const;
  RwsResource event_log_resource() const;
  RwsResource signal_resource(std::string_view signal) const;
  RwsResource symbol_resource(std::string_view task, std::string_view module, std::string_view symbol) const;

  /// Where a program module of that name lies on the controller: "$home/x.mod" or "HOME/x.modx".
  std::string module_path(std::string_view module) const;

 private:
  bool two() const { return generation_ == RwsGeneration::Two; }
  RwsAsk get(std::string path) const;
  RwsAsk post(std::string path, std::string body = {}) const;
  /// "path?action=verb" or "path/verb".
  RwsAsk act(const std::string& path, const char* verb, std::string body = {}) const;
  std::string symbol_path(std::string_view task, std::string_view module, std::string_view symbol) const;
  const char* domain(MastershipDomain domain) const;

  RwsGeneration generation_;
  bool hal_ = true;
};

/// Escapes a form value or a piece of a path; brackets, commas, $ and / stay as they are.
std::string form_value(std::string_view text);

}  // namespace weldcell::wire
