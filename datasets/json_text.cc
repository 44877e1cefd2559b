#include "datasets/json_text.h"

#include <cmath>

#include <fmt/core.h>
#include <nlohmann/json.hpp>

namespace crumple {
namespace {

// The JSON pointer of the first number that is not finite, or nothing.
std::string place_not_finite(const nlohmann::json& node, const std::string& place) {
  if (node.is_number_float() && !std::isfinite(node.get<double>())) return place.empty() ? "/" : place;
  if (!node.is_structured()) return {};
  for (const auto& [key, value] : node.items()) {
    std::string found = place_not_finite(value, place + "/" + key);
    if (!found.empty()) return found;
  }
  return {};
}

}  // namespace

Expected<std::string> json_text(const nlohmann::json& document) {
  const std::string place = place_not_finite(document, "");
  if (!place.empty()) return fail(fmt::format("The number at {} is not finite and JSON cannot hold it.", place));
  return document.dump(2, ' ', false, nlohmann::json::error_handler_t::replace);
}

}  // namespace crumple
