#include "tests/calib/made_car.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>
#include <random>

#include "solvers/sensor_chain.h"
#include "solvers/stripe_point.h"
#include "tracking/probe_pose.h"

namespace crumple {
namespace {

constexpr double kDeg = std::numbers::pi / 180;
constexpr double kProbeDepth_mm = 2700;  // of the probe, from the trackers
constexpr double kScanDistance_mm = 800;
constexpr double kCarDepth_mm = kProbeDepth_mm + kScanDistance_mm;
constexpr double kColumnPitch_mm = 390;
constexpr double kRowPitch_mm = 290;
constexpr double kPatchSteps = 8;  // px of the camera between patches
// A patch of 11 x 11 readings, of which neighbours share most of their error: taken as sixteen.
constexpr double kPatchReadings = 16;
constexpr int kBallStep_px = 2;  // so one reading stands for four

// The car side in the hall: x along the car, y down, z away from the trackers.
double height_mm(double x, double y) {
  return kCarDepth_mm + x * x / 16000 + y * y / 3600 + 8 * std::sin(x / 95) * std::cos(y / 80 + 0.4);
}

Eigen::Vector3d outward(double x, double y) {
  const double dx = x / 8000 + 8 / 95.0 * std::cos(x / 95) * std::cos(y / 80 + 0.4);
  const double dy = y / 1800 - 8 / 80.0 * std::sin(x / 95) * std::sin(y / 80 + 0.4);
  return Eigen::Vector3d(dx, dy, -1).normalized();
}

std::optional<Eigen::Vector3d> meet_car(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) {
  double depth = (kCarDepth_mm - origin.z()) / direction.z();
  for (int i = 0; i < 40; ++i) {
    const Eigen::Vector3d point = origin + depth * direction;
    const double step = (point.z() - height_mm(point.x(), point.y())) / direction.z();
    depth -= step;
    if (std::abs(step) < 1e-11) return origin + depth * direction;
  }
  return std::nullopt;
}

Pose hall_from_onlooker(const Eigen::Vector3d& position, const Eigen::Vector3d& target, double roll_rad) {
  const Eigen::Vector3d z = (target - position).normalized();
  const Eigen::Vector3d x = Eigen::Vector3d::UnitY().cross(z).normalized();
  Eigen::Matrix3d axes;
  axes << x, z.cross(x), z;
  return {Eigen::Quaterniond(axes) * Eigen::AngleAxisd(roll_rad, Eigen::Vector3d::UnitZ()), position};
}

bool inside(const Lens& lens, const Eigen::Vector2d& pixel, double margin_px = 0) {
  return pixel.x() >= margin_px && pixel.y() >= margin_px && pixel.x() <= lens.size().width_px - 1 - margin_px &&
         pixel.y() <= lens.size().height_px - 1 - margin_px;
}

Pose tracker_in_hall(int t) {
  const double x = t % 2 == 0 ? -1400 : 1400, y = t < 2 ? -400 : 600;
  return hall_from_onlooker({x, y, 0}, {0.31 * x, 0, kProbeDepth_mm - 50}, 0);
}

// The same rig for every seed.
Rig made_rig(const MadeCarOptions& options) {
  Rig rig;
  const auto add = [&](const std::string& name, SensorKind kind, Mount mount, const ImageSize& size,
                       std::vector<double> parameters, const Pose& pose) {
    rig.sensors.push_back({name, kind, *Lens::create("LENSMODEL_OPENCV5", size, std::move(parameters)), pose, mount});
  };
  add("cam0", SensorKind::camera, Mount::probe, {1024, 768}, {1402, 1401, 518, 378, -0.11, 0.09, 6e-4, -4e-4, -0.02},
      {});
  add("proj0", SensorKind::projector, Mount::probe, {1024, 768}, {1397, 1398, 509, 400, -0.046, 0.031, -3e-4, 5e-4, 0},
      hall_from_onlooker({250, 6, -12}, {0, 0, kScanDistance_mm}, -0.03).inverse());
  const Pose hall_from_world = tracker_in_hall(0);
  for (int t = 0; t < options.trackers; ++t) {
    const double f = options.tracker_focal_px;
    add("track" + std::to_string(t), SensorKind::camera, Mount::world, options.tracker_size,
        {f + 3 * t, f - 2 * t, options.tracker_size.width_px / 2.0 - 7, options.tracker_size.height_px / 2.0 + 5, -0.06,
         0.03, 2e-4, -3e-4, 0},
        t == 0 ? Pose{} : tracker_in_hall(t).inverse() * hall_from_world);
  }
  for (int l = 0; l < options.leds; ++l) {
    const double angle = 2 * std::numbers::pi * l / options.leds + 0.3;
    rig.leds.push_back({"led" + std::to_string(l),
                        {0.5 * options.led_spread_mm * std::cos(angle), 0.5 * options.led_spread_mm * std::sin(angle),
                         -90 + 0.25 * options.led_spread_mm * (l % 2 == 0 ? 1 : -1)}});
  }
  return rig;
}

// Noise, and what both makers see.
class Onlooker {
 public:
  Onlooker(const MadeCarOptions& options, unsigned seed)
      : options_(options), world_from_hall_(tracker_in_hall(0).inverse()), random_(seed) {
    truth_.rig = made_rig(options);
  }

