// Dense decompositions, compiled once: Eigen's templates cost every file that instantiates them 3 to 50 s of compile
// time.
#pragma once

#include <optional>

#include <Eigen/Core>

namespace crumple {

struct SymmetricEigen {
  Eigen::VectorXd values;   // ascending
  Eigen::MatrixXd vectors;  // unit columns, in the values' order
};

// Reads the lower triangle only.
SymmetricEigen symmetric_eigen(const Eigen::MatrixXd& matrix);

struct DominantEigen {
  double value = 0;
  Eigen::VectorXd vector;  // of unit length; where others nearly are the largest too, one of their space
};

// The largest eigenvalue of a symmetric positive semidefinite matrix, to a hundredth, by power iteration; where others
// are that near, one of them.
DominantEigen dominant_eigen(const Eigen::MatrixXd& matrix);

struct SymmetricEigen3 {
  Eigen::Vector3d values;
  Eigen::Matrix3d vectors;
};

struct SymmetricEigen2 {
  Eigen::Vector2d values;
  Eigen::Matrix2d vectors;
};
SymmetricEigen2 symmetric_eigen2(const Eigen::Matrix2d& matrix);

SymmetricEigen3 symmetric_eigen3(const Eigen::Matrix3d& matrix);

struct RightSingular {
  Eigen::VectorXd values;   // descending; min(rows, columns) of them
  Eigen::MatrixXd vectors;  // a full orthonormal basis of the column space's domain: matrix = U diag(values) vectors'
};

RightSingular right_singular(const Eigen::MatrixXd& matrix);

struct OrthogonalTriangular {
  Eigen::MatrixXd q;  // square and orthonormal
  Eigen::MatrixXd r;  // upper triangular: min(rows, columns) rows
};

OrthogonalTriangular orthogonal_triangular(const Eigen::MatrixXd& matrix);

// R of matrix = Q R, upper triangular: min(rows, columns) rows.
Eigen::MatrixXd triangular_factor(const Eigen::MatrixXd& matrix);

// The matrix after reflections that leave nothing of its first columns below as many rows: without both.
Eigen::MatrixXd eliminated(const Eigen::MatrixXd& matrix, Eigen::Index columns);

// The x that minimises |matrix x - right|, and |x| where several do (complete orthogonal decomposition).
Eigen::VectorXd least_squares(const Eigen::MatrixXd& matrix, const Eigen::VectorXd& right);

// The solution of matrix x = right for a symmetric matrix that is positive or negative semidefinite (LDLT).
Eigen::MatrixXd solve_symmetric(const Eigen::MatrixXd& matrix, const Eigen::MatrixXd& right);

// The inverse of a positive definite matrix whose rows have different units, by the eigenvalues of the matrix scaled to
// a unit diagonal; none where the least of these does not exceed `least`.
std::optional<Eigen::MatrixXd> inverse_information(const Eigen::MatrixXd& information, double least);

// The solution of matrix x = right for a symmetric matrix (LLT); none where it is not positive definite to rounding.
std::optional<Eigen::VectorXd> solve_positive(const Eigen::MatrixXd& matrix, const Eigen::VectorXd& right);

// Of a symmetric positive definite matrix (LLT).
Eigen::MatrixXd inverse_positive(const Eigen::MatrixXd& matrix);

// L^-1 of matrix = L L' with L lower triangular; none where it is not positive definite to rounding.
std::optional<Eigen::MatrixXd> inverse_cholesky_factor(const Eigen::MatrixXd& matrix);

// Read one triangle only, and give one.
Eigen::MatrixXd inverse_lower(const Eigen::MatrixXd& matrix);
Eigen::MatrixXd inverse_upper(const Eigen::MatrixXd& matrix);

// (A'A)^-1 by the column-pivoting QR of A with its columns scaled to unit length; none where the last pivot is below
// `least_pivot` of the first.
std::optional<Eigen::MatrixXd> inverse_gram(const Eigen::MatrixXd& a, double least_pivot);

}  // namespace crumple
