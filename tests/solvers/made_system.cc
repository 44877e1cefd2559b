#include "tests/solvers/made_system.h"

#include <numbers>
#include <random>

#include "solvers/sensor_chain.h"

namespace crumple {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kProbeDistance_mm = 800;

// A frame at `position` whose z axis points to `target` and whose x axis is level, turned about z by `roll_rad`.
Pose world_from_onlooker(const Eigen::Vector3d& position, const Eigen::Vector3d& target, double roll_rad) {
  const Eigen::Vector3d z = (target - position).normalized();
  const Eigen::Vector3d x = Eigen::Vector3d::UnitY().cross(z).normalized();
  Eigen::Matrix3d axes;
  axes << x, z.cross(x), z;
  const Eigen::Quaterniond level(axes);
  return {level * Eigen::AngleAxisd(roll_rad, Eigen::Vector3d::UnitZ()), position};
}

class Maker {
 public:
  explicit Maker(const MadeSystemOptions& options) : options_(options), random_(options.seed) {}

  MadeSystem make() {
    make_rig();
    add_room();
    if (options_.change) options_.change(made_.truth.rig);
    made_.truth.boards = {Board::grid(11, 8, 30), Board::grid(10, 7, 60)};
    made_.truth.boards[0].name = "board";
    made_.truth.boards[1].name = "tracker_board";
    for (int p = 0; p < options_.placements; ++p) place_board();
    for (int s = 0; s < options_.stations; ++s) visit(static_cast<std::size_t>(s % options_.placements), true);
    for (int s = 0; s < options_.wand_stations; ++s) visit(static_cast<std::size_t>(s % options_.placements), false);
    for (int p = 0; p < options_.tracker_placements; ++p) show_to_trackers();
    for (std::size_t s = 0; s < made_.truth.rig.sensors.size(); ++s) {
      if (made_.truth.rig.sensors[s].mount == Mount::world) see_leds(s, std::nullopt);
    }
    made_.observations.placement_count = made_.truth.world_from_board.size();
    return std::move(made_);
  }

 private:
  double uniform(double reach) { return std::uniform_real_distribution<double>(-reach, reach)(random_); }
  double noise(double sigma) { return sigma > 0 ? std::normal_distribution<double>(0, sigma)(random_) : 0; }
  Eigen::Vector2d noise2(double sigma) {
    const double x = noise(sigma);
    return {x, noise(sigma)};
  }
  Eigen::Vector3d middle() const { return {0, 0, options_.tracker_distance_mm}; }

  void add_sensor(const std::string& name, SensorKind kind, Mount mount, const ImageSize& size,
                  std::vector<double> parameters, const Pose& pose) {
    made_.truth.rig.sensors.push_back(
        {name, kind, *Lens::create("LENSMODEL_OPENCV5", size, std::move(parameters)), pose, mount});
  }

  std::size_t cameras() const { return options_.second_pair ? 2 : 1; }
  std::size_t first_tracker() const { return cameras() * (options_.projector ? 2 : 1); }

  // Moved about the middle of the volume, upright.
  void add_tracker(int t, double moved_rad) {
    const Eigen::Vector3d position(t % 2 * options_.tracker_baseline_mm, -t / 2 * 0.7 * options_.tracker_baseline_mm,
                                   0);
    const Eigen::Quaterniond turn = rotation_from_vector({0, moved_rad, 0});
    const Pose world_from_tracker = world_from_onlooker(middle() + turn * (position - middle()), middle(), 0);
    const double f = options_.tracker_focal_px;
    add_sensor("track" + std::to_string(t) + (moved_rad > 0 ? "b" : ""), SensorKind::camera, Mount::world,
               options_.tracker_size,
               {f + 3 * t, f - 2 * t, options_.tracker_size.width_px / 2.0 - 7,
                options_.tracker_size.height_px / 2.0 + 5, -0.09, 0.07, 2e-4, -3e-4, 0},
               t == 0 && moved_rad == 0 ? Pose{} : world_from_tracker.inverse());
  }

