#include "calib/alternative_candidates.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>
#include <set>
#include <utility>

#include <fmt/format.h>

#include "calib/scale_uncertainty.h"
#include "recon/patterns.h"
#include "solvers/decompositions.h"
#include "solvers/sensor_chain.h"

namespace crumple {
namespace {

constexpr std::size_t kEitherSide = 3;  // stations or placements before and after
constexpr double kDegreePerRad = 180 / std::numbers::pi;

using Columns = ScoreTester::Columns;

class CandidateMaker {
 public:
  CandidateMaker(const CalibrationData& data, const Calibration& calibration, const ScoreTester& tester)
      : data_(data), calibration_(calibration), state_(calibration.bundle.state), tester_(tester) {
    for (const MeasuredScale& size : measured_scales(data, calibration.bundle, whole_covariance(calibration))) {
      if (size.determined) measured_.insert(size.board);
    }
  }

  std::vector<AlternativeCandidate> make() {
    for (std::size_t l = 0; l < state_.rig.leds.size(); ++l) add_moved_led(l);
    for (std::size_t s = 0; s < state_.rig.sensors.size(); ++s) {
      add_moved_sensor(s);
      add_lens_terms(s);
      if (state_.rig.sensors[s].kind == SensorKind::projector) add_polarity(s);
    }
    const std::set<std::size_t> boards(state_.board_of.begin(), state_.board_of.end());
    for (const std::size_t b : boards) add_board(b);
    return std::move(made_);
  }

 private:
  std::size_t view_count() const { return tester_.views().size(); }
  const View& view(std::size_t v) const { return *tester_.views()[v]; }

  std::optional<Eigen::MatrixXd> by_block(std::size_t v, const BlockId& block) const {
    const auto& blocks = view(v).blocks();
    const auto found = std::find(blocks.begin(), blocks.end(), block);
    if (found == blocks.end()) return std::nullopt;
    return block_jacobian(view(v), tester_.evaluation(v), state_, static_cast<std::size_t>(found - blocks.begin()));
  }

  // The block's derivative at all views of stations (or, of a probe that stands still, placements), by their numbers.
  std::map<std::size_t, Columns> by_time(const BlockId& block) const {
    std::map<std::size_t, Columns> columns;
    for (std::size_t v = 0; v < view_count(); ++v) {
      const bool still = state_.world_from_probe.empty();
      const auto time = still ? view(v).placement() : view(v).station();
      if (!time) continue;
      if (auto matrix = by_block(v, block)) columns[*time].emplace_back(v, std::move(*matrix));
    }
    return columns;
  }

  std::string time_name(std::size_t time) const {
    return state_.world_from_probe.empty() ? calibration_.placement_names[time] : calibration_.station_names[time];
  }

  // One candidate for each time from which on the block may be another one; `from_first` also from the very first.
  void add_splits(AlternativeKind kind, const std::string& subject, const BlockId& block, bool from_first,
                  const std::function<std::string(const ScoreOutcome&)>& how_far, const std::string& advice) {
    const std::map<std::size_t, Columns> columns = by_time(block);
    std::vector<std::size_t> times;
    for (const auto& entry : columns) times.push_back(entry.first);
    const std::size_t first = from_first ? 0 : kEitherSide;
    for (std::size_t k = first; k + kEitherSide <= times.size(); ++k) {
      if (k > 0 && k < kEitherSide) continue;
      Columns after;
      for (std::size_t i = k; i < times.size(); ++i) {
        const Columns& more = columns.at(times[i]);
        after.insert(after.end(), more.begin(), more.end());
      }
      const std::string since = k == 0 ? "the LEDs" : fmt::format("{} on", time_name(times[k]));
      made_.push_back({kind, subject, std::move(after), [=](const ScoreOutcome& outcome) {
                         return fmt::format("{} was moved by {}: from {} it stands elsewhere than before; {}", subject,
                                            how_far(outcome), since, advice);
                       }});
    }
  }

