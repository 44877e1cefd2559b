// How large numbers in files may be, so that what is computed from them stays finite and fits into memory.
#pragma once

namespace crumple {

constexpr double kLargestValue = 1e12;
constexpr int kLargestImage_px = 1000000;  // along a side

}  // namespace crumple
