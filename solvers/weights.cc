#include "solvers/weights.h"

#include <cmath>

namespace crumple {

void whiten(const View& view, const ViewWeights& weights, ViewEvaluation& evaluation) {
  const double scale = 1 / weights.sigma_px;
  evaluation.residuals *= scale;
  evaluation.jacobian *= scale;
  const int d = view.dimension();
  for (int i = 0; i < view.size(); ++i) {
    if (weights.inlier[static_cast<std::size_t>(i)]) continue;
    evaluation.residuals.segment(d * i, d).setZero();
    if (evaluation.jacobian.rows() > 0) evaluation.jacobian.middleRows(d * i, d).setZero();
  }
}

void discount(const ViewWeights& weights, ViewEvaluation& evaluation) {
  if (weights.inflation == 1) return;
  const double scale = 1 / std::sqrt(weights.inflation);
  evaluation.residuals *= scale;
  evaluation.jacobian *= scale;
}

void robustify(const View& view, double cauchy_scale, ViewEvaluation& evaluation) {
  const int d = view.dimension();
  const double c2 = cauchy_scale * cauchy_scale;
  Eigen::RowVectorXd along;
  for (int i = 0; i < view.size(); ++i) {
    auto r = evaluation.residuals.segment(d * i, d);
    const double s = r.squaredNorm();
    const bool small = s < 1e-6 * c2;
    const double rho = c2 * std::log1p(s / c2);
    const double g = small ? 1 - s / (4 * c2) : std::sqrt(rho / s);
    const double dg_ds = small ? -1 / (4 * c2) : (s / (1 + s / c2) - rho) / (2 * g * s * s);
    if (evaluation.jacobian.rows() > 0) {
      auto jacobian = evaluation.jacobian.middleRows(d * i, d);
      along.noalias() = (2 * dg_ds) * (r.transpose() * jacobian);
      jacobian *= g;
      for (int k = 0; k < d; ++k) jacobian.row(k) += r[k] * along;
    }
    r *= g;
  }
}

}  // namespace crumple
