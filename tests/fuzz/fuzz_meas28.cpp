// A laser's byte stream: no split may change what is read, and what is read is bounded by the bytes.
#include <vector>

#include "fuzz_target.hpp"
#include "weldcell/wire/laser.hpp"

using namespace weldcell;

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 2) return 0;
  wire::Meas28Layout layout;
  layout.exposure = (data[0] & 1) != 0;
  layout.counter = (data[0] & 2) == 0;
  layout.timestamp = (data[0] & 4) == 0;
  layout.intensity = (data[0] & 8) != 0;
  layout.status = (data[0] & 16) != 0;
  const std::size_t piece = data[1] == 0 ? 1 : data[1];
  const auto stream = fuzz::bytes(data + 2, size - 2);

  std::vector<wire::LaserReading> at_once, in_pieces;
  wire::Meas28Decoder whole{layout}, split{layout};
  whole.feed(stream, [&](const wire::LaserReading& r) { at_once.push_back(r); });
  for (std::size_t at = 0; at < stream.size(); at += piece) {
    split.feed(stream.subspan(at, std::min(piece, stream.size() - at)),
               [&](const wire::LaserReading& r) { in_pieces.push_back(r); });
  }
  WELDCELL_ASSERT(at_once.size() == in_pieces.size());
  WELDCELL_ASSERT(at_once.size() * 4 <= stream.size());
  for (std::size_t i = 0; i < at_once.size(); ++i) {
    const auto &a = at_once[i], &b = in_pieces[i];
    WELDCELL_ASSERT(a.counter == b.counter && a.timestamp_us == b.timestamp_us && a.code == b.code);
    WELDCELL_ASSERT(a.distance_mm == b.distance_mm && a.distance_mm > -2148 && a.distance_mm < 2148);
  }
  WELDCELL_ASSERT(whole.counters().readings == at_once.size() &&
                  whole.counters().resyncs == split.counters().resyncs);
  return 0;
}
