#include "recon/station.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include <fmt/format.h>
#include <opencv2/core.hpp>

#include "recon/normals.h"
#include "recon/triangulate.h"

namespace crumple {
namespace {

// One orientation's depths over the image, in the camera's frame.
struct DepthImages {
  cv::Mat depth_mm;  // CV_64F, 0 where there is none
  cv::Mat rate;      // CV_64F, d depth / d coordinate, mm per px
  cv::Mat sigma_px;  // CV_32F
};

template <typename T>
double median_of(std::vector<T> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return static_cast<double>(*middle);
}

StripeCoordinates stripe_centres(const StripeImages& images, const StripeStack& stack, const DecodedStripes& decoded) {
  const StripeOrientation& o = stack.orientation;
  const double origin = stripe_origin_px(o, images.projector);
  StripeCoordinates result;
  decoded.stripe.convertTo(result.coordinate_px, CV_64F, o.stripe_width_px, origin + 0.5 * o.stripe_width_px);
  const cv::Mat none = decoded.stripe < 0;
  result.coordinate_px.setTo(0, none);
  // Uniform within the stripe.
  result.sigma_px = cv::Mat(decoded.stripe.size(), CV_32F, cv::Scalar(o.stripe_width_px / std::sqrt(12.0)));
  result.sigma_px.setTo(0, none);
  return result;
}

DepthImages triangulate(const StationGeometry& geometry, const StripeCoordinates& coordinates,
                        const Eigen::Vector2d& normal) {
  const cv::Size size = coordinates.sigma_px.size();
  const StripeTriangulator triangulator(geometry.projector, geometry.proj_from_cam, normal);
  DepthImages result{cv::Mat(size, CV_64F, cv::Scalar(0)), cv::Mat(size, CV_64F, cv::Scalar(0)), coordinates.sigma_px};
  cv::parallel_for_({0, size.height}, [&](const cv::Range& rows) {
    for (int y = rows.start; y < rows.end; ++y) {
      for (int x = 0; x < size.width; ++x) {
        if (coordinates.sigma_px.at<float>(y, x) <= 0 || !geometry.rays.has(x, y)) continue;
        const auto found = triangulator(geometry.rays.at(x, y), coordinates.coordinate_px.at<double>(y, x));
        if (!found) continue;
        result.depth_mm.at<double>(y, x) = found->depth_mm;
        result.rate.at<double>(y, x) = found->d_depth_d_coordinate;
      }
    }
  });
  return result;
}

OrientationReport describe(const StripeOrientation& orientation, const cv::Mat& rate, const cv::Mat& sigma_px,
                           int lit) {
  std::vector<float> sensitivities, sigmas;
  for (int y = 0; y < rate.rows; ++y) {
    for (int x = 0; x < rate.cols; ++x) {
      const float sigma = sigma_px.at<float>(y, x);
      if (sigma <= 0) continue;
      sigmas.push_back(sigma);
      // Where the ray found no depth in this orientation it knows nothing of it.
      const double r = rate.at<double>(y, x);
      sensitivities.push_back(r == 0 ? 0.0F : static_cast<float>(1 / std::abs(r)));
    }
  }
  OrientationReport report{.angle_rad = orientation.angle_rad, .reason = {}};
  report.decoded_fraction = lit > 0 ? static_cast<double>(sigmas.size()) / lit : 0;
  report.median_sigma_px = median_of(std::move(sigmas));
  report.sensitivity_px_per_mm = median_of(std::move(sensitivities));
  return report;
}

void leave_out_blind(std::vector<OrientationReport>& reports, double least_sensitivity) {
  double best = 0;
  for (const OrientationReport& r : reports) best = std::max(best, r.sensitivity_px_per_mm);
  for (OrientationReport& r : reports) {
    r.used = best > 0 && r.sensitivity_px_per_mm >= least_sensitivity * best;
    if (r.used) continue;
    const double degrees = r.angle_rad * 180 / M_PI;
    r.reason = r.decoded_fraction == 0
                   ? fmt::format("orientation {:.4g} deg was left out: no pixel could be decoded", degrees)
                   : fmt::format(
                         "orientation {:.4g} deg was left out: its stripes run along the epipolar lines and see "
                         "depth with {:.3g} px/mm against {:.3g} of the best",
                         degrees, r.sensitivity_px_per_mm, best);
  }
}

CloudPoint make_point(const StationGeometry& geometry, const Eigen::Vector3d& ray, const CombinedDepth& depth) {
  CloudPoint p;
  p.position_mm = geometry.probe_from_cam * (depth.depth_mm * ray);
  const Eigen::Vector3d along = geometry.probe_from_cam.rotation * (depth.sigma_mm * ray);
  p.covariance_mm2 = (along * along.transpose()).cast<float>();
  p.sigma_mm = static_cast<float>(along.norm());
  p.quality = static_cast<float>(depth.quality);
  return p;
}

class Station {
 public:
  Station(const StationGeometry& geometry, const StationReadings& readings, const StationOptions& options)
      : geometry_(geometry), readings_(readings), options_(options), lit_count_(cv::countNonZero(readings.lit)) {
    result_.cloud.stations = {options.name};
  }

