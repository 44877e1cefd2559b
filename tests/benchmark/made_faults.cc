#include "tests/benchmark/made_faults.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <regex>
#include <set>

#include <fmt/format.h>

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
constexpr int kBits = 10;  // of the Gray code of columns, and of rows

// A coordinate as it is decoded where each pattern from the bit `first_late` on (0: the coarsest) shows the one before
// it: bits of the Gray code that are shifted by one. What is left of a stripe counts as further, finer bits of it.
// `shown_before`: the bit that the pattern before the coarsest shows.
double read_late(double coordinate_px, int first_late, bool shown_before) {
  constexpr int kFraction = 8, kAll = kBits + kFraction;
  const unsigned code = gray_from_binary(static_cast<unsigned>(std::lround((coordinate_px + 0.5) * (1 << kFraction))));
  const unsigned late = (1U << (kAll - first_late)) - 1;
  const unsigned first = first_late == 0 && shown_before ? 1U << (kAll - 1) : 0;
  return static_cast<double>(binary_from_gray((code & ~late) | (code >> 1 & late) | first)) / (1 << kFraction) - 0.5;
}

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
    if (fault == Fault::wrong_pitch_beside_bar || (fault == Fault::none && seed % 2 == 0)) draw_bar();
  }

  FaultyCampaign make() {
    if (fault_ == Fault::too_few_tilts) options_.placements = 1;
    made_ = make_system(options_);
    made_fault();
    add_noise(noise_, random_, made_.observations);
    if (fault_ == Fault::bad_view) spoil_a_view();
    campaign_.data = data_with_bar(made_);
    if (fault_ == Fault::swapped_axes) {
      campaign_.data = with_swapped_axes(std::move(campaign_.data));
      campaign_.named_by = {said_of(fault_)};
    }
    if (fault_ == Fault::wrong_pitch_one_board) campaign_.data.boards.pop_back();
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

  // Its certificate errs as it says.
  void draw_bar() {
    options_.bar_mm = real(600, 1100);
    options_.bar_places = whole(1, 3);
    bar_.name = "bar";
    bar_.certificate.pitch_sigma_mm = real(0.005, 0.03);
    bar_.length_mm = std::normal_distribution<double>(options_.bar_mm, bar_.certificate.pitch_sigma_mm)(random_);
  }

  // The bar's ends are the last of the LEDs.
  CalibrationData data_with_bar(const MadeSystem& made) const {
    CalibrationData data = data_of(made);
    if (!(options_.bar_mm > 0)) return data;
    data.bars = {bar_};
    const std::size_t ends = 2 * static_cast<std::size_t>(options_.bar_places);
    for (std::size_t l = data.leds.size() - ends; l < data.leds.size(); l += 2) {
      data.bars[0].places.emplace_back(l, l + 1);
    }
    return data;
  }

  void made_fault() {
    switch (fault_) {
      case Fault::board_warp:
        return bend_the_board();
      case Fault::wrong_pitch:
        campaign_.named_by = {said_of(fault_, "board 'board'")};
        return stretch_the_board(sign() * real(0.0015, 0.003));
      case Fault::wrong_pitch_one_board:
        show_one_board();
        return stretch_the_board(sign() * real(0.0015, 0.003));
      case Fault::wrong_pitch_beside_bar:
        campaign_.named_by = {said_of(fault_, "board 'board'")};
        return stretch_the_board(sign() * std::exp(real(std::log(0.003), std::log(0.04))));
      case Fault::polarity:
        return shift_edges();
      case Fault::none:
      case Fault::moved_led:
        return capture_later();
      case Fault::nudged_tracker:
        return nudge_a_tracker();
      case Fault::lost_sync:
        return lose_step();
      case Fault::too_few_tilts:
        campaign_.named_by = {said_of(fault_)};
        return;
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
    campaign_.named_by = {said_of(fault_, "board 'board'")};
  }

  void stretch_the_board(double share) {
    campaign_.stretch = share;
    made_.truth.boards[0].scale *= 1 + campaign_.stretch;
    made_.observations = predicted_observations(made_.truth, made_.observations);
  }

  // The trackers are shown the probe's board, as many of its corners as the larger one has.
  void show_one_board() {
    made_.truth.boards.pop_back();
    std::fill(made_.truth.board_of.begin(), made_.truth.board_of.end(), 0);
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
    campaign_.named_by = {said_of(fault_)};
  }

  // With the same rig, or with one of its LEDs moved.
  void capture_later() {
    MadeSystemOptions few = options_;
    few.stations = whole(6, 10);
    few.tracker_placements = 2;
    few.seed = options_.seed + 100000;
    MadeSystem later = make_system(few);
    if (fault_ == Fault::moved_led) {
      Led& led = later.truth.rig.leds[one_of(later.truth.rig.leds.size())];
      campaign_.moved_mm = 0.3;
      led.position_mm += campaign_.moved_mm * direction();
      later.observations = predicted_observations(later.truth, later.observations);
      campaign_.moved_led = "LED " + led.name;
      campaign_.named_by = {said_of(fault_, campaign_.moved_led)};
    }
    add_noise(noise_, random_, later.observations);
    campaign_.later = data_with_bar(later);
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
    campaign_.named_by = {said_of(fault_, made_.truth.rig.sensors[tracker].name)};
  }

  // Columns come first, then rows, whose coarsest pattern then shows the finest of the columns. What names no row of
  // the panel is no reading.
  void lose_step() {
    const int count = whole(1, 3);
    std::set<std::size_t> lost;
    for (int i = 0; i < count; ++i) lost.insert(one_of(static_cast<std::size_t>(options_.stations)));
    for (const std::size_t station : lost) {
      const int first_late = whole(0, 2 * kBits - 1);
      const bool white_before = whole(0, 1) == 1;
      std::vector<StripeView>& stripes = made_.observations.stripes;
      for (std::size_t v = 0; v + 1 < stripes.size(); v += 2) {
        if (stripes[v].station == station) read_late_from(first_late, white_before, stripes[v], stripes[v + 1]);
      }
      campaign_.named_by.push_back(said_of(fault_, fmt::format("station_{}( \\(.*\\))?", station)));
    }
  }

  void read_late_from(int first_late, bool white_before, StripeView& columns, StripeView& rows) const {
    const int height_px = made_.truth.rig.sensors[rows.projector].lens.size().height_px;
    const StripeView exact_columns = columns, exact_rows = rows;
    for (StripeView* view : {&columns, &rows}) {
      view->camera_pixels.clear();
      view->coordinates_px.clear();
    }
    for (std::size_t i = 0; i < exact_columns.coordinates_px.size(); ++i) {
      const double column_px = exact_columns.coordinates_px[i];
      const bool finest = (gray_from_binary(static_cast<unsigned>(column_px + 0.5)) & 1U) != 0;
      const double row_px = read_late(exact_rows.coordinates_px[i], std::max(0, first_late - kBits), finest);
      if (row_px > height_px - 0.5) continue;
      columns.camera_pixels.push_back(exact_columns.camera_pixels[i]);
      rows.camera_pixels.push_back(exact_rows.camera_pixels[i]);
      columns.coordinates_px.push_back(first_late < kBits ? read_late(column_px, first_late, white_before) : column_px);
      rows.coordinates_px.push_back(row_px);
    }
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
    const std::string name =
        view.station ? fmt::format("station_{}( \\(placement placement_{}\\))?", *view.station, view.placement)
                     : fmt::format("placement_{}", view.placement);
    campaign_.named_by = {said_of(fault_, name)};
  }

  Fault fault_;
  std::mt19937_64 random_;
  MadeSystemOptions options_;
  NoiseLevels noise_;
  ScaleBar bar_;  // without its places
  MadeSystem made_;
  FaultyCampaign campaign_;
};

}  // namespace

