#include "tests/benchmark/made_faults.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "calib/swapped_axes.h"
#include "recon/patterns.h"
#include "solvers/decompositions.h"
#include "solvers/residuals.h"
#include "solvers/sensor_chain.h"
#include "tests/calib/made_system_data.h"
#include "tests/solvers/noisy_observations.h"

namespace crumple {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

class Campaign {
 public:
  Campaign(Fault fault, unsigned seed) : fault_(fault), random_(seed) {
    options_.trackers = whole(2, 4);
    options_.leds = whole(5, 8);
    options_.led_spread_mm = real(200, 400);
    options_.stations = whole(10, 16);
    options_.placements = whole(1, 3);
    options_.tracker_placements = whole(6, 10);
    options_.turn_deg = fault == Fault::too_few_tilts ? real(2, 4) : real(18, 35);
    noise_ = {real(0.05, 0.2), real(0.05, 0.2), 0, real(0.02, 0.1)};
    options_.led_sigma_px = options_.corner_sigma_px = options_.stripe_sigma_px = 0;
    options_.seed = seed;
  }

  FaultyCampaign make() {
    if (fault_ == Fault::too_few_tilts) options_.placements = 1;
    made_ = make_system(options_);
    made_fault();
    add_noise(noise_, random_, made_.observations);
    if (fault_ == Fault::bad_view) spoil_a_view();
    campaign_.data = data_of(made_);
    if (fault_ == Fault::swapped_axes) {
      campaign_.data = with_swapped_axes(std::move(campaign_.data));
      campaign_.named_by = {"columns and rows are exchanged"};
    }
    return std::move(campaign_);
  }

 private:
  int whole(int low, int high) { return std::uniform_int_distribution<int>(low, high)(random_); }
  double real(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }
  double sign() { return whole(0, 1) == 1 ? 1 : -1; }
  Eigen::Vector3d direction() {
    std::normal_distribution<double> normal;
    return Eigen::Vector3d::NullaryExpr([&](Eigen::Index) { return normal(random_); }).normalized();
  }
  std::size_t one_of(std::size_t count) { return static_cast<std::size_t>(whole(0, static_cast<int>(count) - 1)); }

  void made_fault() {
    switch (fault_) {
      case Fault::board_warp:
        return bend_the_board();
      case Fault::wrong_pitch:
        return stretch_the_board();
      case Fault::polarity:
        return shift_edges();
      case Fault::moved_led:
        return move_an_led();
      case Fault::nudged_tracker:
        return nudge_a_tracker();
      case Fault::lost_sync:
        return lose_step();
      case Fault::too_few_tilts:
        campaign_.named_by = {"the board's tilts", "tilt the board"};
        return;
      case Fault::none:
      case Fault::swapped_axes:
      case Fault::bad_view:
        return;
    }
  }

