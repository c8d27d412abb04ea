// Every laser dialect: the first byte picks it, and which items a MEAS-28 frame carries. No split of a stream
// may change what is read, and what is read is bounded by the bytes. FUZZ_LASER=meas28 (data28, ...) holds to
// one dialect.
#include <array>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <vector>

#include "fuzz_target.hpp"
#include "weldcell/wire/laser_dialects.hpp"

using namespace weldcell;

namespace {

constexpr unsigned kDialects = 6;

/// The dialect that the environment holds to; kDialects: any.
unsigned only_dialect() {
  const char* name = std::getenv("FUZZ_LASER");
  unsigned i = 0;
  while (name != nullptr && i < kDialects &&
         std::strcmp(name, wire::to_string(static_cast<wire::LaserDialect>(i))) != 0)
    ++i;
  WELDCELL_ASSERT(name == nullptr || i < kDialects);
  return name == nullptr ? kDialects : i;
}

}  // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 2) return 0;
  wire::LaserFormat format;
  static const unsigned only = only_dialect();
  const unsigned dialect = only < kDialects ? only : data[0] % kDialects;
  format.dialect = static_cast<wire::LaserDialect>(dialect);
  const unsigned items = data[0] / kDialects;
  format.meas28.exposure = (items & 1) != 0;
  format.meas28.counter = (items & 2) == 0;
  format.meas28.timestamp = (items & 4) == 0;
  format.meas28.intensity = (items & 8) != 0;
  format.meas28.status = (items & 16) != 0;
  format.range_mm = 100;
  format.rate_hz = 10000;
  if (format.dialect == wire::LaserDialect::Data28) {
    format.words = 3, format.distance_word = 1, format.timestamp_word = 2;
  } else if (format.dialect == wire::LaserDialect::Meas32) {
    format.words = 2, format.distance_word = 1, format.raw_min = 15853, format.raw_max = 3261;
  } else if (format.dialect == wire::LaserDialect::Od5000) {
    format.words = 2;
  }
  WELDCELL_ASSERT(wire::laser_format_fault(format) == nullptr);
  const std::array<std::size_t, kDialects> smallest{4, 4, 4, 2, 3, 4};
  const std::size_t piece = data[1] == 0 ? 1 : data[1];
  const auto stream = fuzz::bytes(data + 2, size - 2);

  std::vector<wire::LaserReading> at_once, in_pieces;
  wire::LaserDecoder whole{format}, split{format};
  whole.feed(stream, [&](const wire::LaserReading& r) { at_once.push_back(r); });
  if (format.dialect == wire::LaserDialect::Od5000) {
    // Datagrams: both get the same ones.
    whole = wire::LaserDecoder(format);
    at_once.clear();
    for (std::size_t at = 0; at < stream.size(); at += piece) {
      whole.feed(stream.subspan(at, std::min(piece, stream.size() - at)),
                 [&](const wire::LaserReading& r) { at_once.push_back(r); });
    }
  }
  for (std::size_t at = 0; at < stream.size(); at += piece) {
    split.feed(stream.subspan(at, std::min(piece, stream.size() - at)),
               [&](const wire::LaserReading& r) { in_pieces.push_back(r); });
  }
  WELDCELL_ASSERT(at_once.size() == in_pieces.size());
  WELDCELL_ASSERT(at_once.size() * smallest[dialect] <= stream.size());
  for (std::size_t i = 0; i < at_once.size(); ++i) {
    const auto &a = at_once[i], &b = in_pieces[i];
    WELDCELL_ASSERT(a.counter == b.counter && a.timestamp_us == b.timestamp_us && a.code == b.code);
    WELDCELL_ASSERT(a.distance_mm == b.distance_mm && std::abs(a.distance_mm) < 2148);
  }
  const wire::LaserCounters &a = whole.counters(), &b = split.counters();
  WELDCELL_ASSERT(a.readings == at_once.size() && a.resyncs == b.resyncs &&
                  a.lost_readings == b.lost_readings && a.skipped_bytes == b.skipped_bytes &&
                  a.restarts == b.restarts);
  return 0;
}
