#include "solvers/residuals.h"

#include "solvers/transfer.h"

namespace crumple {
namespace {

int width_of(const View& view, const CalibrationState& state) {
  int width = 0;
  for (const BlockId& block : view.blocks()) width += tangent_size(block, state);
  return width;
}

// Local coordinates: lens, sensor_from_board, warp.
class CornerResiduals final : public View {
 public:
  explicit CornerResiduals(const CornerView& view)
      : View(Kind::corners, view.sensor, view.placement,
             {{BlockId::Kind::lens, view.sensor},
              {BlockId::Kind::mount, view.sensor},
              {BlockId::Kind::warp},
              {BlockId::Kind::placement, view.placement}}),
        view_(view) {}

  int size() const override { return static_cast<int>(view_.pixels.size()); }

  bool evaluate(const CalibrationState& state, bool with_jacobians, ViewEvaluation& evaluation) const override {
    const Sensor& sensor = state.rig.sensors[view_.sensor];
    const Pose sensor_from_board = sensor.sensor_from_probe * state.probe_from_board[view_.placement];
    const Eigen::Matrix3d rotation = sensor_from_board.rotation.toRotationMatrix();
    const int lens = sensor.lens.parameter_count(), columns = lens + 8;
    evaluation.residuals.resize(2 * size());
    evaluation.jacobian.resize(with_jacobians ? 2 * size() : 0, columns);
    for (int i = 0; i < size(); ++i) {
      const Eigen::Vector3d corner = state.board.corner(view_.corners[i]);
      const Eigen::Vector3d turned = rotation * corner;
      const Eigen::Vector3d in_sensor = turned + sensor_from_board.translation;
      if (!with_jacobians) {
        const auto pixel = sensor.lens.project(in_sensor);
        if (!pixel) return false;
        evaluation.residuals.segment<2>(2 * i) = *pixel - view_.pixels[i];
        continue;
      }
      double* const u = evaluation.jacobian.row(2 * i).data();
      Eigen::Vector2d pixel;
      Matrix2x3d d_point;
      if (!sensor.lens.project_into(in_sensor, pixel, d_point, u, u + columns)) return false;
      evaluation.residuals.segment<2>(2 * i) = pixel - view_.pixels[i];
      const Eigen::RowVector2d d_height = state.board.d_height_d_warp(corner.x(), corner.y()).transpose();
      for (int k = 0; k < 2; ++k) {
        Eigen::Map<Eigen::RowVector<double, 8>> rest(u + k * columns + lens);
        const Eigen::Vector3d d = d_point.row(k).transpose();
        rest << turned.cross(d).transpose(), d.transpose(), d.dot(rotation.col(2)) * d_height;
      }
    }
    if (with_jacobians) set_local(state, evaluation);
    return true;
  }

 private:
  void set_local(const CalibrationState& state, ViewEvaluation& evaluation) const {
    const Sensor& sensor = state.rig.sensors[view_.sensor];
    const CompositionDerivative d_pose = d_composed(sensor.sensor_from_probe, state.probe_from_board[view_.placement]);
    const int lens = sensor.lens.parameter_count();
    Eigen::MatrixXd& local = evaluation.local_from_blocks;
    local.setZero(lens + 8, lens + 14);
    local.topLeftCorner(lens, lens).setIdentity();
    local.block<6, 6>(lens, lens) = d_pose.d_left;
    local.block<2, 2>(lens + 6, lens + 6).setIdentity();
    local.block<6, 6>(lens, lens + 8) = d_pose.d_right;
  }

  const CornerView& view_;
};

// What stripes and features share. Local coordinates: source lens, source_from_board, target lens, target_from_board,
// warp.
class TransferResiduals : public View {
 protected:
  TransferResiduals(Kind kind, std::size_t sensor, std::size_t source, std::size_t target, std::size_t placement)
      : View(kind, sensor, placement,
             {{BlockId::Kind::lens, source},
              {BlockId::Kind::mount, source},
              {BlockId::Kind::lens, target},
              {BlockId::Kind::mount, target},
              {BlockId::Kind::warp},
              {BlockId::Kind::placement, placement}}) {}

