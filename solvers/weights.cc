#include "solvers/weights.h"

#include <cmath>

namespace crumple {

void whiten(const View& view, const ViewWeights& weights, ViewEvaluation& evaluation) {
  evaluation.residuals /= weights.sigma_px;
  for (RowMajorMatrix& jacobian : evaluation.jacobians) jacobian /= weights.sigma_px;
  const int d = view.dimension();
  for (int i = 0; i < view.size(); ++i) {
    if (weights.inlier[static_cast<std::size_t>(i)]) continue;
    evaluation.residuals.segment(d * i, d).setZero();
    for (RowMajorMatrix& jacobian : evaluation.jacobians) jacobian.middleRows(d * i, d).setZero();
  }
}

void discount(const ViewWeights& weights, ViewEvaluation& evaluation) {
  const double scale = 1 / std::sqrt(weights.inflation);
  evaluation.residuals *= scale;
  for (RowMajorMatrix& jacobian : evaluation.jacobians) jacobian *= scale;
}

void robustify(const View& view, double cauchy_scale, ViewEvaluation& evaluation) {
  const int d = view.dimension();
  const double c2 = cauchy_scale * cauchy_scale;
  for (int i = 0; i < view.size(); ++i) {
    auto r = evaluation.residuals.segment(d * i, d);
    const double s = r.squaredNorm();
    const bool small = s < 1e-6 * c2;
    const double rho = c2 * std::log1p(s / c2);
    const double g = small ? 1 - s / (4 * c2) : std::sqrt(rho / s);
    const double dg_ds = small ? -1 / (4 * c2) : (s / (1 + s / c2) - rho) / (2 * g * s * s);
    const Eigen::MatrixXd d_tamed = g * Eigen::MatrixXd::Identity(d, d) + 2 * dg_ds * r * r.transpose();
    for (RowMajorMatrix& jacobian : evaluation.jacobians) {
      jacobian.middleRows(d * i, d) = (d_tamed * jacobian.middleRows(d * i, d)).eval();
    }
    r *= g;
  }
}

}  // namespace crumple
