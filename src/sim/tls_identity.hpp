// A self-signed certificate with its key, as an OmniCore controller makes one for itself.
#pragma once

#include <memory>
#include <string>

#include "weldcell/base/result.hpp"

namespace weldcell::sim {

class TlsIdentity {
 public:
  /// A fresh one, P-256, valid for ten years from yesterday. Throws std::runtime_error when the library
  /// cannot.
  static TlsIdentity make();
  /// From a PEM file with key and certificate; made and written there (mode 0600) when the file does not
  /// exist. Error "tls.identity".
  static Result<TlsIdentity> keep(const std::string& path);

  TlsIdentity(TlsIdentity&&) noexcept;
  TlsIdentity& operator=(TlsIdentity&&) noexcept;
  ~TlsIdentity();

  /// SHA-256 of the certificate, 64 lower-case hexadecimal digits.
  std::string fingerprint() const;
  /// Gives key and certificate to an SSL_CTX. False when the library refuses.
  bool install(void* ssl_ctx) const;

 private:
  struct State;
  explicit TlsIdentity(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace weldcell::sim