  void add_reference(const std::string& name, const Eigen::Vector3d& position_mm) {
    made_.truth.rig.leds.push_back({name, position_mm, Mount::world});
  }

  // References about the middle of the volume; a bar at its places, turned.
  void add_room() {
    for (int l = 0; l < options_.room_leds; ++l) {
      const double x = uniform(400), y = uniform(300), z = uniform(300);
      add_reference("room" + std::to_string(l), middle() + Eigen::Vector3d(x, y, z));
    }
    for (int p = 0; options_.bar_mm > 0 && p < options_.bar_places; ++p) {
      const double x = uniform(60), y = uniform(60), z = uniform(200);
      const Eigen::Vector3d half = 0.5 * options_.bar_mm * (turned(25 * kDegree).rotation * Eigen::Vector3d::UnitX());
      const Eigen::Vector3d centre = middle() + Eigen::Vector3d(x, y, z);
      add_reference("bar" + std::to_string(p) + "a", centre - half);
      add_reference("bar" + std::to_string(p) + "b", centre + half);
    }
  }

  // Whether a tracker stands where it is used while the probe is at the station.
  bool watches(std::size_t sensor, std::size_t station) const {
    if (made_.truth.rig.sensors[sensor].mount != Mount::world) return false;
    const auto half = static_cast<std::size_t>(options_.stations + options_.wand_stations) / 2;
    const bool second = made_.truth.rig.sensors[sensor].lens_of.has_value();
    return !options_.moved_trackers || second == (station >= half);
  }

  void make_rig() {
    add_sensor("cam0", SensorKind::camera, Mount::probe, {1024, 768},
               {1402, 1401, 518, 378, -0.11, 0.09, 6e-4, -4e-4, -0.02}, {});
    if (options_.second_pair) {
      const Pose probe_from_camera = world_from_onlooker({-180, 40, 20}, {0, 0, kProbeDistance_mm}, 0.05);
      add_sensor("cam1", SensorKind::camera, Mount::probe, {1024, 768},
                 {1300, 1302, 505, 390, -0.1, 0.08, -4e-4, 3e-4, 0.01}, probe_from_camera.inverse());
    }
    if (options_.projector) {
      const Pose probe_from_projector = world_from_onlooker({250, 6, -12}, {0, 0, kProbeDistance_mm}, -0.03);
      add_sensor("proj0", SensorKind::projector, Mount::probe, {1024, 768},
                 {1497, 1498, 509, 450, -0.046, 0.031, -3e-4, 5e-4, 0}, probe_from_projector.inverse());
    }
    if (options_.projector && options_.second_pair) {
      const Pose probe_from_projector = world_from_onlooker({30, -220, 8}, {0, 0, kProbeDistance_mm}, 0.02);
      add_sensor("proj1", SensorKind::projector, Mount::probe, {1024, 768},
                 {1450, 1452, 515, 430, -0.05, 0.03, 2e-4, 1e-4, 0}, probe_from_projector.inverse());
    }
    for (int t = 0; t < options_.trackers; ++t) add_tracker(t, 0);
    for (int t = 0; options_.moved_trackers && t < options_.trackers; ++t) {
      add_tracker(t, 35 * kDegree);
      made_.truth.rig.sensors.back().lens_of = first_tracker() + static_cast<std::size_t>(t);
    }
    for (int l = 0; l < options_.leds; ++l) {
      const double angle = 2 * std::numbers::pi * l / options_.leds + 0.3;
      made_.truth.rig.leds.push_back(
          {"led" + std::to_string(l),
           {0.5 * options_.led_spread_mm * std::cos(angle), 0.5 * options_.led_spread_mm * std::sin(angle),
            -90 + 0.25 * options_.led_spread_mm * (l % 2 == 0 ? 1 : -1)}});
    }
  }

  Pose turned(double reach_rad) {
    const double x = uniform(reach_rad), y = uniform(reach_rad), z = uniform(reach_rad);
    return {rotation_from_vector({x, y, z}), Eigen::Vector3d::Zero()};
  }