  Expected<StationCloud> run() {
    for (std::size_t i = 0; i < readings_.orientations.size(); ++i) add_orientation(i);
    const bool weighted = options_.estimator == Estimator::weighted;
    leave_out_blind(result_.orientations,
                    weighted ? options_.weighted_least_sensitivity : options_.paper_least_sensitivity);
    options_.estimator == Estimator::edges ? collect_crossings() : collect_pixels();
    if (result_.cloud.points.empty()) {
      return fail(
          fmt::format("nothing could be reconstructed at {}: {} of {} pixels are lit; check the exposure, that the "
                      "frames belong to "
                      "their orientations, and that the rig belongs to this capture",
                      options_.name, lit_count_, readings_.lit.total()));
    }
    summarise();
    return std::move(result_);
  }

 private:
  void add_orientation(std::size_t i) {
    const StripeOrientation& orientation = readings_.orientations[i];
    depths_.push_back(triangulate(geometry_, readings_.coordinates[i], orientation.normal()));
    result_.orientations.push_back(describe(orientation, depths_.back().rate, depths_.back().sigma_px, lit_count_));
  }

  std::optional<CombinedDepth> combine(int x, int y) const {
    std::vector<DepthReading> readings;
    for (std::size_t i = 0; i < depths_.size(); ++i) {
      const DepthImages& d = depths_[i];
      if (!result_.orientations[i].used || d.depth_mm.at<double>(y, x) <= 0) continue;
      readings.push_back({d.depth_mm.at<double>(y, x), d.rate.at<double>(y, x), d.sigma_px.at<float>(y, x)});
    }
    if (readings.empty()) return std::nullopt;
    if (options_.estimator == Estimator::paper) return average_depth(readings);
    return weighted_depth(readings, options_.common_sigma_px, options_.gate);
  }

  void collect_pixels() {
    const cv::Size size = readings_.lit.size();
    result_.depth_mm = cv::Mat(size, CV_64F, cv::Scalar(0));
    result_.sigma_mm = cv::Mat(size, CV_32F, cv::Scalar(0));
    cv::Mat quality(size, CV_32F, cv::Scalar(0));
    cv::parallel_for_({0, size.height}, [&](const cv::Range& rows) {
      for (int y = rows.start; y < rows.end; ++y) {
        for (int x = 0; x < size.width; ++x) {
          if (readings_.lit.at<std::uint8_t>(y, x) == 0) continue;
          const auto depth = combine(x, y);
          if (!depth) continue;
          result_.depth_mm.at<double>(y, x) = depth->depth_mm;
          result_.sigma_mm.at<float>(y, x) = static_cast<float>(depth->sigma_mm);
          quality.at<float>(y, x) = static_cast<float>(depth->quality);
        }
      }
    });
    leave_out_uncertain();
    for (int y = 0; y < size.height; ++y) {
      for (int x = 0; x < size.width; ++x) {
        const double depth = result_.depth_mm.at<double>(y, x);
        if (depth > 0) add_pixel(x, y, {depth, result_.sigma_mm.at<float>(y, x), quality.at<float>(y, x)});
      }
    }
  }

  void leave_out_uncertain() {
    std::vector<float> sigmas;
    for (const float sigma : cv::Mat_<float>(result_.sigma_mm)) {
      if (sigma > 0) sigmas.push_back(sigma);
    }
    const cv::Mat uncertain = result_.sigma_mm > options_.largest_sigma_ratio * median_of(std::move(sigmas));
    result_.depth_mm.setTo(0, uncertain);
    result_.sigma_mm.setTo(0, uncertain);
  }

  void add_pixel(int x, int y, const CombinedDepth& depth) {
    CloudPoint p = make_point(geometry_, geometry_.rays.at(x, y), depth);
    const Eigen::Vector3d normal = grid_normal(result_.depth_mm, geometry_.rays, x, y);
    p.normal = (geometry_.probe_from_cam.rotation * normal).cast<float>();
    p.intensity = intensity(x, y);
    result_.cloud.points.push_back(p);
  }

  float intensity(int x, int y) const {
    const cv::Mat& white = readings_.white;
    const double grey = white.depth() == CV_16U ? white.at<std::uint16_t>(y, x) : white.at<std::uint8_t>(y, x);
    return static_cast<float>(grey / full_range(white));
  }

