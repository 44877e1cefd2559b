#include "solvers/rig_covariance.h"

#include <algorithm>
#include <map>
#include <utility>

namespace crumple {

bool is_scale(const std::string& name) { return name.ends_with(".scale"); }

std::optional<Eigen::Index> find_row(const RigCovariance& covariance, const std::string& name) {
  const auto found = std::find(covariance.names.begin(), covariance.names.end(), name);
  if (found == covariance.names.end()) return std::nullopt;
  return static_cast<Eigen::Index>(found - covariance.names.begin());
}

Eigen::MatrixXd covariance_of(const RigCovariance& covariance, const std::vector<std::string>& names) {
  std::map<std::string, Eigen::Index> rows;
  for (const std::string& name : covariance.names) rows.emplace(name, static_cast<Eigen::Index>(rows.size()));
  std::vector<std::pair<Eigen::Index, Eigen::Index>> known;  // among the names, and in the covariance
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (const auto row = rows.find(names[i]); row != rows.end()) known.emplace_back(i, row->second);
  }
  const auto size = static_cast<Eigen::Index>(names.size());
  Eigen::MatrixXd result = Eigen::MatrixXd::Zero(size, size);
  for (const auto& [k, column] : known) {
    for (const auto& [i, row] : known) result(i, k) = covariance.matrix(row, column);
  }
  return result;
}

}  // namespace crumple
