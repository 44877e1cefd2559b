#include "solvers/residuals.h"

#include <array>
#include <optional>

#include "solvers/disc.h"
#include "solvers/overlap_residuals.h"
#include "solvers/transfer.h"

namespace crumple {
namespace {

int width_of(const View& view, const CalibrationState& state) {
  int width = 0;
  for (const BlockId& block : view.blocks()) width += tangent_size(block, state);
  return width;
}

std::vector<BlockId> with_poses(std::vector<BlockId> blocks, std::optional<std::size_t> placement,
                                std::optional<std::size_t> station) {
  if (placement) blocks.push_back({BlockId::Kind::placement, *placement});
  if (station) blocks.push_back({BlockId::Kind::station, *station});
  return blocks;
}

// Columns of the poses that a board view ends with: the placement's, then the station's.
int pose_columns(const View& view) { return view.station() ? 12 : 6; }

// How the six local coordinates of a board's pose in a sensor follow from that sensor's mount, which stands in the same
// columns, and from the poses at the end.
void set_chain(const SensorChain& chain, const View& view, int at, Eigen::MatrixXd& local) {
  const Eigen::Index placement = local.cols() - pose_columns(view);
  local.block<6, 6>(at, at) = chain.d_mount;
  local.block<6, 6>(at, placement) = chain.d_board;
  if (view.station()) local.block<6, 6>(at, placement + 6) = chain.d_station;
}

// A point of the board (or a disc's centre of gravity) in a sensor: the prediction and how it moves with the local
// coordinates lens, sensor_from_board, warp, scale.
class PointPredictor {
 public:
  PointPredictor(const Lens& lens, const Board& board, const Pose& sensor_from_board)
      : lens_(lens),
        board_(board),
        rotation_(sensor_from_board.rotation.toRotationMatrix()),
        translation_(sensor_from_board.translation),
        outline_(disc_outline(board.disc_radius_mm())) {}

  int columns() const { return lens_.parameter_count() + kFurtherColumns; }

  std::optional<Eigen::Vector2d> pixel(int index) const {
    const Eigen::Vector2d& nominal_mm = board_.nominal_mm()[static_cast<std::size_t>(index)];
    if (!board_.has_discs()) return project(nominal_mm);
    DiscOutline image;
    for (std::size_t i = 0; i < image.size(); ++i) {
      const auto vertex = project(nominal_mm + outline_[i]);
      if (!vertex) return std::nullopt;
      image[i] = *vertex;
    }
    return centroid(image);
  }

  // The derivatives go to two rows of columns() values, the second after the first.
  bool predict(int index, Eigen::Vector2d& pixel, double* rows) {
    const Eigen::Vector2d& nominal_mm = board_.nominal_mm()[static_cast<std::size_t>(index)];
    if (!board_.has_discs()) return differentiate(nominal_mm, pixel, rows);
    DiscOutline image;
    vertices_.resize(2 * kDiscVertices, columns());
    for (int i = 0; i < kDiscVertices; ++i) {
      const auto at = static_cast<std::size_t>(i);
      if (!differentiate(nominal_mm + outline_[at], image[at], vertices_.row(2 * i).data())) return false;
    }
    const CentroidDerivative derivative = centroid_with_derivative(image);
    pixel = derivative.centroid;
    Eigen::Map<RowMajorMatrix> sum(rows, 2, columns());
    sum.setZero();
    for (int i = 0; i < kDiscVertices; ++i) {
      sum += derivative.d_vertex[static_cast<std::size_t>(i)].lazyProduct(vertices_.middleRows<2>(2 * i));
    }
    return true;
  }

 private:
  static constexpr int kFurtherColumns = 6 + 2 + 1;

  std::optional<Eigen::Vector2d> project(const Eigen::Vector2d& nominal_mm) const {
    return lens_.project(rotation_ * board_.on_surface(nominal_mm) + translation_);
  }