  void resize(const CalibrationState& state, bool with_jacobians, ViewEvaluation& evaluation) const {
    const int rows = size() * dimension();
    evaluation.residuals.resize(rows);
    evaluation.jacobian.resize(with_jacobians ? rows : 0, width_of(*this, state) - 6);
  }

  // Left-multiplies the derivative by `rows` (the identity, or a stripe's normal) into the rows of one observation.
  template <typename Rows>
  static void store(const TransferDerivative& d, const Rows& rows, int first_row, RowMajorMatrix& jacobian) {
    auto target = jacobian.middleRows(first_row, rows.rows());
    target << rows * d.source_lens, rows * d.source_pose, rows * d.target_lens, rows * d.target_pose, rows * d.warp;
  }

  void set_local(const Transfer& transfer, const CalibrationState& state, ViewEvaluation& evaluation) const {
    const int source = tangent_size(blocks()[0], state), target = tangent_size(blocks()[2], state);
    const int columns = width_of(*this, state), placement = columns - 6;
    Eigen::MatrixXd& local = evaluation.local_from_blocks;
    local.setZero(columns - 6, columns);
    local.leftCols(columns - 6).setIdentity();
    local.block<6, 6>(source, source) = transfer.d_source().d_left;
    local.block<6, 6>(source, placement) = transfer.d_source().d_right;
    const int at = source + 6 + target;
    local.block<6, 6>(at, at) = transfer.d_target().d_left;
    local.block<6, 6>(at, placement) = transfer.d_target().d_right;
  }
};

class StripeResiduals final : public TransferResiduals {
 public:
  explicit StripeResiduals(const StripeView& view)
      : TransferResiduals(Kind::stripes, view.projector, view.camera, view.projector, view.placement), view_(view) {}

  int size() const override { return static_cast<int>(view_.coordinates_px.size()); }

  bool evaluate(const CalibrationState& state, bool with_jacobians, ViewEvaluation& evaluation) const override {
    resize(state, with_jacobians, evaluation);
    const Transfer transfer(state, view_.camera, view_.projector, view_.placement);
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
  explicit FeatureResiduals(const FeatureView& view)
      : TransferResiduals(Kind::features, view.camera, view.projector, view.camera, view.placement), view_(view) {}

  int size() const override { return static_cast<int>(view_.camera_pixels.size()); }

  bool evaluate(const CalibrationState& state, bool with_jacobians, ViewEvaluation& evaluation) const override {
    resize(state, with_jacobians, evaluation);
    const Transfer transfer(state, view_.projector, view_.camera, view_.placement);
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

}  // namespace

int tangent_size(const BlockId& block, const CalibrationState& state) {
  switch (block.kind) {
    case BlockId::Kind::lens:
      return state.rig.sensors[block.index].lens.parameter_count();
    case BlockId::Kind::warp:
      return 2;
    case BlockId::Kind::mount:
    case BlockId::Kind::placement:
      break;
  }
  return 6;
}

const char* name_of(View::Kind kind) {
  switch (kind) {
    case View::Kind::corners:
      return "corners";
    case View::Kind::stripes:
      return "stripes";
    case View::Kind::features:
      break;
  }
  return "features";
}

Eigen::MatrixXd block_jacobian(const View& view, const ViewEvaluation& evaluation, const CalibrationState& state,
                               std::size_t index) {
  int column = 0;
  for (std::size_t b = 0; b < index; ++b) column += tangent_size(view.blocks()[b], state);
  return evaluation.jacobian *
         evaluation.local_from_blocks.middleCols(column, tangent_size(view.blocks()[index], state));
}

std::vector<std::unique_ptr<View>> make_views(const Observations& observations) {
  std::vector<std::unique_ptr<View>> views;
  for (const CornerView& view : observations.corners) views.push_back(std::make_unique<CornerResiduals>(view));
  for (const StripeView& view : observations.stripes) views.push_back(std::make_unique<StripeResiduals>(view));
  for (const FeatureView& view : observations.features) views.push_back(std::make_unique<FeatureResiduals>(view));
  return views;
}

}  // namespace crumple
