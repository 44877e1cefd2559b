#include "solvers/residuals.h"

#include "solvers/transfer.h"

namespace crumple {
namespace {

void resize(ViewEvaluation& evaluation, const View& view, const CalibrationState& state, bool with_jacobians) {
  const int rows = view.size() * view.dimension();
  evaluation.residuals.resize(rows);
  evaluation.jacobians.resize(with_jacobians ? view.blocks().size() : 0);
  for (std::size_t b = 0; b < evaluation.jacobians.size(); ++b) {
    evaluation.jacobians[b].resize(rows, tangent_size(view.blocks()[b], state));
  }
}

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
    resize(evaluation, *this, state, with_jacobians);
    const Sensor& sensor = state.rig.sensors[view_.sensor];
    const Pose& probe_from_board = state.probe_from_board[view_.placement];
    const Pose sensor_from_board = sensor.sensor_from_probe * probe_from_board;
    const Eigen::Vector3d board_normal = sensor_from_board.rotation * Eigen::Vector3d::UnitZ();
    const CompositionDerivative d_pose = d_composed(sensor.sensor_from_probe, probe_from_board);
    for (int i = 0; i < size(); ++i) {
      const Eigen::Vector3d corner = state.board.corner(view_.corners[i]);
      const Eigen::Vector3d in_sensor = sensor_from_board * corner;
      if (!with_jacobians) {
        const auto pixel = sensor.lens.project(in_sensor);
        if (!pixel) return false;
        evaluation.residuals.segment<2>(2 * i) = *pixel - view_.pixels[i];
        continue;
      }
      const auto projection = sensor.lens.project_with_gradients(in_sensor);
      if (!projection) return false;
      const Matrix2x6d d_sensor_pose = projection->d_point * d_transformed_d_pose(sensor_from_board, corner);
      evaluation.residuals.segment<2>(2 * i) = projection->pixel - view_.pixels[i];
      evaluation.jacobians[0].middleRows<2>(2 * i) = projection->d_parameters;
      evaluation.jacobians[1].middleRows<2>(2 * i) = d_sensor_pose * d_pose.d_left;
      evaluation.jacobians[2].middleRows<2>(2 * i) =
          projection->d_point * board_normal * state.board.d_height_d_warp(corner.x(), corner.y()).transpose();
      evaluation.jacobians[3].middleRows<2>(2 * i) = d_sensor_pose * d_pose.d_right;
    }
    return true;
  }

 private:
  const CornerView& view_;
};

std::vector<BlockId> transfer_blocks(std::size_t source, std::size_t target, std::size_t placement) {
  return {{BlockId::Kind::lens, source},  {BlockId::Kind::mount, source}, {BlockId::Kind::lens, target},
          {BlockId::Kind::mount, target}, {BlockId::Kind::warp},          {BlockId::Kind::placement, placement}};
}

// Left-multiplies the derivative by `rows` (the identity, or a stripe's normal) into the rows of one observation.
template <typename Rows>
void store(const TransferDerivative& d, const Rows& rows, int first_row, std::vector<RowMajorMatrix>& jacobians) {
  jacobians[0].middleRows(first_row, rows.rows()) = rows * d.source_lens;
  jacobians[1].middleRows(first_row, rows.rows()) = rows * d.source_mount;
  jacobians[2].middleRows(first_row, rows.rows()) = rows * d.target_lens;
  jacobians[3].middleRows(first_row, rows.rows()) = rows * d.target_mount;
  jacobians[4].middleRows(first_row, rows.rows()) = rows * d.warp;
  jacobians[5].middleRows(first_row, rows.rows()) = rows * d.placement;
}

class StripeResiduals final : public View {
 public:
  explicit StripeResiduals(const StripeView& view)
      : View(Kind::stripes, view.projector, view.placement,
             transfer_blocks(view.camera, view.projector, view.placement)),
        view_(view) {}

  int size() const override { return static_cast<int>(view_.coordinates_px.size()); }

  bool evaluate(const CalibrationState& state, bool with_jacobians, ViewEvaluation& evaluation) const override {
    resize(evaluation, *this, state, with_jacobians);
    const Transfer transfer(state, view_.camera, view_.projector, view_.placement);
    TransferDerivative derivative;
    for (int i = 0; i < size(); ++i) {
      const auto pixel =
          with_jacobians ? transfer(view_.camera_pixels[i], derivative) : transfer(view_.camera_pixels[i]);
      if (!pixel) return false;
      evaluation.residuals[i] = view_.normal.dot(*pixel) - view_.coordinates_px[i];
      if (with_jacobians) store(derivative, view_.normal.transpose(), i, evaluation.jacobians);
    }
    return true;
  }

 private:
  const StripeView& view_;
};

class FeatureResiduals final : public View {
 public:
  explicit FeatureResiduals(const FeatureView& view)
      : View(Kind::features, view.camera, view.placement, transfer_blocks(view.projector, view.camera, view.placement)),
        view_(view) {}

  int size() const override { return static_cast<int>(view_.camera_pixels.size()); }

  bool evaluate(const CalibrationState& state, bool with_jacobians, ViewEvaluation& evaluation) const override {
    resize(evaluation, *this, state, with_jacobians);
    const Transfer transfer(state, view_.projector, view_.camera, view_.placement);
    TransferDerivative derivative;
    for (int i = 0; i < size(); ++i) {
      const Eigen::Vector2d& source = view_.projector_pixels[i];
      const auto pixel = with_jacobians ? transfer(source, derivative) : transfer(source);
      if (!pixel) return false;
      evaluation.residuals.segment<2>(2 * i) = *pixel - view_.camera_pixels[i];
      if (with_jacobians) store(derivative, Eigen::Matrix2d::Identity().eval(), 2 * i, evaluation.jacobians);
    }
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

std::vector<std::unique_ptr<View>> make_views(const Observations& observations) {
  std::vector<std::unique_ptr<View>> views;
  for (const CornerView& view : observations.corners) views.push_back(std::make_unique<CornerResiduals>(view));
  for (const StripeView& view : observations.stripes) views.push_back(std::make_unique<StripeResiduals>(view));
  for (const FeatureView& view : observations.features) views.push_back(std::make_unique<FeatureResiduals>(view));
  return views;
}

}  // namespace crumple
