// Any bytes as an answer of Robot Web Services, as an event frame and as a Location header: read without
// harm, and what is found keeps its form.
#include <string_view>

#include "fuzz_target.hpp"
#include "weldcell/wire/rws_replies.hpp"

using namespace weldcell;

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  for (const wire::RwsState& state : wire::rws_states(text)) {
    const std::string type = wire::rws_field(state, "_type");
    WELDCELL_ASSERT(state.contains("_type") && (type.empty() || type.back() != ' '));
  }
  // Events are entries: there is never more news than entries.
  WELDCELL_ASSERT(wire::rws_news(text).log_entries.size() <= wire::rws_states(text).size());
  const Error refusal = wire::rws_refusal(403, text, "GET /");
  WELDCELL_ASSERT(refusal.code.starts_with("rws.") && !refusal.what.empty());
  WELDCELL_ASSERT(wire::rws_next_page(text).size() <= text.size());
  const std::size_t half = text.find('\n');
  const std::string_view location = text.substr(0, half);
  const std::string_view body = half == std::string_view::npos ? text : text.substr(half + 1);
  if (const auto made = wire::rws_subscribed(location, body)) {
    WELDCELL_ASSERT(made->poll.starts_with("/poll/") && made->poll.size() > 6);
    WELDCELL_ASSERT(made->poll.find_first_of(" \t\r\n") == std::string::npos);
  }
  return 0;
}
