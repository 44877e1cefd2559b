// What is to be measured in a cloud, as YAML: crumple-measure/1 (points, planes, spheres, distances and angles) and
// crumple-vdi2634/1 (artefacts with their certificates). docs/formats.md has the keys. Coordinates are those of the
// cloud's frame, mm.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "solvers/expected.h"

namespace crumple {

// Where a feature's points are looked for: within a ball or, of planes, a box along the axes.
struct PlannedFeature {
  enum class Kind { point, plane, sphere };
  std::string name;
  Kind kind = Kind::point;
  Eigen::Vector3d near_mm = Eigen::Vector3d::Zero();  // of spheres roughly the centre
  double radius_mm = 0;                               // of the ball; of spheres their own, roughly
  std::optional<Eigen::AlignedBox3d> box_mm = {};     // in place of the ball
};

struct MeasuringPlan {
  std::vector<PlannedFeature> features;             // points, planes, spheres; names are all different
  std::vector<std::vector<std::size_t>> distances;  // of two features, a plane second
  std::vector<std::vector<std::size_t>> angles;     // of two planes, or at the second of three points or spheres
};

// A value with its standard uncertainty, by a certificate.
struct CertifiedLength {
  double length_mm = 0;
  double sigma_mm = 0;
};

struct BallBar {
  std::string name;
  std::size_t from = 0;  // features
  std::size_t to = 0;
  CertifiedLength length;  // between the centres
};

struct AcceptancePlan {
  std::vector<PlannedFeature> features;    // spheres, then plates
  std::vector<CertifiedLength> diameters;  // of the spheres
  std::vector<BallBar> bars;
  // Of probing_form, probing_size, sphere_spacing, length and flatness those that are stated.
  std::map<std::string, double> limits_mm;
};

// Fail, naming file, line and key, on whatever is not as docs/formats.md has it, such as a name that there is not.
Expected<MeasuringPlan> read_measuring_plan(const std::filesystem::path& file);
Expected<AcceptancePlan> read_acceptance_plan(const std::filesystem::path& file);

}  // namespace crumple
