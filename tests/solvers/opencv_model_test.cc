#include "solvers/opencv_model.h"

#include <vector>

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

extern "C" {
#include <mrcal/mrcal.h>
}

namespace crumple {
namespace {

struct Model {
  const char* name;
  int count;
};

constexpr Model kModels[] = {{"LENSMODEL_PINHOLE", 4},
                             {"LENSMODEL_OPENCV4", 8},
                             {"LENSMODEL_OPENCV5", 9},
                             {"LENSMODEL_OPENCV8", 12},
                             {"LENSMODEL_OPENCV12", 16}};

RC_GTEST_PROP(OpencvModel, EqualsLibmrcal, ()) {
  const Model model = kModels[*rc::gen::inRange(0, 5)];
  const auto milli = [](int low, int high) { return 1e-3 * *rc::gen::inRange(low, high); };
  std::vector<double> parameters{1e6 * milli(1, 3), 1e6 * milli(1, 3), 500, 400};
  while (static_cast<int>(parameters.size()) < model.count) parameters.push_back(milli(-200, 200));
  const Eigen::Vector3d point(milli(-700, 700), milli(-700, 700), milli(1000, 5000));

  mrcal_lensmodel_t lens;
  RC_ASSERT(mrcal_lensmodel_from_name(&lens, model.name));
  const mrcal_point3_t p{.xyz = {point.x(), point.y(), point.z()}};
  mrcal_point2_t q;
  mrcal_point3_t dq_dp[2];
  std::vector<double> expected(2 * parameters.size()), found(2 * parameters.size());
  mrcal_project(&q, dq_dp, expected.data(), &p, 1, &lens, parameters.data());
  const OpencvProjection projection =
      project_opencv_with_gradients(parameters.data(), model.count, point, found.data(), found.data() + model.count);
  const auto near = [](double a, double b) { return std::abs(a - b) <= 1e-11 * (1000 + std::abs(b)); };
  RC_ASSERT(projection.pixel == project_opencv(parameters.data(), model.count, point));
  RC_ASSERT(near(projection.pixel.x(), q.x) && near(projection.pixel.y(), q.y));
  for (int i = 0; i < 2; ++i) {
    for (int k = 0; k < 3; ++k) RC_ASSERT(near(projection.d_point(i, k), dq_dp[i].xyz[k]));
  }
  for (std::size_t i = 0; i < found.size(); ++i) RC_ASSERT(near(found[i], expected[i]));
}

}  // namespace
}  // namespace crumple
