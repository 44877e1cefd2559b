#include "cli/led_input.h"

#include <algorithm>
#include <map>
#include <numeric>
#include <optional>
#include <set>
#include <utility>

#include <fmt/format.h>

#include "cli/progress.h"
#include "datasets/led_images.h"
#include "solvers/parallel.h"
#include "tracking/constellation.h"
#include "tracking/mixed_images.h"
#include "tracking/stillness.h"

namespace crumple {
namespace {

constexpr const char* kAllTrackers = "all trackers";

// One tracker at one station.
struct LightSight {
  std::size_t sensor = 0;
  const Station* station = nullptr;
  Expected<Identification> lights = Identification{};
};

// The room's LEDs by their places: an end of a scale bar is another LED at every place the bar is put down at.
class RoomLeds {
 public:
  // Adds to the LEDs of the data, which are the capture's so far, and the bars between them.
  RoomLeds(const Capture& capture, CalibrationData& data) : capture_(capture) {
    for (const CaptureBar& bar : capture.scale_bars) {
      ScaleBar placed{bar.name, {}, bar.length_mm, bar.certificate, bar.placing_sigma_mm};
      const std::size_t count = std::max<std::size_t>(1, bar.places.size());
      for (std::size_t place = 0; place < count; ++place) {
        placed.places.emplace_back(add(bar, 0, place, data), add(bar, 1, place, data));
      }
      data.bars.push_back(std::move(placed));
    }
  }

  // The LED's number in the data while the probe is at the station; none of an end whose bar lies nowhere then.
  std::optional<std::size_t> at(std::size_t led, const std::string& station) const {
    const auto found = places_.find(led);
    if (found == places_.end()) return led;
    for (const Place& place : found->second) {
      const bool there = place.stations == nullptr ||
                         std::find(place.stations->begin(), place.stations->end(), station) != place.stations->end();
      if (there) return place.led;
    }
    return std::nullopt;
  }

 private:
  struct Place {
    std::size_t led = 0;
    const std::vector<std::string>* stations = nullptr;  // none: all
  };

  std::size_t add(const CaptureBar& bar, std::size_t end, std::size_t place, CalibrationData& data) {
    std::size_t led = 0;
    while (capture_.leds[led].name != bar.leds[end]) ++led;
    std::size_t placed = led;
    if (place > 0) {
      placed = data.leds.size();
      data.leds.push_back({fmt::format("{}-{}", bar.leds[end], place + 1), Eigen::Vector3d::Zero(), Mount::world});
    }
    places_[led].push_back({placed, bar.places.empty() ? nullptr : &bar.places[place]});
    return placed;
  }

