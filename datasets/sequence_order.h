// Finds the order in which frames were really taken. Works on sequence statistics alone.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "datasets/capture.h"
#include "datasets/sequence_statistics.h"

namespace crumple {

enum class OrderFault { none, exchanged, inverses_first, finest_first, dropped, repeated, bad_frame, unclear };

struct OrderVerdict {
  OrderFault fault = OrderFault::none;
  // exchanged: pairs of frames, flattened. dropped, repeated: the frames that explain the data equally well, of which
  // one was. bad_frame: the frames. inverses_first, finest_first: orientations. unclear: the frames that fit worst.
  std::vector<std::size_t> involved;
};

OrderVerdict find_order(const std::vector<FrameContent>& contents, const SequenceStatistics& statistics);

}  // namespace crumple