  void collect_crossings() {
    for (std::size_t i = 0; i < readings_.crossings.size(); ++i) {
      if (!result_.orientations[i].used) continue;
      const StripeTriangulator triangulator(geometry_.projector, geometry_.proj_from_cam,
                                            readings_.orientations[i].normal());
      for (const StripeCrossing& crossing : readings_.crossings[i]) add_crossing(triangulator, crossing);
    }
  }

  void add_crossing(const StripeTriangulator& triangulator, const StripeCrossing& crossing) {
    const auto ray = geometry_.camera.ray(crossing.camera_pixel);
    const auto beside = geometry_.camera.ray(crossing.camera_pixel + crossing.direction);
    if (!ray || !beside || ray->z() <= 0 || beside->z() <= 0) return;
    const auto found = triangulator(*ray, crossing.coordinate_px);
    if (!found) return;
    // What a shift of the camera pixel does to the coordinate at fixed depth, and so to depth at a fixed coordinate.
    const auto here = triangulator.coordinate_px(*ray, found->depth_mm);
    const auto there = triangulator.coordinate_px(*beside, found->depth_mm);
    if (!here || !there) return;
    const double sigma = std::abs(found->d_depth_d_coordinate * (*there - *here)) * crossing.sigma_px;
    CloudPoint p = make_point(geometry_, *ray, {.depth_mm = found->depth_mm, .sigma_mm = sigma, .quality = 0.5});
    p.intensity = intensity(static_cast<int>(std::lround(crossing.camera_pixel.x())),
                            static_cast<int>(std::lround(crossing.camera_pixel.y())));
    result_.cloud.points.push_back(p);
  }

  void summarise() {
    std::vector<float> sigmas;
    for (const CloudPoint& p : result_.cloud.points) sigmas.push_back(p.sigma_mm);
    result_.median_sigma_mm = median_of(std::move(sigmas));
    result_.decoded_fraction = static_cast<double>(result_.cloud.points.size()) / lit_count_;
  }

  const StationGeometry& geometry_;
  const StationReadings& readings_;
  const StationOptions& options_;
  int lit_count_ = 0;
  std::vector<DepthImages> depths_;
  StationCloud result_;
};

}  // namespace

StationGeometry::StationGeometry(const Lens& camera_lens, const Lens& projector_lens, const Pose& camera_from_probe,
                                 const Pose& projector_from_probe)
    : camera(camera_lens),
      projector(projector_lens),
      proj_from_cam(projector_from_probe * camera_from_probe.inverse()),
      probe_from_cam(camera_from_probe.inverse()),
      rays(camera_lens) {}

Expected<StationReadings> read_stripes(const StripeImages& images, const StationOptions& options) {
  if (auto sound = check_images(images); !sound) return tl::unexpected(sound.error());
  StationReadings readings{images.projector, images.white, lit_mask(images, options.decode), {}, {}, {}};
  for (std::size_t i = 0; i < images.stacks.size(); ++i) {
    const auto decoded = decode_stripes(images, i, readings.lit, options.decode);
    if (!decoded) return tl::unexpected(decoded.error());
    readings.orientations.push_back(images.stacks[i].orientation);
    readings.coordinates.push_back(options.estimator == Estimator::weighted
                                       ? estimate_stripe_phase(images, i, *decoded, options.phase)
                                       : stripe_centres(images, images.stacks[i], *decoded));
    if (options.estimator == Estimator::edges) {
      readings.crossings.push_back(find_stripe_edges(images, i, *decoded, options.edges));
    }
  }
  return readings;
}

Expected<StationCloud> reconstruct_readings(const StationGeometry& geometry, const StationReadings& readings,
                                            const StationOptions& options) {
  const ImageSize camera = geometry.camera.size();
  if (readings.white.cols != camera.width_px || readings.white.rows != camera.height_px) {
    return fail(fmt::format("{}: its frames are {} x {} but the rig's camera is {} x {}: is it another rig's capture?",
                            options.name, readings.white.cols, readings.white.rows, camera.width_px, camera.height_px));
  }
  if (!(readings.projector == geometry.projector.size())) {
    return fail(fmt::format("{}: its stripes are for a projector of {} x {} but the rig's has {} x {}", options.name,
                            readings.projector.width_px, readings.projector.height_px,
                            geometry.projector.size().width_px, geometry.projector.size().height_px));
  }
  return Station(geometry, readings, options).run();
}

Expected<StationCloud> reconstruct_station(const StationGeometry& geometry, const StripeImages& images,
                                           const StationOptions& options) {
  const auto readings = read_stripes(images, options);
  if (!readings) return fail(fmt::format("{}: {}", options.name, readings.error().message));
  return reconstruct_readings(geometry, *readings, options);
}

}  // namespace crumple
