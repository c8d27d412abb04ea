// The HTTP connection to a controller: plain, or TLS that goes no further than the handshake unless the
// certificate is the pinned one. Private.
#pragma once

#include <Poco/Exception.h>
#include <Poco/Net/HTTPClientSession.h>

#include <memory>

#include "weldcell/adapters/rws_http.hpp"

namespace weldcell::adapters {

/// Thrown while connecting: the message names both fingerprints.
class WrongCertificate : public Poco::Exception {
 public:
  using Poco::Exception::Exception;
};

/// An unconnected session with the access' timeouts.
std::unique_ptr<Poco::Net::HTTPClientSession> make_rws_session(const RwsAccess& access);

Poco::Timespan rws_timespan(Nanoseconds ns);

}  // namespace weldcell::adapters