  void add_moved_led(std::size_t l) {
    if (state_.rig.leds[l].mount != Mount::probe) return;
    add_splits(
        AlternativeKind::led, fmt::format("LED {}", state_.rig.leds[l].name), {BlockId::Kind::led, l}, false,
        [](const ScoreOutcome& outcome) { return fmt::format("{:.2g} mm", outcome.estimate.norm()); },
        "fasten it, and calibrate with the stations on one side of that");
  }

  void add_moved_sensor(std::size_t s) {
    const Sensor& sensor = state_.rig.sensors[s];
    const auto alike = std::count_if(state_.rig.sensors.begin(), state_.rig.sensors.end(),
                                     [&](const Sensor& other) { return other.mount == sensor.mount; });
    const bool tracker = sensor.mount == Mount::world && !state_.world_from_probe.empty();
    if (alike < 2 && !tracker && state_.rig.leds.empty()) return;
    add_splits(
        AlternativeKind::place, sensor.name, {BlockId::Kind::mount, s}, tracker,
        [](const ScoreOutcome& outcome) {
          return fmt::format("{:.2g} mm and {:.2g} deg", outcome.estimate.tail<3>().norm(),
                             outcome.estimate.head<3>().norm() * kDegreePerRad);
        },
        "fasten it, and calibrate with the views on one side of that");
  }

  // Terms that the lens lacks: those of OPENCV8, and polynomials of degree 2 to 4 over the image.
  void add_lens_terms(std::size_t s) {
    const Sensor& sensor = state_.rig.sensors[s];
    const auto owns = [&](std::size_t other) { return other == s || state_.rig.sensors[other].lens_of == s; };
    if (sensor.lens_of) return;
    const bool has_rational = sensor.lens.model() == "LENSMODEL_OPENCV4" || sensor.lens.model() == "LENSMODEL_OPENCV5";
    std::optional<Lens> richer;
    if (has_rational) {
      std::vector<double> parameters = sensor.lens.parameters();
      parameters.resize(12, 0);
      richer = Lens::create("LENSMODEL_OPENCV8", sensor.lens.size(), std::move(parameters)).value();
    }
    Columns rational, polynomial;
    for (std::size_t v = 0; v < view_count(); ++v) {
      const std::size_t projecting = view(v).sensor();
      if (!owns(projecting) || view(v).kind() == View::Kind::overlaps) continue;
      const std::vector<Eigen::Vector3d> points = points_before(v);
      if (points.empty()) continue;
      const int d = view(v).dimension();
      Eigen::MatrixXd terms = Eigen::MatrixXd::Zero(d * view(v).size(), 3);
      Eigen::MatrixXd shape = Eigen::MatrixXd::Zero(d * view(v).size(), 2 * kPolynomials);
      for (std::size_t i = 0; i < points.size(); ++i) {
        const auto row = static_cast<Eigen::Index>(i) * d;
        Eigen::MatrixXd rows = Eigen::MatrixXd::Identity(d, 2);
        if (d == 1) rows = stripe_normal(v).transpose();
        const auto pixel = sensor.lens.project(points[i]);
        if (!pixel) continue;
        shape.middleRows(row, d) = rows * polynomials(sensor.lens.size(), *pixel);
        if (!richer) continue;
        const auto projection = richer->project_with_gradients(points[i]);
        if (projection) terms.middleRows(row, d) = rows * projection->d_parameters.rightCols(3);
      }
      polynomial.emplace_back(v, std::move(shape));
      if (richer) rational.emplace_back(v, std::move(terms));
    }
    const auto add = [&](Columns columns, const std::string& remedy) {
      if (columns.empty()) return;
      made_.push_back({AlternativeKind::lens, fmt::format("the lens of {}", sensor.name), std::move(columns),
                       [name = sensor.name, model = sensor.lens.model(), remedy](const ScoreOutcome& outcome) {
                         return fmt::format(
                             "{}: {} does not follow its lens: {} would explain {:.2g} sigma per observation more "
                             "(RMS), and parameters are off by up to {:.1f} sigma; calibrate with it, or with "
                             "--lens=auto",
                             name, model, remedy, outcome.effect, outcome.bias);
                       }});
    };
    add(std::move(rational), "LENSMODEL_OPENCV8");
    add(std::move(polynomial), "a splined lens");
  }

