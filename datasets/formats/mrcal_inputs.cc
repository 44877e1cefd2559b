#include "datasets/formats/mrcal_inputs.h"

#include <algorithm>
#include <map>

#include <fmt/format.h>

#include "calib/lens_prior.h"
#include "datasets/formats/foreign_rig.h"
#include "datasets/npz_archive.h"

namespace crumple {
namespace {

// The corners of one view with the places of its camera and frame in mrcal's problem.
struct MrcalView {
  std::int32_t frame = 0;
  std::int32_t camera = 0;
  const RecordedCorners* corners = nullptr;
};

struct MrcalProblem {
  std::vector<Sensor> cameras;
  PlacedBoard board;
  std::vector<Pose> probe_from_board;  // by frame
  std::vector<MrcalView> views;        // by frame, then camera, as mrcal wants them
};

Expected<std::vector<Sensor>> cameras_for_mrcal(const Rig& rig) {
  std::vector<Sensor> cameras = cameras_of(rig);
  if (cameras.empty()) return fail("the rig has no camera");
  if (!is_at_reference(cameras.front())) return fail("the first camera is not the reference of the poses");
  for (const Sensor& camera : cameras) {
    if (camera.lens.model() == cameras.front().lens.model()) continue;
    return fail(fmt::format("mrcal solves for one lens model, and {} has {}, {} has {}", cameras.front().name,
                            cameras.front().lens.model(), camera.name, camera.lens.model()));
  }
  return cameras;
}

Expected<PlacedBoard> board_for_mrcal(const Placements& placements) {
  if (placements.boards.size() != 1) {
    return fail(fmt::format("mrcal solves for one board, and there are {}", placements.boards.size()));
  }
  const PlacedBoard& board = placements.boards.front();
  if (board.target.kind != TargetKind::chessboard && board.target.kind != TargetKind::charuco) {
    return fail(
        fmt::format("mrcal's boards have corners in rows and columns at one distance; this one is of the kind {}",
                    name_of(board.target.kind)));
  }
  return board;
}

Expected<std::vector<MrcalView>> views_for_mrcal(const CalibrationRecord& record, const std::vector<Sensor>& cameras,
                                                 std::vector<Pose>& probe_from_board) {
  if (!record.placements.stations.empty()) {
    return fail("the probe was moved about between trackers, which mrcal's inputs have no place for");
  }
  std::vector<MrcalView> views;
  for (const BoardPlacement& placement : record.placements.placements) {
    const std::size_t before = views.size();
    for (std::size_t c = 0; c < cameras.size(); ++c) {
      for (const RecordedCorners& view : record.corners) {
        if (view.placement != placement.name || view.camera != cameras[c].name) continue;
        views.push_back({static_cast<std::int32_t>(probe_from_board.size()), static_cast<std::int32_t>(c), &view});
      }
    }
    if (views.size() > before) probe_from_board.push_back(placement.world_from_board);
  }
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    const bool seen = std::any_of(views.begin(), views.end(),
                                  [&](const MrcalView& v) { return v.camera == static_cast<std::int32_t>(c); });
    if (!seen) return fail(fmt::format("the rig's folder holds no corners of {}", cameras[c].name));
  }
  return views;
}

Expected<MrcalProblem> problem_of(const RigToExport& source) {
  if (!source.record) {
    return fail("the rig's folder holds no observations (placements.yaml): calibrate anew, and export that rig");
  }
  MrcalProblem problem;
  auto cameras = cameras_for_mrcal(source.rig);
  if (!cameras) return tl::unexpected(cameras.error());
  auto board = board_for_mrcal(source.record->placements);
  if (!board) return tl::unexpected(board.error());
  problem.cameras = std::move(*cameras);
  problem.board = *board;
  auto views = views_for_mrcal(*source.record, problem.cameras, problem.probe_from_board);
  if (!views) return tl::unexpected(views.error());
  problem.views = std::move(*views);
  return problem;
}

void append_rt(const Pose& pose, double mm_per_unit, std::vector<double>& values) {
  const Eigen::Vector3d rotation = rotation_vector(pose.rotation);
  const Eigen::Vector3d translation = pose.translation / mm_per_unit;
  values.insert(values.end(), rotation.begin(), rotation.end());
  values.insert(values.end(), translation.begin(), translation.end());
}

// Weights by camera: 1 for the one whose corners are the most exact.
std::vector<double> weights_of(const std::vector<Sensor>& cameras, const std::map<std::string, double>& sigma_px) {
  std::vector<double> sigmas;
  for (const Sensor& camera : cameras) {
    const auto found = sigma_px.find(camera.name + ".corners");
    if (found == sigma_px.end()) return std::vector<double>(cameras.size(), 1.0);
    sigmas.push_back(found->second);
  }
  const double smallest = *std::min_element(sigmas.begin(), sigmas.end());
  for (double& sigma : sigmas) sigma = smallest / sigma;
  return sigmas;
}

// Rows of x, y and weight; a weight below zero is an outlier, and so is what was not seen.
std::vector<double> board_observations(const MrcalProblem& problem, const std::vector<double>& weights) {
  const auto points = static_cast<std::size_t>(problem.board.target.columns * problem.board.target.rows);
  std::vector<double> values;
  for (const MrcalView& view : problem.views) {
    const std::size_t first = values.size();
    values.resize(first + 3 * points, -1.0);
    const double weight = weights[static_cast<std::size_t>(view.camera)];
    for (std::size_t i = 0; i < view.corners->corners.size(); ++i) {
      double* const at = values.data() + first + 3 * static_cast<std::size_t>(view.corners->corners[i]);
      at[0] = view.corners->pixels[i].x();
      at[1] = view.corners->pixels[i].y();
      at[2] = view.corners->accepted[i] != 0 ? weight : -weight;
    }
  }
  return values;
}

void add_cameras(const std::vector<Sensor>& cameras, double mm_per_unit, NpzArchive& archive) {
  std::vector<double> intrinsics, extrinsics;
  std::vector<std::int32_t> sizes;
  for (const Sensor& camera : cameras) {
    intrinsics.insert(intrinsics.end(), camera.lens.parameters().begin(), camera.lens.parameters().end());
    sizes.push_back(camera.lens.size().width_px);
    sizes.push_back(camera.lens.size().height_px);
    if (&camera != &cameras.front()) append_rt(camera.sensor_from_mount, mm_per_unit, extrinsics);
  }
  const Lens& lens = cameras.front().lens;
  archive.add_text("lensmodel", lens.model());
  archive.add("intrinsics", {cameras.size(), static_cast<std::size_t>(lens.parameter_count())}, intrinsics);
  archive.add("imagersizes", {cameras.size(), 2}, sizes);
  archive.add("extrinsics_rt_fromref", {cameras.size() - 1, 6}, extrinsics);
  archive.add_flag("do_optimize_intrinsics_core", !lens.splined());  // the control points can take it over
  archive.add_flag("do_optimize_intrinsics_distortions", true);
  CalibrationState alone;
  alone.rig.sensors = cameras;
  archive.add_flag("do_apply_regularization", !lens_priors(alone).empty());
}

void add_board(const PlacedBoard& board, double mm_per_unit, NpzArchive& archive) {
  archive.add("calibration_object_spacing", {}, std::vector<double>{board.target.pitch_mm * board.scale / mm_per_unit});
  archive.add("calobject_warp", {2},
              std::vector<double>{board.warp_mm.x() / mm_per_unit, board.warp_mm.y() / mm_per_unit});
  archive.add_flag("do_optimize_calobject_warp", board.warp_estimated);
}

}  // namespace

