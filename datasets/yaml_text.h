// Text as YAML that reads back as the same bytes.
#pragma once

#include <string>

namespace crumple {

// In double quotes, control characters escaped.
std::string yaml_quoted(const std::string& text);

}  // namespace crumple
