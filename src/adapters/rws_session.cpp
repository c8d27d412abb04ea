#include "rws_session.hpp"

#include <Poco/Net/Context.h>
#include <Poco/Net/HTTPCredentials.h>
#include <Poco/Net/HTTPRequest.h>
#include <Poco/Net/HTTPResponse.h>
#include <Poco/Net/HTTPSClientSession.h>
#include <Poco/Net/NetException.h>
#include <Poco/Net/SSLException.h>
#include <Poco/Net/SecureStreamSocket.h>
#include <Poco/Net/X509Certificate.h>

namespace weldcell::adapters {

namespace net = Poco::Net;

namespace {

net::Context::Ptr tls_context() {
  net::Context::Params params;
  // No authority signs these certificates: the fingerprint is compared instead, before anything is sent.
  params.verificationMode = net::Context::VERIFY_NONE;
  params.loadDefaultCAs = false;
  net::Context::Ptr context = new net::Context(net::Context::TLS_CLIENT_USE, params);
  context->requireMinimumProtocol(net::Context::PROTO_TLSV1_2);
  return context;
}

class PinnedSession final : public net::HTTPSClientSession {
 public:
  explicit PinnedSession(const RwsAccess& access)
      : HTTPSClientSession(access.host, static_cast<Poco::UInt16>(access.port), tls_context()),
        pinned_(access.certificate_sha256) {}

 protected:
  void connect(const net::SocketAddress& address) override {
    HTTPSClientSession::connect(address);
    net::SecureStreamSocket secure(socket());
    secure.completeHandshake();
    const std::string shown = Poco::DigestEngine::digestToHex(secure.peerCertificate().fingerprint("SHA256"));
    if (shown == pinned_) return;
    close();
    throw WrongCertificate("the controller's certificate has the fingerprint " + shown + ", pinned is " +
                           (pinned_.empty() ? "none" : pinned_));
  }

 private:
  std::string pinned_;
};

}  // namespace

Poco::Timespan rws_timespan(Nanoseconds ns) {
  return {ns / kSecond, static_cast<long>(ns % kSecond / kMicrosecond)};
}

std::unique_ptr<net::HTTPClientSession> make_rws_session(const RwsAccess& access) {
  std::unique_ptr<net::HTTPClientSession> out;
  if (access.generation == wire::RwsGeneration::Two) {
    out = std::make_unique<PinnedSession>(access);
  } else {
    out = std::make_unique<net::HTTPClientSession>(access.host, static_cast<Poco::UInt16>(access.port));
  }
  const Poco::Timespan timeout = rws_timespan(access.timeout);
  out->setKeepAlive(true);
  out->setTimeout(timeout, timeout, timeout);
  return out;
}

Result<wire::RwsGeneration> find_rws_generation(const RwsAccess& access) {
  const std::string place = "rws " + access.host + ":" + std::to_string(access.port);
  const Poco::Timespan timeout = rws_timespan(access.timeout);
  // Plain first: a TLS server refuses plain HTTP at once, a plain server may wait for the end of a TLS
  // greeting.
  try {
    net::HTTPClientSession plain(access.host, static_cast<Poco::UInt16>(access.port));
    plain.setTimeout(timeout, timeout, timeout);
    net::HTTPRequest request("GET", "/rw/system", net::HTTPRequest::HTTP_1_1);
    net::HTTPResponse response;
    plain.sendRequest(request);
    plain.receiveResponse(response);
    if (response.getStatus() == net::HTTPResponse::HTTP_UNAUTHORIZED &&
        net::HTTPCredentials::isDigestCredentials(response.get("WWW-Authenticate", "")))
      return wire::RwsGeneration::One;
  } catch (const Poco::Exception&) {
    // No HTTP there; whether anything is there the next question tells.
  }
  try {
    net::SecureStreamSocket secure(tls_context());
    secure.connect(net::SocketAddress(access.host, static_cast<Poco::UInt16>(access.port)), timeout);
    secure.setReceiveTimeout(timeout);
    secure.completeHandshake();
    secure.close();
    return wire::RwsGeneration::Two;
  } catch (const net::SSLException&) {
    return Error{"http.refused", place, "what answers there asks for no digest and talks no TLS",
                 "check rws.address: RWS 1.0 is on port 80, RWS 2.0 on 443 unless the controller says else"};
  } catch (const Poco::Exception& e) {
    return Error{"http.unreachable", place, e.displayText(),
                 "check that the controller runs, and rws.address"};
  }
}

}  // namespace weldcell::adapters