  // In the frame of the sensor whose pixels are predicted; empty where views do not tell it.
  std::vector<Eigen::Vector3d> points_before(std::size_t v) const {
    std::vector<Eigen::Vector3d> points;
    const std::size_t corners = data_.observations.corners.size(), stripes = data_.observations.stripes.size(),
                      features = data_.observations.features.size();
    if (v < corners + stripes + features) {
      const Pose sensor_from_board =
          sensor_from_board_pose(state_, view(v).sensor(), *view(v).placement(), view(v).station());
      for (const Eigen::Vector3d& point : board_points(v)) points.emplace_back(sensor_from_board * point);
      return points;
    }
    const std::size_t l = v - corners - stripes - features;
    if (l >= data_.observations.leds.size()) return points;
    const LedView& leds = data_.observations.leds[l];
    const Pose sensor_from_carrier = sensor_from_leds(state_, leds.sensor, leds.station).pose;
    for (const std::size_t led : leds.leds) {
      points.emplace_back(sensor_from_carrier * state_.rig.leds[led].position_mm);
    }
    return points;
  }

  Eigen::Vector2d stripe_normal(std::size_t v) const {
    return data_.observations.stripes[v - data_.observations.corners.size()].normal;
  }

  // Of a view of a board: where on the sheet, in the board's frame, each observation is.
  std::vector<Eigen::Vector3d> board_points(std::size_t v) const {
    const Observations& seen = data_.observations;
    std::vector<Eigen::Vector3d> points;
    if (v < seen.corners.size()) {
      const CornerView& corners = seen.corners[v];
      for (const int corner : corners.corners) points.push_back(state_.board_at(corners.placement).point(corner));
      return points;
    }
    v -= seen.corners.size();
    if (v < seen.stripes.size()) {
      const StripeView& stripes = seen.stripes[v];
      return met_with_board(stripes.camera, stripes.placement, stripes.station, stripes.camera_pixels);
    }
    v -= seen.stripes.size();
    const FeatureView& features = seen.features[v];
    return met_with_board(features.projector, features.placement, features.station, features.projector_pixels);
  }

  // Rays met with the board's plane; its bending moves these points by a fraction of itself.
  std::vector<Eigen::Vector3d> met_with_board(std::size_t sensor, std::size_t placement,
                                              std::optional<std::size_t> station,
                                              const std::vector<Eigen::Vector2d>& pixels) const {
    const Pose sensor_from_board = sensor_from_board_pose(state_, sensor, placement, station);
    const Pose board_from_sensor = sensor_from_board.inverse();
    const Eigen::Vector3d normal = sensor_from_board.rotation * Eigen::Vector3d::UnitZ();
    std::vector<Eigen::Vector3d> points;
    for (const Eigen::Vector2d& pixel : pixels) {
      const Eigen::Vector3d ray = state_.rig.sensors[sensor].lens.ray(pixel).value_or(Eigen::Vector3d::UnitZ());
      points.emplace_back(board_from_sensor *
                          Eigen::Vector3d(ray * (normal.dot(sensor_from_board.translation) / normal.dot(ray))));
    }
    return points;
  }

  static constexpr int kPolynomials = 12;

