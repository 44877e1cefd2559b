// The triangular square root of the reduced normal equations, R'R = S = A - sum_j B_j D_j^-1 B_j' of
// solvers/normal_equations.h, from the whitened Jacobian itself.
//
// Squares lose digits: with normal equations of condition 1e9 a covariance is known to 1e-7, where the Jacobian, whose
// condition is the root of that, would give it to 1e-11. Orthogonal transformations keep them: each view's Jacobian is
// brought to a triangle, each pose's triangles are stacked and the pose eliminated by reflections, and what
// is left is brought to a triangle together (Golub & Van Loan, Matrix Computations, section 5.3; Bjorck, Numerical
// Methods for Least Squares Problems, section 6.3). This costs several times what the normal equations do.
//
// The same bits at any number of threads.
#pragma once

#include <memory>
#include <vector>

#include "solvers/normal_equations.h"

namespace crumple {

// Rows and columns as the common parameters. Precondition: every view is predicted; a prior's pose, if it has one,
// has views.
Eigen::MatrixXd reduced_square_root(const std::vector<std::unique_ptr<View>>& views, const Parameters& parameters,
                                    const NormalEquations::Evaluate& evaluate, const std::vector<Prior>& priors,
                                    const CalibrationState& state, int threads);

}  // namespace crumple
