// Residuals of the measurement model: what was measured against what the state predicts, predicted minus measured, px.
//
// One View is one sensor's observations of one board placement, or of LEDs at one station; its residuals and Jacobian
// are evaluated together.
//   CornerView   lens(sensor_from_world * world_from_board * point) - pixel                           2 per point
//                (of a disc: the centre of gravity of its image, solvers/disc.h)
//   StripeView   n . transfer(camera pixel -> projector) - coordinate                                 1 per reading
//   FeatureView  transfer(projector pixel -> camera) - pixel                                          2 per feature
//   LedView      lens(sensor_from_world * world_from_probe * led) - pixel                             2 per LED
//                (of a reference point seen from the probe: lens(sensor_from_probe * probe_from_world * point))
//   OverlapView  solvers/overlap_residuals.h                                                          1 per point
// The parameters come in blocks, moved by tangents (solvers/pose.h). What a view sees of them is less: a mount and a
// placement only through the board's pose in the sensor. So a view's Jacobian is with respect to its local coordinates
// (lens parameters, the board's pose in each sensor, warp and scale), and local_from_blocks says how these follow from
// the blocks; forming normal equations from local coordinates is what makes a refinement fast.
#pragma once

#include <compare>
#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "solvers/observations.h"
#include "solvers/state.h"

namespace crumple {

using RowMajorMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// The parameters come in blocks: the lens and the mount (sensor_from_mount) of each sensor, the warp and the scale of
// each board, the pose of each placement (world_from_board) and of the probe at each station (world_from_probe), the
// position of each LED.
struct BlockId {
  enum class Kind { lens, mount, warp, scale, placement, station, led };
  Kind kind;
  std::size_t index = 0;
  bool is_pose() const { return kind == Kind::placement || kind == Kind::station; }
  auto operator<=>(const BlockId&) const = default;
};

int tangent_size(const BlockId& block, const CalibrationState& state);
int tangent_size(BlockId::Kind kind, int lens_parameters);  // the latter where it is a lens

struct ViewEvaluation {
  Eigen::VectorXd residuals;
  RowMajorMatrix jacobian;            // by the local coordinates; empty where not asked for, as is the next
  Eigen::MatrixXd local_from_blocks;  // by the tangents of View::blocks, side by side
};

class View {
 public:
  enum class Kind { corners, stripes, features, leds, overlaps };

  static int dimension_of(Kind kind) { return kind == Kind::stripes || kind == Kind::overlaps ? 1 : 2; }

  virtual ~View() = default;
  virtual int size() const = 0;  // observations

  // False where the model cannot predict one of the observations at this state.
  virtual bool evaluate(const CalibrationState& state, bool with_jacobians, ViewEvaluation& evaluation) const = 0;

  Kind kind() const { return kind_; }
  int dimension() const { return dimension_of(kind_); }                // residuals per observation
  std::size_t sensor() const { return sensor_; }                       // whose noise the residuals carry
  std::optional<std::size_t> placement() const { return placement_; }  // none: no board is involved
  std::optional<std::size_t> station() const { return station_; }      // as its observations have it; overlaps: here
  const std::vector<BlockId>& blocks() const { return blocks_; }

 protected:
  View(Kind kind, std::size_t sensor, std::optional<std::size_t> placement, std::optional<std::size_t> station,
       std::vector<BlockId> blocks)
      : kind_(kind), sensor_(sensor), placement_(placement), station_(station), blocks_(std::move(blocks)) {}

 private:
  Kind kind_;
  std::size_t sensor_;
  std::optional<std::size_t> placement_;
  std::optional<std::size_t> station_;
  std::vector<BlockId> blocks_;
};

const char* name_of(View::Kind kind);
// "placement 3", "station 2": what the view is of, for messages.
std::string place_of(const View& view);

// The columns of a view's Jacobian by the tangent of its block at `index` in View::blocks.
Eigen::MatrixXd block_jacobian(const View& view, const ViewEvaluation& evaluation, const CalibrationState& state,
                               std::size_t index);

// Views refer to the observations they are made from, which must outlive them. Order: corners, stripes,
// features, LEDs, overlaps.
// `board_of` is the state's.
std::vector<std::unique_ptr<View>> make_views(const Observations& observations,
                                              const std::vector<std::size_t>& board_of);

}  // namespace crumple
