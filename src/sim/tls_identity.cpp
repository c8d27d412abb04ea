#include "sim/tls_identity.hpp"

#include <fcntl.h>
#include <openssl/evp.h>
#include <openssl/pem.h>
#include <openssl/ssl.h>
#include <openssl/x509.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <stdexcept>

namespace weldcell::sim {

struct TlsIdentity::State {
  EVP_PKEY* key = nullptr;
  X509* certificate = nullptr;
  State() = default;
  State(const State&) = delete;
  State& operator=(const State&) = delete;
  ~State() {
    EVP_PKEY_free(key);
    X509_free(certificate);
  }
};

TlsIdentity::TlsIdentity(std::unique_ptr<State> state) : state_(std::move(state)) {}
TlsIdentity::TlsIdentity(TlsIdentity&&) noexcept = default;
TlsIdentity& TlsIdentity::operator=(TlsIdentity&&) noexcept = default;
TlsIdentity::~TlsIdentity() = default;

TlsIdentity TlsIdentity::make() {
  constexpr long kDay_s = 86400;
  auto state = std::make_unique<State>();
  state->key = EVP_EC_gen("P-256");
  state->certificate = X509_new();
  if (state->key == nullptr || state->certificate == nullptr) throw std::runtime_error("no TLS key");
  X509* const x = state->certificate;
  X509_set_version(x, 2);
  ASN1_INTEGER_set(X509_get_serialNumber(x), 1);
  X509_gmtime_adj(X509_getm_notBefore(x), -kDay_s);
  X509_gmtime_adj(X509_getm_notAfter(x), 3650 * kDay_s);
  X509_set_pubkey(x, state->key);
  X509_NAME* const name = X509_get_subject_name(x);
  const auto* const text = reinterpret_cast<const unsigned char*>("weldcell-sim");
  X509_NAME_add_entry_by_txt(name, "CN", MBSTRING_ASC, text, -1, -1, 0);
  X509_set_issuer_name(x, name);
  if (X509_sign(x, state->key, EVP_sha256()) == 0) throw std::runtime_error("no TLS certificate");
  return TlsIdentity(std::move(state));
}

Result<TlsIdentity> TlsIdentity::keep(const std::string& path) {
  const auto refuse = [&path](const char* what) {
    return Error{"tls.identity", path, what, "name a PEM file with key and certificate, or a new one"};
  };
  if (std::FILE* file = std::fopen(path.c_str(), "r")) {
    auto state = std::make_unique<State>();
    state->key = PEM_read_PrivateKey(file, nullptr, nullptr, nullptr);
    state->certificate = PEM_read_X509(file, nullptr, nullptr, nullptr);
    std::fclose(file);
    if (state->key == nullptr || state->certificate == nullptr) return refuse("holds no key and certificate");
    return TlsIdentity(std::move(state));
  }
  TlsIdentity fresh = make();
  const int fd = ::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
  std::FILE* file = fd < 0 ? nullptr : ::fdopen(fd, "w");
  if (file == nullptr) {
    if (fd >= 0) ::close(fd);
    return refuse("cannot be written");
  }
  const bool written =
      PEM_write_PrivateKey(file, fresh.state_->key, nullptr, nullptr, 0, nullptr, nullptr) == 1 &&
      PEM_write_X509(file, fresh.state_->certificate) == 1;
  if (std::fclose(file) != 0 || !written) return refuse("cannot be written");
  return fresh;
}

std::string TlsIdentity::fingerprint() const {
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
  unsigned size = 0;
  X509_digest(state_->certificate, EVP_sha256(), digest.data(), &size);
  constexpr const char* kHex = "0123456789abcdef";
  std::string out;
  for (unsigned i = 0; i < size; ++i) {
    out += kHex[digest[i] >> 4];
    out += kHex[digest[i] & 15];
  }
  return out;
}

bool TlsIdentity::install(void* ssl_ctx) const {
  auto* const context = static_cast<SSL_CTX*>(ssl_ctx);
  return SSL_CTX_use_certificate(context, state_->certificate) == 1 &&
         SSL_CTX_use_PrivateKey(context, state_->key) == 1;
}

}  // namespace weldcell::sim
