// RWS 1.0 requests answered from the simulated controller's state: XHTML, or JSON with ?json=1. No sockets.
// Pure.
#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "weldcell/ports/http.hpp"

namespace weldcell::sim {

struct ControllerState;

/// Controller error codes as they stand in RWS answers.
inline constexpr long kRwsHeldByOther = -1073445862;
inline constexpr long kRwsNoMastership = -1073445859;
inline constexpr long kRwsRejected = -1073445881;
inline constexpr long kRwsBadValue = -1073445879;
inline constexpr long kRwsWrongState = -1073442809;
inline constexpr long kRwsBadModule = -1073442813;
inline constexpr long kRwsUnknownModule = -1073442816;
inline constexpr long kRwsNoResource = -1073414146;
inline constexpr long kRwsBadSignal = -1073445866;
inline constexpr long kRwsNoPath = -1073438713;
inline constexpr long kRwsBadModulePath = -1073438708;

class RwsHandler {
 public:
  RwsHandler(ControllerState& state, int session) : s_(state), session_(session) {}
  ports::HttpReply handle(const ports::HttpRequest& request);

 private:
  using Fields = std::vector<std::pair<std::string, std::string>>;
  struct Item {
    std::string type, title;
    Fields fields;
  };
  using Items = std::vector<Item>;

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
  ports::HttpReply mastership();
  ports::HttpReply mechunits();
  ports::HttpReply robtarget();
  ports::HttpReply signals();
  ports::HttpReply fileservice();
  ports::HttpReply elog();
  ports::HttpReply system();
  ports::HttpReply retcode();

  ports::HttpReply answer(const Items& items) const;
  ports::HttpReply fault(int status, long code, const std::string& text) const;
  static ports::HttpReply no_content();
  bool holds(const std::string& domain) const;
  bool action_is(const std::string& wanted) const;
  std::string query(const std::string& key) const;
  std::string form(const std::string& key) const;
  std::string segment(std::size_t i) const;

  ControllerState& s_;
  int session_;
  std::string method_, path_, body_;
  std::vector<std::string> segments_;
  std::map<std::string, std::string> query_, form_;
};

/// "%41+b" -> "A b".
std::string url_decoded(std::string_view text);
std::map<std::string, std::string> parse_form(std::string_view text);

}  // namespace weldcell::sim
