// That a station's LEDs were read once, so that nothing says whether anything moved there (tracking/stillness.h).
#pragma once

#include <string>
#include <vector>

namespace crumple {

// One line on all such stations, and what to do; empty where there is none.
std::string untested_text(const std::vector<std::string>& stations);

}  // namespace crumple
