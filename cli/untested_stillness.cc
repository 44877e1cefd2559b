#include "cli/untested_stillness.h"

#include <algorithm>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace crumple {
namespace {

constexpr std::size_t kUntestedToName = 5;

}  // namespace

std::string untested_text(const std::vector<std::string>& stations) {
  if (stations.empty()) return "";
  const std::size_t named = std::min(stations.size(), kUntestedToName);
  const auto end = stations.begin() + static_cast<std::ptrdiff_t>(named);
  return fmt::format(
      "stillness was not tested at {}{}: the LEDs' words were read once there; to have it tested, take at least twice "
      "as many frames as a word has steps\n",
      fmt::join(stations.begin(), end, ", "),
      stations.size() > named ? fmt::format(" and {} more", stations.size() - named) : "");
}

}  // namespace crumple
