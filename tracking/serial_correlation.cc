#include "tracking/serial_correlation.h"

#include <algorithm>

namespace crumple {
namespace {

constexpr double kFallen = 0.1;

}  // namespace

int correlation_reach(const Eigen::MatrixXd& residuals) {
  const auto most = static_cast<int>(residuals.rows() / 4);
  const Eigen::RowVectorXd variance = residuals.colwise().squaredNorm();
  for (int lag = 1; lag < most; ++lag) {
    const Eigen::Index overlap = residuals.rows() - lag;
    const Eigen::RowVectorXd products =
        residuals.topRows(overlap).cwiseProduct(residuals.bottomRows(overlap)).colwise().sum();
    if (products.cwiseQuotient(variance).mean() < kFallen) return std::min(2 * (lag - 1), most);
  }
  return most;
}

Eigen::MatrixXd serial_covariance(const Eigen::MatrixXd& inverse_information, const Eigen::MatrixXd& scores,
                                  int reach) {
  Eigen::MatrixXd sum = scores.transpose() * scores;
  for (int lag = 1; lag <= reach; ++lag) {
    const Eigen::Index overlap = scores.rows() - lag;
    const Eigen::MatrixXd products = scores.topRows(overlap).transpose() * scores.bottomRows(overlap);
    sum += (1 - lag / (reach + 1.0)) * (products + products.transpose());
  }
  return inverse_information * sum * inverse_information;
}

}  // namespace crumple
