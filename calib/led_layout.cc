#include "calib/led_layout.h"

#include <cmath>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "solvers/closed_form/rigid_fit.h"

namespace crumple {
namespace {

constexpr double kMuchBetter = 3;

using Places = std::vector<Eigen::Vector3d>;

// RMS distance after the rigid motion that fits best; none where that is not determined.
std::optional<double> rms_after_fit(const Places& from, const Places& to) {
  const auto motion = rigid_fit(from, to);
  if (!motion) return std::nullopt;
  double sum = 0;
  for (std::size_t i = 0; i < from.size(); ++i) sum += (*motion * from[i] - to[i]).squaredNorm();
  return std::sqrt(sum / static_cast<double>(from.size()));
}

}  // namespace

std::vector<std::string> check_led_layout(const Rig& rig, const std::map<std::string, Eigen::Vector3d>& nominal_mm,
                                          double tolerance_mm) {
  std::vector<std::string> names;
  Places found, nominal;
  for (const Led& led : rig.leds) {
    const auto place = nominal_mm.find(led.name);
    if (led.mount != Mount::probe || place == nominal_mm.end()) continue;
    names.push_back(led.name);
    found.push_back(led.position_mm);
    nominal.push_back(place->second);
  }
  if (names.size() < 4) return {};
  const auto rms = rms_after_fit(found, nominal);
  if (!rms || *rms <= tolerance_mm) return {};
  double least = *rms;
  std::pair<std::size_t, std::size_t> swapped;
  for (std::size_t i = 0; i < names.size(); ++i) {
    for (std::size_t k = i + 1; k < names.size(); ++k) {
      Places exchanged = found;
      std::swap(exchanged[i], exchanged[k]);
      const auto other = rms_after_fit(exchanged, nominal);
      if (!other || *other >= least) continue;
      least = *other;
      swapped = {i, k};
    }
  }
  if (least < *rms / kMuchBetter) {
    return {
        fmt::format("LEDs {} and {} seem swapped: from their nominal places all are {:.1f} mm away, {:.1f} mm with "
                    "these two exchanged; check their words",
                    names[swapped.first], names[swapped.second], *rms, least)};
  }
  return {
      fmt::format("the LEDs are {:.1f} mm (RMS) from their nominal places: check `nominal_mm` and the words", *rms)};
}

}  // namespace crumple
