#include "solvers/residuals.h"

#include <array>
#include <optional>

#include "solvers/disc.h"
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

// A point of the board (or a disc's centre of gravity) in a sensor: the prediction and how it moves.
struct PointPrediction {
  Eigen::Vector2d pixel;
  Matrix2Xd lens;
  Matrix2x6d sensor_from_board;
  Eigen::Matrix2d warp;
  Eigen::Vector2d scale;
};

class PointPredictor {
 public:
  PointPredictor(const Lens& lens, const Board& board, const Pose& sensor_from_board)
      : lens_(lens),
        board_(board),
        sensor_from_board_(sensor_from_board),
        rotation_(sensor_from_board.rotation.toRotationMatrix()),
        outline_(disc_outline(board.disc_radius_mm())) {}

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

  bool predict(int index, PointPrediction& prediction) const {
    const Eigen::Vector2d& nominal_mm = board_.nominal_mm()[static_cast<std::size_t>(index)];
    if (!board_.has_discs()) return differentiate(nominal_mm, prediction);
    DiscOutline image;
    std::array<PointPrediction, kDiscVertices> vertices;
    for (std::size_t i = 0; i < image.size(); ++i) {
      if (!differentiate(nominal_mm + outline_[i], vertices[i])) return false;
      image[i] = vertices[i].pixel;
    }
    const CentroidDerivative derivative = centroid_with_derivative(image);
    prediction = {derivative.centroid, Matrix2Xd::Zero(2, lens_.parameter_count()), Matrix2x6d::Zero(),
                  Eigen::Matrix2d::Zero(), Eigen::Vector2d::Zero()};
    for (std::size_t i = 0; i < image.size(); ++i) {
      prediction.lens += derivative.d_vertex[i] * vertices[i].lens;
      prediction.sensor_from_board += derivative.d_vertex[i] * vertices[i].sensor_from_board;
      prediction.warp += derivative.d_vertex[i] * vertices[i].warp;
      prediction.scale += derivative.d_vertex[i] * vertices[i].scale;
    }
    return true;
  }

 private:
  std::optional<Eigen::Vector2d> project(const Eigen::Vector2d& nominal_mm) const {
    const Eigen::Vector3d in_sensor = sensor_from_board_ * board_.on_surface(nominal_mm);
    return lens_.project(in_sensor);
  }

  bool differentiate(const Eigen::Vector2d& nominal_mm, PointPrediction& prediction) const {
    const Eigen::Vector3d point = board_.on_surface(nominal_mm);
    const Eigen::Vector3d in_sensor = sensor_from_board_ * point;
    const auto projection = lens_.project_with_gradients(in_sensor);
    if (!projection) return false;
    const Matrix2x3d d_board_point = projection->d_point * rotation_;
    prediction.pixel = projection->pixel;
    prediction.lens = projection->d_parameters;
    prediction.sensor_from_board = projection->d_point * d_transformed_d_pose(sensor_from_board_, point);
    prediction.warp = d_board_point.col(2) * board_.d_height_d_warp(point.x(), point.y()).transpose();
    prediction.scale = d_board_point * Board::d_on_surface_d_scale(nominal_mm);
    return true;
  }

  const Lens& lens_;
  const Board& board_;
  Pose sensor_from_board_;
  Eigen::Matrix3d rotation_;
  DiscOutline outline_;
};

class CornerResiduals final : public View {
 public:
  CornerResiduals(const CornerView& view, std::size_t board)
      : View(Kind::corners, view.sensor, view.placement,
             {{BlockId::Kind::lens, view.sensor},
              {BlockId::Kind::mount, view.sensor},
              {BlockId::Kind::warp, board},
              {BlockId::Kind::scale, board},
              {BlockId::Kind::placement, view.placement}}),
        view_(view) {}

  int size() const override { return static_cast<int>(view_.pixels.size()); }

  bool evaluate(const CalibrationState& state, bool with_jacobians, ViewEvaluation& evaluation) const override {
    resize(evaluation, *this, state, with_jacobians);
    const Sensor& sensor = state.rig.sensors[view_.sensor];
    const Pose& probe_from_board = state.probe_from_board[view_.placement];
    const PointPredictor predictor(sensor.lens, state.board_at(view_.placement),
                                   sensor.sensor_from_probe * probe_from_board);
    const CompositionDerivative d_pose = d_composed(sensor.sensor_from_probe, probe_from_board);
    PointPrediction prediction;
    for (int i = 0; i < size(); ++i) {
      if (!with_jacobians) {
        const auto pixel = predictor.pixel(view_.corners[i]);
        if (!pixel) return false;
        evaluation.residuals.segment<2>(2 * i) = *pixel - view_.pixels[i];
        continue;
      }
      if (!predictor.predict(view_.corners[i], prediction)) return false;
      evaluation.residuals.segment<2>(2 * i) = prediction.pixel - view_.pixels[i];
      evaluation.jacobians[0].middleRows<2>(2 * i) = prediction.lens;
      evaluation.jacobians[1].middleRows<2>(2 * i) = prediction.sensor_from_board * d_pose.d_left;
      evaluation.jacobians[2].middleRows<2>(2 * i) = prediction.warp;
      evaluation.jacobians[3].middleRows<2>(2 * i) = prediction.scale;
      evaluation.jacobians[4].middleRows<2>(2 * i) = prediction.sensor_from_board * d_pose.d_right;
    }
    return true;
  }

 private:
  const CornerView& view_;
};

std::vector<BlockId> transfer_blocks(std::size_t source, std::size_t target, std::size_t placement, std::size_t board) {
  return {{BlockId::Kind::lens, source},        {BlockId::Kind::mount, source}, {BlockId::Kind::lens, target},
          {BlockId::Kind::mount, target},       {BlockId::Kind::warp, board},   {BlockId::Kind::scale, board},
          {BlockId::Kind::placement, placement}};
}

// Left-multiplies the derivative by `rows` (the identity, or a stripe's normal) into the rows of one observation.
template <typename Rows>
void store(const TransferDerivative& d, const Rows& rows, int first_row, std::vector<RowMajorMatrix>& jacobians) {
  jacobians[0].middleRows(first_row, rows.rows()) = rows * d.source_lens;
  jacobians[1].middleRows(first_row, rows.rows()) = rows * d.source_mount;
  jacobians[2].middleRows(first_row, rows.rows()) = rows * d.target_lens;
  jacobians[3].middleRows(first_row, rows.rows()) = rows * d.target_mount;
  jacobians[4].middleRows(first_row, rows.rows()) = rows * d.warp;
  jacobians[5].middleRows(first_row, rows.rows()) = rows * d.scale;
  jacobians[6].middleRows(first_row, rows.rows()) = rows * d.placement;
}

class StripeResiduals final : public View {
 public:
  StripeResiduals(const StripeView& view, std::size_t board)
      : View(Kind::stripes, view.projector, view.placement,
             transfer_blocks(view.camera, view.projector, view.placement, board)),
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
  FeatureResiduals(const FeatureView& view, std::size_t board)
      : View(Kind::features, view.camera, view.placement,
             transfer_blocks(view.projector, view.camera, view.placement, board)),
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
    case BlockId::Kind::scale:
      return 1;
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
  return views;
}

}  // namespace crumple
