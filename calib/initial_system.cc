#include "calib/initial_system.h"

#include <algorithm>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include <fmt/format.h>

#include "calib/one_tracker.h"
#include "solvers/closed_form/hand_eye.h"
#include "solvers/closed_form/rigid_fit.h"
#include "solvers/closed_form/triangulate.h"
#include "solvers/mean_pose.h"
#include "tracking/motion_selection.h"
#include "tracking/probe_pose.h"

namespace crumple {
namespace {

using Station = std::optional<std::size_t>;
using BoardSighting = std::pair<std::size_t, Station>;  // placement and station

constexpr std::size_t kLeastForRigidFit = 3;

// A part's sensors and board views with numbers of their own.
struct Part {
  CalibrationData data;
  std::vector<std::size_t> sensors;       // of the whole, by the part's numbers
  std::vector<BoardSighting> placements;  // by the part's numbers
};

std::string sighting_name(const CalibrationData& data, const BoardSighting& sighting) {
  const std::string& placement = data.placement_names[sighting.first];
  if (!sighting.second) return placement;
  const std::string& station = data.station_names[*sighting.second];
  return station == placement ? placement : fmt::format("{} from station {}", placement, station);
}

class PartMaker {
 public:
  PartMaker(const CalibrationData& whole, Mount mount) : whole_(whole) {
    part_.data.boards = whole.boards;
    part_.data.temperature = whole.temperature;
    for (std::size_t s = 0; s < whole.sensors.size(); ++s) {
      if (whole.sensors[s].mount != mount) continue;
      number_of_sensor_[s] = part_.sensors.size();
      part_.sensors.push_back(s);
      part_.data.sensors.push_back(whole.sensors[s]);
      part_.data.sensors.back().mount = Mount::probe;
    }
  }

  Part make() {
    for (CornerView view : whole_.observations.corners) {
      if (!number_of_sensor_.contains(view.sensor)) continue;
      view.sensor = number_of_sensor_.at(view.sensor);
      add(std::move(view), part_.data.observations.corners);
    }
    for (StripeView view : whole_.observations.stripes) {
      if (!take_pair(view)) continue;
      add(std::move(view), part_.data.observations.stripes);
    }
    for (FeatureView view : whole_.observations.features) {
      if (!take_pair(view)) continue;
      add(std::move(view), part_.data.observations.features);
    }
    for (PixelPairs pairs : whole_.pairs) {
      if (!take_pair(pairs)) continue;
      add(std::move(pairs), part_.data.pairs);
    }
    part_.data.observations.placement_count = part_.placements.size();
    return std::move(part_);
  }

 private:
  template <typename V>
  bool take_pair(V& view) const {
    if (!number_of_sensor_.contains(view.camera)) return false;
    view.camera = number_of_sensor_.at(view.camera);
    view.projector = number_of_sensor_.at(view.projector);
    return true;
  }

  template <typename V>
  void add(V view, std::vector<V>& views) {
    view.placement = number_of({view.placement, view.station});
    view.station = std::nullopt;
    views.push_back(std::move(view));
  }

  std::size_t number_of(const BoardSighting& sighting) {
    const auto [found, is_new] = number_of_sighting_.emplace(sighting, part_.placements.size());
    if (is_new) {
      part_.placements.push_back(sighting);
      part_.data.board_of.push_back(whole_.board_of[sighting.first]);
      part_.data.placement_names.push_back(sighting_name(whole_, sighting));
    }
    return found->second;
  }

