// A laser's answers on its command port: the first byte picks the dialect, the second how they are cut. The
// talk ends, whatever comes, and says what it could not use.
#include <algorithm>
#include <string_view>

#include "fuzz_target.hpp"
#include "weldcell/wire/laser_setup.hpp"

using namespace weldcell;

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 2) return 0;
  wire::LaserWanted wanted;
  wanted.format.dialect = static_cast<wire::LaserDialect>(data[0] % 6);
  wanted.format.range_mm = 100;
  wanted.format.rate_hz = 10000;
  if (wanted.format.dialect == wire::LaserDialect::Data28)
    wanted.format.words = 3, wanted.format.distance_word = 1, wanted.format.timestamp_word = 2;
  if (wanted.format.dialect == wire::LaserDialect::Meas32)
    wanted.format.words = 2, wanted.format.distance_word = 1;
  wanted.data_port = 1024;
  const auto setup = wire::laser_setup(wanted);
  const std::size_t piece = data[1] == 0 ? size : data[1];
  std::string_view rest(reinterpret_cast<const char*>(data + 2), size - 2);
  int requests = 0;
  while (!setup->request().empty()) {
    WELDCELL_ASSERT(++requests < 40);
    bool answered = false;
    while (!answered && !rest.empty()) {
      const std::string_view now = rest.substr(0, std::min(piece, rest.size()));
      rest.remove_prefix(now.size());
      answered = setup->take(now);
    }
    if (!answered) return 0;
  }
  if (const auto fault = setup->fault()) {
    WELDCELL_ASSERT(!fault->code.empty() && !fault->where.empty() && !fault->what.empty() &&
                    !fault->mend.empty());
    for (const char c : fault->text()) WELDCELL_ASSERT(c >= 0x20 && c < 0x7F);
  }
  return 0;
}
