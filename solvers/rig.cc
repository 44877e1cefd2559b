#include "solvers/rig.h"

namespace crumple {

std::optional<std::size_t> Rig::find(const std::string& name) const {
  for (std::size_t i = 0; i < sensors.size(); ++i) {
    if (sensors[i].name == name) return i;
  }
  return std::nullopt;
}

}  // namespace crumple
