// One HTTP exchange, whoever carries it: a socket, or a simulated controller in the same process.
#pragma once

#include <map>
#include <string>

#include "weldcell/base/result.hpp"

namespace weldcell::ports {

struct HttpRequest {
  std::string method;  ///< GET, POST, PUT, DELETE
  std::string path;    ///< with query, from the root: "/rw/panel/ctrlstate?json=1"
  std::string body;
  std::string content_type = "application/x-www-form-urlencoded";
  std::string accept = {};  ///< "" sends none
};

struct HttpReply {
  int status = 0;
  std::map<std::string, std::string> headers;
  std::string body;
};

/// Carries one request at a time. Authentication and cookies are the carrier's matter.
class HttpTransport {
 public:
  virtual ~HttpTransport() = default;
  /// Errors: "http.unreachable", "http.timeout", "http.refused" (authentication).
  virtual Result<HttpReply> exchange(const HttpRequest& request) = 0;
};

}  // namespace weldcell::ports
