// Numbers that a reader takes in at a glance, for scales and steps.
#pragma once

namespace crumple {

// Of 1, 2 and 5 times a power of ten, the largest that does not exceed the value. Precondition: a positive value.
double largest_round_below(double value);

}  // namespace crumple
