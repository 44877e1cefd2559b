// The part of Python's literals that .cameramodel files are written in.
#pragma once

#include <string>

#include <nlohmann/json.hpp>

#include "solvers/expected.h"

namespace crumple {

// Dicts with text keys, lists and tuples (both become arrays), texts, bytes (b'...', as a text of its raw characters),
// whole and floating numbers, True, False, None; comments and trailing commas. Numbers are read exactly. Fails on
// anything else, on a key given twice and on nesting deeper than 32, naming line and column.
Expected<nlohmann::json> parse_python_literal(const std::string& text);

}  // namespace crumple