  void add_placement(const Eigen::Vector3d& centre, std::size_t board, double tilt_rad) {
    Pose pose = turned(tilt_rad);
    const Board& points = made_.truth.boards[board];
    pose.translation = centre - pose.rotation * (0.5 * (points.point(0) + points.point(points.point_count() - 1)));
    made_.truth.world_from_board.push_back(pose);
    made_.truth.board_of.push_back(board);
  }

  void place_board() {
    const double x = uniform(300), y = uniform(150);
    add_placement(middle() + Eigen::Vector3d(x, y, 500), 0, 12 * kDegree);
  }

  // The probe looks at the board from a new direction.
  void visit(std::size_t placement, bool scan) {
    const Board& board = made_.truth.boards[0];
    const Eigen::Vector3d centre =
        made_.truth.world_from_board[placement] * (0.5 * (board.point(0) + board.point(board.point_count() - 1)));
    const double turn = options_.turn_deg * kDegree;
    const Eigen::Quaterniond tilt =
        options_.one_axis ? rotation_from_vector({0, uniform(turn), 0}) : turned(turn).rotation;
    const Eigen::Vector3d direction = tilt * Eigen::Vector3d::UnitZ();
    const double distance = kProbeDistance_mm * (1 + uniform(0.12));
    const double up = uniform(40), right = uniform(40);
    const Eigen::Vector3d aside(right, up, 0);
    const double roll_rad = uniform(1.5 * turn);
    const bool looks_at_it = turn > 0 && !options_.one_axis;
    const Eigen::Vector3d position = centre - distance * direction + (looks_at_it ? Eigen::Vector3d(0, 0, 0) : aside);
    made_.truth.world_from_probe.push_back(looks_at_it ? world_from_onlooker(position, centre + aside, roll_rad)
                                                       : world_from_onlooker(position, position + direction, 0));
    const std::size_t station = made_.truth.world_from_probe.size() - 1;
    for (std::size_t s = 0; s < made_.truth.rig.sensors.size(); ++s) {
      if (watches(s, station)) see_leds(s, station);
    }
    if (!scan) return;
    for (std::size_t camera = 0; camera < cameras(); ++camera) {
      see_board(camera, placement, station);
      const std::size_t projector = cameras() + (options_.second_pair ? station % 2 : 0);
      if (options_.projector) see_stripes(camera, projector, placement, station);
    }
  }

  void show_to_trackers() {
    const double x = uniform(450), y = uniform(300), z = uniform(400);
    add_placement(middle() + Eigen::Vector3d(x, y, z), 1, 30 * kDegree);
    for (std::size_t s = 0; s < made_.truth.rig.sensors.size(); ++s) {
      const Sensor& sensor = made_.truth.rig.sensors[s];
      if (sensor.mount != Mount::world || sensor.lens_of) continue;
      see_board(s, made_.truth.world_from_board.size() - 1, std::nullopt);
    }
  }

  static bool inside(const Lens& lens, const Eigen::Vector2d& pixel) {
    return pixel.x() >= 0 && pixel.y() >= 0 && pixel.x() <= lens.size().width_px - 1 &&
           pixel.y() <= lens.size().height_px - 1;
  }

  // The probe's at a station, or the room's.
  void see_leds(std::size_t sensor, std::optional<std::size_t> station) {
    const Lens& lens = made_.truth.rig.sensors[sensor].lens;
    const Pose sensor_from_carrier = sensor_from_leds(made_.truth, sensor, station).pose;
    LedView view{sensor, {}, {}, station};
    for (std::size_t l = 0; l < made_.truth.rig.leds.size(); ++l) {
      const Led& led = made_.truth.rig.leds[l];
      if ((led.mount == Mount::probe) != station.has_value()) continue;
      const auto pixel = lens.project(sensor_from_carrier * led.position_mm);
      if (!pixel || !inside(lens, *pixel)) continue;
      view.leds.push_back(l);
      view.pixels.push_back(*pixel + noise2(options_.led_sigma_px));
    }
    if (!view.leds.empty()) made_.observations.leds.push_back(view);
  }

