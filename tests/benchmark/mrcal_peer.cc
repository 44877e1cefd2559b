#include "tests/benchmark/mrcal_peer.h"

#include <fstream>
#include <sstream>
#include <stdexcept>

#include "tests/python.h"

namespace crumple {
namespace {

constexpr double kMetresPerMm = 1e-3;  // mrcal scales its unknowns for metres

template <typename T>
void write(const std::filesystem::path& file, const std::vector<T>& values) {
  std::ofstream(file, std::ios::binary)
      .write(reinterpret_cast<const char*>(values.data()), static_cast<std::streamsize>(values.size() * sizeof(T)));
}

void append(const Pose& pose, std::vector<double>& values) {
  const Eigen::Vector3d turn = rotation_vector(pose.rotation), shift = kMetresPerMm * pose.translation;
  values.insert(values.end(), turn.begin(), turn.end());
  values.insert(values.end(), shift.begin(), shift.end());
}

}  // namespace

MrcalPeer::MrcalPeer(const Campaign& campaign, int corners) {
  const CalibrationState& start = campaign.start;
  std::vector<double> pixels, lenses, mounts, placements;
  for (const CornerView& view : campaign.observations.corners) {
    for (const Eigen::Vector2d& pixel : view.pixels) pixels.insert(pixels.end(), pixel.begin(), pixel.end());
  }
  for (const Sensor& sensor : start.rig.sensors) {
    lenses.insert(lenses.end(), sensor.lens.parameters().begin(), sensor.lens.parameters().end());
    append(sensor.sensor_from_mount, mounts);
  }
  for (const Pose& pose : start.world_from_board) append(pose, placements);
  write<std::int64_t>(folder_ / "sizes", {static_cast<std::int64_t>(start.rig.sensors.size()),
                                          static_cast<std::int64_t>(start.world_from_board.size()), corners, 1});
  write(folder_ / "pixels", pixels);
  write(folder_ / "lenses", lenses);
  write(folder_ / "mounts", mounts);
  write(folder_ / "placements", placements);
  const Eigen::Vector2d warp = kMetresPerMm * start.boards[0].warp_mm;
  write<double>(folder_ / "warp", {warp.x(), warp.y()});
}

std::string MrcalPeer::said(const std::string& task) const {
  static const std::string script = content_of(CRUMPLE_SOURCE_DIR "/tests/benchmark/mrcal_solve.py");
  return run_python(script, task + ":" + folder_.path().string());
}

PeerSolve MrcalPeer::solve() const {
  const std::string answer = said("solve");
  PeerSolve solve;
  if (!(std::istringstream(answer) >> solve.seconds >> solve.cost)) throw std::runtime_error("mrcal: " + answer);
  return solve;
}

Prior MrcalPeer::regularisation(const CalibrationState& state) const {
  const std::string answer = said("prior");
  std::istringstream text(answer);
  CalibrationState about = state;
  std::vector<PriorTerm> terms;
  std::vector<double> variances;
  std::size_t camera = 0, parameter = 0;
  for (double mean = 0, sigma = 0; text >> camera >> parameter >> mean >> sigma;) {
    Lens& lens = about.rig.sensors.at(camera).lens;
    std::vector<double> parameters = lens.parameters();
    parameters.at(parameter) = mean;
    lens = lens.with_parameters(parameters);
    terms.push_back({{BlockId::Kind::lens, camera}, static_cast<int>(parameter)});
    variances.push_back(sigma * sigma);
  }
  if (terms.empty() || !text.eof()) throw std::runtime_error("mrcal: " + answer);
  const Eigen::Map<const Eigen::VectorXd> diagonal(variances.data(), static_cast<Eigen::Index>(variances.size()));
  return Prior::create("mrcal's regularisation", terms, about, diagonal.asDiagonal()).value();
}

PeerUncertainty MrcalPeer::uncertainty(std::size_t camera, int columns, int rows, double distance_mm,
                                       bool regularised) const {
  write<double>(folder_ / "request", {static_cast<double>(camera), static_cast<double>(columns),
                                      static_cast<double>(rows), kMetresPerMm * distance_mm, regularised ? 1.0 : 0.0});
  const std::string answer = said("uncertainty");
  std::istringstream text(answer);
  PeerUncertainty map;
  text >> map.seconds;
  for (Eigen::Matrix2d cell; text >> cell(0, 0) >> cell(0, 1) >> cell(1, 0) >> cell(1, 1);) {
    map.covariance_px2.push_back(cell);
  }
  if (map.covariance_px2.size() != static_cast<std::size_t>(columns * rows)) {
    throw std::runtime_error("mrcal: " + answer);
  }
  return map;
}

}  // namespace crumple
