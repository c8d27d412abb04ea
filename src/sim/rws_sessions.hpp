// Who may talk to the simulated controller: HTTP digest (MD5, qop=auth) with nonces that expire in generation
// 1, HTTP basic in generation 2, and the controller's sessions with their cookies. Time is an argument. Pure.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace weldcell::sim {

inline constexpr std::size_t kRwsMaxSessions = 70;
/// OmniCore's number is not published; clients note about five an address.
inline constexpr std::size_t kRws2MaxSessions = 5;
inline constexpr double kRwsSessionExpiry_s = 300;

struct RwsAccess {
  enum class Verdict { Allowed, Challenge, Full };
  Verdict verdict = Verdict::Challenge;
  int session = 0;                       ///< when allowed
  std::string challenge;                 ///< WWW-Authenticate, when challenged
  std::vector<std::string> set_cookies;  ///< Set-Cookie values
};

class RwsSessions {
 public:
  RwsSessions(std::string user, std::string password, std::uint64_t seed, int generation = 1)
      : user_(std::move(user)), password_(std::move(password)), seed_(seed), generation_(generation) {}

  /// Judges one request by its Authorization and Cookie headers ("" when absent).
  RwsAccess admit(const std::string& method, const std::string& uri, const std::string& authorization,
                  const std::string& cookie, double now_s);
  /// The session that a Cookie header belongs to; 0 when there is none.
  int of_cookie(const std::string& cookie) const;
  void log_out(int session);
  /// The controller restarts: nobody is known any more.
  void forget_all() { sessions_.clear(); }
  /// Sessions that ended by inactivity since the last call.
  std::vector<int> take_expired();
  std::size_t count() const { return sessions_.size(); }

 private:
  struct Session {
    std::string cookie;
    double last_s = 0;
  };
  bool digest_right(const std::string& method, const std::string& uri, const std::string& authorization,
                    double now_s, bool& stale) const;
  bool basic_right(const std::string& authorization) const;
  RwsAccess begin(double now_s);
  std::string nonce(double now_s) const;
  bool nonce_fresh(const std::string& nonce, double now_s) const;
  std::string token(const char* purpose);
  void expire(double now_s);

  std::string user_, password_;
  std::uint64_t seed_, tokens_ = 0;
  int generation_;
  int next_session_ = 1;
  std::map<int, Session> sessions_;
  std::vector<int> expired_;
};

/// Hexadecimal MD5 of a text.
std::string md5_hex(const std::string& text);
/// The items of a Digest header: Digest a="b", c=d.
std::map<std::string, std::string> parse_digest(const std::string& header);

}  // namespace weldcell::sim