  bool differentiate(const Eigen::Vector2d& nominal_mm, Eigen::Vector2d& pixel, double* rows) const {
    const Eigen::Vector3d point = board_.on_surface(nominal_mm);
    const Eigen::Vector3d turned = rotation_ * point;
    Matrix2x3d d_point;
    if (!lens_.project_into(turned + translation_, pixel, d_point, rows, rows + columns())) return false;
    const Eigen::RowVector2d d_height = board_.d_height_d_warp(point.x(), point.y()).transpose();
    const Eigen::Vector3d d_scale = rotation_ * Board::d_on_surface_d_scale(nominal_mm);
    for (int k = 0; k < 2; ++k) {
      Eigen::Map<Eigen::RowVector<double, kFurtherColumns>> rest(rows + k * columns() + lens_.parameter_count());
      const Eigen::Vector3d d = d_point.row(k).transpose();
      rest << turned.cross(d).transpose(), d.transpose(), d.dot(rotation_.col(2)) * d_height, d.dot(d_scale);
    }
    return true;
  }

  const Lens& lens_;
  const Board& board_;
  Eigen::Matrix3d rotation_;
  Eigen::Vector3d translation_;
  DiscOutline outline_;
  RowMajorMatrix vertices_;  // two rows for each corner of a disc's outline
};

class CornerResiduals final : public View {
 public:
  CornerResiduals(const CornerView& view, std::size_t board)
      : View(Kind::corners, view.sensor, view.placement, view.station,
             with_poses({{BlockId::Kind::lens, view.sensor},
                         {BlockId::Kind::mount, view.sensor},
                         {BlockId::Kind::warp, board},
                         {BlockId::Kind::scale, board}},
                        view.placement, view.station)),
        view_(view) {}

  int size() const override { return static_cast<int>(view_.pixels.size()); }

  bool evaluate(const CalibrationState& state, bool with_jacobians, ViewEvaluation& evaluation) const override {
    const Sensor& sensor = state.rig.sensors[view_.sensor];
    PointPredictor predictor(sensor.lens, state.board_at(view_.placement),
                             sensor_from_board_pose(state, view_.sensor, view_.placement, view_.station));
    evaluation.residuals.resize(2 * size());
    evaluation.jacobian.resize(with_jacobians ? 2 * size() : 0, predictor.columns());
    for (int i = 0; i < size(); ++i) {
      if (!with_jacobians) {
        const auto pixel = predictor.pixel(view_.corners[i]);
        if (!pixel) return false;
        evaluation.residuals.segment<2>(2 * i) = *pixel - view_.pixels[i];
        continue;
      }
      Eigen::Vector2d pixel;
      if (!predictor.predict(view_.corners[i], pixel, evaluation.jacobian.row(2 * i).data())) return false;
      evaluation.residuals.segment<2>(2 * i) = pixel - view_.pixels[i];
    }
    if (with_jacobians) set_local(state, evaluation);
    return true;
  }

 private:
  void set_local(const CalibrationState& state, ViewEvaluation& evaluation) const {
    const int columns = width_of(*this, state), locals = columns - pose_columns(*this);
    Eigen::MatrixXd& local = evaluation.local_from_blocks;
    local.setZero(locals, columns);
    local.leftCols(locals).setIdentity();
    set_chain(sensor_from_board(state, view_.sensor, view_.placement, view_.station), *this,
              tangent_size(blocks()[0], state), local);
  }

  const CornerView& view_;
};

// What stripes and features share. Local coordinates: source lens, source_from_board, target lens, target_from_board,
// warp, scale.
class TransferResiduals : public View {
 protected:
  TransferResiduals(Kind kind, std::size_t sensor, std::size_t source, std::size_t target, std::size_t placement,
                    std::optional<std::size_t> station, std::size_t board)
      : View(kind, sensor, placement, station,
             with_poses({{BlockId::Kind::lens, source},
                         {BlockId::Kind::mount, source},
                         {BlockId::Kind::lens, target},
                         {BlockId::Kind::mount, target},
                         {BlockId::Kind::warp, board},
                         {BlockId::Kind::scale, board}},
                        placement, station)) {}

  void resize(const CalibrationState& state, bool with_jacobians, ViewEvaluation& evaluation) const {
    const int rows = size() * dimension();
    evaluation.residuals.resize(rows);
    evaluation.jacobian.resize(with_jacobians ? rows : 0, width_of(*this, state) - pose_columns(*this));
  }

  // Left-multiplies the derivative by `rows` (the identity, or a stripe's normal) into the rows of one observation.
  template <typename Rows>
  static void store(const TransferDerivative& d, const Rows& rows, int first_row, RowMajorMatrix& jacobian) {
    auto target = jacobian.middleRows(first_row, rows.rows());
    target << rows * d.source_lens, rows * d.source_pose, rows * d.target_lens, rows * d.target_pose, rows * d.warp,
        rows * d.scale;
  }