  const CalibrationData& whole_;
  Part part_;
  std::map<std::size_t, std::size_t> number_of_sensor_;
  std::map<BoardSighting, std::size_t> number_of_sighting_;
};

// Everything in its place, nothing known of it yet.
Expected<CalibrationState> blank_state(const CalibrationData& data) {
  CalibrationState state;
  for (const SensorSpec& spec : data.sensors) {
    auto lens = Lens::undistorted(spec.lens_model, spec.size, spec.size.width_px, spec.size.width_px,
                                  {0.5 * (spec.size.width_px - 1), 0.5 * (spec.size.height_px - 1)});
    if (!lens) return fail(fmt::format("{}: {}", spec.name, lens.error().message));
    state.rig.sensors.push_back({spec.name, spec.kind, std::move(*lens), {}, spec.mount});
  }
  state.rig.leds = data.leds;
  state.boards = nominal_boards(data);
  state.board_of = data.board_of;
  state.world_from_board.resize(data.placement_names.size());
  state.world_from_probe.resize(data.station_names.size());
  return state;
}

// What the parts know, in the frames of the whole.
struct Known {
  CalibrationState state;
  std::map<BoardSighting, Pose> probe_from_board;
  std::map<std::size_t, Pose> world_from_board;        // by placement
  std::map<std::size_t, Pose> world_from_leds;         // by station; the LEDs' own frame
  std::map<std::size_t, Pose> world_from_probe;        // by station
  std::map<std::size_t, Eigen::Vector3d> led_in_leds;  // by LED, in the LEDs' frame
  std::set<std::size_t> located;                       // LEDs whose place on the probe is in the state
};

Expected<void> take_part(const CalibrationData& data, Mount mount, const CalibratePart& calibrate_part, Known& known) {
  const Part part = PartMaker(data, mount).make();
  if (part.sensors.empty()) return {};
  const auto solved = calibrate_part(part.data);
  if (!solved) return tl::unexpected(solved.error());
  for (std::size_t s = 0; s < part.sensors.size(); ++s) {
    Sensor& sensor = known.state.rig.sensors[part.sensors[s]];
    sensor = solved->rig.sensors[s];
    sensor.mount = mount;
  }
  for (std::size_t p = 0; p < part.placements.size(); ++p) {
    const BoardSighting& sighting = part.placements[p];
    if (mount == Mount::world) {
      known.world_from_board[sighting.first] = solved->world_from_board[p];
    } else {
      known.probe_from_board[sighting] = solved->world_from_board[p];
    }
  }
  for (const std::size_t b : solved->board_of) known.state.boards[b] = solved->boards[b];
  return {};
}

// Of the LEDs that two sensors or more see: in the world.
std::map<std::size_t, Eigen::Vector3d> triangulated_leds(const CalibrationData& data, const Rig& rig, Station station) {
  std::map<std::size_t, std::vector<Sighting>> sightings;
  for (const LedView& view : data.observations.leds) {
    if (view.station != station) continue;
    const Sensor& sensor = rig.sensors[view.sensor];
    for (std::size_t i = 0; i < view.leds.size(); ++i) {
      sightings[view.leds[i]].push_back({&sensor.lens, sensor.sensor_from_mount, view.pixels[i]});
    }
  }
  std::map<std::size_t, Eigen::Vector3d> points;
  for (const auto& [led, seen] : sightings) {
    if (const auto point = triangulate(seen)) points[led] = point->point_mm;
  }
  return points;
}

// The pose of the LEDs' frame from those LEDs it knows already.
std::optional<Pose> fit_leds(const std::map<std::size_t, Eigen::Vector3d>& in_leds,
                             const std::map<std::size_t, Eigen::Vector3d>& in_world) {
  std::vector<Eigen::Vector3d> from, to;
  for (const auto& [led, point] : in_world) {
    const auto known = in_leds.find(led);
    if (known == in_leds.end()) continue;
    from.push_back(known->second);
    to.push_back(point);
  }
  if (from.size() < kLeastForRigidFit) return std::nullopt;
  const auto pose = rigid_fit(from, to);
  return pose ? std::optional(*pose) : std::nullopt;
}

// Where nothing can be triangulated: the tracker that reads most LEDs before one placement poses that placement and the
// LEDs.
Expected<void> start_from_one_tracker(const CalibrationData& data, Known& known) {
  std::map<std::pair<std::size_t, std::size_t>, std::vector<LedsBeforeBoard>> candidates;  // by placement and tracker
  for (const LedView& view : data.observations.leds) {
    for (const auto& [sighting, probe_from_board] : known.probe_from_board) {
      if (!view.station || sighting.second != view.station) continue;
      candidates[{sighting.first, view.sensor}].push_back({probe_from_board.inverse(), view.leds, view.pixels});
    }
  }
  const auto most = std::max_element(candidates.begin(), candidates.end(),
                                     [](const auto& a, const auto& b) { return a.second.size() < b.second.size(); });
  if (most == candidates.end()) return fail("no tracker sees the probe's LEDs while the probe sees a board");
  const auto& [placement, tracker] = most->first;
  const Sensor& sensor = known.state.rig.sensors[tracker];
  const auto start = one_tracker_start(sensor.lens, most->second);
  if (!start) return tl::unexpected(start.error());
  known.world_from_board[placement] = sensor.sensor_from_mount.inverse() * start->tracker_from_board;
  for (const auto& [led, position_mm] : start->led_in_probe_mm) {
    known.state.rig.leds[led].position_mm = position_mm;
    known.located.insert(led);
  }
  return {};
}

// The constellation, and where it is at every station that shows enough of it.
Expected<void> build_constellation(const CalibrationData& data, Known& known) {
  std::map<std::size_t, std::map<std::size_t, Eigen::Vector3d>> waiting;  // station -> LED -> in the world
  for (std::size_t s = 0; s < data.station_names.size(); ++s) {
    auto points = triangulated_leds(data, known.state.rig, s);
    if (points.size() >= kLeastForRigidFit) waiting.emplace(s, std::move(points));
  }
  if (waiting.empty() && !known.probe_from_board.empty()) return start_from_one_tracker(data, known);
  if (waiting.empty()) {
    return fail(
        "at no station do two trackers see the same three LEDs: check what the trackers see and that they are "
        "calibrated");
  }
  const auto most = std::max_element(waiting.begin(), waiting.end(),
                                     [](const auto& a, const auto& b) { return a.second.size() < b.second.size(); });
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const auto& [led, point] : most->second) middle += point / static_cast<double>(most->second.size());
  for (const auto& [led, point] : most->second) known.led_in_leds[led] = point - middle;
  for (bool any = true; any && !waiting.empty();) {
    any = false;
    for (auto station = waiting.begin(); station != waiting.end();) {
      const auto pose = fit_leds(known.led_in_leds, station->second);
      if (!pose) {
        ++station;
        continue;
      }
      known.world_from_leds[station->first] = *pose;
      for (const auto& [led, point] : station->second) known.led_in_leds.emplace(led, pose->inverse() * point);
      station = waiting.erase(station);
      any = true;
    }
  }
  return {};
}

// leds_from_probe by boards that trackers and probe see at the same place.
std::vector<Pose> direct_hand_eyes(const Known& known) {
  std::vector<Pose> found;
  for (const auto& [sighting, probe_from_board] : known.probe_from_board) {
    const auto board = known.world_from_board.find(sighting.first);
    if (!sighting.second || board == known.world_from_board.end()) continue;
    const auto leds = known.world_from_leds.find(*sighting.second);
    if (leds == known.world_from_leds.end()) continue;
    found.push_back(leds->second.inverse() * board->second * probe_from_board.inverse());
  }
  return found;
}

Expected<Pose> leds_from_probe(const Known& known) {
  if (const std::vector<Pose> direct = direct_hand_eyes(known); !direct.empty()) return mean_pose(direct);
  std::map<std::size_t, std::vector<PosePair>> pairs;  // by placement
  for (const auto& [sighting, probe_from_board] : known.probe_from_board) {
    if (!sighting.second) continue;
    const auto leds = known.world_from_leds.find(*sighting.second);
    if (leds == known.world_from_leds.end()) continue;
    auto& of_placement = pairs[sighting.first];
    of_placement.push_back(
        {static_cast<double>(of_placement.size()), leds->second, probe_from_board.inverse(), {}, {}});
  }
  std::vector<HandEyeMotion> motions;
  for (const auto& [placement, of_placement] : pairs) {
    if (of_placement.size() < 2) continue;
    const SelectedMotions selected = select_motions(of_placement);
    motions.insert(motions.end(), selected.motions.begin(), selected.motions.end());
  }
  const auto start = hand_eye_start(motions);
  if (!start) {
    return fail(
        fmt::format("hand and eye: {}. Show the probe the same board placement from several stations, turned about "
                    "different axes, or "
                    "let the trackers see the board too",
                    start.error().message));
  }
  return start->hand_from_eye;
}

// Stations that are not known yet, by the pixels of LEDs that are: such as those of one tracker.
void pose_by_leds(const CalibrationData& data, Known& known) {
  constexpr double kNominalSigma_px = 0.5;
  for (std::size_t s = 0; s < data.station_names.size(); ++s) {
    if (known.world_from_probe.contains(s)) continue;
    LedReadings readings;
    for (const LedView& view : data.observations.leds) {
      if (view.station != s) continue;
      const Eigen::Matrix2d covariance = kNominalSigma_px * kNominalSigma_px * Eigen::Matrix2d::Identity();
      readings.push_back({view, std::vector<Eigen::Matrix2d>(view.leds.size(), covariance)});
    }
    const auto pose = probe_pose(known.state.rig, readings);
    if (pose) known.world_from_probe[s] = pose->world_from_probe;
  }
}

// Placements from stations and stations from placements until nothing new is known.
void spread(Known& known) {
  for (bool any = true; any;) {
    any = false;
    std::map<std::size_t, std::vector<Pose>> placements;
    for (const auto& [sighting, probe_from_board] : known.probe_from_board) {
      if (!sighting.second) continue;
      const auto station = known.world_from_probe.find(*sighting.second);
      if (station != known.world_from_probe.end() && !known.world_from_board.contains(sighting.first)) {
        placements[sighting.first].push_back(station->second * probe_from_board);
      }
    }
    for (const auto& [placement, poses] : placements) {
      known.world_from_board[placement] = mean_pose(poses);
      any = true;
    }
    for (const auto& [sighting, probe_from_board] : known.probe_from_board) {
      const auto board = known.world_from_board.find(sighting.first);
      if (!sighting.second || board == known.world_from_board.end()) continue;
      any = known.world_from_probe.emplace(*sighting.second, board->second * probe_from_board.inverse()).second || any;
    }
  }
}

// LEDs of the probe that are in no constellation yet: seen by single trackers, but from several stations that are
// posed. Names one that stays unknown; the refinement must not start it from nowhere.
Expected<void> locate_other_leds(const CalibrationData& data, Known& known) {
  std::map<std::size_t, std::vector<Sighting>> sightings;  // the probe's frame in place of the world
  for (const LedView& view : data.observations.leds) {
    if (!view.station) continue;
    const auto station = known.world_from_probe.find(*view.station);
    const Sensor& sensor = known.state.rig.sensors[view.sensor];
    for (std::size_t i = 0; i < view.leds.size(); ++i) {
      if (known.located.contains(view.leds[i])) continue;
      auto& of_led = sightings[view.leds[i]];
      if (station == known.world_from_probe.end()) continue;
      of_led.push_back({&sensor.lens, sensor.sensor_from_mount * station->second, view.pixels[i]});
    }
  }
  for (const auto& [led, seen] : sightings) {
    const auto point = triangulate(seen);
    if (!point) {
      return fail(
          fmt::format("LED {}: its place on the probe cannot be told: {}", data.leds[led].name, point.error().message));
    }
    known.state.rig.leds[led].position_mm = point->point_mm;
  }
  return {};
}

// Takes the poses into the state; names what is not connected.
Expected<void> settle(const CalibrationData& data, const Known& known, CalibrationState& state) {
  for (const LedView& view : data.observations.leds) {
    if (view.station && !known.world_from_probe.contains(*view.station)) {
      return fail(
          fmt::format("station {}: the probe cannot be posed: it needs three LEDs seen by two trackers each, or a "
                      "board whose place is known from other stations",
                      data.station_names[*view.station]));
    }
  }
  for (std::size_t p = 0; p < state.world_from_board.size(); ++p) {
    const auto found = known.world_from_board.find(p);
    if (found == known.world_from_board.end()) {
      return fail(
          fmt::format("placement {}: nothing connects it with the rest: neither trackers nor a posed station see "
                      "the board there",
                      data.placement_names[p]));
    }
    state.world_from_board[p] = found->second;
  }
  for (const auto& [station, pose] : known.world_from_probe) state.world_from_probe[station] = pose;
  return {};
}

}  // namespace

