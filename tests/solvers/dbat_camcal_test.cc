// A published photogrammetric adjustment reproduced by the joint refinement's own minimiser, normal equations and
// covariance: a foreign lens model as one more residual, and where the published model is ours, our lens.
#include "tests/solvers/dbat_camcal.h"

#include <cmath>
#include <numbers>
#include <sstream>

#include <gtest/gtest.h>

#include "solvers/closed_form/board_pose.h"
#include "solvers/closed_form/triangulate.h"
#include "tests/datasets/public_data.h"
#include "tests/solvers/backward_brown.h"
#include "tests/solvers/gradients.h"
#include "tests/solvers/joint_solve.h"

namespace crumple {
namespace {

constexpr double kDegree_rad = std::numbers::pi / 180;
constexpr std::array<const char*, 6> kOutside{"Omega", "Phi", "Kappa", "Xc", "Yc", "Zc"};
const BlockId kLens{BlockId::Kind::lens, 0};

// Which way the toolbox models the lens; `forward` is ours.
enum class DbatModel { forward, without_aspect, aspect_before, aspect_after, aspect_first };

Pose sensor_from_probe() { return {Eigen::Quaterniond(0, 1, 0, 0), Eigen::Vector3d::Zero()}; }

// What the first photographs see of some points.
DbatNetwork part_of(const DbatNetwork& network, std::size_t photographs, const std::set<int>& ids) {
  DbatNetwork part;
  part.photographs = photographs;
  part.ids.assign(ids.begin(), ids.end());
  for (const auto& [led, position] : network.control) part.control[part.led(network.ids[led])] = position;
  for (const LedView& view : network.views) {
    if (*view.station >= photographs) continue;
    LedView kept{0, {}, {}, view.station};
    for (std::size_t i = 0; i < view.leds.size(); ++i) {
      if (!ids.contains(network.ids[view.leds[i]])) continue;
      kept.leds.push_back(part.led(network.ids[view.leds[i]]));
      kept.pixels.push_back(view.pixels[i]);
    }
    if (!kept.leds.empty()) part.views.push_back(kept);
  }
  return part;
}

template <typename Action>
void for_each_mark(const DbatNetwork& network, std::size_t photograph, const Action& action) {
  for (const LedView& view : network.views) {
    if (view.station != photograph) continue;
    for (std::size_t i = 0; i < view.leds.size(); ++i) action(view.leds[i], view.pixels[i]);
  }
}

// Nothing known but the control points and about the focal length: poses from their homographies, points where rays
// meet.
CalibrationState forward_start(const DbatNetwork& network) {
  const double focal_px = 7.3 / DbatNetwork::kPixelSize_mm;
  const Lens lens = *Lens::undistorted("LENSMODEL_OPENCV5", {2272, 1704}, focal_px, focal_px, {1135.5, 851.5});
  CalibrationState state;
  state.rig.sensors = {{"camera", SensorKind::camera, lens, sensor_from_probe()}};
  std::vector<std::vector<Sighting>> sightings(network.ids.size());
  for (std::size_t photograph = 0; photograph < network.photographs; ++photograph) {
    Points2d plane, pixels;
    for_each_mark(network, photograph, [&](std::size_t led, const Eigen::Vector2d& pixel) {
      const auto control = network.control.find(led);
      if (control == network.control.end()) return;
      plane.emplace_back(control->second.head<2>());
      pixels.push_back(pixel);
    });
    const Pose sensor_from_world = board_pose(lens, plane, pixels).value();
    state.world_from_probe.push_back(sensor_from_world.inverse() * sensor_from_probe());
    for_each_mark(network, photograph, [&](std::size_t led, const Eigen::Vector2d& pixel) {
      sightings[led].push_back({&lens, sensor_from_world, pixel});
    });
  }
  for (std::size_t p = 0; p < network.ids.size(); ++p) {
    const auto control = network.control.find(p);
    const Eigen::Vector3d point =
        control != network.control.end() ? control->second : triangulate(sightings[p]).value().point_mm;
    state.rig.leds.push_back({std::to_string(network.ids[p]), point, Mount::world});
  }
  return state;
}

// With the backward lens's nine numbers in the place of ours.
CalibrationState backward_start(const DbatNetwork& network) {
  CalibrationState state = forward_start(network);
  Lens& lens = state.rig.sensors[0].lens;
  lens = lens.with_parameters({7.3, 1, 3.6, 2.7, 0, 0, 0, 0, 0});
  return state;
}

std::vector<std::unique_ptr<View>> views_of(const Observations& photographs, DbatModel model) {
  if (model == DbatModel::forward) return make_views(photographs, {});
  std::vector<std::unique_ptr<View>> views;
  for (const LedView& view : photographs.leds) {
    const Aspect aspect = model == DbatModel::aspect_after   ? Aspect::after_distortion
                          : model == DbatModel::aspect_first ? Aspect::before_principal_point
                                                             : Aspect::before_distortion;
    views.push_back(backward_brown_residuals(view, DbatNetwork::kPixelSize_mm, aspect));
  }
  return views;
}

// The models without an aspect have one number less than our nine: a prior far sharper than the adjustment holds it,
// and so far wider along with the focal length that it says nothing of that.
std::vector<Prior> without_aspect(DbatModel model, const CalibrationState& state) {
  if (model == DbatModel::without_aspect) {
    return {*Prior::create("no aspect", {{kLens, 1}}, state, Eigen::MatrixXd::Constant(1, 1, 1e-18))};
  }
  if (model != DbatModel::forward) return {};
  Eigen::Matrix2d equal = Eigen::Matrix2d::Constant(1e6);
  equal.diagonal().array() += 1e-8;
  return {*Prior::create("no aspect", {{kLens, 0}, {kLens, 1}}, state, equal)};
}

struct Adjustment {
  CalibrationState state;
  JointCovariance covariance;
  double sigma0 = 0;
  int redundancy = 0;
};

Expected<Adjustment> adjusted(const DbatNetwork& network, DbatModel model, std::set<BlockId> held,
                              const CalibrationState& start) {
  Observations photographs;
  photographs.leds = network.views;
  const auto views = views_of(photographs, model);
  std::vector<ViewWeights> weights;
  int residuals = 0;
  for (const auto& view : views) {
    weights.push_back({DbatNetwork::kSigma_px, 1, std::vector<char>(static_cast<std::size_t>(view->size()), 1)});
    residuals += 2 * view->size();
  }
  held.insert({BlockId::Kind::mount, 0});
  const auto priors = without_aspect(model, start);
  for (const Prior& prior : priors) residuals += static_cast<int>(prior.blocks().size());
  const Parameters parameters(start, views, held);
  const JointProblem problem{views, weights, priors};
  const auto minimum = joint_minimum(problem, parameters, start);
  if (!minimum) return tl::unexpected(minimum.error());
  auto covariance = joint_covariance(problem, parameters, minimum->state);
  if (!covariance) return tl::unexpected(covariance.error());
  const int redundancy = residuals - parameters.size();
  return Adjustment{minimum->state, std::move(*covariance), std::sqrt(minimum->sum_of_squares / redundancy),
                    redundancy};
}

std::set<BlockId> control_points(const DbatNetwork& network) {
  std::set<BlockId> held;
  for (const auto& [led, position] : network.control) held.insert({BlockId::Kind::led, led});
  return held;
}

struct Estimate {
  double value = 0, deviation = 0;
};

Estimate linear(const Adjustment& adjustment, const BlockId& block, double value, const Eigen::VectorXd& derivative) {
  const Eigen::MatrixXd covariance = adjustment.covariance.of({block}, adjustment.state);
  return {value, adjustment.sigma0 * std::sqrt(derivative.dot(covariance * derivative))};
}

// The toolbox's interior numbers, by their printed names.
std::map<std::string, Estimate> inside(const Adjustment& adjustment, DbatModel model) {
  const std::vector<double>& p = adjustment.state.rig.sensors[0].lens.parameters();
  const double size = DbatNetwork::kPixelSize_mm, cc = model == DbatModel::forward ? size * p[0] : p[0];
  std::map<std::string, Estimate> found;
  // value = scale p[i] / cc^power, and for our lens cc follows the focal length in px.
  const auto add = [&](const char* name, std::size_t i, double scale, int power) {
    const double value = scale * p[i] / std::pow(cc, power);
    Eigen::VectorXd derivative = Eigen::VectorXd::Zero(9);
    derivative[static_cast<Eigen::Index>(i)] = scale / std::pow(cc, power);
    if (power > 0) derivative[0] -= power * value / p[0];
    found[name] = linear(adjustment, kLens, value, derivative);
  };
  if (model == DbatModel::forward) {
    add("Camera Constant", 0, size, 0);
    add("px", 2, size, 0);
    add("py", 3, size, 0);
    add("K1", 4, -1, 2);
    add("K2", 5, -1, 4);
    add("K3", 8, -1, 6);
    add("P1", 7, -1, 1);
    add("P2", 6, 1, 1);
    return found;
  }
  const std::array<const char*, 9> names{"Camera Constant", "as", "px", "py", "K1", "K2", "P1", "P2", "K3"};
  for (std::size_t i = 0; i < names.size(); ++i) add(names[i], i, 1, 0);
  found["as"].value -= 1;
  if (model == DbatModel::without_aspect) found.erase("as");
  return found;
}

// world_from_probe = R1(omega) R2(phi) R3(kappa), about x, y and z, the later ones about the turned axes; degrees.
std::map<std::string, Estimate> outside(const Adjustment& adjustment, std::size_t photograph) {
  const Pose& pose = adjustment.state.world_from_probe[photograph];
  const Eigen::Matrix3d r = pose.rotation.toRotationMatrix();
  const double omega = std::atan2(-r(1, 2), r(2, 2)), phi = std::asin(r(0, 2)), kappa = std::atan2(-r(0, 1), r(0, 0));
  const Eigen::Matrix3d r1 = Eigen::AngleAxisd(omega, Eigen::Vector3d::UnitX()).toRotationMatrix();
  const Eigen::Matrix3d r12 = r1 * Eigen::AngleAxisd(phi, Eigen::Vector3d::UnitY()).toRotationMatrix();
  Eigen::Matrix3d turn_by_angles;
  turn_by_angles << Eigen::Vector3d::UnitX(), r1.col(1), r12.col(2);
  Matrix6d derivative = Matrix6d::Identity();
  derivative.topLeftCorner<3, 3>() = turn_by_angles.inverse() / kDegree_rad;
  const Vector6d values{omega / kDegree_rad,  phi / kDegree_rad,    kappa / kDegree_rad,
                        pose.translation.x(), pose.translation.y(), pose.translation.z()};
  std::map<std::string, Estimate> found;
  for (int i = 0; i < 6; ++i) {
    found[kOutside[static_cast<std::size_t>(i)]] =
        linear(adjustment, {BlockId::Kind::station, photograph}, values[i], derivative.row(i).transpose());
  }
  return found;
}

// How far two runs of the toolbox, which stops where a step is a millionth of the residuals, may be from each other:
// the two published runs of the main model differ by up to 1.7e-4 of a deviation, and by one in the last place of P2.
constexpr double kSettled = 2e-4;  // of a standard deviation

void expect_printed(const Estimate& found, const DbatValue& printed, double settled) {
  double value = found.value;
  double place = 1e-6;  // of angles and positions
  if (printed.photograph.empty()) place = last_place(printed.value, 6);
  if (printed.name == "Kappa") value += 360 * std::round((std::stod(printed.value) - value) / 360);
  EXPECT_LE(std::abs(value - std::stod(printed.value)), 0.5 * place + settled * found.deviation)
      << printed.photograph << " " << printed.name << ": " << value << ", published " << printed.value;
  EXPECT_TRUE(rounds_to(found.deviation, printed.deviation, 3))
      << printed.photograph << " deviation of " << printed.name << ": " << found.deviation << ", published "
      << printed.deviation;
}

// Every number of a report that has a standard deviation; returns how many.
int expect_report(const Adjustment& adjustment, DbatModel model, const DbatReport& report, double settled) {
  EXPECT_TRUE(rounds_to(adjustment.sigma0, report.facts.at("Sigma0"), 6)) << adjustment.sigma0;
  EXPECT_EQ(std::to_string(adjustment.redundancy), report.facts.at("Redundancy"));
  const auto of_lens = inside(adjustment, model);
  int compared = 0;
  for (const DbatValue& printed : report.values) {
    if (printed.deviation.empty()) continue;
    ++compared;
    if (printed.photograph.empty()) {
      expect_printed(of_lens.at(printed.name), printed, settled);
    } else {
      const int number = std::stoi(printed.photograph.substr(1));  // "P8250021.JPG" is the first
      expect_printed(outside(adjustment, static_cast<std::size_t>(number - 8250021)).at(printed.name), printed,
                     settled);
    }
  }
  return compared;
}

class DbatCamcal : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = public_data("dbat_camcal");
    if (!folder_) GTEST_SKIP() << "SKIPPED: the public data set dbat_camcal is not there";
    network_ = read_dbat_network(*folder_);
  }

