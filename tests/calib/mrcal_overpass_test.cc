// A real solve of mrcal's (186 views of a 10 x 10 board by a wide lens, 6016 x 4016) against ours: the residuals and
// the Jacobian at its solution, and the cost that our own solve comes to from our own start.
//
// mrcal's board observations carry weights, 1/8 to 1, and outliers; its regularization is Gaussian about zero
// distortion and the image's centre. Both are part of what is minimised here as there.
#include <cmath>
#include <map>
#include <random>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "calib/calibrate.h"
#include "datasets/cameramodel_file.h"
#include "datasets/npy_file.h"
#include "tests/datasets/public_data.h"
#include "tests/python.h"
#include "tests/solvers/joint_solve.h"

namespace crumple {
namespace {

constexpr int kSide = 10;
constexpr int kPoints = kSide * kSide;

// Of every `step`-th view: the state, the measurements x and their Jacobian, columns by lens, frame (rotation vector,
// translation) and warp; the lens's optimised parameters only, from `first_parameter`. Of all: the observations. Where
// asked for: inverse(J'J), from mrcal's own Cholesky factor, of lens, warp and two frames.
constexpr const char* kExtract = R"(
import mrcal, os, sys, numpy as np
model, out, step, solve = sys.argv[1].split('|')
step = int(step)
m = mrcal.cameramodel(model)
o = m.optimization_inputs()
o['do_apply_outlier_rejection'] = False
if solve == 'solved':
    mrcal.optimize(**o)
b, x, J, f = mrcal.optimizer_callback(**o)
boards, views = mrcal.num_measurements_boards(**o), len(o['observations_board'])
lens = np.arange(mrcal.state_index_intrinsics(0, **o), mrcal.num_states_intrinsics(**o))
warp = mrcal.state_index_calobject_warp(**o) + np.arange(2)
rows = []
for i in range(0, views, step):
    frame = mrcal.state_index_frames(i, **o) + np.arange(6)
    dense = J[200 * i : 200 * (i + 1)].toarray()
    mrcal.pack_state(dense, **o)
    rows.append(dense[:, np.concatenate((lens, frame, warp))])
regularization = J[boards:].toarray()
mrcal.pack_state(regularization, **o)
save = lambda name, a: np.save(os.path.join(out, name + '.npy'), np.atleast_2d(np.array(a, dtype=float)))
save('intrinsics', o['intrinsics'])
save('frames', o['frames_rt_toref'])
save('warp', o['calobject_warp'])
save('spacing', o['calibration_object_spacing'])
save('observations', o['observations_board'].reshape(-1, 3))
save('x', x[:boards].reshape(-1, 2))
save('J', np.concatenate(rows))
save('regularization_x', x[boards:])
save('regularization_J', regularization[:, lens])
save('cost', np.sum(x ** 2))
if solve == 'covariance':
    chosen = np.concatenate((lens, warp, mrcal.state_index_frames(0, **o) + np.arange(6),
                             mrcal.state_index_frames(100, **o) + np.arange(6)))
    rows = np.zeros((len(chosen), len(b)))
    rows[np.arange(len(chosen)), chosen] = 1
    rows = f.solve_xt_JtJ_bt(rows)
    units = np.ones(len(b))
    mrcal.unpack_state(units, **o)
    save('covariance', rows[:, chosen] * units[chosen] * units[chosen].reshape(-1, 1))
)";

// mrcal counts in metres here, which is as good a unit as mm.
class MrcalOverpass : public testing::Test {
 protected:
  void load(const std::string& name, int step, const std::string& solve = "as stored") {
    const auto data = public_data("mrcal_overpass");
    if (!data) GTEST_SKIP() << "SKIPPED: mrcal_overpass is missing (set CRUMPLE_DATA)";
    if (!python_has("mrcal")) GTEST_SKIP() << "SKIPPED: Debian's python3-mrcal is not installed";
    const std::string model = (*data / name).string();
    const std::string said =
        run_python(kExtract, model + "|" + home_.path().string() + "|" + std::to_string(step) + "|" + solve);
    ASSERT_EQ(said, "");
    const Eigen::MatrixXd intrinsics = matrix("intrinsics");
    const Lens lens =
        read_cameramodel(model)->lens.with_parameters({intrinsics.data(), intrinsics.data() + intrinsics.size()});
    state_.rig.sensors = {{"camera", SensorKind::camera, lens, {}}};
    state_.boards = {Board::grid(kSide, kSide, matrix("spacing")(0, 0))};
    state_.boards[0].warp_mm = matrix("warp").row(0).transpose();
    const Eigen::MatrixXd frames = matrix("frames"), observed = matrix("observations");
    for (Eigen::Index f = 0; f < frames.rows(); ++f) {
      const Eigen::Vector3d rotation = frames.block<1, 3>(f, 0).transpose();
      rotations_.push_back(rotation);
      state_.world_from_board.push_back({rotation_from_vector(rotation), frames.block<1, 3>(f, 3).transpose()});
      state_.board_of.push_back(0);
      CornerView view{0, static_cast<std::size_t>(f), {}, {}};
      for (int i = 0; i < kPoints; ++i) {
        view.corners.push_back(i);
        view.pixels.emplace_back(observed(f * kPoints + i, 0), observed(f * kPoints + i, 1));
        weights_.push_back(observed(f * kPoints + i, 2));
      }
      observations_.corners.push_back(view);
    }
    observations_.placement_count = observations_.corners.size();
  }

