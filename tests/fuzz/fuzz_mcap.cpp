// A record of any content: reading ends, gives no more than was there, and what was read can be written and
// read again.
#include <map>

#include "fuzz_target.hpp"
#include "weldcell/wire/mcap.hpp"

using namespace weldcell;

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto file = wire::read_mcap(fuzz::bytes(data, size));
  if (!file.ok()) return 0;
  std::size_t content = 0;
  for (const auto& m : file->messages) content += m.data.size();
  for (const auto& a : file->attachments) content += a.text.size();
  WELDCELL_ASSERT(content <= size);

  wire::Bytes out;
  wire::McapWriter writer([&](std::span<const std::byte> b) { out.insert(out.end(), b.begin(), b.end()); },
                          256);
  writer.begin("weldcell", file->library);
  std::map<std::string, std::uint16_t> channels;
  for (const auto& m : file->messages) {
    const auto [it, fresh] = channels.try_emplace(m.topic, std::uint16_t{0});
    if (fresh) it->second = writer.channel(m.topic, "json");
    writer.message(it->second, m.sequence, m.log_time, m.data);
  }
  for (const auto& a : file->attachments) writer.attachment(a.name, a.media_type, {}, a.text);
  writer.end();
  const auto again = wire::read_mcap(out);
  WELDCELL_ASSERT(again.ok() && again->complete && again->damage.empty());
  WELDCELL_ASSERT(again->messages.size() == file->messages.size() &&
                  again->attachments.size() == file->attachments.size());
  for (std::size_t i = 0; i < file->messages.size(); ++i) {
    const auto &a = file->messages[i], &b = again->messages[i];
    WELDCELL_ASSERT(a.topic == b.topic && a.data == b.data && a.sequence == b.sequence &&
                    a.log_time == b.log_time);
  }
  return 0;
}