  Adjustment adjust(DbatModel model, const CalibrationState& start) const {
    return adjusted(network_, model, control_points(network_), start).value();
  }
  void expect_published(const Adjustment& adjustment, DbatModel model, const std::string& name, int values,
                        double settled = kSettled) const {
    EXPECT_EQ(expect_report(adjustment, model, read_dbat_report(*folder_ / "result" / name), settled), values);
  }

  std::optional<std::filesystem::path> folder_;
  DbatNetwork network_;
};

constexpr int kNumbers = 9 + 6 * 21;

// "5e-05 (OP 90)": the largest deviation of a coordinate of the object points, and which point's.
void expect_largest(const Adjustment& adjustment, const DbatNetwork& network, int coordinate,
                    const std::string& printed) {
  double largest = 0;
  int id = 0;
  for (std::size_t p = 0; p < network.ids.size(); ++p) {
    const double deviation =
        linear(adjustment, {BlockId::Kind::led, p}, 0, Eigen::Vector3d::Unit(coordinate)).deviation;
    if (deviation > largest) id = network.ids[p];
    largest = std::max(largest, deviation);
  }
  EXPECT_TRUE(rounds_to(largest, printed, 2)) << largest << ", published " << printed;
  EXPECT_NE(printed.find("(OP " + std::to_string(id) + ")"), std::string::npos) << id << ", published " << printed;
}

