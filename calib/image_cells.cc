#include "calib/image_cells.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Eigenvalues>

namespace crumple {
namespace {

struct CellSums {
  Eigen::Matrix2d information = Eigen::Matrix2d::Zero();  // sum n n' / sigma^2
  Eigen::Vector2d weighted = Eigen::Vector2d::Zero();     // sum n n' r / sigma^2
  double largest_sigma_px = 0;
};

void add(const PlacedResidual& residual, CellSums& sums) {
  const Eigen::Matrix2d along =
      residual.normal ? Eigen::Matrix2d(*residual.normal * residual.normal->transpose()) : Eigen::Matrix2d::Identity();
  const double variance_px2 = residual.sigma_px * residual.sigma_px;
  sums.information += along / variance_px2;
  sums.weighted += along * residual.residual_px / variance_px2;
  sums.largest_sigma_px = std::max(sums.largest_sigma_px, residual.sigma_px);
}

bool knows_both_coordinates(const CellSums& sums) {
  const double least = Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(sums.information).eigenvalues()[0];
  // Two readings across each other know as much as their share; rounding must not decide at the limit.
  return least * sums.largest_sigma_px * sums.largest_sigma_px > kLeastForMean - 1e-6;
}

}  // namespace

Eigen::Vector2d ImageCells::centre_px(std::size_t cell) const {
  const auto column = static_cast<double>(static_cast<int>(cell) % columns);
  const auto row = static_cast<double>(static_cast<int>(cell) / columns);
  return Eigen::Vector2d(column + 0.5, row + 0.5).cwiseProduct(cell_px) - Eigen::Vector2d::Constant(0.5);
}

ImageCells image_cells(const std::vector<PlacedResidual>& residuals, ImageSize size) {
  ImageCells grid;
  const double side_px = std::max(size.width_px, size.height_px) / kLongSideCells;
  grid.columns = std::max(1, static_cast<int>(std::lround(size.width_px / side_px)));
  grid.rows = std::max(1, static_cast<int>(std::lround(size.height_px / side_px)));
  grid.cell_px = {static_cast<double>(size.width_px) / grid.columns, static_cast<double>(size.height_px) / grid.rows};
  grid.cells.resize(static_cast<std::size_t>(grid.columns * grid.rows));
  std::vector<CellSums> sums(grid.cells.size());
  for (const PlacedResidual& residual : residuals) {
    if (!residual.accepted) continue;
    const Eigen::Vector2d place = (residual.pixel.array() + 0.5) / grid.cell_px.array();
    const int column = std::clamp(static_cast<int>(std::floor(place.x())), 0, grid.columns - 1);
    const int row = std::clamp(static_cast<int>(std::floor(place.y())), 0, grid.rows - 1);
    const auto cell = static_cast<std::size_t>(row * grid.columns + column);
    ++grid.cells[cell].observations;
    add(residual, sums[cell]);
  }
  double covered = 0, means = 0, square = 0, expected = 0;
  for (std::size_t c = 0; c < sums.size(); ++c) {
    if (grid.cells[c].observations > 0) ++covered;
    if (!knows_both_coordinates(sums[c])) continue;
    const Eigen::Matrix2d covariance = sums[c].information.inverse();
    grid.cells[c].mean_px = covariance * sums[c].weighted;
    ++means;
    square += grid.cells[c].mean_px->squaredNorm();
    expected += covariance.trace();
  }
  grid.covered = covered / static_cast<double>(sums.size());
  if (means > 0) grid.rms_mean_px = std::sqrt(square / means);
  if (means > 0) grid.expected_px = std::sqrt(expected / means);
  return grid;
}

}  // namespace crumple
