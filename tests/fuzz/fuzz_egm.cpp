// One datagram through the EGM decoder: whatever it accepts is a usable frame, and refusing leaves the output
// alone.
#include <cmath>

#include "fuzz_target.hpp"
#include "weldcell/wire/egm.hpp"

using namespace weldcell;

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static wire::EgmCodec codec;
  wire::EgmFeedback f;
  f.seqno = 424242;
  const wire::EgmDecode result = codec.decode(fuzz::bytes(data, size), f);
  if (result != wire::EgmDecode::Ok) {
    WELDCELL_ASSERT(f.seqno == 424242);
    return 0;
  }
  WELDCELL_ASSERT(size <= wire::kEgmMaxBytes);
  for (std::size_t i = 0; i < 6; ++i)
    WELDCELL_ASSERT(std::isfinite(f.joints_deg[i]) && std::isfinite(f.planned_deg[i]));
  WELDCELL_ASSERT(f.time_us >= -1 && std::isfinite(f.utilization_percent));
  WELDCELL_ASSERT(static_cast<int>(f.motors) <= 2 && static_cast<int>(f.mci) <= 3 &&
                  static_cast<int>(f.rapid) <= 2);
  // A fresh decoder must see the same: nothing may stay behind from the frames before.
  wire::EgmCodec fresh;
  wire::EgmFeedback again;
  WELDCELL_ASSERT(fresh.decode(fuzz::bytes(data, size), again) == result);
  WELDCELL_ASSERT(again.seqno == f.seqno && again.joints_deg == f.joints_deg &&
                  again.planned_deg == f.planned_deg);
  WELDCELL_ASSERT(again.time_us == f.time_us && again.motors == f.motors && again.mci == f.mci &&
                  again.rapid == f.rapid);
  return 0;
}