// The stations' deviations with all their digits; the file has those of positions times 180 / pi as well.
void expect_stations(const Adjustment& adjustment, const std::vector<std::vector<std::string>>& rows) {
  constexpr std::array<const char*, 6> order{"Xc", "Yc", "Zc", "Omega", "Phi", "Kappa"};
  ASSERT_EQ(rows.size(), 21U);
  for (const auto& row : rows) {
    const auto found = outside(adjustment, static_cast<std::size_t>(std::stoi(row.at(0)) - 1));
    for (std::size_t i = 0; i < order.size(); ++i) {
      const double published = std::stod(row.at(8 + i)) * (i < 3 ? kDegree_rad : 1);
      EXPECT_NEAR(found.at(order[i]).deviation / published, 1, 1e-7) << order[i] << " of photograph " << row.at(0);
    }
  }
}

// The fifty largest residuals, to the printed digits.
void expect_residuals(const Adjustment& adjustment, const DbatNetwork& network,
                      const std::vector<std::vector<std::string>>& rows) {
  std::map<std::pair<int, int>, Eigen::Vector2d> residuals;  // by point and photograph
  for (const LedView& view : network.views) {
    ViewEvaluation evaluation;
    backward_brown_residuals(view, DbatNetwork::kPixelSize_mm, Aspect::before_distortion)
        ->evaluate(adjustment.state, false, evaluation);
    for (std::size_t i = 0; i < view.leds.size(); ++i) {
      residuals[{network.ids[view.leds[i]], static_cast<int>(*view.station) + 1}] =
          evaluation.residuals.segment<2>(2 * static_cast<Eigen::Index>(i));
    }
  }
  ASSERT_EQ(rows.size(), 50U);
  for (const auto& row : rows) {
    const Eigen::Vector2d& residual = residuals.at({std::stoi(row.at(0)), std::stoi(row.at(1))});
    EXPECT_NEAR(residual.norm(), std::stod(row.at(6)), 2e-6) << row.at(0) << " in photograph " << row.at(1);
    EXPECT_NEAR(std::abs(residual.x()), std::abs(std::stod(row.at(4))), 1e-5);
    EXPECT_NEAR(std::abs(residual.y()), std::abs(std::stod(row.at(5))), 1e-5);
  }
}