  // Monomials of degree 2 to 4 over the image from -1 to 1, for each of the pixel's coordinates.
  static Eigen::Matrix<double, 2, 2 * kPolynomials> polynomials(const ImageSize& size, const Eigen::Vector2d& pixel) {
    const double x = 2 * pixel.x() / size.width_px - 1, y = 2 * pixel.y() / size.height_px - 1;
    Eigen::Matrix<double, 2, 2 * kPolynomials> columns = Eigen::Matrix<double, 2, 2 * kPolynomials>::Zero();
    int k = 0;
    for (int degree = 2; degree <= 4; ++degree) {
      for (int power = 0; power <= degree; ++power) {
        columns(0, 2 * k) = columns(1, 2 * k + 1) = std::pow(x, power) * std::pow(y, degree - power);
        ++k;
      }
    }
    return columns;
  }

  // +1 where the stripe's edge nearest to a coordinate rises with it, -1 where it falls: by the bit of the Gray code
  // that changes there. Of stripes one pixel wide from the panel's edge.
  static double polarity(double coordinate_px) {
    const auto stripe = static_cast<unsigned>(std::max(1.0, std::round(coordinate_px + 0.5)));
    return gray_from_binary(stripe) > gray_from_binary(stripe - 1) ? 1 : -1;
  }

  void add_polarity(std::size_t s) {
    Columns columns;
    const std::size_t first = data_.observations.corners.size();
    for (std::size_t i = 0; i < data_.observations.stripes.size(); ++i) {
      const StripeView& stripes = data_.observations.stripes[i];
      if (stripes.projector != s) continue;
      Eigen::MatrixXd signs(static_cast<Eigen::Index>(stripes.coordinates_px.size()), 1);
      for (std::size_t k = 0; k < stripes.coordinates_px.size(); ++k) {
        signs(static_cast<Eigen::Index>(k), 0) = polarity(stripes.coordinates_px[k]);
      }
      columns.emplace_back(first + i, std::move(signs));
    }
    if (columns.empty()) return;
    const std::string& name = state_.rig.sensors[s].name;
    made_.push_back({AlternativeKind::polarity, name, std::move(columns), [name](const ScoreOutcome& outcome) {
                       return fmt::format(
                           "{}: rising edges of stripes are off by {:+.2g} px and falling ones by {:+.2g} px, as a "
                           "gamma makes them without inverse patterns; take every pattern with its inverse",
                           name, outcome.estimate[0], -outcome.estimate[0]);
                     }});
  }

  // Calls fill(point in the board's frame, rows by displacement in the board's frame, row of columns) for every
  // observation of a board.
  template <typename Fill>
  Columns over_board(std::size_t board, Eigen::Index degrees, const Fill& fill) const {
    Columns columns;
    for (std::size_t v = 0; v < view_count(); ++v) {
      if (!view(v).placement() || state_.board_of[*view(v).placement()] != board) continue;
      const auto by_placement = by_block(v, {BlockId::Kind::placement, *view(v).placement()});
      if (!by_placement) continue;
      const Eigen::Matrix3d axes = state_.world_from_board[*view(v).placement()].rotation.toRotationMatrix();
      const std::vector<Eigen::Vector3d> points = board_points(v);
      const int d = view(v).dimension();
      Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(d * view(v).size(), degrees);
      for (std::size_t i = 0; i < points.size(); ++i) {
        const auto row = static_cast<Eigen::Index>(i) * d;
        const Eigen::MatrixXd moved = by_placement->middleRows(row, d).rightCols<3>() * axes;
        fill(points[i], moved, matrix.middleRows(row, d));
      }
      columns.emplace_back(v, std::move(matrix));
    }
    return columns;
  }