 protected:
  double uniform(double reach) { return std::uniform_real_distribution<double>(-reach, reach)(random_); }
  double noise(double sigma) { return sigma > 0 ? std::normal_distribution<double>(0, sigma)(random_) : 0; }
  Eigen::Vector2d noise2(double sigma) {
    const double x = noise(sigma);
    return {x, noise(sigma)};
  }
  Eigen::Quaterniond turned(double reach_rad) {
    const double x = uniform(reach_rad), y = uniform(reach_rad), z = uniform(reach_rad);
    return rotation_from_vector({x, y, z});
  }

  std::size_t go_to(const Pose& hall_from_probe) {
    truth_.world_from_probe.push_back(world_from_hall_ * hall_from_probe);
    return truth_.world_from_probe.size() - 1;
  }

  std::vector<LedView> see_leds(std::optional<std::size_t> station, std::size_t first, std::size_t end) {
    std::vector<LedView> views;
    for (std::size_t s = 0; s < truth_.rig.sensors.size(); ++s) {
      const Sensor& sensor = truth_.rig.sensors[s];
      if (sensor.mount != Mount::world) continue;
      const Pose pose = sensor_from_leds(truth_, s, station).pose;
      LedView view{s, {}, {}, station};
      for (std::size_t l = first; l < end; ++l) {
        const auto pixel = sensor.lens.project(pose * truth_.rig.leds[l].position_mm);
        if (!pixel || !inside(sensor.lens, *pixel)) continue;
        view.leds.push_back(l);
        view.pixels.push_back(*pixel + noise2(options_.led_sigma_px));
      }
      if (!view.leds.empty()) views.push_back(std::move(view));
    }
    return views;
  }

  std::size_t probe_leds() const { return static_cast<std::size_t>(options_.leds); }

  MadeCarOptions options_;
  Pose world_from_hall_;
  std::mt19937_64 random_;
  CalibrationState truth_;
};

class CampaignMaker : public Onlooker {
 public:
  using Onlooker::Onlooker;

