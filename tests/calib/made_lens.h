// Corners of a board all over the field of one camera with a given lens: what lens models are told apart by.
#pragma once

#include <random>
#include <string>
#include <vector>

#include "calib/calibrate.h"

namespace crumple {

struct MadeLens {
  CalibrationData data;
  CalibrationState truth;
};

inline MadeLens made_lens(const Lens& lens, const std::string& fitted_model, double sigma_px, unsigned seed) {
  constexpr int kPlacements = 12;
  std::mt19937_64 generator(seed);
  std::normal_distribution<double> normal;
  MadeLens made;
  made.truth.boards = {Board::grid(7, 5, 55)};
  made.truth.rig.sensors = {{"cam0", SensorKind::camera, lens, {}}};
  made.data.boards = {{"board", {7, 5, 55}, {}}};
  made.data.sensors = {{"cam0", SensorKind::camera, lens.size(), fitted_model}};
  const Eigen::Vector3d centre(165, 110, 0);
  for (int p = 0; p < kPlacements; ++p) {
    const double angle = 2.4 * p;
    Pose pose;
    pose.rotation = rotation_from_vector(0.45 * Eigen::Vector3d(std::cos(angle), std::sin(angle), 0.3 * (p % 2)));
    pose.translation =
        Eigen::Vector3d(150 * (p % 3 - 1), 110 * (p / 3 % 3 - 1), 480 + 40 * (p % 4)) - pose.rotation * centre;
    CornerView view{0, static_cast<std::size_t>(p), {}, {}};
    for (int i = 0; i < made.truth.boards[0].point_count(); ++i) {
      const auto pixel = lens.project(pose * made.truth.boards[0].point(i));
      const bool seen = pixel && (pixel->array() > 0).all() && pixel->x() < lens.size().width_px - 1 &&
                        pixel->y() < lens.size().height_px - 1;
      if (!seen) continue;
      const double x = sigma_px * normal(generator);
      view.corners.push_back(i);
      view.pixels.push_back(*pixel + Eigen::Vector2d(x, sigma_px * normal(generator)));
    }
    made.truth.world_from_board.push_back(pose);
    made.truth.board_of.push_back(0);
    made.data.board_of.push_back(0);
    made.data.placement_names.push_back("p" + std::to_string(p));
    made.data.observations.corners.push_back(std::move(view));
  }
  made.data.observations.placement_count = kPlacements;
  return made;
}

}  // namespace crumple
