// The middle of some numbers.
#pragma once

#include <vector>

namespace crumple {

// Of an even number of them the upper of the two in the middle. Precondition: there are some.
double median_of(std::vector<double> values);

}  // namespace crumple