  MadeCampaign make() {
    for (const auto& [name, board] :
         {std::pair{"board", Board::grid(11, 8, 30)}, {"tracker_board", Board::grid(10, 7, 60)}}) {
      truth_.boards.push_back(board);
      truth_.boards.back().name = name;
    }
    std::vector<double> nominal;
    for (Board& board : truth_.boards) {
      nominal.push_back(board.scale);
      board.scale *= 1 + noise(options_.board_scale_sigma);
    }
    for (int p = 0; p < 3; ++p) {
      const double x = uniform(100), y = uniform(80);
      place_board({1100.0 * (p - 1) + x, y, kCarDepth_mm}, 0, 12 * kDeg);
    }
    for (int s = 0; s < options_.campaign_stations; ++s) visit(static_cast<std::size_t>(s % 3));
    for (int s = 0; s < options_.wand_stations; ++s) wave();
    for (int b = 0; b < options_.tracker_boards; ++b) show_board();
    for (int b = 0; b < options_.bar_poses; ++b) show_bar(b);
    observations_.placement_count = truth_.world_from_board.size();
    MadeCampaign made{truth_, truth_, std::move(observations_), std::move(bars_)};
    for (std::size_t b = 0; b < nominal.size(); ++b) made.start.boards[b].scale = nominal[b];
    return made;
  }

 private:
  void place_board(const Eigen::Vector3d& centre_in_hall, std::size_t board, double tilt_rad) {
    const Board& points = truth_.boards[board];
    Pose pose{turned(tilt_rad), {}};
    pose.translation =
        centre_in_hall - pose.rotation * (0.5 * (points.point(0) + points.point(points.point_count() - 1)));
    truth_.world_from_board.push_back(world_from_hall_ * pose);
    truth_.board_of.push_back(board);
  }

  void visit(std::size_t placement) {
    const Board& board = truth_.boards[0];
    const Eigen::Vector3d centre =
        world_from_hall_.inverse() *
        (truth_.world_from_board[placement] * (0.5 * (board.point(0) + board.point(board.point_count() - 1))));
    const Eigen::Vector3d direction = turned(30 * kDeg) * Eigen::Vector3d::UnitZ();
    const double distance = kScanDistance_mm * (1 + uniform(0.12));
    const double x = uniform(40), y = uniform(40), roll = uniform(45 * kDeg);
    const std::size_t station =
        go_to(hall_from_onlooker(centre - distance * direction, centre + Eigen::Vector3d(x, y, 0), roll));
    for (LedView& view : see_leds(station, 0, probe_leds())) observations_.leds.push_back(std::move(view));
    see_board(0, placement, station);
    see_stripes(placement, station);
  }

  void wave() {
    const double x = uniform(1900), y = uniform(450), z = uniform(450);
    const std::size_t station = go_to({turned(25 * kDeg), {x, y, kProbeDepth_mm + z}});
    for (LedView& view : see_leds(station, 0, probe_leds())) observations_.leds.push_back(std::move(view));
  }

  void show_board() {
    const double x = uniform(1500), y = uniform(450), z = uniform(500);
    place_board({x, y, kProbeDepth_mm + z}, 1, 30 * kDeg);
    for (std::size_t s = 0; s < truth_.rig.sensors.size(); ++s) {
      if (truth_.rig.sensors[s].mount == Mount::world) see_board(s, truth_.world_from_board.size() - 1, std::nullopt);
    }
  }

  void show_bar(int pose) {
    const double x = uniform(850), y = uniform(300), z = uniform(300);
    Eigen::Vector3d along = turned(15 * kDeg) * Eigen::Vector3d::UnitX();
    if (pose % 4 == 3) along = turned(15 * kDeg) * Eigen::Vector3d(0.8, 0.3, 0.5).normalized();
    const Eigen::Vector3d middle(x, y, kProbeDepth_mm + z);
    MadeBar bar{truth_.rig.leds.size(), truth_.rig.leds.size() + 1, options_.bar_mm};
    if (pose == 0) bar_length_mm_ = options_.bar_mm + noise(options_.bar_sigma_mm);
    for (const double side : {-0.5, 0.5}) {
      truth_.rig.leds.push_back({"bar" + std::to_string(pose) + (side < 0 ? "a" : "b"),
                                 world_from_hall_ * (middle + side * bar_length_mm_ * along), Mount::world});
    }
    for (LedView& view : see_leds(std::nullopt, bar.first_led, bar.second_led + 1)) {
      observations_.leds.push_back(std::move(view));
    }
    bars_.push_back(bar);
  }