TEST_F(DbatCamcal, BackwardModelsToThePrintedDigits) {
  const Adjustment adjustment = adjust(DbatModel::aspect_before, backward_start(network_));
  expect_published(adjustment, DbatModel::aspect_before, "camcal-dbatreport.txt", kNumbers, 0);
  expect_published(adjustment, DbatModel::aspect_before, "report.txt", kNumbers);
  const DbatReport report = read_dbat_report(*folder_ / "result/report.txt");
  expect_largest(adjustment, network_, 0, report.facts.at("Maximum X standard deviation"));
  expect_largest(adjustment, network_, 1, report.facts.at("Maximum Y standard deviation"));
  expect_largest(adjustment, network_, 2, report.facts.at("Maximum Z standard deviation"));
  expect_stations(adjustment, read_dbat_table(*folder_ / "result/camera_stations.txt"));
  expect_residuals(adjustment, network_, read_dbat_table(*folder_ / "result/top_residuals.txt"));

  const CalibrationState& near = adjustment.state;
  expect_published(adjust(DbatModel::aspect_after, near), DbatModel::aspect_after, "camcal-dbatreport-model4.txt",
                   kNumbers);
  expect_published(adjust(DbatModel::aspect_first, near), DbatModel::aspect_first, "camcal-dbatreport-model5.txt",
                   kNumbers);
  CalibrationState square = near;
  std::vector<double> parameters = square.rig.sensors[0].lens.parameters();
  parameters[1] = 1;
  square.rig.sensors[0].lens = square.rig.sensors[0].lens.with_parameters(parameters);
  expect_published(adjust(DbatModel::without_aspect, square), DbatModel::without_aspect, "camcal-dbatreport-model1.txt",
                   kNumbers - 1);
}