  void set_local(const Transfer& transfer, const CalibrationState& state, ViewEvaluation& evaluation) const {
    const int source = tangent_size(blocks()[0], state), target = tangent_size(blocks()[2], state);
    const int columns = width_of(*this, state), locals = columns - pose_columns(*this);
    Eigen::MatrixXd& local = evaluation.local_from_blocks;
    local.setZero(locals, columns);
    local.leftCols(locals).setIdentity();
    set_chain(transfer.source(), *this, source, local);
    set_chain(transfer.target(), *this, source + 6 + target, local);
  }
};

class StripeResiduals final : public TransferResiduals {
 public:
  StripeResiduals(const StripeView& view, std::size_t board)
      : TransferResiduals(Kind::stripes, view.projector, view.camera, view.projector, view.placement, view.station,
                          board),
        view_(view) {}

  int size() const override { return static_cast<int>(view_.coordinates_px.size()); }

  bool evaluate(const CalibrationState& state, bool with_jacobians, ViewEvaluation& evaluation) const override {
    resize(state, with_jacobians, evaluation);
    const Transfer transfer(state, view_.camera, view_.projector, view_.placement, view_.station);
    TransferDerivative derivative;
    for (int i = 0; i < size(); ++i) {
      const auto pixel =
          with_jacobians ? transfer(view_.camera_pixels[i], derivative) : transfer(view_.camera_pixels[i]);
      if (!pixel) return false;
      evaluation.residuals[i] = view_.normal.dot(*pixel) - view_.coordinates_px[i];
      if (with_jacobians) store(derivative, view_.normal.transpose(), i, evaluation.jacobian);
    }
    if (with_jacobians) set_local(transfer, state, evaluation);
    return true;
  }

 private:
  const StripeView& view_;
};

class FeatureResiduals final : public TransferResiduals {
 public:
  FeatureResiduals(const FeatureView& view, std::size_t board)
      : TransferResiduals(Kind::features, view.camera, view.projector, view.camera, view.placement, view.station,
                          board),
        view_(view) {}

  int size() const override { return static_cast<int>(view_.camera_pixels.size()); }

  bool evaluate(const CalibrationState& state, bool with_jacobians, ViewEvaluation& evaluation) const override {
    resize(state, with_jacobians, evaluation);
    const Transfer transfer(state, view_.projector, view_.camera, view_.placement, view_.station);
    TransferDerivative derivative;
    for (int i = 0; i < size(); ++i) {
      const Eigen::Vector2d& source = view_.projector_pixels[i];
      const auto pixel = with_jacobians ? transfer(source, derivative) : transfer(source);
      if (!pixel) return false;
      evaluation.residuals.segment<2>(2 * i) = *pixel - view_.camera_pixels[i];
      if (with_jacobians) store(derivative, Eigen::Matrix2d::Identity().eval(), 2 * i, evaluation.jacobian);
    }
    if (with_jacobians) set_local(transfer, state, evaluation);
    return true;
  }

 private:
  const FeatureView& view_;
};

// Local coordinates: lens, the pose in the sensor of what carries the LEDs, then the LEDs' positions.
class LedResiduals final : public View {
 public:
  explicit LedResiduals(const LedView& view)
      : View(Kind::leds, view.sensor, std::nullopt, view.station, blocks_of(view)), view_(view) {}

  int size() const override { return static_cast<int>(view_.pixels.size()); }

