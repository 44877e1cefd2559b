// Independent work over several threads. Each item is done alone and writes only its own result, so the bits do not
// depend on the thread count; sums over items are the caller's, in the caller's order.
#pragma once

#include <cstddef>
#include <functional>

namespace crumple {

// Calls work(0) ... work(count - 1), each once, in no particular order; threads <= 1 runs all of them here. `work` must
// not throw; it may call parallel_for itself.
//
// Threads are started once and kept. The caller works too and waits only for items that another thread has begun: on a
// busy machine, where helpers come late or never, a call takes no longer than it would alone.
void parallel_for(std::size_t count, int threads, const std::function<void(std::size_t)>& work);

}  // namespace crumple
