// Board placements measured with rigs that had not seen them.
#pragma once

#include <string>

#include "calib/cross_validate.h"

namespace crumple {

std::string validation_section(const CrossValidation& validation);

}  // namespace crumple
