#include "datasets/render/tracer.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <embree3/rtcore.h>

namespace crumple {
namespace {

constexpr double mesh_step_mm = 2;
constexpr int fewest_cells = 8;
constexpr int most_cells = 2000;
// Lifts shadow rays clear of the mesh, whose facets stray from the surface by some 0.01 mm at its sharpest bends.
constexpr double shadow_lift_mm = 0.05;

int cells_along(double length_mm) {
  return std::clamp(static_cast<int>(std::ceil(length_mm / mesh_step_mm)), fewest_cells, most_cells);
}

void add_mesh(RTCDevice device, RTCScene scene, const Surface& surface) {
  const Extent extent = surface.extent();
  const Eigen::Vector2d size = extent.high - extent.low;
  const auto columns = static_cast<unsigned>(cells_along(size.x()));
  const auto rows = static_cast<unsigned>(cells_along(size.y()));
  RTCGeometry mesh = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* vertex = static_cast<float*>(rtcSetNewGeometryBuffer(mesh, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                                             3 * sizeof(float), (columns + 1) * (rows + 1)));
  for (unsigned j = 0; j <= rows; ++j) {
    for (unsigned i = 0; i <= columns; ++i) {
      const double x = extent.low.x() + size.x() * i / columns;
      const double y = extent.low.y() + size.y() * j / rows;
      *vertex++ = static_cast<float>(x);
      *vertex++ = static_cast<float>(y);
      *vertex++ = static_cast<float>(surface.height_mm(x, y));
    }
  }
  const auto is_there = [&](unsigned i, unsigned j) {
    return surface.exists(extent.low.x() + size.x() * i / columns, extent.low.y() + size.y() * j / rows);
  };
  std::vector<unsigned> triangles;
  triangles.reserve(std::size_t{6} * columns * rows);
  for (unsigned j = 0; j < rows; ++j) {
    for (unsigned i = 0; i < columns; ++i) {
      if (!is_there(i, j) && !is_there(i + 1, j) && !is_there(i, j + 1) && !is_there(i + 1, j + 1)) continue;
      const unsigned corner = j * (columns + 1) + i;
      const unsigned below = corner + columns + 1;
      for (const unsigned v : {corner, corner + 1, below, corner + 1, below + 1, below}) triangles.push_back(v);
    }
  }
  void* index = rtcSetNewGeometryBuffer(mesh, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(unsigned),
                                        triangles.size() / 3);
  std::copy(triangles.begin(), triangles.end(), static_cast<unsigned*>(index));
  rtcCommitGeometry(mesh);
  rtcAttachGeometry(scene, mesh);
  rtcReleaseGeometry(mesh);
}

RTCRay ray_along(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, float far) {
  RTCRay ray{};
  ray.org_x = static_cast<float>(origin.x());
  ray.org_y = static_cast<float>(origin.y());
  ray.org_z = static_cast<float>(origin.z());
  ray.dir_x = static_cast<float>(direction.x());
  ray.dir_y = static_cast<float>(direction.y());
  ray.dir_z = static_cast<float>(direction.z());
  ray.tnear = 0;
  ray.tfar = far;
  ray.mask = ~0U;
  return ray;
}

}  // namespace

struct Tracer::Embree {
  RTCDevice device = rtcNewDevice("threads=1");
  RTCScene scene = rtcNewScene(device);

  explicit Embree(const Surface& surface) {
    rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);
    rtcSetSceneBuildQuality(scene, RTC_BUILD_QUALITY_HIGH);
    add_mesh(device, scene, surface);
    rtcCommitScene(scene);
  }
  ~Embree() {
    rtcReleaseScene(scene);
    rtcReleaseDevice(device);
  }
  Embree(const Embree&) = delete;
  Embree& operator=(const Embree&) = delete;
};

Tracer::Tracer(const Surface& surface) : surface_(surface), embree_(std::make_unique<const Embree>(surface)) {}
Tracer::~Tracer() = default;
Tracer::Tracer(Tracer&&) noexcept = default;

std::optional<Eigen::Vector3d> Tracer::first_hit(const Eigen::Vector3d& origin,
                                                 const Eigen::Vector3d& direction) const {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCRayHit hit{};
  hit.ray = ray_along(origin, direction, std::numeric_limits<float>::infinity());
  hit.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(embree_->scene, &context, &hit);
  if (hit.hit.geomID == RTC_INVALID_GEOMETRY_ID) return std::nullopt;
  const std::optional<double> t = surface_.meet(origin, direction, static_cast<double>(hit.ray.tfar));
  if (!t) return std::nullopt;
  return origin + *t * direction;
}

bool Tracer::shadowed(const SurfacePoint& point, const Eigen::Vector3d& light) const {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  const Eigen::Vector3d lifted = point.position_mm + shadow_lift_mm * point.normal;
  RTCRay ray = ray_along(lifted, light - lifted, 1.0F);
  rtcOccluded1(embree_->scene, &context, &ray);
  return ray.tfar < 0;
}

}  // namespace crumple
