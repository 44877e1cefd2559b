// --unit: the unit of lengths in files of formats that state none.
#pragma once

#include <optional>
#include <string>

#include "datasets/formats/rig_format.h"
#include "solvers/expected.h"

namespace crumple {

// mm in one of it, by --unit; none where the flag is empty. Fails on a unit it does not know, and on one for a format
// that states its own.
Expected<std::optional<double>> unit_from_flag(const RigFormat& format);

}  // namespace crumple
