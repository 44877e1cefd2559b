// Surfaces that the renderer can look at, exactly: height fields over a rectangle.
//
// Surface frame, mm: z = height(x, y), z pointing into the body, away from a viewer who sees x to the right and y down
// (the frame of solvers/board.h). Everything the renderer and the scoring need follows from height and slope, so what
// is rendered and what a cloud is scored against are the same function, never a tessellation of it.
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include "calib/target_print.h"
#include "solvers/board.h"

namespace crumple {

// Lambert's diffuse reflection and a glossy lobe (see light.h).
struct Material {
  double albedo = 0.5;     // 0..1
  double gloss = 0;        // reflectance of the glossy coat at normal incidence, 0..1 (clear coat: 0.04)
  double roughness = 0.3;  // of the lobe: GGX's alpha, 0..1
  double thermal = 0.5;    // what a thermal camera sees of it, as a radiance
};

struct Extent {
  Eigen::Vector2d low = Eigen::Vector2d::Zero();
  Eigen::Vector2d high = Eigen::Vector2d::Zero();

  bool contains(const Eigen::Vector2d& xy) const;
  Eigen::Vector2d clamped(const Eigen::Vector2d& xy) const;
};

struct SurfacePoint {
  Eigen::Vector3d position_mm;
  Eigen::Vector3d normal;  // unit, towards the viewer's side (negative z)
};

class Surface {
 public:
  virtual ~Surface() = default;

  virtual Extent extent() const = 0;
  virtual double height_mm(double x, double y) const = 0;
  virtual Eigen::Vector2d slope(double x, double y) const = 0;
  virtual Material material(double x, double y) const = 0;
  // Where the surface is, within its extent; elsewhere height and slope are finite all the same.
  virtual bool exists(double, double) const { return true; }

  SurfacePoint at(double x, double y) const;

  // Where the ray origin + t * direction meets the surface, by Newton's method from a start at most a few mm off. No
  // value where it does not settle to 1e-9 mm inside the extent, as along a silhouette.
  std::optional<double> meet(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, double t_start) const;

  // The point of the surface nearest to `point`: the best of a grid of starts that must contain its basin unless the
  // surface bends more sharply than the point is far away, then Gauss-Newton kept inside the extent.
  Eigen::Vector3d nearest(const Eigen::Vector3d& point) const;

  // Distance to the nearest point; positive on the viewer's side.
  double distance_mm(const Eigen::Vector3d& point) const;
};

// A printed target on a plate, with a white margin around everything dark.
class BoardPlate final : public Surface {
 public:
  BoardPlate(const Target& target, const Eigen::Vector2d& warp_mm, double margin_mm, const Material& white,
             const Material& black);

  const Target& target() const { return target_; }
  const Board& board() const { return board_; }
  Extent extent() const override;
  double height_mm(double x, double y) const override { return board_.height_mm(x, y); }
  Eigen::Vector2d slope(double x, double y) const override { return board_.d_height_d_xy(x, y); }
  Material material(double x, double y) const override;

 private:
  Target target_;
  TargetPrint print_;
  Board board_;
  double margin_mm_;
  Material white_;
  Material black_;
};

// A fold along a line; positive angles fold both sides away from the viewer. The edge is rounded: height
// tan(angle / 2) (sqrt(d^2 + r^2) - r) at distance d from the line.
struct Crease {
  Eigen::Vector2d through_mm = Eigen::Vector2d::Zero();
  double direction_rad = 0;  // of the line, from x towards y
  double angle_rad = 0;
  double radius_mm = 1;
};

// A bowl pressed in, such as behind a door handle: depth exp(-q^2), q = (x/a)^2 + (y/b)^2 from its centre.
struct Recess {
  Eigen::Vector2d centre_mm = Eigen::Vector2d::Zero();
  Eigen::Vector2d half_size_mm = Eigen::Vector2d::Ones();
  double depth_mm = 0;
};

// A round dent: depth exp(-r^2 / (2 radius^2)); negative depth is a bump.
struct Dent {
  Eigen::Vector2d centre_mm = Eigen::Vector2d::Zero();
  double radius_mm = 1;
  double depth_mm = 0;
};

// A long dent along a line, as where a pillar was pushed in: depth exp(-(u/length)^4) profile(v), u along the line and
// v across it. The profile is exp(-(v/width)^2); with an edge radius r it is a crease that ends, exp(-(sqrt(v^2 + r^2)
// - r) / width).
struct Press {
  Eigen::Vector2d centre_mm = Eigen::Vector2d::Zero();
  double direction_rad = 0;  // of the line, from x towards y
  double half_length_mm = 1;
  double half_width_mm = 1;
  double depth_mm = 0;
  double edge_radius_mm = 0;
};

struct PanelShape {
  Eigen::Vector2d size_mm = Eigen::Vector2d(600, 450);         // the origin is the centre
  Eigen::Vector2d curvature_per_mm = Eigen::Vector2d::Zero();  // along x and y; positive bulges towards the viewer
  std::vector<Crease> creases;
  std::vector<Recess> recesses;
  std::vector<Dent> dents;
  std::vector<Press> presses;
};

// The side of a car of this length and height: curved along both, a shoulder line, a waist and a sill, a handle on each
// of two doors.
PanelShape car_side(const Eigen::Vector2d& size_mm);

// A painted body panel: gentle double curvature, character lines, a handle's recess, dents.
class Panel final : public Surface {
 public:
  Panel(PanelShape shape, const Material& paint);

  const PanelShape& shape() const { return shape_; }
  Extent extent() const override;
  double height_mm(double x, double y) const override;
  Eigen::Vector2d slope(double x, double y) const override;
  Material material(double, double) const override { return paint_; }

 private:
  // A crease as the height function needs it.
  struct Fold {
    Eigen::Vector2d through;
    Eigen::Vector2d normal;  // of the line, in the plane
    double tangent;
    double radius;
  };

  PanelShape shape_;
  Material paint_;
  std::vector<Fold> folds_;
};

// The front of balls of one radius side by side: a reference sphere, or a ball bar without its bar. Their centres lie
// in z = 0. A ball is there up to `kBallRim` of its radius from its axis, where it slopes by 76 degrees.
class Balls final : public Surface {
 public:
  static constexpr double kBallRim = 0.97;

  // Precondition: at least one centre; balls do not overlap.
  Balls(double radius_mm, std::vector<Eigen::Vector2d> centres_mm, const Material& finish);

  double radius_mm() const { return radius_mm_; }
  const std::vector<Eigen::Vector2d>& centres_mm() const { return centres_mm_; }
  Extent extent() const override;
  double height_mm(double x, double y) const override;
  Eigen::Vector2d slope(double x, double y) const override;
  Material material(double, double) const override { return finish_; }
  bool exists(double x, double y) const override;

 private:
  Eigen::Vector2d from_nearest_centre(double x, double y) const;

  double radius_mm_;
  std::vector<Eigen::Vector2d> centres_mm_;
  Material finish_;
};

}  // namespace crumple
