#include "solvers/overlap_residuals.h"

#include <algorithm>
#include <cmath>

#include "solvers/stripe_point.h"

namespace crumple {
namespace {

constexpr double kGrazing = 0.02;  // cosine between ray and normal below which the plane gives no point

class OverlapResiduals final : public View {
 public:
  explicit OverlapResiduals(const OverlapView& view)
      : View(Kind::overlaps, view.here.projector, std::nullopt, view.here.station, blocks_of(view)), view_(view) {}

  int size() const override { return static_cast<int>(view_.here.coordinates_px.size()); }

  bool evaluate(const CalibrationState& state, bool with_jacobians, ViewEvaluation& evaluation) const override {
    int columns = 0;
    for (const BlockId& block : blocks()) columns += tangent_size(block, state);
    evaluation.residuals.resize(size());
    evaluation.jacobian.setZero(with_jacobians ? size() : 0, columns);
    if (with_jacobians) evaluation.local_from_blocks.setIdentity(columns, columns);
    for (int i = 0; i < size(); ++i) {
      if (!evaluate_point(state, static_cast<std::size_t>(i), with_jacobians, evaluation)) return false;
    }
    return true;
  }

 private:
  // Each block once, though both sides hold it.
  static std::vector<BlockId> blocks_of(const OverlapView& view) {
    std::vector<BlockId> blocks;
    for (const StripePoints* side : {&view.here, &view.there}) {
      for (const BlockId& block : {BlockId{BlockId::Kind::lens, side->camera},
                                   {BlockId::Kind::mount, side->camera},
                                   {BlockId::Kind::lens, side->projector},
                                   {BlockId::Kind::mount, side->projector}}) {
        if (std::find(blocks.begin(), blocks.end(), block) == blocks.end()) blocks.push_back(block);
      }
    }
    blocks.push_back({BlockId::Kind::station, view.here.station});
    blocks.push_back({BlockId::Kind::station, view.there.station});
    return blocks;
  }

  void add(const CalibrationState& state, const BlockId& block, const Eigen::RowVectorXd& derivative,
           Eigen::Ref<Eigen::RowVectorXd> row) const {
    int column = 0;
    for (const BlockId& of_view : blocks()) {
      if (of_view == block) row.segment(column, derivative.size()) += derivative;
      column += tangent_size(of_view, state);
    }
  }

  bool evaluate_point(const CalibrationState& state, std::size_t i, bool with_jacobians,
                      ViewEvaluation& evaluation) const {
    const StripePoints &here = view_.here, &there = view_.there;
    const auto& sensors = state.rig.sensors;
    const Pose& world_from_here = state.world_from_probe[here.station];
    const Pose& world_from_there = state.world_from_probe[there.station];
    const auto ray = probe_ray(sensors[here.camera], here.camera_pixels[i], with_jacobians);
    const auto other = stripe_point(sensors[there.camera], sensors[there.projector], there.normal,
                                    there.camera_pixels[i], there.coordinates_px[i], with_jacobians);
    if (!ray || !other) return false;
    const Eigen::Vector3d normal = world_from_there.rotation * view_.there_normals[i];  // in the world, as what follows
    const Eigen::Vector3d on_plane = world_from_there * other->in_probe;
    const Eigen::Vector3d direction = world_from_here.rotation * ray->direction;
    const double slope = normal.dot(direction);
    if (std::abs(slope) < kGrazing * direction.norm()) return false;
    const double depth = normal.dot(on_plane - world_from_here * ray->origin_mm) / slope;
    const Eigen::Vector3d point = ray->at(depth);
    const auto met = depth > 0 ? stripe_coordinate(sensors[here.projector], here.normal, point) : std::nullopt;
    if (!met) return false;
    const auto row = static_cast<Eigen::Index>(i);
    evaluation.residuals[row] = met->value_px - here.coordinates_px[i];
    if (!with_jacobians) return true;

    // A point that leaves the plane by normal . d comes back along the ray.
    const double back = met->d_point.dot(ray->direction) / slope;
    const Eigen::RowVector3d in_probe =
        met->d_point - back * normal.transpose() * world_from_here.rotation.toRotationMatrix();
    const Eigen::RowVector3d by_plane = back * normal.transpose();  // by a motion of the plane's point in the world
    const Eigen::RowVector3d by_other = by_plane * world_from_there.rotation.toRotationMatrix();
    Eigen::RowVector<double, 6> d_there = by_plane * d_transformed_d_pose(world_from_there, other->in_probe);
    d_there.head<3>() -= back * normal.cross(world_from_here * point - on_plane).transpose();

    const auto target = [&](const BlockId& block, const Eigen::RowVectorXd& derivative) {
      add(state, block, derivative, evaluation.jacobian.row(row));
    };
    target({BlockId::Kind::lens, here.camera}, depth * in_probe * ray->d_lens);
    target({BlockId::Kind::mount, here.camera}, in_probe * ray->d_mount(depth));
    target({BlockId::Kind::lens, here.projector}, met->d_lens);
    target({BlockId::Kind::mount, here.projector}, met->d_mount);
    target({BlockId::Kind::station, here.station}, -by_plane * d_transformed_d_pose(world_from_here, point));
    target({BlockId::Kind::lens, there.camera}, by_other * other->d_camera_lens);
    target({BlockId::Kind::mount, there.camera}, by_other * other->d_camera_mount);
    target({BlockId::Kind::lens, there.projector}, by_other * other->d_projector_lens);
    target({BlockId::Kind::mount, there.projector}, by_other * other->d_projector_mount);
    target({BlockId::Kind::station, there.station}, d_there);
    return true;
  }

  const OverlapView& view_;
};

}  // namespace

std::unique_ptr<View> overlap_view(const OverlapView& observations) {
  return std::make_unique<OverlapResiduals>(observations);
}

}  // namespace crumple