  void see_board(std::size_t sensor, std::size_t placement, std::optional<std::size_t> station) {
    const Lens& lens = truth_.rig.sensors[sensor].lens;
    const Board& board = truth_.board_at(placement);
    const Pose sensor_from_board = sensor_from_board_pose(truth_, sensor, placement, station);
    CornerView view{sensor, placement, {}, {}, station};
    for (int i = 0; i < board.point_count(); ++i) {
      const auto pixel = lens.project(sensor_from_board * board.point(i));
      if (!pixel || !inside(lens, *pixel)) continue;
      view.corners.push_back(i);
      view.pixels.push_back(*pixel + noise2(options_.corner_sigma_px));
    }
    if (view.corners.size() >= 12) observations_.corners.push_back(view);
  }

  void see_stripes(std::size_t placement, std::size_t station) {
    const Sensor &camera = truth_.rig.sensors[0], &projector = truth_.rig.sensors[1];
    const Board& board = truth_.board_at(placement);
    const Pose camera_from_board = sensor_from_board_pose(truth_, 0, placement, station);
    const Pose projector_from_board = sensor_from_board_pose(truth_, 1, placement, station);
    StripeView columns{0, 1, placement, Eigen::Vector2d::UnitX(), {}, {}, station};
    StripeView rows{0, 1, placement, Eigen::Vector2d::UnitY(), {}, {}, station};
    for (const Eigen::Vector2d& nominal : board.nominal_mm()) {
      const Eigen::Vector3d point = board.on_surface(nominal + Eigen::Vector2d(9, 11));
      const auto pixel = camera.lens.project(camera_from_board * point);
      const auto lit = projector.lens.project(projector_from_board * point);
      if (!pixel || !lit || !inside(camera.lens, *pixel) || !inside(projector.lens, *lit)) continue;
      for (StripeView* view : {&columns, &rows}) {
        view->camera_pixels.push_back(*pixel);
        view->coordinates_px.push_back(view->normal.dot(*lit) + noise(options_.stripe_sigma_px));
      }
    }
    observations_.stripes.push_back(columns);
    observations_.stripes.push_back(rows);
  }

  Observations observations_;
  std::vector<MadeBar> bars_;
  double bar_length_mm_ = 0;
};

class CarMaker : public Onlooker {
 public:
  using Onlooker::Onlooker;

  MadeCar make() {
    for (int row = 0; row < options_.rows; ++row) {
      for (int column = 0; column < options_.columns; ++column) scan(row, column);
    }
    place_targets();
    for (int b = 0; b < options_.balls; ++b) place_ball(b);
    car_.truth = truth_;
    car_.ball_sigma_px = options_.stripe_sigma_px / kBallStep_px;
    return std::move(car_);
  }

 private:
  Eigen::Vector3d station_aim(int row, int column) const {
    const double x = (column - 0.5 * (options_.columns - 1)) * kColumnPitch_mm;
    const double y = (row - 0.5 * (options_.rows - 1)) * kRowPitch_mm;
    return {x, y, height_mm(x, y)};
  }

  void scan(int row, int column) {
    const Eigen::Vector3d aim = station_aim(row, column);
    const Eigen::Vector3d direction = turned(4 * kDeg) * Eigen::Vector3d::UnitZ();
    const double roll = uniform(4 * kDeg);
    const std::size_t s = go_to(hall_from_onlooker(aim - kScanDistance_mm * direction, aim, roll));
    ObservedStation station{.name = "station_" + std::to_string(s), .world_from_probe = truth_.world_from_probe[s]};
    const Eigen::Matrix2d covariance = options_.led_sigma_px * options_.led_sigma_px * Eigen::Matrix2d::Identity();
    for (LedView& view : see_leds(s, 0, probe_leds())) {
      const std::size_t count = view.leds.size();
      station.readings.push_back({std::move(view), std::vector<Eigen::Matrix2d>(count, covariance)});
    }
    station.surfaces.push_back(patches(truth_.world_from_probe[s]));
    car_.stations.push_back(std::move(station));
  }

