// Dense decompositions of matrices whose size is known at run time only, compiled once: Eigen's templates cost every
// file that instantiates them 10 to 50 s of compile time.
#pragma once

#include <Eigen/Core>

namespace crumple {

struct SymmetricEigen {
  Eigen::VectorXd values;   // ascending
  Eigen::MatrixXd vectors;  // unit columns, in the values' order
};

// Reads the lower triangle only.
SymmetricEigen symmetric_eigen(const Eigen::MatrixXd& matrix);

struct RightSingular {
  Eigen::VectorXd values;   // descending; min(rows, columns) of them
  Eigen::MatrixXd vectors;  // a full orthonormal basis of the column space's domain: matrix = U diag(values) vectors'
};

RightSingular right_singular(const Eigen::MatrixXd& matrix);

// R of matrix = Q R, upper triangular: min(rows, columns) rows.
Eigen::MatrixXd triangular_factor(const Eigen::MatrixXd& matrix);

// The matrix after reflections that leave nothing of its first columns below as many rows: without both.
Eigen::MatrixXd eliminated(const Eigen::MatrixXd& matrix, Eigen::Index columns);

// The x that minimises |matrix x - right|, and |x| where several do (complete orthogonal decomposition).
Eigen::VectorXd least_squares(const Eigen::MatrixXd& matrix, const Eigen::VectorXd& right);

// The solution of matrix x = right for a symmetric matrix that is positive or negative semidefinite (LDLT).
Eigen::MatrixXd solve_symmetric(const Eigen::MatrixXd& matrix, const Eigen::MatrixXd& right);

}  // namespace crumple