  void see_board(std::size_t sensor, std::size_t placement, std::optional<std::size_t> station) {
    const Lens& lens = made_.truth.rig.sensors[sensor].lens;
    const Board& board = made_.truth.board_at(placement);
    const Pose sensor_from_board = sensor_from_board_pose(made_.truth, sensor, placement, station);
    CornerView view{sensor, placement, {}, {}, station};
    for (int i = 0; i < board.point_count(); ++i) {
      const auto pixel = lens.project(sensor_from_board * board.point(i));
      if (!pixel || !inside(lens, *pixel)) continue;
      view.corners.push_back(i);
      view.pixels.push_back(*pixel + noise2(options_.corner_sigma_px));
    }
    if (view.corners.size() >= 12) made_.observations.corners.push_back(view);
  }

  void see_stripes(std::size_t camera_index, std::size_t projector_index, std::size_t placement, std::size_t station) {
    const Lens& camera = made_.truth.rig.sensors[camera_index].lens;
    const Lens& projector = made_.truth.rig.sensors[projector_index].lens;
    const Board& board = made_.truth.board_at(placement);
    const Pose camera_from_board = sensor_from_board_pose(made_.truth, camera_index, placement, station);
    const Pose projector_from_board = sensor_from_board_pose(made_.truth, projector_index, placement, station);
    StripeView columns{camera_index, projector_index, placement, Eigen::Vector2d::UnitX(), {}, {}, station};
    StripeView rows{camera_index, projector_index, placement, Eigen::Vector2d::UnitY(), {}, {}, station};
    for (int i = 0; i < board.point_count(); ++i) {
      const Eigen::Vector3d point =
          board.on_surface(board.nominal_mm()[static_cast<std::size_t>(i)] + Eigen::Vector2d(9, 11));
      const auto pixel = camera.project(camera_from_board * point);
      const auto coordinate = projector.project(projector_from_board * point);
      if (!pixel || !coordinate || !inside(camera, *pixel) || !inside(projector, *coordinate)) continue;
      for (StripeView* view : {&columns, &rows}) {
        view->camera_pixels.push_back(*pixel);
        view->coordinates_px.push_back(view->normal.dot(*coordinate) + noise(options_.stripe_sigma_px));
      }
    }
    made_.observations.stripes.push_back(columns);
    made_.observations.stripes.push_back(rows);
  }

  MadeSystemOptions options_;
  std::mt19937_64 random_;
  MadeSystem made_;
};

}  // namespace

MadeSystem make_system(const MadeSystemOptions& options) { return Maker(options).make(); }

CalibrationState disturbed_system(const CalibrationState& truth, unsigned seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  CalibrationState state = truth;
  const auto disturb = [&](Pose& pose) {
    Vector6d step;
    for (int i = 0; i < 6; ++i) step[i] = uniform(random) * (i < 3 ? 0.01 : 5);
    pose = retract(pose, step);
  };
  bool first_in_world = true;
  for (std::size_t s = 0; s < state.rig.sensors.size(); ++s) {
    Sensor& sensor = state.rig.sensors[s];
    std::vector<double> parameters = sensor.lens.parameters();
    for (std::size_t i = 0; i < 4; ++i) parameters[i] += 5 * uniform(random);
    sensor.lens = sensor.lens_of ? state.rig.sensors[*sensor.lens_of].lens : sensor.lens.with_parameters(parameters);
    const bool reference = sensor.mount == Mount::world ? first_in_world : s == 0;
    if (sensor.mount == Mount::world) first_in_world = false;
    if (!reference) disturb(sensor.sensor_from_mount);
  }
  for (Led& led : state.rig.leds) {
    const double z = uniform(random), y = uniform(random), x = uniform(random);
    led.position_mm += 3 * Eigen::Vector3d(x, y, z);
  }
  for (Pose& pose : state.world_from_board) disturb(pose);
  for (Pose& pose : state.world_from_probe) disturb(pose);
  return state;
}

}  // namespace crumple