  bool evaluate(const CalibrationState& state, bool with_jacobians, ViewEvaluation& evaluation) const override {
    const Lens& lens = state.rig.sensors[view_.sensor].lens;
    const SensorChain chain = sensor_from_leds(state, view_.sensor, view_.station);
    const Eigen::Matrix3d rotation = chain.pose.rotation.toRotationMatrix();
    const int lens_columns = lens.parameter_count();
    evaluation.residuals.resize(2 * size());
    if (with_jacobians) evaluation.jacobian.setZero(2 * size(), lens_columns + 6 + 3 * size());
    for (int i = 0; i < size(); ++i) {
      const Eigen::Vector3d& led = state.rig.leds[view_.leds[static_cast<std::size_t>(i)]].position_mm;
      const Eigen::Vector2d& seen = view_.pixels[static_cast<std::size_t>(i)];
      if (!with_jacobians) {
        const auto pixel = lens.project(chain.pose * led);
        if (!pixel) return false;
        evaluation.residuals.segment<2>(2 * i) = *pixel - seen;
        continue;
      }
      const auto projection = lens.project_with_gradients(chain.pose * led);
      if (!projection) return false;
      evaluation.residuals.segment<2>(2 * i) = projection->pixel - seen;
      auto rows = evaluation.jacobian.middleRows<2>(2 * i);
      rows.leftCols(lens_columns) = projection->d_parameters;
      rows.middleCols<6>(lens_columns) = projection->d_point * d_transformed_d_pose(chain.pose, led);
      rows.middleCols<3>(lens_columns + 6 + 3 * i) = projection->d_point * rotation;
    }
    if (!with_jacobians) {
      evaluation.jacobian.resize(0, lens_columns + 6 + 3 * size());
      return true;
    }
    Eigen::MatrixXd& local = evaluation.local_from_blocks;
    const int locals = lens_columns + 6 + 3 * size();
    local.setZero(locals, locals + (view_.station ? 6 : 0));
    local.leftCols(locals).setIdentity();
    local.block<6, 6>(lens_columns, lens_columns) = chain.d_mount;
    if (view_.station) local.block<6, 6>(lens_columns, locals) = chain.d_station;
    return true;
  }

 private:
  static std::vector<BlockId> blocks_of(const LedView& view) {
    std::vector<BlockId> blocks{{BlockId::Kind::lens, view.sensor}, {BlockId::Kind::mount, view.sensor}};
    for (const std::size_t led : view.leds) blocks.push_back({BlockId::Kind::led, led});
    return with_poses(std::move(blocks), std::nullopt, view.station);
  }

  const LedView& view_;
};

}  // namespace

int tangent_size(BlockId::Kind kind, int lens_parameters) {
  switch (kind) {
    case BlockId::Kind::lens:
      return lens_parameters;
    case BlockId::Kind::warp:
      return 2;
    case BlockId::Kind::scale:
      return 1;
    case BlockId::Kind::led:
      return 3;
    case BlockId::Kind::mount:
    case BlockId::Kind::placement:
    case BlockId::Kind::station:
      break;
  }
  return 6;
}

int tangent_size(const BlockId& block, const CalibrationState& state) {
  const bool lens = block.kind == BlockId::Kind::lens;
  return tangent_size(block.kind, lens ? state.rig.sensors[block.index].lens.parameter_count() : 0);
}

const char* name_of(View::Kind kind) {
  switch (kind) {
    case View::Kind::corners:
      return "corners";
    case View::Kind::stripes:
      return "stripes";
    case View::Kind::features:
      return "features";
    case View::Kind::overlaps:
      return "overlaps";
    case View::Kind::leds:
      break;
  }
  return "leds";
}

std::string place_of(const View& view) {
  if (view.placement()) return "placement " + std::to_string(*view.placement());
  return view.station() ? "station " + std::to_string(*view.station()) : "the room";
}

Eigen::MatrixXd block_jacobian(const View& view, const ViewEvaluation& evaluation, const CalibrationState& state,
                               std::size_t index) {
  int column = 0;
  for (std::size_t b = 0; b < index; ++b) column += tangent_size(view.blocks()[b], state);
  return evaluation.jacobian *
         evaluation.local_from_blocks.middleCols(column, tangent_size(view.blocks()[index], state));
}

std::vector<std::unique_ptr<View>> make_views(const Observations& observations,
                                              const std::vector<std::size_t>& board_of) {
  std::vector<std::unique_ptr<View>> views;
  for (const CornerView& view : observations.corners) {
    views.push_back(std::make_unique<CornerResiduals>(view, board_of[view.placement]));
  }
  for (const StripeView& view : observations.stripes) {
    views.push_back(std::make_unique<StripeResiduals>(view, board_of[view.placement]));
  }
  for (const FeatureView& view : observations.features) {
    views.push_back(std::make_unique<FeatureResiduals>(view, board_of[view.placement]));
  }
  for (const LedView& view : observations.leds) views.push_back(std::make_unique<LedResiduals>(view));
  for (const OverlapView& view : observations.overlaps) views.push_back(overlap_view(view));
  return views;
}

}  // namespace crumple
