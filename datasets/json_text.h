// JSON as text that every reader takes.
#pragma once

#include <string>

#include <nlohmann/json_fwd.hpp>

#include "solvers/expected.h"

namespace crumple {

// The document, indented. JSON has no NaN and no infinity: a number that is not finite is an error that names its
// place, such as "/sensors/0/sigma_px". Text that is not UTF-8 (a file name may hold any bytes) is replaced by U+FFFD.
Expected<std::string> json_text(const nlohmann::json& document);

}  // namespace crumple
