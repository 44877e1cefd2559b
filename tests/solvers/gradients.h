// Central differences, for checking analytic derivatives.
#pragma once

#include <Eigen/Core>

namespace crumple {

// The derivative of f: R^n -> R^m at x, with a step that suits values of about `scale`.
template <typename Function>
Eigen::MatrixXd central_differences(const Function& f, const Eigen::VectorXd& x, double step = 1e-6) {
  Eigen::MatrixXd jacobian;
  for (int i = 0; i < x.size(); ++i) {
    Eigen::VectorXd forward = x, backward = x;
    const double h = step * std::max(1.0, std::abs(x[i]));
    forward[i] += h;
    backward[i] -= h;
    const Eigen::VectorXd column =
        (Eigen::VectorXd(f(forward)) - Eigen::VectorXd(f(backward))) / (forward[i] - backward[i]);
    if (i == 0) jacobian.resize(column.size(), x.size());
    jacobian.col(i) = column;
  }
  return jacobian;
}

// The same to fourth order in the step, which may then be as large as rounding wants it.
template <typename Function>
Eigen::MatrixXd fourth_order_differences(const Function& f, const Eigen::VectorXd& x, double step) {
  return (4 * central_differences(f, x, step) - central_differences(f, x, 2 * step)) / 3;
}

}  // namespace crumple