  const Capture& capture_;
  std::map<std::size_t, std::vector<Place>> places_;
};

// Stations at which the probe or a tracker moved between two readings of the words, by name: the mean of the readings
// is of no place at which anything stood.
std::set<std::string> stations_that_moved(const Capture& capture, const std::vector<LightSight>& sights,
                                          CalibrationInput& input) {
  std::vector<std::size_t> leds(capture.leds.size());
  std::iota(leds.begin(), leds.end(), std::size_t{0});
  std::vector<Stillness> stations;
  for (const Station& station : capture.stations) {
    std::vector<TrackerLights> trackers;
    for (const LightSight& sight : sights) {
      if (sight.station == &station) trackers.push_back({sight.sensor, *sight.lights});
    }
    stations.push_back(stillness(readings_over_time(trackers, leds)));
  }
  std::set<std::string> moved;
  for (const std::size_t s : moved_stations(stations)) {
    const std::string& id = capture.stations[s].id;
    const std::string reason = moved_text(stations[s]);
    log_warning(fmt::format("station {}: its LEDs are left out: {}", id, reason));
    input.skipped.push_back({id, kAllTrackers, reason, false});
    moved.insert(id);
  }
  return moved;
}

// The LEDs that are told for sure, as observations of the station; the room's by themselves.
void add_leds(const Capture& capture, const RoomLeds& room, const LightSight& sight, CalibrationInput& input) {
  const std::string& tracker = input.data.sensors[sight.sensor].name;
  LedView on_probe{sight.sensor, {}, {}, {}}, in_room{sight.sensor, {}, {}, {}};
  for (const IdentifiedLight& light : sight.lights->leds) {
    const bool is_room = capture.leds[light.led].mount == Mount::world;
    const auto led = is_room ? room.at(light.led, sight.station->id) : light.led;
    if (!led) continue;
    LedView& view = is_room ? in_room : on_probe;
    view.leds.push_back(*led);
    view.pixels.push_back(light.light.pixel);
  }
  for (std::size_t i = 0; i < sight.lights->candidates.size(); ++i) {
    const std::size_t led = sight.lights->candidates[i].led;
    if (i > 0 && sight.lights->candidates[i - 1].led == led) continue;
    input.skipped.push_back(
        {sight.station->id, tracker,
         fmt::format("LED {} blinks at several places: a reflection, which only a calibrated rig tells",
                     capture.leds[led].name),
         false});
  }
  if (!on_probe.leds.empty()) {
    on_probe.station = station_number(sight.station->id, input.data);
    input.data.observations.leds.push_back(std::move(on_probe));
  }
  if (!in_room.leds.empty()) input.data.observations.leds.push_back(std::move(in_room));
}

// One that is not in the rig, or not read.
void name_led(const std::string& station, const std::string& sensor, const std::string& reason,
              CalibrationInput& input) {
  log_warning(reason);
  input.skipped.push_back({station, sensor, reason, false});
}

// By their numbers in the data, those of an earlier rig that stay in the new one, read or not.
std::set<std::size_t> known_leds(const std::vector<Led>& earlier, const CalibrationData& data) {
  const bool any_in_world = std::any_of(data.sensors.begin(), data.sensors.end(),
                                        [](const SensorSpec& sensor) { return sensor.mount == Mount::world; });
  if (!any_in_world) return {};
  std::set<std::size_t> known;
  for (std::size_t l = 0; l < data.leds.size(); ++l) {
    const bool is_there = std::any_of(earlier.begin(), earlier.end(), [&](const Led& led) {
      return led.name == data.leds[l].name && led.mount == data.leds[l].mount;
    });
    if (is_there) known.insert(l);
  }
  for (const ScaleBar& bar : data.bars) {
    for (const auto& [from, to] : bar.places) {
      known.erase(from);
      known.erase(to);
    }
  }
  return known;
}

// References that only one camera sees: nothing tells their places, unless they are known. Returns which.
std::set<std::size_t> leave_out_lone_references(const std::set<std::size_t>& known, CalibrationInput& input) {
  std::map<std::size_t, std::set<std::size_t>> seen_by;
  for (const LedView& view : input.data.observations.leds) {
    if (view.station) continue;
    for (const std::size_t led : view.leds) seen_by[led].insert(view.sensor);
  }
  for (LedView& view : input.data.observations.leds) {
    if (view.station) continue;
    LedView kept{view.sensor, {}, {}, {}};
    for (std::size_t i = 0; i < view.leds.size(); ++i) {
      if (seen_by[view.leds[i]].size() < 2 && !known.contains(view.leds[i])) continue;
      kept.leds.push_back(view.leds[i]);
      kept.pixels.push_back(view.pixels[i]);
    }
    view = std::move(kept);
  }
  std::erase_if(input.data.observations.leds, [](const LedView& view) { return view.leds.empty(); });
  std::set<std::size_t> lone;
  for (const auto& [led, sensors] : seen_by) {
    if (sensors.size() > 1 || known.contains(led)) continue;
    const std::string& camera = input.data.sensors[*sensors.begin()].name;
    name_led("room", camera,
             fmt::format("LED {} is left out: no camera but {} sees it", input.data.leds[led].name, camera), input);
    lone.insert(led);
  }
  return lone;
}

std::set<std::size_t> leds_that_were_read(const Observations& observations) {
  std::set<std::size_t> read;
  for (const LedView& view : observations.leds) read.insert(view.leds.begin(), view.leds.end());
  return read;
}

// LEDs that were read at no station, by name, but for those that have been named.
void name_unread_leds(const std::vector<LightSight>& sights, const std::set<std::string>& moved,
                      const std::set<std::size_t>& named, const std::set<std::size_t>& known, CalibrationInput& input) {
  const std::set<std::size_t> read = leds_that_were_read(input.data.observations);
  std::set<std::size_t> doubtful, unsteady;  // an LED of the capture has the same number in the data
  for (const LightSight& sight : sights) {
    for (const IdentifiedLight& light : sight.lights->candidates) doubtful.insert(light.led);
    if (!moved.contains(sight.station->id)) continue;
    for (const IdentifiedLight& light : sight.lights->leds) unsteady.insert(light.led);
  }
  for (std::size_t l = 0; l < input.data.leds.size(); ++l) {
    if (read.contains(l) || named.contains(l)) continue;
    const char* const why = sights.empty()         ? "no camera among the sensors watches it"
                            : unsteady.contains(l) ? "wherever it was read something moved between the readings"
                            : doubtful.contains(l)
                                ? "wherever it is seen its word blinks at several places; does another LED blink it?"
                                : "it was never read; is it lit, and is that its word?";
    const char* const what = known.contains(l) ? "keeps what the earlier rig says of it" : "is left out";
    name_led("all", kAllTrackers, fmt::format("LED {} {}: {}", input.data.leds[l].name, what, why), input);
  }
}

// A rig states the places of all its LEDs, so it may not have those that neither an observation places nor an earlier
// rig.
void drop_unplaced_leds(const std::set<std::size_t>& known, CalibrationData& data) {
  std::set<std::size_t> placed = leds_that_were_read(data.observations);
  placed.insert(known.begin(), known.end());
  std::map<std::size_t, std::size_t> number_of;
  std::vector<Led> kept;
  for (const std::size_t led : placed) {
    number_of[led] = kept.size();
    kept.push_back(data.leds[led]);
  }
  data.leds = std::move(kept);
  for (LedView& view : data.observations.leds) {
    for (std::size_t& led : view.leds) led = number_of.at(led);
  }
  for (ScaleBar& bar : data.bars) {
    for (auto& [from, to] : bar.places) {
      from = number_of.at(from);
      to = number_of.at(to);
    }
  }
}

Expected<void> check_images_differ(const std::vector<LightSight>& sights, const CalibrationData& data) {
  for (const LightSight& a : sights) {
    for (const LightSight& b : sights) {
      if (a.station != b.station || a.sensor >= b.sensor || !same_images(*a.lights, *b.lights)) continue;
      return fail(fmt::format("station {}: {} and {} have the same images: one of them has the other's", a.station->id,
                              data.sensors[a.sensor].name, data.sensors[b.sensor].name));
    }
  }
  return {};
}

Expected<void> check_bars_are_seen(const CalibrationData& data) {
  std::set<std::size_t> seen;
  for (const LedView& view : data.observations.leds) {
    if (!view.station) seen.insert(view.leds.begin(), view.leds.end());
  }
  for (const ScaleBar& bar : data.bars) {
    for (const auto& [from, to] : bar.places) {
      if (seen.contains(from) && seen.contains(to)) continue;
      return fail(fmt::format("scale bar {}: two cameras must see its LED {}: leave out that place, or the bar",
                              bar.name, data.leds[seen.contains(from) ? to : from].name));
    }
  }
  return {};
}

}  // namespace

std::size_t station_number(const std::string& id, CalibrationData& data) {
  const auto known = std::find(data.station_names.begin(), data.station_names.end(), id);
  const auto number = static_cast<std::size_t>(known - data.station_names.begin());
  if (known == data.station_names.end()) data.station_names.push_back(id);
  return number;
}

Expected<void> read_leds(const Capture& capture, const std::vector<Led>& earlier, int threads,
                         CalibrationInput& input) {
  if (capture.leds.empty()) return {};
  const auto code = blink_code_of(capture);
  if (!code) return tl::unexpected(code.error());
  for (const CaptureLed& led : capture.leds) input.data.leds.push_back({led.name, {0, 0, 0}, led.mount});
  const RoomLeds room(capture, input.data);
  const std::set<std::size_t> known = known_leds(earlier, input.data);
  std::vector<LightSight> sights;
  for (const Station& station : capture.stations) {
    for (std::size_t s = 0; s < input.data.sensors.size(); ++s) {
      const SensorSpec& sensor = input.data.sensors[s];
      const bool watches = sensor.mount == Mount::world && capture.took_images(sensor.name, station) &&
                           capture.find_frame(FrameContent::Kind::leds, sensor.name);
      if (watches && !capture.exclusion(station.id, sensor.name)) sights.push_back({s, &station});
    }
  }
  Progress progress("reading LEDs", sights.size());
  parallel_for(sights.size(), threads, [&](std::size_t i) {
    sights[i].lights = read_lights(capture, *code, input.data.sensors[sights[i].sensor].name, sights[i].station->id);
    progress.advance();
  });
  for (const LightSight& sight : sights) {
    if (!sight.lights) return tl::unexpected(sight.lights.error());
  }
  if (const auto differ = check_images_differ(sights, input.data); !differ) return differ;
  const std::set<std::string> moved = stations_that_moved(capture, sights, input);
  for (const LightSight& sight : sights) {
    if (!moved.contains(sight.station->id)) add_leds(capture, room, sight, input);
  }
  const std::set<std::size_t> lone = leave_out_lone_references(known, input);
  if (const auto seen = check_bars_are_seen(input.data); !seen) return seen;
  name_unread_leds(sights, moved, lone, known, input);
  drop_unplaced_leds(known, input.data);
  return {};
}

}  // namespace crumple
