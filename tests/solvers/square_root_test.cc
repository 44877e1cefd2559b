#include "solvers/square_root.h"

#include <Eigen/LU>
#include <Eigen/QR>
#include <gtest/gtest.h>

#include "solvers/covariance.h"
#include "tests/solvers/synthetic.h"

namespace crumple {
namespace {

const BlockId kFirstLens{BlockId::Kind::lens, 0};
const BlockId kThirdPlacement{BlockId::Kind::placement, 2};

// One refinement at its truth. The priors are of all sorts: of a lens, and of a placement together with a lens.
struct RootProblem {
  explicit RootProblem(const char* model)
      : made(make_synthetic({.placements = 6, .corner_sigma_px = 0.2, .model = model, .warp_mm = {0.6, -0.4}})),
        views(make_views(made.observations, made.truth.board_of)),
        parameters(made.truth, views, {{BlockId::Kind::mount, 0}, {BlockId::Kind::scale, 0}}) {
    const Eigen::Vector3d sigma(1e-3, 2, 3e-2);
    priors.push_back(Prior::create("some", {{kThirdPlacement, 1}, {kFirstLens, 3}, {kThirdPlacement, 4}}, made.truth,
                                   sigma.cwiseAbs2().asDiagonal())
                         .value());
    priors.push_back(Prior::create("fx", {{kFirstLens, 0}}, made.truth, Eigen::MatrixXd::Constant(1, 1, 4)).value());
  }

  NormalEquations::Evaluate evaluate() const {
    return
        [this](std::size_t v, ViewEvaluation& evaluation) { return views[v]->evaluate(made.truth, true, evaluation); };
  }
  NormalEquations equations() const {
    NormalEquations equations = NormalEquations::of(views, parameters, evaluate(), 1).value();
    for (const Prior& prior : priors) equations.add(prior, made.truth);
    return equations;
  }

  Synthetic made;
  std::vector<std::unique_ptr<View>> views;
  Parameters parameters;
  std::vector<Prior> priors;
};

// The whole Jacobian, dense.
class Whole {
 public:
  explicit Whole(const RootProblem& problem) : parameters_(problem.parameters), rows_(0, problem.parameters.size()) {
    for (std::size_t v = 0; v < problem.views.size(); ++v) {
      ViewEvaluation evaluation;
      problem.evaluate()(v, evaluation);
      add(evaluation.jacobian * evaluation.local_from_blocks, problem.views[v]->blocks());
    }
    for (const Prior& prior : problem.priors) {
      const WhitenedPrior whitened = prior.evaluate(problem.made.truth);
      Eigen::MatrixXd rows(whitened.residuals.size(), 0);
      for (const RowMajorMatrix& block : whitened.jacobians) {
        rows.conservativeResize(Eigen::NoChange, rows.cols() + block.cols());
        rows.rightCols(block.cols()) = block;
      }
      add(rows, prior.blocks());
    }
  }

  // (J'J)^-1 of the common parameters, by a QR factor with pivoting.
  Eigen::MatrixXd covariance() const {
    const Eigen::VectorXd scale = rows_.colwise().norm().transpose().cwiseInverse();
    const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(rows_ * scale.asDiagonal());
    const Eigen::Index n = rows_.cols(), common = parameters_.common_size();
    const auto root = qr.matrixR().topLeftCorner(n, n).triangularView<Eigen::Upper>();
    const Eigen::MatrixXd inverse =
        scale.asDiagonal() * (qr.colsPermutation() * root.solve(Eigen::MatrixXd::Identity(n, n)));
    return (inverse * inverse.transpose()).topLeftCorner(common, common);
  }

 private:
  void add(const Eigen::MatrixXd& by_blocks, const std::vector<BlockId>& blocks) {
    rows_.conservativeResize(rows_.rows() + by_blocks.rows(), Eigen::NoChange);
    rows_.bottomRows(by_blocks.rows()).setZero();
    for (const Parameters::Span& span : parameters_.spans(blocks)) {
      const int column = span.slot ? parameters_.common_size() + 6 * static_cast<int>(*span.slot) : span.common_offset;
      rows_.block(rows_.rows() - by_blocks.rows(), column, by_blocks.rows(), span.size) =
          by_blocks.middleCols(span.column, span.size);
    }
  }

  const Parameters& parameters_;
  Eigen::MatrixXd rows_;
};

// The largest difference, in standard deviations.
double apart(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  const Eigen::VectorXd scale = b.diagonal().cwiseSqrt().cwiseInverse();
  return (scale.asDiagonal() * (a - b) * scale.asDiagonal()).cwiseAbs().maxCoeff();
}

TEST(SquareRoot, SquaredIsTheReducedInformation) {
  const RootProblem problem("LENSMODEL_OPENCV4");
  const Eigen::MatrixXd root =
      reduced_square_root(problem.views, problem.parameters, problem.evaluate(), problem.priors, problem.made.truth, 1);
  EXPECT_TRUE(root.isUpperTriangular());
  EXPECT_LT(apart((root.transpose() * root).inverse(), Whole(problem).covariance()), 1e-9);
}

TEST(SquareRoot, TheSameBitsAtAnyThreadCount) {
  const RootProblem problem("LENSMODEL_OPENCV8");
  const auto at = [&](int threads) {
    return reduced_square_root(problem.views, problem.parameters, problem.evaluate(), problem.priors,
                               problem.made.truth, threads);
  };
  EXPECT_EQ(at(1), at(3));
}

// Rational lenses that a prior hardly holds: squaring the Jacobian costs more digits than a covariance should lose.
TEST(Covariance, SharpenedHasTheDigitsThatSquaringCosts) {
  RootProblem problem("LENSMODEL_OPENCV8");
  for (const std::size_t sensor : {0U, 1U}) {
    const BlockId lens{BlockId::Kind::lens, sensor};
    problem.priors.push_back(Prior::create("weak", {{lens, 9}, {lens, 10}, {lens, 11}}, problem.made.truth,
                                           Eigen::Vector3d(1e2, 1e4, 1e6).asDiagonal())
                                 .value());
  }
  auto covariance = JointCovariance::create(problem.equations(), problem.made.truth);
  ASSERT_TRUE(covariance) << covariance.error().message;
  const Eigen::MatrixXd expected = Whole(problem).covariance();
  EXPECT_GT(apart(covariance->common(), expected), 1e-8);
  covariance->sharpen(problem.views, problem.evaluate(), problem.priors, problem.made.truth, 2);
  EXPECT_LT(apart(covariance->common(), expected), 1e-10);
}

}  // namespace
}  // namespace crumple
