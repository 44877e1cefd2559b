// The closed-form start of a calibration: every lens, every mount and every board pose.
//
//   1. Each camera: homographies board -> pixels, Zhang's intrinsics, board poses (solvers/closed_form/zhang.h). And,
//   as
//      strong distortion makes pinholes' poses wrong, poses by radial alignment about the image's middle
//      (solvers/closed_form/radial_alignment.h) with one focal length and up to three radial terms, of the numerator or
//      the denominator, linear once the poses are known. The start that reprojects best is taken.
//   2. Cameras are joined through the placements they share; the mean of the poses is the mount.
//   3. Each projector, the cameras being known: every pixel pair gives a board point and a projector pixel. Two forms:
//      the paper's (homographies board -> projector, Zhang again) and the resection of all placements' points at once,
//      which copes with an offset lens and few tilts; the one that reprojects better is taken. Views that contradict
//      most others, as of a station where camera and projector were out of step, have no part in it.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "solvers/observations.h"
#include "solvers/state.h"

namespace crumple {

struct SensorSpec {
  std::string name;
  SensorKind kind = SensorKind::camera;
  ImageSize size;
  std::string lens_model = "LENSMODEL_OPENCV5";
  Mount mount = Mount::probe;
  std::optional<std::size_t> lens_of = {};  // as Sensor's
  // Taken where boards that are all parallel do not tell it; without one there is no start then.
  std::optional<double> assumed_focal_px = {};
};

// Camera pixels on the board whose projector pixel is known, of one placement.
struct PixelPairs {
  std::size_t camera = 0;
  std::size_t projector = 0;
  std::size_t placement = 0;
  std::vector<Eigen::Vector2d> camera_pixels;
  std::vector<Eigen::Vector2d> projector_pixels;
  std::optional<std::size_t> station = {};  // as StripeView's
};

// The cameras and board poses. Sensors without corners keep an identity mount and a lens that only has the right size.
// The error says which camera lacks what; `placement_names` are for it.
Expected<CalibrationState> initial_cameras(const std::vector<SensorSpec>& sensors, const std::vector<Board>& boards,
                                           const std::vector<std::size_t>& board_of,
                                           const std::vector<CornerView>& corners,
                                           const std::vector<std::string>& placement_names);

// Sets the projectors' lenses and mounts in a state whose cameras and placements are known.
Expected<void> add_initial_projectors(const std::vector<PixelPairs>& pairs, CalibrationState& state);

}  // namespace crumple
