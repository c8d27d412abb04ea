#include "app/job_signing.hpp"

#include <filesystem>

#include "weldcell/adapters/signature_check.hpp"
#include "weldcell/files/document.hpp"
#include "weldcell/files/job_file.hpp"

namespace weldcell::app {

namespace {

Error signature_fault(const std::string& place, const std::string& what, const std::string& mend) {
  return {"job.signature", place, what, mend};
}

/// The signer's words; "" for a job without a signature that may run without one.
Result<std::string> signer_of(const std::string& text, const std::string& signature_file,
                              const std::optional<std::string>& signature, const files::CellConfig& config) {
  if (config.job_keys.empty()) return std::string{};
  const std::string name = std::filesystem::path(signature_file).filename().string();
  if (!signature) {
    if (!config.unsigned_refused) return std::string{};
    return Error{"job.unsigned", name, "is not there, and this cell takes no job without a signature",
                 "sign the job (minisign -Sm " + std::filesystem::path(name).stem().string() +
                     ") and drop the signature with it, the signature first"};
  }
  const auto signer = adapters::check_signature(text, *signature, config.job_keys);
  if (!signer.ok()) return signature_fault(name, signer.error().what, signer.error().mend);
  return "signed by the key " + wire::to_string(signer->key) + ", trusted comment '" + signer->comment + "'";
}

}  // namespace

Result<ReadJob> read_job(const std::string& job_file, const files::CellConfig& config) {
  const auto faulty = [](const files::Faults& faults) {
    return Error{"job.file", "", files::text(faults), ""};
  };
  auto text = files::read_text_file(job_file);
  if (const auto* faults = std::get_if<files::Faults>(&text)) return faulty(*faults);
  ReadJob out;
  out.text = std::get<std::string>(std::move(text));
  const std::string signature_file = signature_file_of(job_file);
  const auto signature = adapters::read_signature_file(signature_file);
  if (!signature.ok())
    return signature_fault(signature.error().where, signature.error().what, signature.error().mend);
  out.signature_there = signature->has_value();
  auto signer = signer_of(out.text, signature_file, *signature, config);
  if (!signer.ok()) return signer.error();
  out.signer = *signer;
  auto order = files::parse_job(out.text, job_file);
  if (const auto* faults = std::get_if<files::Faults>(&order)) return faulty(*faults);
  out.order = std::get<job::JobOrder>(std::move(order));
  if (!out.signer.empty() && out.order.revision.empty())
    return signature_fault(
        job_file + ": revision", "is missing: the signature covers the job file alone, not its workpiece",
        "write revision: sha256:<what sha256sum prints of the workpiece file>, and sign again");
  return out;
}

}  // namespace weldcell::app