const std::vector<Fault>& all_faults() {
  static const std::vector<Fault> all{Fault::board_warp,
                                      Fault::wrong_pitch,
                                      Fault::wrong_pitch_one_board,
                                      Fault::wrong_pitch_beside_bar,
                                      Fault::polarity,
                                      Fault::swapped_axes,
                                      Fault::bad_view,
                                      Fault::moved_led,
                                      Fault::nudged_tracker,
                                      Fault::lost_sync,
                                      Fault::too_few_tilts};
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
    case Fault::wrong_pitch_one_board:
      return "wrong pitch, one board";
    case Fault::wrong_pitch_beside_bar:
      return "wrong pitch beside a scale bar";
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

std::string said_of(Fault fault, const std::string& part) {
  // Of parts that cannot be told apart one is named, and the others are after it.
  const std::string or_it_is = ".*; or (it is )?" + part + "(;|$)";
  switch (fault) {
    case Fault::none:
      return "";
    case Fault::board_warp:
      return part + " is bent by| is bent by" + or_it_is;
    case Fault::wrong_pitch:
    case Fault::wrong_pitch_one_board:
    case Fault::wrong_pitch_beside_bar:
      return "the pitch of " + part + " is off by|the pitch of .* is off by" + or_it_is;
    case Fault::polarity:
      return "rising edges of stripes are off by";
    case Fault::swapped_axes:
      return "columns and rows are exchanged";
    case Fault::bad_view:
      return "station " + part + " is bad in";
    case Fault::moved_led:
      return part + " changed by| changed by" + or_it_is;
    case Fault::nudged_tracker:
      return part + " (was moved by|stood elsewhere)| was moved by" + or_it_is;
    case Fault::lost_sync:
      return "station " + part + " is bad in .* out of step";
    case Fault::too_few_tilts:
      // Not "put or tilt the board there", which is where no view covers a part of an image.
      return "the board's tilts|two different tilts|: tilt the board";
  }
  return "";
}

bool names_a_fault(const std::string& sentence) {
  return std::any_of(all_faults().begin(), all_faults().end(),
                     [&](Fault fault) { return std::regex_search(sentence, std::regex(said_of(fault))); });
}

bool names_one_of_several(const std::string& sentence) {
  return std::regex_search(sentence, std::regex("^either |; or "));
}

FaultyCampaign make_faulty(Fault fault, unsigned seed) { return Campaign(fault, seed).make(); }

}  // namespace crumple