  Eigen::MatrixXd matrix(const std::string& name) const { return read_npy(home_ / (name + ".npy")).value(); }

  double weight(const CornerView& view, int corner) const {
    return weights_[view.placement * kPoints + static_cast<std::size_t>(corner)];
  }

  // Compares every `step`-th view at mrcal's solution. `first_parameter`: mrcal holds the lens's parameters before it.
  void expect_same_residuals_and_jacobian(int step, Eigen::Index first_parameter) const;

  // Views with one weight each, outliers left out.
  Observations split_by_weight(std::vector<double>& view_weights) const;
  struct Problem;
  std::unique_ptr<const Problem> problem() const;
  // At mrcal's solution, correlation by correlation.
  void expect_same_covariance() const;
  Expected<double> least_cost(const CalibrationState& start) const;

  TemporaryFolder home_;
  CalibrationState state_;
  std::vector<Eigen::Vector3d> rotations_;
  Observations observations_;
  std::vector<double> weights_;
};

Eigen::MatrixXd block_of(const View& view, const ViewEvaluation& evaluation, const CalibrationState& state,
                         BlockId::Kind kind) {
  for (std::size_t i = 0; i < view.blocks().size(); ++i) {
    if (view.blocks()[i].kind == kind) return block_jacobian(view, evaluation, state, i);
  }
  return {};
}

void MrcalOverpass::expect_same_residuals_and_jacobian(int step, Eigen::Index first_parameter) const {
  const Eigen::MatrixXd x = matrix("x"), theirs = matrix("J");
  const auto views = make_views(observations_, state_.board_of);
  Eigen::Index row = 0;
  double worst_residual = 0, worst_jacobian = 0;
  for (std::size_t v = 0; v < views.size(); v += static_cast<std::size_t>(step)) {
    ViewEvaluation ours;
    ASSERT_TRUE(views[v]->evaluate(state_, true, ours)) << v;
    const Eigen::MatrixXd lens = block_of(*views[v], ours, state_, BlockId::Kind::lens);
    Eigen::MatrixXd pose = block_of(*views[v], ours, state_, BlockId::Kind::placement);
    pose.leftCols<3>() *= left_jacobian(rotations_[v]);
    Eigen::MatrixXd jacobian(2 * kPoints, lens.cols() - first_parameter + 8);
    jacobian << lens.rightCols(lens.cols() - first_parameter), pose,
        block_of(*views[v], ours, state_, BlockId::Kind::warp);
    ASSERT_EQ(jacobian.cols(), theirs.cols());
    for (int i = 0; i < kPoints; ++i, row += 2) {
      const double w = weight(observations_.corners[v], i);
      if (w < 0) continue;  // mrcal blanks its outliers
      const Eigen::Index point = static_cast<Eigen::Index>(v) * kPoints + i;
      worst_residual = std::max(
          worst_residual, (w * ours.residuals.segment<2>(2 * i) - x.row(point).transpose()).cwiseAbs().maxCoeff());
      const Eigen::MatrixXd difference = w * jacobian.middleRows(2 * i, 2) - theirs.middleRows(row, 2);
      const Eigen::MatrixXd size = theirs.middleRows(row, 2).cwiseAbs().cwiseMax(1.0);
      worst_jacobian = std::max(worst_jacobian, difference.cwiseQuotient(size).cwiseAbs().maxCoeff());
    }
  }
  ASSERT_EQ(row, theirs.rows());
  EXPECT_LT(worst_residual, 1e-9);
  EXPECT_LT(worst_jacobian, 1e-9);
  RecordProperty("worst_residual_px", std::to_string(worst_residual * 1e12) + "e-12");
  RecordProperty("worst_jacobian", std::to_string(worst_jacobian * 1e12) + "e-12");
}

Observations MrcalOverpass::split_by_weight(std::vector<double>& view_weights) const {
  Observations split;
  split.placement_count = observations_.placement_count;
  for (const CornerView& view : observations_.corners) {
    std::map<double, CornerView> by_weight;
    for (int i = 0; i < kPoints; ++i) {
      const double w = weight(view, i);
      if (w < 0) continue;
      CornerView& part = by_weight[w];
      part.placement = view.placement;
      part.corners.push_back(i);
      part.pixels.push_back(view.pixels[static_cast<std::size_t>(i)]);
    }
    for (const auto& [w, part] : by_weight) {
      split.corners.push_back(part);
      view_weights.push_back(w);
    }
  }
  return split;
}

// mrcal's regularization as a prior: each of its measurements is linear in one lens parameter.
Prior regularization(const CalibrationState& state, const Eigen::VectorXd& x, const Eigen::MatrixXd& jacobian) {
  std::vector<PriorTerm> terms;
  std::vector<double> about = state.rig.sensors[0].lens.parameters();
  Eigen::VectorXd variance(x.size());
  for (Eigen::Index i = 0; i < x.size(); ++i) {
    Eigen::Index parameter = 0;
    jacobian.row(i).cwiseAbs().maxCoeff(&parameter);
    const double slope = jacobian(i, parameter);
    terms.push_back({{BlockId::Kind::lens, 0}, static_cast<int>(parameter)});
    about[static_cast<std::size_t>(parameter)] -= x[i] / slope;
    variance[i] = 1 / (slope * slope);
  }
  CalibrationState mean = state;
  mean.rig.sensors[0].lens = state.rig.sensors[0].lens.with_parameters(about);
  return Prior::create("regularization", terms, mean, variance.asDiagonal()).value();
}

// What mrcal minimises, in our terms.
struct MrcalOverpass::Problem {
  Observations split;
  std::vector<std::unique_ptr<View>> views;
  std::vector<ViewWeights> weights;
  std::vector<Prior> priors;

