// RWS requests of both generations answered from the simulated controller's state. Generation 2 is brought
// into the paths and actions of generation 1, so that one controller stands behind both. No sockets. Pure.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "weldcell/base/time.hpp"
#include "weldcell/ports/http.hpp"

namespace weldcell::sim {

struct ControllerState;

/// Controller error codes as they stand in RWS answers.
inline constexpr long kRwsHeldByOther = -1073445862;
inline constexpr long kRwsNoMastership = -1073445859;
inline constexpr long kRwsRejected = -1073445881;
inline constexpr long kRwsNotAllowed = -1073445867;
inline constexpr long kRwsBadValue = -1073445879;
inline constexpr long kRwsWrongState = -1073442809;
inline constexpr long kRwsBadModule = -1073442813;
inline constexpr long kRwsUnknownModule = -1073442816;
inline constexpr long kRwsNoResource = -1073414146;
inline constexpr long kRwsBadSignal = -1073445866;
inline constexpr long kRwsNoPath = -1073438713;
inline constexpr long kRwsBadModulePath = -1073438708;
inline constexpr long kRwsBadVolume = -1073438716;

class RwsHandler {
 public:
  RwsHandler(ControllerState& state, int session) : s_(state), session_(session) {}
  ports::HttpReply handle(const ports::HttpRequest& request);

 private:
  using Fields = std::vector<std::pair<std::string, std::string>>;
  struct Item {
    std::string type, title;
    Fields fields;
    std::vector<Item> parts{};  ///< of a configuration row: its attributes
  };
  using Items = std::vector<Item>;

  bool read_path(const std::string& path);
  bool action_from_path();
  bool rapid_from_path();
  std::optional<ports::HttpReply> refused_type(const ports::HttpRequest& request) const;
  ports::HttpReply route();
  ports::HttpReply panel();
  ports::HttpReply execution();
  ports::HttpReply start();
  ports::HttpReply tasks();
  ports::HttpReply task_action(const std::string& action);
  ports::HttpReply load_module();
  ports::HttpReply modules();
  ports::HttpReply symbol_data();
  ports::HttpReply symbol_properties();
  ports::HttpReply operation_mode();
  ports::HttpReply set_motors();
  ports::HttpReply mastership();
  ports::HttpReply users();
  ports::HttpReply manual_privilege();
  ports::HttpReply mastership_with_id(const std::string& domain);
  ports::HttpReply symbol_search();
  std::optional<ports::HttpReply> no_edit_right() const;
  ports::HttpReply mechunits();
  ports::HttpReply robtarget();
  ports::HttpReply signals();
  ports::HttpReply set_signal(const std::string& name);
  ports::HttpReply make_folder(const std::string& parent);
  ports::HttpReply fileservice();
  ports::HttpReply elog();
  ports::HttpReply another_name(const std::string& path);
  ports::HttpReply system();
  ports::HttpReply retcode();
  ports::HttpReply clock();
  ports::HttpReply configuration();
  ports::HttpReply load_configuration();

  /// `next` is the link to the next page of a list.
  ports::HttpReply answer(const Items& items, const std::string& next = "") const;
  ports::HttpReply hal(const Items& items, const std::string& next) const;
  ports::HttpReply fault(int status, long code, const std::string& text) const;
  static ports::HttpReply no_content();
  bool two() const;
  const char* edit_domain() const { return two() ? "edit" : "rapid"; }
  bool holds(const std::string& domain) const;
  bool action_is(const std::string& wanted) const;
  std::string query(const std::string& key) const;
  std::string form(const std::string& key) const;
  std::string segment(std::size_t i) const;

  ControllerState& s_;
  int session_;
  std::string method_, path_, body_, accept_;
  std::string action_;  ///< "?action=" of generation 1, the verb in the path of generation 2; "" with GET
  std::vector<std::string> segments_;
  std::map<std::string, std::string> query_, form_;
};

/// "2026-01-01 T 00:00:04" of an instant; `set_s` is by how much clients moved the calendar.
std::string calendar(HostTime at, double set_s);
/// Text for XHTML.
std::string escaped(const std::string& text);
/// XML declaration, head and the begin of the body.
std::string xhtml_head(const std::string& title);
/// "%41+b" -> "A b".
std::string url_decoded(std::string_view text);
std::map<std::string, std::string> parse_form(std::string_view text);

}  // namespace weldcell::sim
