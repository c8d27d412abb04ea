#include "sim/rws_sessions.hpp"

#include <Poco/Base64Encoder.h>
#include <Poco/MD5Engine.h>
#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <sstream>
#include <utility>

#include "sim/noise.hpp"

namespace weldcell::sim {

namespace {
constexpr const char* kRealm = "validusers@robapi.abb";
constexpr double kNonceLife_s = 300;
constexpr const char* kSessionCookie = "-http-session-";

std::string cookie_value(const std::string& header, const std::string& name) {
  std::size_t at = 0;
  while (at < header.size()) {
    const std::size_t end = std::min(header.find(';', at), header.size());
    std::string pair = header.substr(at, end - at);
    pair.erase(0,
               pair.find_first_not_of(' ') == std::string::npos ? pair.size() : pair.find_first_not_of(' '));
    if (pair.rfind(name + "=", 0) == 0) return pair.substr(name.size() + 1);
    at = end + 1;
  }
  return "";
}
}  // namespace

std::string md5_hex(const std::string& text) {
  Poco::MD5Engine engine;
  engine.update(text);
  return Poco::DigestEngine::digestToHex(engine.digest());
}

std::map<std::string, std::string> parse_digest(const std::string& header) {
  std::map<std::string, std::string> out;
  std::size_t at = header.find(' ');
  if (at == std::string::npos || header.substr(0, at) != "Digest") return out;
  while (at < header.size()) {
    at = header.find_first_not_of(" ,", at);
    const std::size_t equals = header.find('=', at);
    if (at == std::string::npos || equals == std::string::npos) break;
    const std::string key = header.substr(at, equals - at);
    std::string value;
    at = equals + 1;
    if (at < header.size() && header[at] == '"') {
      for (++at; at < header.size() && header[at] != '"'; ++at) {
        if (header[at] == '\\' && at + 1 < header.size()) ++at;
        value += header[at];
      }
      ++at;
    } else {
      const std::size_t end = std::min(header.find_first_of(", ", at), header.size());
      value = header.substr(at, end - at);
      at = end;
    }
    out[key] = value;
  }
  return out;
}

std::string RwsSessions::nonce(double now_s) const {
  const auto made = static_cast<std::uint64_t>(std::max(0.0, now_s));
  return fmt::format("{:08x}{}", made,
                     md5_hex(fmt::format("{}:{}:{}", made, seed_, password_)).substr(0, 24));
}

bool RwsSessions::nonce_fresh(const std::string& given, double now_s) const {
  std::uint64_t made = 0;
  if (given.size() != 32 || std::from_chars(given.data(), given.data() + 8, made, 16).ec != std::errc{})
    return false;
  const auto seconds = static_cast<double>(made);
  return given == nonce(seconds) && now_s - seconds >= -1 && now_s - seconds < kNonceLife_s;
}

bool RwsSessions::digest_right(const std::string& method, const std::string& uri,
                               const std::string& authorization, double now_s, bool& stale) const {
  auto d = parse_digest(authorization);
  if (d["username"] != user_ || d["realm"] != kRealm || d["uri"] != uri) return false;
  const std::string ha1 = md5_hex(user_ + ":" + kRealm + ":" + password_), ha2 = md5_hex(method + ":" + uri);
  const std::string expected =
      d["qop"] == "auth"
          ? md5_hex(ha1 + ":" + d["nonce"] + ":" + d["nc"] + ":" + d["cnonce"] + ":auth:" + ha2)
          : md5_hex(ha1 + ":" + d["nonce"] + ":" + ha2);
  if (d["response"] != expected) return false;
  stale = !nonce_fresh(d["nonce"], now_s);
  return !stale;
}

std::string RwsSessions::token(const char* purpose) {
  return md5_hex(fmt::format("{}:{}:{}", purpose, seed_, mixed(seed_, ++tokens_, 17)));
}

void RwsSessions::expire(double now_s) {
  for (auto it = sessions_.begin(); it != sessions_.end();) {
    if (now_s - it->second.last_s > kRwsSessionExpiry_s) {
      expired_.push_back(it->first);
      it = sessions_.erase(it);
    } else {
      ++it;
    }
  }
}

bool RwsSessions::basic_right(const std::string& authorization) const {
  std::ostringstream text;
  Poco::Base64Encoder encoder(text);
  encoder.rdbuf()->setLineLength(0);
  encoder << user_ << ':' << password_;
  encoder.close();
  return authorization == "Basic " + text.str();
}

int RwsSessions::of_cookie(const std::string& cookie) const {
  const std::string given = cookie_value(cookie, kSessionCookie);
  for (const auto& [id, session] : sessions_) {
    if (!given.empty() && session.cookie == given) return id;
  }
  return 0;
}

RwsAccess RwsSessions::begin(double now_s) {
  RwsAccess out;
  if (sessions_.size() >= (generation_ == 2 ? kRws2MaxSessions : kRwsMaxSessions)) {
    out.verdict = RwsAccess::Verdict::Full;
    return out;
  }
  out.verdict = RwsAccess::Verdict::Allowed;
  out.session = next_session_++;
  sessions_[out.session] = {token("session"), now_s};
  const std::string more = generation_ == 2 ? "; path=/; secure; httponly" : "; path=/; httponly";
  out.set_cookies = {fmt::format("{}={}{}", kSessionCookie, sessions_[out.session].cookie, more),
                     fmt::format("ABBCX={}{}", token("connection").substr(0, 8), more)};
  return out;
}

RwsAccess RwsSessions::admit(const std::string& method, const std::string& uri,
                             const std::string& authorization, const std::string& cookie, double now_s) {
  expire(now_s);
  RwsAccess out;
  if (const int known = of_cookie(cookie); known != 0) {
    sessions_[known].last_s = now_s;
    out.verdict = RwsAccess::Verdict::Allowed;
    out.session = known;
    return out;
  }
  if (generation_ == 2) {
    if (basic_right(authorization)) return begin(now_s);
    out.challenge = fmt::format("Basic realm=\"{}\"", kRealm);
    return out;
  }
  bool stale = false;
  if (!authorization.empty() && digest_right(method, uri, authorization, now_s, stale)) return begin(now_s);
  out.challenge = fmt::format(
      "Digest realm=\"{}\", domain=\"127.0.0.1:80\", qop=\"auth\", nonce=\"{}\", opaque=\"\", "
      "algorithm=\"MD5\", stale=\"{}\"",
      kRealm, nonce(std::floor(now_s)), stale ? "TRUE" : "FALSE");
  return out;
}

void RwsSessions::log_out(int session) { sessions_.erase(session); }

std::vector<int> RwsSessions::take_expired() { return std::exchange(expired_, {}); }

}  // namespace weldcell::sim