  StationSurface patches(const Pose& world_from_probe) {
    StationSurface surface{0, 1, Eigen::Vector2d::UnitX(), {}};
    const Sensor &camera = truth_.rig.sensors[0], &projector = truth_.rig.sensors[1];
    const Pose hall_from_probe = world_from_hall_.inverse() * world_from_probe;
    const double sigma = options_.stripe_sigma_px / std::sqrt(kPatchReadings);
    for (double y = kPatchSteps; y < camera.lens.size().height_px - 4; y += kPatchSteps) {
      for (double x = kPatchSteps; x < camera.lens.size().width_px - 4; x += kPatchSteps) {
        const auto ray = probe_ray(camera, {x, y}, false);
        const auto met = meet_car(hall_from_probe * ray->origin_mm, hall_from_probe.rotation * ray->direction);
        if (!met) continue;
        const Eigen::Vector3d in_probe = hall_from_probe.inverse() * *met;
        const auto lit = projector.lens.project(projector.sensor_from_mount * in_probe);
        if (!lit || !inside(projector.lens, *lit)) continue;
        SurfacePatch patch{{x, y}, lit->x() + noise(sigma), {}, {}};
        const auto read =
            stripe_point(camera, projector, surface.stripe_normal, patch.camera_pixel, patch.coordinate_px, false);
        patch.position_mm = read->in_probe;
        // The slope of 11 x 11 depths 0.6 mm apart with 0.17 mm of noise.
        patch.normal = turned(0.01) * (hall_from_probe.rotation.conjugate() * outward(met->x(), met->y()));
        surface.patches.push_back(patch);
      }
    }
    return surface;
  }

  // About the middle of each overlap of neighbours in a row and in a column.
  void place_targets() {
    std::vector<Eigen::Vector3d> places;
    const auto spread = [&](const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
      const Eigen::Vector3d middle = 0.5 * (a + b);
      const bool in_row = std::abs(a.x() - b.x()) > 1;
      for (int t = 0; t < options_.targets_per_overlap; ++t) {
        const double along = (t / 2 - 1) * (in_row ? 130.0 : 180.0), across = (t % 2 - 0.5) * (in_row ? 90.0 : 60.0);
        const double x = middle.x() + (in_row ? across : along) + uniform(10);
        const double y = middle.y() + (in_row ? along : across) + uniform(10);
        places.emplace_back(x, y, height_mm(x, y) - 1);
      }
    };
    for (int row = 0; row < options_.rows; ++row) {
      for (int column = 0; column < options_.columns; ++column) {
        if (column + 1 < options_.columns) spread(station_aim(row, column), station_aim(row, column + 1));
        if (row + 1 < options_.rows) spread(station_aim(row, column), station_aim(row + 1, column));
      }
    }
    const Sensor& camera = truth_.rig.sensors[0];
    for (const Eigen::Vector3d& place : places) {
      const Eigen::Vector3d in_world = world_from_hall_ * place;
      std::vector<std::pair<std::size_t, Eigen::Vector2d>> sightings;
      for (std::size_t s = 0; s < car_.stations.size(); ++s) {
        const auto pixel = camera.lens.project(truth_.world_from_probe[s].inverse() * in_world);
        if (pixel && inside(camera.lens, *pixel, 12))
          sightings.emplace_back(s, *pixel + noise2(options_.target_sigma_px));
      }
      if (sightings.size() < 2) continue;
      const std::size_t target = car_.targets.size();
      car_.targets.push_back({"target" + std::to_string(target), in_world + Eigen::Vector3d(1, -1, 1)});
      for (const auto& [s, pixel] : sightings) {
        auto& readings = car_.stations[s].targets;
        if (readings.empty()) readings.push_back({0, {}, {}});
        readings[0].targets.push_back(target);
        readings[0].pixels.push_back(pixel);
      }
    }
  }

