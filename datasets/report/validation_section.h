// What changes where views are left out, and board placements measured with rigs that had not seen them.
#pragma once

#include <optional>
#include <string>

#include "calib/cross_validate.h"
#include "calib/fold_differences.h"

namespace crumple {

// Empty where neither was asked for.
std::string validation_section(const std::optional<FoldDifferences>& folds,
                               const std::optional<CrossValidation>& boards);

}  // namespace crumple
