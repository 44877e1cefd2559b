#include "tests/benchmark/car_distances.h"

#include <Eigen/LU>

#include "solvers/stripe_point.h"

namespace crumple {
namespace {

struct BallCentre {
  Eigen::Vector3d in_probe;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  Matrix3Xd d_rig[4];  // camera's lens and mount, projector's
};

const BlockId kRigBlocks[] = {
    {BlockId::Kind::lens, 0}, {BlockId::Kind::mount, 0}, {BlockId::Kind::lens, 1}, {BlockId::Kind::mount, 1}};

// Least squares of the distances from the centre, less the radius, each over its sigma along the normal.
Expected<BallCentre> fit_ball(const Rig& rig, const SeenBall& seen, double radius_mm, double sigma_px) {
  const Eigen::Vector2d columns = Eigen::Vector2d::UnitX();
  std::vector<StripePoint> points;
  for (std::size_t i = 0; i < seen.camera_pixels.size(); ++i) {
    auto point = stripe_point(rig.sensors[0], rig.sensors[1], columns, seen.camera_pixels[i], seen.coordinates_px[i]);
    if (!point) return fail("a pixel of a ball has no point");
    points.push_back(std::move(*point));
  }
  BallCentre ball{points.front().in_probe, {}, {}};
  for (const StripePoint& point : points) {
    if (point.in_probe.z() < ball.in_probe.z()) ball.in_probe = point.in_probe;
  }
  ball.in_probe.z() += radius_mm;
  Eigen::Matrix3d information;
  for (int round = 0; round < 15; ++round) {
    information.setZero();
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    for (Matrix3Xd& d : ball.d_rig) d.resize(3, 0);
    Matrix3Xd sums[4];
    for (const StripePoint& point : points) {
      const Eigen::Vector3d from = point.in_probe - ball.in_probe;
      const Eigen::Vector3d normal = from.normalized();
      const double along = normal.dot(point.d_coordinate) * sigma_px;
      const Eigen::Matrix3d weighted = normal * normal.transpose() / (along * along);
      information += weighted;
      right += normal * (from.norm() - radius_mm) / (along * along);
      if (round < 14) continue;
      const Matrix3Xd d[] = {point.d_camera_lens, point.d_camera_mount, point.d_projector_lens,
                             point.d_projector_mount};
      for (int k = 0; k < 4; ++k) {
        if (sums[k].cols() == 0) sums[k].setZero(3, d[k].cols());
        sums[k] += weighted * d[k];
      }
    }
    ball.covariance = information.inverse();
    ball.in_probe += ball.covariance * right;
    for (int k = 0; k < 4; ++k) ball.d_rig[k] = ball.covariance * sums[k];
  }
  return ball;
}

struct PlacedBall {
  Eigen::Vector3d in_world = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  std::map<BlockId, Matrix3Xd> d_block;
};

void add(const Matrix3Xd& derivative, const BlockId& block, PlacedBall& ball) {
  auto [found, is_new] = ball.d_block.try_emplace(block, derivative);
  if (!is_new) found->second += derivative;
}

void add_rows(const Eigen::RowVector3d& direction, const std::map<BlockId, Matrix3Xd>& d, double sign,
              BallDistance& distance) {
  for (const auto& [block, derivative] : d) {
    const Eigen::RowVectorXd row = sign * direction * derivative;
    auto [found, is_new] = distance.d_block.try_emplace(block, row);
    if (!is_new) found->second += row;
  }
}

}  // namespace

Expected<std::vector<BallDistance>> ball_distances(const Rig& rig, const std::vector<Pose>& world_from_probe,
                                                   const MadeCar& car, double least_mm) {
  std::vector<PlacedBall> balls(car.balls_mm.size());
  std::vector<int> visits(car.balls_mm.size());
  for (const SeenBall& seen : car.seen) ++visits[seen.ball];
  for (const SeenBall& seen : car.seen) {
    const auto centre = fit_ball(rig, seen, car.ball_radius_mm, car.ball_sigma_px);
    if (!centre) return tl::unexpected(centre.error());
    const Pose& pose = world_from_probe[seen.station];
    const double share = 1.0 / visits[seen.ball];
    const Eigen::Matrix3d rotation = share * pose.rotation.toRotationMatrix();
    PlacedBall& ball = balls[seen.ball];
    ball.in_world += share * (pose * centre->in_probe);
    ball.covariance += rotation * centre->covariance * rotation.transpose();
    for (int k = 0; k < 4; ++k) add(rotation * centre->d_rig[k], kRigBlocks[k], ball);
    add(share * d_transformed_d_pose(pose, centre->in_probe), {BlockId::Kind::station, seen.station}, ball);
  }
  std::vector<BallDistance> distances;
  for (std::size_t i = 0; i < balls.size(); ++i) {
    for (std::size_t k = i + 1; k < balls.size(); ++k) {
      const double truth = (car.balls_mm[i] - car.balls_mm[k]).norm();
      if (visits[i] == 0 || visits[k] == 0 || truth < least_mm) continue;
      const Eigen::Vector3d apart = balls[i].in_world - balls[k].in_world;
      const Eigen::Vector3d direction = apart.normalized();
      BallDistance distance{apart.norm(), truth, {}, 0};
      distance.decoding_mm2 = direction.dot((balls[i].covariance + balls[k].covariance) * direction);
      add_rows(direction.transpose(), balls[i].d_block, 1, distance);
      add_rows(direction.transpose(), balls[k].d_block, -1, distance);
      distances.push_back(std::move(distance));
    }
  }
  return distances;
}

}  // namespace crumple