Expected<CalibrationState> initial_system(const CalibrationData& data, const CalibratePart& calibrate_part) {
  auto blank = blank_state(data);
  if (!blank) return blank;
  Known known;
  known.state = std::move(*blank);
  if (const auto done = take_part(data, Mount::world, calibrate_part, known); !done)
    return tl::unexpected(done.error());
  if (const auto done = take_part(data, Mount::probe, calibrate_part, known); !done)
    return tl::unexpected(done.error());
  const bool any_led = std::any_of(data.observations.leds.begin(), data.observations.leds.end(),
                                   [](const LedView& view) { return view.station.has_value(); });
  if (any_led) {
    if (const auto done = build_constellation(data, known); !done) return tl::unexpected(done.error());
    const bool needs_hand_eye = !known.probe_from_board.empty() && !known.led_in_leds.empty();
    const auto hand_eye = needs_hand_eye ? leds_from_probe(known) : Expected<Pose>(Pose{});
    if (!hand_eye) return tl::unexpected(hand_eye.error());
    for (const auto& [station, world_from_leds] : known.world_from_leds) {
      known.world_from_probe[station] = world_from_leds * *hand_eye;
    }
    for (const auto& [led, point] : known.led_in_leds) {
      known.state.rig.leds[led].position_mm = hand_eye->inverse() * point;
      known.located.insert(led);
    }
  }
  for (const auto& [led, point] : triangulated_leds(data, known.state.rig, std::nullopt)) {
    known.state.rig.leds[led].position_mm = point;
  }
  spread(known);
  if (any_led) pose_by_leds(data, known);
  spread(known);
  if (const auto done = locate_other_leds(data, known); !done) return tl::unexpected(done.error());
  CalibrationState state = std::move(known.state);
  if (const auto done = settle(data, known, state); !done) return tl::unexpected(done.error());
  return state;
}

}  // namespace crumple