TEST_F(DbatCamcal, ForwardModelThroughOurOwnLens) {
  expect_published(adjust(DbatModel::forward, forward_start(network_)), DbatModel::forward,
                   "camcal-dbatreport-model-1.txt", kNumbers - 1);
}

// Ten points in five photographs; without its control points refused: the datum is seven numbers short.
TEST_F(DbatCamcal, SmallNetwork) {
  network_ = part_of(network_, 5, {2, 3, 4, 5, 6, 10, 1001, 1002, 1003, 1004});
  const CalibrationState start = backward_start(network_);
  expect_published(adjust(DbatModel::aspect_before, start), DbatModel::aspect_before, "camcal-dbatreport5.txt",
                   9 + 6 * 5);
  const auto free = adjusted(network_, DbatModel::aspect_before, {}, start);
  ASSERT_FALSE(free);
  EXPECT_NE(free.error().message.find("determine"), std::string::npos) << free.error().message;
}

// The lens's derivatives, wherever the aspect stands; those of poses and points are ours.
TEST(BackwardBrown, JacobianMatchesCentralDifferences) {
  CalibrationState state;
  state.rig.sensors = {
      {"camera", SensorKind::camera,
       *Lens::create("LENSMODEL_OPENCV5", {2272, 1704}, {7.4, 1.1, 3.6, 2.6, 4.6e-3, -4.5e-4, -2e-3, 3e-3, -2e-5}),
       sensor_from_probe()}};
  state.world_from_probe = {{rotation_from_vector({-0.7, 0.1, 2.9}), {0.45, 1.8, 1.5}}};
  LedView view{0, {0, 1, 2}, {{300, 400}, {2000, 900}, {1100, 1500}}, 0};
  for (const Eigen::Vector3d& point : {Eigen::Vector3d(0, 1, 0.01), {1, 1, 0}, {0.4, 0.2, 0.3}}) {
    state.rig.leds.push_back({"", point, Mount::world});
  }
  for (const Aspect aspect : {Aspect::before_distortion, Aspect::after_distortion, Aspect::before_principal_point}) {
    const auto residuals = backward_brown_residuals(view, 0.003, aspect);
    ViewEvaluation evaluation;
    ASSERT_TRUE(residuals->evaluate(state, true, evaluation));
    for (std::size_t b = 0; b < residuals->blocks().size(); ++b) {
      const auto moved_residuals = [&](const Eigen::VectorXd& step) {
        CalibrationState there = state;
        move_block(residuals->blocks()[b], step, there);
        ViewEvaluation at;
        EXPECT_TRUE(residuals->evaluate(there, false, at));
        return at.residuals;
      };
      const Eigen::MatrixXd analytic = block_jacobian(*residuals, evaluation, state, b);
      const Eigen::MatrixXd numeric = central_differences(moved_residuals, Eigen::VectorXd::Zero(analytic.cols()));
      EXPECT_LT((numeric - analytic).cwiseAbs().maxCoeff(), 1e-8 * (1 + analytic.cwiseAbs().maxCoeff())) << b;
    }
  }
}

}  // namespace
}  // namespace crumple
