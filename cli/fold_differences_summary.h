// What leaving views out changes, for summary.json and the terminal.
#pragma once

#include <string>

#include <nlohmann/json.hpp>

#include "calib/fold_differences.h"

namespace crumple {

nlohmann::json fold_differences_summary(const FoldDifferences& differences);
std::string fold_differences_text(const FoldDifferences& differences);

}  // namespace crumple