Expected<std::string> mrcal_inputs(const RigToExport& source) {
  const auto problem = problem_of(source);
  if (!problem) return tl::unexpected(problem.error());
  std::vector<std::int32_t> indices;
  for (const MrcalView& view : problem->views) {
    const std::int32_t extrinsics = view.camera - 1;  // the first camera is the reference
    indices.insert(indices.end(), {view.frame, view.camera, extrinsics});
  }
  std::vector<double> frames;
  for (const Pose& pose : problem->probe_from_board) append_rt(pose, source.mm_per_unit, frames);
  const Target& target = problem->board.target;
  const std::vector<double> weights = weights_of(problem->cameras, source.rig.sigma_px);

  NpzArchive archive;
  add_cameras(problem->cameras, source.mm_per_unit, archive);
  add_board(problem->board, source.mm_per_unit, archive);
  archive.add("frames_rt_toref", {problem->probe_from_board.size(), 6}, frames);
  archive.add(
      "observations_board",
      {problem->views.size(), static_cast<std::size_t>(target.rows), static_cast<std::size_t>(target.columns), 3},
      board_observations(*problem, weights));
  archive.add("indices_frame_camintrinsics_camextrinsics", {problem->views.size(), 3}, indices);
  for (const char* const unused : {"points", "observations_point", "indices_point_camintrinsics_camextrinsics"}) {
    archive.add_text(unused, "");  // None
  }
  archive.add_flag("do_optimize_extrinsics", true);
  archive.add_flag("do_optimize_frames", true);
  archive.add_flag("do_apply_outlier_rejection", false);  // ours has been made
  archive.add_flag("verbose", false);
  return base85(archive.bytes());
}

}  // namespace crumple