  JointProblem joint() const { return {views, weights, priors, 2}; }
  Parameters parameters(const CalibrationState& state) const {
    return {state, views, {{BlockId::Kind::mount, 0}, {BlockId::Kind::scale, 0}}};
  }
};

std::unique_ptr<const MrcalOverpass::Problem> MrcalOverpass::problem() const {
  auto problem = std::make_unique<Problem>();
  std::vector<double> view_weights;
  problem->split = split_by_weight(view_weights);
  for (std::size_t v = 0; v < view_weights.size(); ++v) {
    problem->weights.push_back(
        {1 / view_weights[v], 1, std::vector<char>(problem->split.corners[v].corners.size(), 1)});
  }
  problem->views = make_views(problem->split, state_.board_of);
  problem->priors = {regularization(state_, matrix("regularization_x").row(0).transpose(), matrix("regularization_J"))};
  return problem;
}

// In mrcal's order and units: lens, warp and two frames.
void MrcalOverpass::expect_same_covariance() const {
  const auto of_mrcal = problem();
  const auto covariance = joint_covariance(of_mrcal->joint(), of_mrcal->parameters(state_), state_);
  ASSERT_TRUE(covariance) << covariance.error().message;
  const Eigen::MatrixXd ours = covariance->of({{BlockId::Kind::lens, 0},
                                               {BlockId::Kind::warp, 0},
                                               {BlockId::Kind::placement, 0},
                                               {BlockId::Kind::placement, 100}},
                                              state_);
  const Eigen::MatrixXd theirs = matrix("covariance");
  ASSERT_EQ(ours.rows(), theirs.rows());
  const int lens = state_.rig.sensors[0].lens.parameter_count();
  Eigen::MatrixXd tangents = Eigen::MatrixXd::Identity(ours.rows(), ours.cols());
  tangents.block<3, 3>(lens + 2, lens + 2) = left_jacobian(rotations_[0]);
  tangents.block<3, 3>(lens + 8, lens + 8) = left_jacobian(rotations_[100]);
  const Eigen::VectorXd sigmas = ours.diagonal().cwiseSqrt();
  const Eigen::MatrixXd difference = ours - tangents * theirs * tangents.transpose();
  const double worst = difference.cwiseQuotient(sigmas * sigmas.transpose()).cwiseAbs().maxCoeff();
  EXPECT_LT(worst, 1e-6);
  RecordProperty("worst_covariance", std::to_string(worst * 1e9) + "e-9");
}

// What our minimiser comes to from there.
Expected<double> MrcalOverpass::least_cost(const CalibrationState& start) const {
  const auto of_mrcal = problem();
  const auto minimum = joint_minimum(of_mrcal->joint(), of_mrcal->parameters(start), start);
  if (!minimum) return tl::unexpected(minimum.error());
  return minimum->sum_of_squares;
}

TEST_F(MrcalOverpass, ResidualsJacobianAndCovarianceAreMrcals) {
  load("opencv8-0.cameramodel", 1, "covariance");
  if (IsSkipped() || HasFatalFailure()) return;
  expect_same_residuals_and_jacobian(1, 0);
  expect_same_covariance();
}

TEST_F(MrcalOverpass, ResidualsAndJacobianOfASplinedLensAreMrcals) {
  load("splined-0.cameramodel", 20);
  if (!IsSkipped() && !HasFatalFailure()) expect_same_residuals_and_jacobian(20, 4);
}

TEST_F(MrcalOverpass, OurSolveFromMrcalsSolutionCostsNoMore) {
  load("opencv8-0.cameramodel", 186, "solved");
  if (IsSkipped() || HasFatalFailure()) return;
  const auto cost = least_cost(state_);
  ASSERT_TRUE(cost) << cost.error().message;
  RecordProperty("cost_ours", std::to_string(*cost));
  RecordProperty("cost_mrcal", std::to_string(matrix("cost")(0, 0)));
  EXPECT_LE(*cost, matrix("cost")(0, 0) * (1 + 1e-9));
}

// Focal lengths 2 % off, distortion 10 %, the principal point in the image's middle, poses half a degree and a
// centimetre, the board flat.
TEST_F(MrcalOverpass, OurSolveFromADisturbedStartCostsNoMore) {
  load("opencv8-0.cameramodel", 186, "solved");
  if (IsSkipped() || HasFatalFailure()) return;
  CalibrationState start = state_;
  Lens& lens = start.rig.sensors[0].lens;
  std::vector<double> parameters = lens.parameters();
  for (std::size_t i = 0; i < parameters.size(); ++i) parameters[i] *= i < 2 ? 1.02 : 0.9;
  parameters[2] = 3007.5;
  parameters[3] = 2007.5;
  lens = lens.with_parameters(parameters);
  start.boards[0].warp_mm.setZero();
  std::mt19937 generator(3);
  std::normal_distribution<double> noise(0, 0.01);
  for (Pose& pose : start.world_from_board) {
    pose = retract(pose, Vector6d::NullaryExpr([&](Eigen::Index) { return noise(generator); }));
  }
  const auto cost = least_cost(start);
  ASSERT_TRUE(cost) << cost.error().message;
  RecordProperty("cost_ours", std::to_string(*cost));
  EXPECT_LE(*cost, matrix("cost")(0, 0) * (1 + 1e-9));
}

// Nothing of mrcal's but the observations: our calibration of all views from its closed forms, through this wide
// lens, with its gate and sigma.
TEST_F(MrcalOverpass, OurSolveFromOurOwnStartCostsNoMore) {
  load("opencv8-0.cameramodel", 186, "solved");
  if (IsSkipped() || HasFatalFailure()) return;
  const Lens& lens = state_.rig.sensors[0].lens;
  CalibrationData data;
  data.sensors = {{"camera", SensorKind::camera, lens.size(), lens.model()}};
  data.boards = {{"board", {kSide, kSide, matrix("spacing")(0, 0)}, {}}};
  data.board_of = state_.board_of;
  data.observations = observations_;
  for (std::size_t v = 0; v < observations_.corners.size(); ++v) data.placement_names.push_back(std::to_string(v));
  // Where it arrives must not hang on what little decides of single corners.
  for (const double gate : {16.0, 15.92, 16.08}) {
    CalibrationOptions options;
    options.bundle.threads = 2;
    options.bundle.gate = gate;
    const auto calibration = calibrate(data, options);
    ASSERT_TRUE(calibration) << calibration.error().message;
    EXPECT_TRUE(calibration->bundle.settled) << gate;
    EXPECT_LT(calibration->bundle.groups.front().rms_px, 0.7) << gate;
    const auto cost = least_cost(calibration->bundle.state);
    ASSERT_TRUE(cost) << cost.error().message;
    RecordProperty("cost_ours", std::to_string(*cost));
    EXPECT_LE(*cost, matrix("cost")(0, 0) * (1 + 1e-9)) << gate;
  }
}

}  // namespace
}  // namespace crumple