  void place_ball(int b) {
    const double reach = 0.5 * (options_.columns - 1) * kColumnPitch_mm + 190;
    const double x = reach * (2.0 * b / std::max(options_.balls - 1, 1) - 1), y = b % 2 == 0 ? -110 : 110;
    const Eigen::Vector3d centre(x, y, height_mm(x, y) - 45);
    car_.balls_mm.push_back(world_from_hall_ * centre);
    for (std::size_t s = 0; s < car_.stations.size(); ++s) see_ball(static_cast<std::size_t>(b), s);
  }

  // Pixels whose ray and light meet the ball less than 60 degrees from its normal; of balls that are seen whole.
  void see_ball(std::size_t ball, std::size_t station) {
    const Sensor &camera = truth_.rig.sensors[0], &projector = truth_.rig.sensors[1];
    const double radius = car_.ball_radius_mm;
    const Eigen::Vector3d centre = truth_.world_from_probe[station].inverse() * car_.balls_mm[ball];
    const auto middle = camera.lens.project(centre);
    const auto lit_middle = projector.lens.project(projector.sensor_from_mount * centre);
    const double reach_px = 1402 * radius / centre.z() + 3;
    if (!middle || !lit_middle || !inside(camera.lens, *middle, reach_px) ||
        !inside(projector.lens, *lit_middle, reach_px)) {
      return;
    }
    const Eigen::Vector3d light = projector.sensor_from_mount.inverse().translation;
    SeenBall seen{ball, station, {}, {}};
    for (double y = std::ceil(middle->y() - reach_px); y < middle->y() + reach_px; y += kBallStep_px) {
      for (double x = std::ceil(middle->x() - reach_px); x < middle->x() + reach_px; x += kBallStep_px) {
        const Eigen::Vector3d ray = camera.lens.ray({x, y})->normalized();
        const double along = ray.dot(centre), off = centre.squaredNorm() - along * along;
        if (off >= radius * radius) continue;
        const Eigen::Vector3d point = (along - std::sqrt(radius * radius - off)) * ray;
        const Eigen::Vector3d normal = (point - centre) / radius;
        if (-normal.dot(ray) < 0.5 || normal.dot((light - point).normalized()) < 0.5) continue;
        const auto lit = projector.lens.project(projector.sensor_from_mount * point);
        if (!lit) continue;
        seen.camera_pixels.emplace_back(x, y);
        seen.coordinates_px.push_back(lit->x() + noise(options_.stripe_sigma_px / kBallStep_px));
      }
    }
    if (seen.camera_pixels.size() > 100) car_.seen.push_back(std::move(seen));
  }

  MadeCar car_;
};

}  // namespace

MadeCampaign make_car_campaign(const MadeCarOptions& options, unsigned seed) {
  return CampaignMaker(options, seed).make();
}

MadeCar make_car(const MadeCarOptions& options, unsigned seed) { return CarMaker(options, seed).make(); }

Expected<std::vector<ObservedStation>> placed_by(const Rig& rig, const MadeCar& car, double led_sigma_px) {
  std::vector<ObservedStation> stations = car.stations;
  for (ObservedStation& station : stations) {
    for (LedReading& reading : station.readings) {
      for (Eigen::Matrix2d& covariance : reading.covariances_px2) {
        covariance = led_sigma_px * led_sigma_px * Eigen::Matrix2d::Identity();
      }
    }
    const auto pose = probe_pose(rig, station.readings);
    if (!pose) return fail(station.name + ": " + pose.error().message);
    station.world_from_probe = pose->world_from_probe;
    for (StationSurface& surface : station.surfaces) {
      for (SurfacePatch& patch : surface.patches) {
        const auto point = stripe_point(rig.sensors[surface.camera], rig.sensors[surface.projector],
                                        surface.stripe_normal, patch.camera_pixel, patch.coordinate_px, false);
        if (!point) return fail(station.name + ": a patch has no point");
        patch.position_mm = point->in_probe;
      }
    }
  }
  return stations;
}

}  // namespace crumple