  // Every observation of the probe's board moves by what a point's height moves it by, to first order: 0.2 mm of 800.
  void bend_the_board() {
    const auto terms = [](double u, double v) {
      return (Eigen::VectorXd(7) << u * u, u * v, v * v, u * u * u, u * u * v, u * v * v, v * v * v).finished();
    };
    // A bow, or any shape.
    const int drawn = whole(0, 1) == 1 ? 7 : 1;
    Eigen::VectorXd shape = Eigen::VectorXd::Zero(7);
    for (int i = 0; i < drawn; ++i) shape[i] = real(-1, 1);
    Eigen::MatrixXd plane(121, 3);
    Eigen::VectorXd heights(121);
    for (int i = 0; i < 121; ++i) {
      const double u = i % 11 / 5.0 - 1, v = i / 11 / 5.0 - 1;
      plane.row(i) << 1, u, v;
      heights[i] = shape.dot(terms(u, v));
    }
    heights -= plane * least_squares(plane, heights);
    shape *= 0.2 / (heights.maxCoeff() - heights.minCoeff());
    const Observations exact = made_.observations;
    const auto views = make_views(exact, made_.truth.board_of);
    const auto displaced = [&](const View& view, const std::vector<Eigen::Vector3d>& points, const auto& add) {
      ViewEvaluation evaluation;
      view.evaluate(made_.truth, true, evaluation);
      const BlockId placement{BlockId::Kind::placement, *view.placement()};
      const auto at = std::find(view.blocks().begin(), view.blocks().end(), placement) - view.blocks().begin();
      const Eigen::MatrixXd jacobian = block_jacobian(view, evaluation, made_.truth, static_cast<std::size_t>(at));
      const Eigen::Vector3d normal =
          made_.truth.world_from_board[*view.placement()].rotation * Eigen::Vector3d::UnitZ();
      for (std::size_t i = 0; i < points.size(); ++i) {
        const double height = shape.dot(terms(points[i].x() / 150 - 1, points[i].y() / 105 - 1));
        add(i,
            Eigen::VectorXd(
                jacobian.middleRows(static_cast<Eigen::Index>(i) * view.dimension(), view.dimension()).rightCols<3>() *
                normal * height));
      }
    };
    const std::size_t corner_count = exact.corners.size();
    for (std::size_t v = 0; v < corner_count; ++v) {
      CornerView& view = made_.observations.corners[v];
      if (made_.truth.board_of[view.placement] != 0) continue;
      std::vector<Eigen::Vector3d> points;
      for (const int corner : view.corners) points.push_back(made_.truth.boards[0].point(corner));
      displaced(*views[v], points, [&](std::size_t i, const Eigen::VectorXd& by) { view.pixels[i] += by; });
    }
    for (std::size_t v = 0; v < exact.stripes.size(); ++v) {
      StripeView& view = made_.observations.stripes[v];
      const Pose camera_from_board = sensor_from_board_pose(made_.truth, view.camera, view.placement, view.station);
      const Eigen::Vector3d normal = camera_from_board.rotation * Eigen::Vector3d::UnitZ();
      std::vector<Eigen::Vector3d> points;
      for (const Eigen::Vector2d& pixel : view.camera_pixels) {
        const Eigen::Vector3d ray = *made_.truth.rig.sensors[view.camera].lens.ray(pixel);
        points.emplace_back(camera_from_board.inverse() *
                            Eigen::Vector3d(ray * (normal.dot(camera_from_board.translation) / normal.dot(ray))));
      }
      displaced(*views[corner_count + v], points,
                [&](std::size_t i, const Eigen::VectorXd& by) { view.coordinates_px[i] += by[0]; });
    }
    campaign_.named_by = {"board 'board' is bent"};
  }

  void stretch_the_board() {
    campaign_.stretch = sign() * real(0.0015, 0.003);
    made_.truth.boards[0].scale *= 1 + campaign_.stretch;
    made_.observations = predicted_observations(made_.truth, made_.observations);
    campaign_.named_by = {"the pitch of board"};
  }

  void shift_edges() {
    const double shift_px = sign() * real(0.15, 0.4);
    for (StripeView& view : made_.observations.stripes) {
      for (double& coordinate_px : view.coordinates_px) {
        const auto boundary = static_cast<unsigned>(std::max(1.0, std::round(coordinate_px + 0.5)));
        const bool rises = gray_from_binary(boundary) > gray_from_binary(boundary - 1);
        coordinate_px += rises ? shift_px : -shift_px;
      }
    }
    campaign_.named_by = {"rising edges of stripes"};
  }

  void move_an_led() {
    MadeSystemOptions few = options_;
    few.stations = whole(6, 10);
    few.tracker_placements = 2;
    few.seed = options_.seed + 100000;
    MadeSystem later = make_system(few);
    Led& led = later.truth.rig.leds[one_of(later.truth.rig.leds.size())];
    campaign_.moved_mm = 0.3;
    led.position_mm += campaign_.moved_mm * direction();
    later.observations = predicted_observations(later.truth, later.observations);
    add_noise(noise_, random_, later.observations);
    campaign_.later = data_of(later);
    campaign_.named_by = {"LED " + led.name};
  }

