// A made rig for the tests of the formats: cameras of one lens model, a projector, a covariance; and how to damage
// files.
#pragma once

#include <cmath>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "datasets/formats/rig_format.h"
#include "tests/temporary_folder.h"

namespace crumple {

inline Lens made_lens(const std::string& model, double focal_px) {
  std::vector<double> parameters(lens_parameter_names(model).size());
  for (std::size_t i = 0; i < parameters.size(); ++i) parameters[i] = 0.03 * std::cos(static_cast<double>(i)) / 3;
  parameters[0] = focal_px;
  parameters[1] = focal_px + 1.0 / 3;
  parameters[2] = 639.5 + 1e-7;
  parameters[3] = 511.25;
  if (parameters.size() > 7) parameters[7] = 1e-7;  // a number that wants an exponent
  return Lens::create(model, {1280, 1024}, parameters).value();
}

// cam0 at the reference, further cameras turned and moved, and a projector of OPENCV5.
inline RigToExport made_rig(const std::string& model, int cameras) {
  RigToExport source;
  for (int i = 0; i < cameras; ++i) {
    const Pose pose{rotation_from_vector({0.1 * i, -0.2 * i, 0.05 * i}), {-110.0 / 3 * i, 5.5 * i, 1e-3 * i}};
    source.rig.sensors.push_back({"cam" + std::to_string(i), SensorKind::camera, made_lens(model, 1000.1 + i), pose});
  }
  source.rig.sensors.push_back({"proj0",
                                SensorKind::projector,
                                made_lens("LENSMODEL_OPENCV5", 1900),
                                {rotation_from_vector({0.3, 0, 0}), {0, 200, -30}}});
  source.rig.covariance = {{"cam0.fx"}, Eigen::MatrixXd::Identity(1, 1)};
  source.rig.sigma_px = {{"cam0.corners", 0.1}};
  return source;
}

inline std::vector<double> with_zeros(std::vector<double> parameters, std::size_t count) {
  parameters.resize(count);
  return parameters;
}

// `model` and `terms`: what the lens is read back as where the format has no exact name for it.
inline void expect_camera(const Sensor& read, const Sensor& expected, const std::string& model) {
  EXPECT_EQ(read.name, expected.name);
  EXPECT_EQ(read.kind, expected.kind);
  EXPECT_EQ(read.lens.model(), model);
  EXPECT_EQ(read.lens.size(), expected.lens.size());
  const std::vector<double> parameters = with_zeros(expected.lens.parameters(), read.lens.parameters().size());
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    EXPECT_NEAR(read.lens.parameters()[i], parameters[i], 1e-12) << read.name << ' ' << i;
  }
  const Vector6d step = local_step(expected.sensor_from_mount, read.sensor_from_mount);
  EXPECT_LT(step.head<3>().norm(), 1e-14) << read.name;
  EXPECT_LT(step.tail<3>().norm(), 1e-11) << read.name;
}

// Writes and reads back, from the folder.
inline Expected<Rig> there_and_back(const std::string& format, const RigToExport& source,
                                    std::vector<std::string>* lost = nullptr) {
  const TemporaryFolder home;
  const RigFormat chosen = rig_format(format).value();
  const auto written = chosen.write(source, home.path());
  if (!written) return tl::unexpected(written.error());
  if (lost != nullptr) *lost = *written;
  return chosen.read({home.path()});
}

struct FileDamage {
  std::string file;
  std::string old_text;
  std::string new_text;
  std::string said;
};

inline void PrintTo(const FileDamage& damage, std::ostream* stream) {
  *stream << damage.file << ": " << damage.old_text << " -> " << damage.new_text;
}

// The made rig with one text replaced has to be refused, naming file and reason.
inline void expect_damage_is_refused(const std::string& format, const RigToExport& source, const FileDamage& damage) {
  const TemporaryFolder home;
  const RigFormat chosen = rig_format(format).value();
  ASSERT_TRUE(chosen.write(source, home.path()));
  ASSERT_THAT(content_of(home / damage.file), testing::HasSubstr(damage.old_text));
  replace_in(home / damage.file, damage.old_text, damage.new_text);
  const auto read = chosen.read({home.path()});
  ASSERT_FALSE(read);
  EXPECT_THAT(read.error().message, testing::HasSubstr(damage.file));
  EXPECT_THAT(read.error().message, testing::HasSubstr(damage.said));
}

inline void expect_lens_is_refused(const std::string& format, const std::string& model) {
  const TemporaryFolder home;
  const auto written = rig_format(format).value().write(made_rig(model, 2), home.path());
  ASSERT_FALSE(written) << model;
  EXPECT_THAT(written.error().message,
              testing::AllOf(testing::HasSubstr("cam0 has the lens model " + model), testing::HasSubstr("it holds")));
  EXPECT_EQ(home.entries(), 0);
}

inline const std::string splined_model = "LENSMODEL_SPLINED_STEREOGRAPHIC_order=3_Nx=11_Ny=8_fov_x_deg=120";

}  // namespace crumple