  void add_board(std::size_t b) {
    const Board& board = state_.boards[b];
    Eigen::Vector2d low = Eigen::Vector2d::Constant(1e9), high = -low;
    for (const Eigen::Vector2d& point : board.nominal_mm()) {
      low = low.cwiseMin(point);
      high = high.cwiseMax(point);
    }
    const Eigen::Vector2d middle = 0.5 * (low + high), half = 0.5 * (high - low);
    const auto normalised = [middle, half](const Eigen::Vector3d& point) {
      return Eigen::Vector2d((point.head<2>() - middle).cwiseQuotient(half));
    };
    const std::string subject = fmt::format("board '{}'", board.name);
    made_.push_back(
        {AlternativeKind::shape, subject,
         over_board(b, kHeights,
                    [&](const Eigen::Vector3d& point, const Eigen::MatrixXd& moved, Eigen::Ref<Eigen::MatrixXd> row) {
                      row = moved.col(2) * heights(normalised(point)).transpose();
                    }),
         [subject](const ScoreOutcome& outcome) {
           return fmt::format(
               "{} is bent by {:.2g} mm in a way that was not allowed for: use a stiffer one, or "
               "--warp=on",
               subject, height_range(outcome.estimate));
         }});
    // Where the size was measured beside bars and certified boards, the verdict holds it against the stated one.
    if (!measured_.contains(b)) {
      made_.push_back(
          {AlternativeKind::size, subject,
           over_board(b, 1,
                      [](const Eigen::Vector3d& point, const Eigen::MatrixXd& moved, Eigen::Ref<Eigen::MatrixXd> row) {
                        row = moved.leftCols<2>() * point.head<2>();
                      }),
           [subject](const ScoreOutcome& outcome) {
             return fmt::format(
                 "the pitch of {} is off by {:+.3g} % from what the others, bars and certificates say: measure it",
                 subject, 100 * outcome.estimate[0]);
           }});
    }
    made_.push_back(
        {AlternativeKind::size, subject,
         over_board(b, 2,
                    [](const Eigen::Vector3d& point, const Eigen::MatrixXd& moved, Eigen::Ref<Eigen::MatrixXd> row) {
                      row.col(0) = moved.col(0) * point.x();
                      row.col(1) = moved.col(0) * point.y();
                    }),
         [subject](const ScoreOutcome& outcome) {
           return fmt::format(
               "the pitch of {} along x differs by {:+.3g} % from that along y, and its axes are {:.2g} deg off "
               "square: measure it",
               subject, 100 * outcome.estimate[0], outcome.estimate[1] * kDegreePerRad);
         }});
  }

  // u^2, uv, v^2, u^3, u^2 v, u v^2, v^3: what bends a sheet.
  static constexpr int kHeights = 7;
  static Eigen::VectorXd heights(const Eigen::Vector2d& at) {
    const double u = at.x(), v = at.y();
    return (Eigen::VectorXd(kHeights) << u * u, u * v, v * v, u * u * u, u * u * v, u * v * v, v * v * v).finished();
  }

  // Between the highest and the lowest of the sheet, a plane through it taken off.
  static double height_range(const Eigen::VectorXd& estimate) {
    constexpr int kSide = 9;
    Eigen::MatrixXd plane(kSide * kSide, 3);
    Eigen::VectorXd height(kSide * kSide);
    for (int i = 0; i < kSide * kSide; ++i) {
      const Eigen::Vector2d at(2.0 * (i % kSide) / (kSide - 1) - 1, 2.0 * (i / kSide) / (kSide - 1) - 1);
      plane.row(i) << 1, at.x(), at.y();
      height[i] = heights(at).dot(estimate);
    }
    height -= plane * least_squares(plane, height);
    return height.maxCoeff() - height.minCoeff();
  }

  const CalibrationData& data_;
  const Calibration& calibration_;
  const CalibrationState& state_;
  const ScoreTester& tester_;
  std::set<std::size_t> measured_;  // boards
  std::vector<AlternativeCandidate> made_;
};

}  // namespace

std::vector<AlternativeCandidate> alternative_candidates(const CalibrationData& data, const Calibration& calibration,
                                                         const ScoreTester& tester) {
  return CandidateMaker(data, calibration, tester).make();
}

}  // namespace crumple