  void nudge_a_tracker() {
    const std::size_t first = 2;
    const std::size_t tracker = first + one_of(static_cast<std::size_t>(options_.trackers));
    const auto since = static_cast<std::size_t>(whole(4, options_.stations - 4));
    CalibrationState nudged = made_.truth;
    Vector6d step;
    step << real(0.01, 0.04) * kDegree * direction(), real(0.3, 1) * direction();
    Pose& mount = nudged.rig.sensors[tracker].sensor_from_mount;
    mount = retract(mount, step);
    const Observations after = predicted_observations(nudged, made_.observations);
    for (std::size_t v = 0; v < after.leds.size(); ++v) {
      const LedView& view = after.leds[v];
      if (view.sensor == tracker && view.station && *view.station >= since) made_.observations.leds[v] = view;
    }
    // Of two trackers either may have been.
    const std::string name = made_.truth.rig.sensors[tracker].name;
    campaign_.named_by = {name + " was moved", name + " stood elsewhere", "or it is " + name};
  }

  void lose_step() {
    const int count = whole(1, 3);
    for (int i = 0; i < count; ++i) {
      const std::size_t station = one_of(static_cast<std::size_t>(options_.stations));
      for (StripeView& view : made_.observations.stripes) {
        if (view.station != station) continue;
        for (double& coordinate_px : view.coordinates_px) coordinate_px *= 0.5;
      }
    }
    campaign_.named_by = {"out of step"};
  }

  void spoil_a_view() {
    CornerView& view = made_.observations.corners[one_of(made_.observations.corners.size())];
    if (whole(0, 1) == 1) {
      std::normal_distribution<double> noise(0, 8 * noise_.corner_px);
      for (Eigen::Vector2d& pixel : view.pixels) {
        const double dx = noise(random_);
        pixel += Eigen::Vector2d(dx, noise(random_));
      }
    } else {
      std::vector<int> corners;
      std::vector<Eigen::Vector2d> pixels;
      const int columns = made_.truth.board_of[view.placement] == 0 ? 11 : 10;
      for (std::size_t i = 0; i < view.corners.size(); ++i) {
        if (view.corners[i] % columns + 1 == columns) continue;
        corners.push_back(view.corners[i] + 1);
        pixels.push_back(view.pixels[i]);
      }
      view.corners = corners;
      view.pixels = pixels;
    }
    const std::string place = "placement_" + std::to_string(view.placement);
    const std::string station = view.station ? "station_" + std::to_string(*view.station) : place;
    campaign_.named_by = {"station " + station + " (placement " + place + ") is bad", "station " + station + " is bad"};
  }

  Fault fault_;
  std::mt19937_64 random_;
  MadeSystemOptions options_;
  NoiseLevels noise_;
  MadeSystem made_;
  FaultyCampaign campaign_;
};

}  // namespace

const std::vector<Fault>& all_faults() {
  static const std::vector<Fault> all{Fault::board_warp,     Fault::wrong_pitch, Fault::polarity,
                                      Fault::swapped_axes,   Fault::bad_view,    Fault::moved_led,
                                      Fault::nudged_tracker, Fault::lost_sync,   Fault::too_few_tilts};
  return all;
}

const char* name_of(Fault fault) {
  switch (fault) {
    case Fault::none:
      return "none";
    case Fault::board_warp:
      return "board bent by 0.2 mm";
    case Fault::wrong_pitch:
      return "wrong pitch";
    case Fault::polarity:
      return "gamma without inverse patterns";
    case Fault::swapped_axes:
      return "swapped axes";
    case Fault::bad_view:
      return "one bad view";
    case Fault::moved_led:
      return "LED moved by 0.3 mm between captures";
    case Fault::nudged_tracker:
      return "tracker nudged";
    case Fault::lost_sync:
      return "lost sync";
    case Fault::too_few_tilts:
      return "too few tilts";
  }
  return "";
}

FaultyCampaign make_faulty(Fault fault, unsigned seed) { return Campaign(fault, seed).make(); }

}  // namespace crumple
