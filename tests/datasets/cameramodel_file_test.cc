#include "datasets/cameramodel_file.h"

#include <cmath>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "datasets/python_literal.h"
#include "tests/datasets/public_data.h"
#include "tests/python.h"
#include "tests/temporary_folder.h"

namespace crumple {
namespace {

using testing::HasSubstr;

CameraModel example_model() {
  return {Lens::create("LENSMODEL_OPENCV5", {1280, 1024},
                       {1000.1, 1001.0 / 3, 639.5, 511.5, -0.1, 1.23e-7, -3.3e-4, 1e-5, 0.3})
              .value(),
          {rotation_from_vector({0.1, -0.2, 0.3}), {1.0 / 3, -200, 1e-9}}};
}

std::string text_without(const std::string& old_text, const std::string& new_text) {
  std::string text = cameramodel_text(example_model());
  return text.replace(text.find(old_text), old_text.size(), new_text);
}

TEST(CameramodelFile, LensSurvivesExactlyAndPoseToRounding) {
  const TemporaryFolder home;
  ASSERT_TRUE(write_cameramodel(home / "a.cameramodel", example_model()));
  const auto read = read_cameramodel(home / "a.cameramodel");
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->lens.model(), example_model().lens.model());
  EXPECT_EQ(read->lens.size(), example_model().lens.size());
  EXPECT_EQ(read->lens.parameters(), example_model().lens.parameters());
  EXPECT_EQ(read->camera_from_reference.translation, example_model().camera_from_reference.translation);
  EXPECT_LT(local_step(read->camera_from_reference, example_model().camera_from_reference).norm(), 1e-15);
}

TEST(CameramodelFile, MrcalReadsTheSameNumbers) {
  if (!python_has("mrcal")) GTEST_SKIP() << "Debian's python3-mrcal is not installed";
  const TemporaryFolder home;
  ASSERT_TRUE(write_cameramodel(home / "a.cameramodel", example_model()));
  const std::string script =
      "import mrcal, sys, numpy as np\n"
      "m = mrcal.cameramodel(sys.argv[1])\n"
      "assert m.intrinsics()[0] == 'LENSMODEL_OPENCV5'\n"
      "assert list(m.intrinsics()[1]) == [1000.1, 1001 / 3, 639.5, 511.5, -0.1, 1.23e-7, -3.3e-4, 1e-5, 0.3]\n"
      "assert list(m.imagersize()) == [1280, 1024]\n"
      "rt = m.extrinsics_rt_fromref()\n"
      "assert np.allclose(rt[:3], [0.1, -0.2, 0.3], atol=1e-15, rtol=0), rt\n"
      "assert list(rt[3:]) == [1 / 3, -200, 1e-9], rt\n"
      "p = mrcal.project(np.array((10., -20., 300.)), *m.intrinsics())\n"
      "print('%.17g %.17g' % tuple(p))\n";
  const std::string answer = run_python(script, (home / "a.cameramodel").string());
  double x = 0, y = 0;
  ASSERT_EQ(std::sscanf(answer.c_str(), "%lf %lf", &x, &y), 2) << answer;
  const Eigen::Vector2d ours = example_model().lens.project({10, -20, 300}).value();
  EXPECT_NEAR(x, ours.x(), 1e-10);
  EXPECT_NEAR(y, ours.y(), 1e-10);
}

// A lens of every model, with parameters that take all their digits.
std::vector<Lens> every_lens() {
  std::vector<Lens> lenses;
  for (const char* model :
       {"LENSMODEL_PINHOLE", "LENSMODEL_OPENCV4", "LENSMODEL_OPENCV5", "LENSMODEL_OPENCV8", "LENSMODEL_OPENCV12",
        "LENSMODEL_CAHVOR", "LENSMODEL_SPLINED_STEREOGRAPHIC_order=2_Nx=6_Ny=5_fov_x_deg=70",
        "LENSMODEL_SPLINED_STEREOGRAPHIC_order=3_Nx=11_Ny=8_fov_x_deg=200"}) {
    std::vector<double> parameters(lens_parameter_names(model).size());
    for (std::size_t i = 0; i < parameters.size(); ++i) parameters[i] = 0.01 * std::sin(static_cast<double>(i) / 3);
    parameters[0] = 1000.0 / 3;
    parameters[1] = 1001.0 / 3;
    parameters[2] = 639.5;
    parameters[3] = 511.5;
    lenses.push_back(Lens::create(model, {1280, 1024}, parameters).value());
  }
  return lenses;
}

TEST(CameramodelFile, EveryModelSurvives) {
  for (const Lens& lens : every_lens()) {
    const auto read = parse_cameramodel(cameramodel_text({lens, {}}));
    ASSERT_TRUE(read) << read.error().message;
    EXPECT_EQ(read->lens.model(), lens.model());
    EXPECT_EQ(read->lens.parameters(), lens.parameters());
  }
}

// Oracle: what mrcal's own reader makes of each file, and the pixel it projects a point to; and mrcal's rewritten file
// is read here.
TEST(CameramodelFile, MrcalReadsEveryModelAndItsFilesAreRead) {
  if (!python_has("mrcal")) GTEST_SKIP() << "Debian's python3-mrcal is not installed";
  const TemporaryFolder home;
  const std::vector<Lens> lenses = every_lens();
  for (std::size_t i = 0; i < lenses.size(); ++i) {
    ASSERT_TRUE(write_cameramodel(home / (std::to_string(i) + ".cameramodel"), {lenses[i], {}}));
  }
  const std::string script =
      "import mrcal, sys, numpy as np\n"
      "for i in range(8):\n"
      "    m = mrcal.cameramodel('%s/%d.cameramodel' % (sys.argv[1], i))\n"
      "    q = mrcal.project(np.array((30., -20., 300.)), *m.intrinsics())\n"
      "    m.write('%s/again_%d.cameramodel' % (sys.argv[1], i))\n"
      "    print(m.intrinsics()[0], len(m.intrinsics()[1]), '%.17g %.17g' % tuple(q))\n";
  std::istringstream answer(run_python(script, home.path().string()));
  for (std::size_t i = 0; i < lenses.size(); ++i) {
    std::string model;
    int count = 0;
    Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
    answer >> model >> count >> pixel.x() >> pixel.y();
    EXPECT_EQ(model, lenses[i].model()) << answer.str();
    EXPECT_EQ(count, lenses[i].parameter_count());
    EXPECT_LT((pixel - lenses[i].project({30, -20, 300}).value()).norm(), 1e-10) << model;
    const auto again = read_cameramodel(home / ("again_" + std::to_string(i) + ".cameramodel"));
    ASSERT_TRUE(again) << again.error().message;
    EXPECT_EQ(again->lens.model(), model);
    EXPECT_LT((again->lens.project({30, -20, 300}).value() - pixel).norm(), 1e-3);  // mrcal writes some digits only
  }
}

// Real files, one with 1204 parameters; both carry the inputs they were solved from.
TEST(CameramodelFile, ReadsRealModelsAsMrcalDoes) {
  const auto folder = public_data("mrcal_overpass");
  if (!folder) GTEST_SKIP() << "SKIPPED: mrcal_overpass is missing (set CRUMPLE_DATA)";
  if (!python_has("mrcal")) GTEST_SKIP() << "Debian's python3-mrcal is not installed";
  for (const char* name : {"opencv8-0.cameramodel", "splined-1.cameramodel"}) {
    const auto model = read_cameramodel(*folder / name);
    ASSERT_TRUE(model) << model.error().message;
    const std::string script =
        "import mrcal, sys, numpy as np\n"
        "m = mrcal.cameramodel(sys.argv[1])\n"
        "print('%.17g %.17g' % tuple(mrcal.project(np.array((2., -1., 1.5)), *m.intrinsics())))\n";
    const std::string answer = run_python(script, (*folder / name).string());
    Eigen::Vector2d theirs;
    ASSERT_EQ(std::sscanf(answer.c_str(), "%lf %lf", &theirs.x(), &theirs.y()), 2) << answer;
    const Eigen::Vector2d ours = model->lens.project({2, -1, 1.5}).value();
    EXPECT_LT((ours - theirs).norm(), 1e-9) << name;
    const auto ray = model->lens.ray(ours);
    ASSERT_TRUE(ray) << name;
    EXPECT_LT((*ray * 1.5 - Eigen::Vector3d(2, -1, 1.5)).norm(), 1e-9) << name;
  }
}

TEST(CameramodelFile, ReadsWhatMrcalWrites) {
  const std::string text =
      "# generated with a note\n"
      "{\n 'lensmodel':  'LENSMODEL_PINHOLE',\n"
      "    # intrinsics are fx,fy,cx,cy,distortion0,distortion1,....\n"
      "    'intrinsics': [ 1000, 1001.5, 500, 400,],\n"
      " 'valid_intrinsics_region': [\n    [ 622, 0 ],\n    [ 0, 634 ],\n],\n"
      "    'extrinsics': [ 0, 0, 0, 1e-3, 2, 3,],\n"
      "    'imagersize': [ 1024, 768,],\n"
      "    'optimization_inputs': b'P)h>@6aWAK2mk;8Apjz3 {]#,$\\'x',\n"
      "    'icam_intrinsics': 0,\n}\n";
  const auto model = parse_cameramodel(text);
  ASSERT_TRUE(model) << model.error().message;
  EXPECT_EQ(model->lens.parameters(), (std::vector<double>{1000, 1001.5, 500, 400}));
  EXPECT_EQ(model->camera_from_reference.translation, Eigen::Vector3d(1e-3, 2, 3));
}

TEST(CameramodelFile, ErrorsNameTheKey) {
  const auto message = [](const std::string& old_text, const std::string& new_text) {
    const auto model = parse_cameramodel(text_without(old_text, new_text));
    return model ? std::string("no error") : model.error().message;
  };
  EXPECT_THAT(message("'lensmodel'", "'lens'"), HasSubstr("'lensmodel' is missing"));
  EXPECT_THAT(message("LENSMODEL_OPENCV5", "LENSMODEL_OPENCV4"), HasSubstr("LENSMODEL_OPENCV4"));
  EXPECT_THAT(message("1280, 1024", "1280, 0"), HasSubstr("'imagersize'"));
  EXPECT_THAT(message("1280, 1024", "1280, 1024, 3"), HasSubstr("'imagersize'"));
  EXPECT_THAT(message("639.5", "nan"), HasSubstr("nan"));
  EXPECT_THAT(message("639.5", "None"), HasSubstr("'intrinsics'"));
  EXPECT_THAT(message("-200", "'-200'"), HasSubstr("'extrinsics'"));
  EXPECT_THAT(message("-200", "1e200"), HasSubstr("'extrinsics'"));
  EXPECT_THAT(message("'imagersize'", "'intrinsics'"), HasSubstr("given twice"));
  EXPECT_THAT(message("}", ""), HasSubstr("line"));
  EXPECT_THAT(read_cameramodel("/nonexistent").error().message, HasSubstr("/nonexistent"));
}

RC_GTEST_PROP(CameramodelFile, AnyTextIsReadOrRefused, (const std::string& text)) {
  (void)parse_cameramodel(text);
  (void)parse_cameramodel("{'lensmodel': " + text + "}");
}

TEST(PythonLiteral, DeepNestingIsRefused) {
  EXPECT_FALSE(parse_python_literal(std::string(1000000, '[')));
  EXPECT_FALSE(parse_python_literal(std::string(1000000, '{')));
}

}  // namespace
}  // namespace crumple
