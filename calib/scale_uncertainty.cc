#include "calib/scale_uncertainty.h"

#include <algorithm>
#include <map>
#include <set>

namespace crumple {
namespace {

// The lengths among the rig's parameters, by name.
std::map<std::string, double> lengths_mm(const CalibrationState& state) {
  std::map<std::string, double> lengths;
  for (const Sensor& sensor : state.rig.sensors) {
    const Eigen::Vector3d& t = sensor.sensor_from_probe.translation;
    lengths[sensor.name + ".translation_x"] = t.x();
    lengths[sensor.name + ".translation_y"] = t.y();
    lengths[sensor.name + ".translation_z"] = t.z();
  }
  for (const Board& board : state.boards) {
    lengths[board.name + ".warp_x"] = board.warp_mm.x();
    lengths[board.name + ".warp_y"] = board.warp_mm.y();
  }
  return lengths;
}

}  // namespace

std::optional<ScaleUncertainty> scale_uncertainty(const std::vector<BoardSpec>& boards,
                                                  const std::vector<std::size_t>& board_of,
                                                  const std::optional<Temperature>& capture) {
  std::optional<ScaleUncertainty> largest;
  for (const std::size_t b : std::set<std::size_t>(board_of.begin(), board_of.end())) {
    const BoardSpec& board = boards[b];
    if (!board.certificate) return std::nullopt;
    const double relative = scale_prior(*board.certificate, board.target.pitch_mm, capture).sigma;
    if (!largest || relative > largest->relative) {
      largest = ScaleUncertainty{relative, missing_in(*board.certificate, capture)};
    }
  }
  return largest;
}

RigCovariance with_scale_uncertainty(const RigCovariance& covariance, const CalibrationState& state, double relative) {
  const std::map<std::string, double> lengths = lengths_mm(state);
  const auto size = covariance.matrix.rows();
  Eigen::VectorXd derivative = Eigen::VectorXd::Zero(size + 1);
  for (Eigen::Index i = 0; i < size; ++i) {
    const auto length = lengths.find(covariance.names[static_cast<std::size_t>(i)]);
    if (length != lengths.end()) derivative[i] = length->second;
  }
  derivative[size] = 1;
  RigCovariance result{covariance.names, relative * relative * derivative * derivative.transpose()};
  result.names.emplace_back("scale");
  result.matrix.topLeftCorner(size, size) += covariance.matrix;
  return result;
}

}  // namespace crumple
