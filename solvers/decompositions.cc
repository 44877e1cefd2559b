#include "solvers/decompositions.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <Eigen/SVD>

namespace crumple {

SymmetricEigen symmetric_eigen(const Eigen::MatrixXd& matrix) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(matrix);
  return {eigen.eigenvalues(), eigen.eigenvectors()};
}

DominantEigen dominant_eigen(const Eigen::MatrixXd& matrix) {
  constexpr int kFewestProducts = 20;  // an eigenvector below the largest could be met by chance
  constexpr int kMostProducts = 1000;
  constexpr double kNear = 1e-2;  // |A v - value v| bounds how far an eigenvalue is
  // A start with no structure has a part along every eigenvector, of uncoupled variables as well.
  const Eigen::VectorXd start =
      Eigen::VectorXd::NullaryExpr(matrix.rows(), [](Eigen::Index i) { return std::cos(static_cast<double>(i * i)); });
  DominantEigen dominant{0, start.normalized()};
  for (int i = 0; i < kMostProducts; ++i) {
    const Eigen::VectorXd product = matrix * dominant.vector;
    dominant.value = dominant.vector.dot(product);
    const bool near = (product - dominant.value * dominant.vector).norm() <= kNear * dominant.value;
    if (near && i >= kFewestProducts) break;
    dominant.vector = product.stableNormalized();
  }
  return dominant;
}

SymmetricEigen2 symmetric_eigen2(const Eigen::Matrix2d& matrix) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> eigen(matrix);
  return {eigen.eigenvalues(), eigen.eigenvectors()};
}

SymmetricEigen3 symmetric_eigen3(const Eigen::Matrix3d& matrix) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(matrix);
  return {eigen.eigenvalues(), eigen.eigenvectors()};
}

RightSingular right_singular(const Eigen::MatrixXd& matrix) {
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(matrix, Eigen::ComputeFullV);
  return {svd.singularValues(), svd.matrixV()};
}

OrthogonalTriangular orthogonal_triangular(const Eigen::MatrixXd& matrix) {
  const Eigen::HouseholderQR<Eigen::MatrixXd> qr(matrix);
  return {qr.householderQ(),
          qr.matrixQR().topRows(std::min(matrix.rows(), matrix.cols())).triangularView<Eigen::Upper>()};
}

Eigen::MatrixXd triangular_factor(const Eigen::MatrixXd& matrix) {
  const Eigen::HouseholderQR<Eigen::MatrixXd> qr(matrix);
  return qr.matrixQR().topRows(std::min(matrix.rows(), matrix.cols())).triangularView<Eigen::Upper>();
}

Eigen::MatrixXd eliminated(const Eigen::MatrixXd& matrix, Eigen::Index columns) {
  const Eigen::HouseholderQR<Eigen::MatrixXd> qr(matrix.leftCols(columns));
  Eigen::MatrixXd rest = matrix.rightCols(matrix.cols() - columns);
  rest.applyOnTheLeft(qr.householderQ().adjoint());
  return rest.bottomRows(std::max<Eigen::Index>(matrix.rows() - columns, 0));
}

Eigen::VectorXd least_squares(const Eigen::MatrixXd& matrix, const Eigen::VectorXd& right) {
  return matrix.completeOrthogonalDecomposition().solve(right);
}

Eigen::MatrixXd solve_symmetric(const Eigen::MatrixXd& matrix, const Eigen::MatrixXd& right) {
  return matrix.ldlt().solve(right);
}

std::optional<Eigen::VectorXd> solve_positive(const Eigen::MatrixXd& matrix, const Eigen::VectorXd& right) {
  const Eigen::LLT<Eigen::MatrixXd> llt(matrix);
  if (llt.info() != Eigen::Success) return std::nullopt;
  return llt.solve(right);
}

Eigen::MatrixXd inverse_positive(const Eigen::MatrixXd& matrix) {
  return matrix.llt().solve(Eigen::MatrixXd::Identity(matrix.rows(), matrix.cols()));
}

std::optional<Eigen::MatrixXd> inverse_cholesky_factor(const Eigen::MatrixXd& matrix) {
  const Eigen::LLT<Eigen::MatrixXd> llt(matrix);
  if (llt.info() != Eigen::Success) return std::nullopt;
  Eigen::MatrixXd inverse = Eigen::MatrixXd::Identity(matrix.rows(), matrix.cols());
  llt.matrixL().solveInPlace(inverse);
  return inverse;
}

Eigen::MatrixXd inverse_lower(const Eigen::MatrixXd& matrix) {
  Eigen::MatrixXd inverse = Eigen::MatrixXd::Identity(matrix.rows(), matrix.cols());
  matrix.triangularView<Eigen::Lower>().solveInPlace(inverse);
  return inverse;
}

Eigen::MatrixXd inverse_upper(const Eigen::MatrixXd& matrix) {
  Eigen::MatrixXd inverse = Eigen::MatrixXd::Identity(matrix.rows(), matrix.cols());
  matrix.triangularView<Eigen::Upper>().solveInPlace(inverse);
  return inverse;
}

std::optional<Eigen::MatrixXd> inverse_gram(const Eigen::MatrixXd& a, double least_pivot) {
  const Eigen::VectorXd scale = a.colwise().norm().transpose().cwiseInverse();
  if (!scale.allFinite()) return std::nullopt;
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(a * scale.asDiagonal());
  const Eigen::Index n = a.cols();
  if (std::abs(qr.matrixR()(n - 1, n - 1)) < least_pivot * std::abs(qr.matrixR()(0, 0))) return std::nullopt;
  const auto root = qr.matrixR().topLeftCorner(n, n).triangularView<Eigen::Upper>();
  const Eigen::MatrixXd inverse_root =
      scale.asDiagonal() * (qr.colsPermutation() * root.solve(Eigen::MatrixXd::Identity(n, n)));
  return inverse_root * inverse_root.transpose();
}

std::optional<Eigen::MatrixXd> inverse_information(const Eigen::MatrixXd& information, double least) {
  const Eigen::VectorXd scale = information.diagonal().cwiseSqrt().cwiseInverse();
  if (!scale.allFinite()) return std::nullopt;
  const SymmetricEigen eigen = symmetric_eigen(scale.asDiagonal() * information * scale.asDiagonal());
  if (!(eigen.values[0] > least)) return std::nullopt;
  const Eigen::MatrixXd rows =
      scale.asDiagonal() * eigen.vectors * eigen.values.cwiseSqrt().cwiseInverse().asDiagonal();
  return Eigen::MatrixXd(rows * rows.transpose());
}

}  // namespace crumple
