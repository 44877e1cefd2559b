#include <random>
#include <sstream>

#include "calib/calibrate.h"
#include "datasets/npz_archive.h"
#include "datasets/placements_file.h"
#include "datasets/residuals_file.h"
#include "tests/datasets/formats/made_rig.h"
#include "tests/python.h"

namespace crumple {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

TEST(MrcalRig, EveryLensComesBack) {
  for (const std::string& model : {std::string("LENSMODEL_PINHOLE"), std::string("LENSMODEL_OPENCV12"),
                                   std::string("LENSMODEL_CAHVOR"), splined_model}) {
    const RigToExport source = made_rig(model, 3);
    const auto read = there_and_back("mrcal", source);
    ASSERT_TRUE(read) << read.error().message;
    ASSERT_EQ(read->sensors.size(), 4U);
    for (std::size_t i = 0; i < 3; ++i) expect_camera(read->sensors[i], source.rig.sensors[i], model);
    EXPECT_EQ(read->sensors[3].name, "proj0");
  }
}

// Two cameras that see a chessboard placed by hand, one corner of which is missing in one view, another an outlier;
// what a calibration leaves in a rig's folder of it.
class Solved : public testing::Test {
 protected:
  void SetUp() override { solve("LENSMODEL_OPENCV5"); }

  void solve(const std::string& model) {
    const BoardSpec board{"board", {7, 5, 30, TargetKind::chessboard}, {}};
    CalibrationData data;
    data.sensors = {{"left", SensorKind::camera, {1280, 1024}, model},
                    {"right", SensorKind::camera, {1280, 1024}, model}};
    data.boards = {board};
    const Board truth = board_of(board.target);
    std::mt19937 generator(7);
    std::normal_distribution<double> noise(0, 0.1);
    const Lens lens =
        Lens::create("LENSMODEL_OPENCV5", {1280, 1024}, {1000, 1002, 640, 510, -0.1, 0.05, 1e-3, -1e-3, 0.01}).value();
    const Pose right_from_left{rotation_from_vector({0.02, -0.1, 0.01}), {-100, 3, 5}};
    for (std::size_t p = 0; p < 12; ++p) {
      const double turn = 0.5 * static_cast<double>(p);
      const Pose left_from_board{rotation_from_vector({0.5 * std::cos(turn), 0.5 * std::sin(turn), 0.1}),
                                 {-90 + 20 * std::cos(turn), -60 + 15 * std::sin(turn), 420 + 12 * turn}};
      for (std::size_t s = 0; s < 2; ++s) {
        CornerView view{s, p, {}, {}};
        const Pose camera_from_board = s == 0 ? left_from_board : right_from_left * left_from_board;
        for (int i = p == 3 ? 1 : 0; i < truth.point_count(); ++i) {
          view.corners.push_back(i);
          view.pixels.push_back(*lens.project(camera_from_board * truth.point(i)) +
                                (s == 0 ? 1.0 : 2.0) * Eigen::Vector2d(noise(generator), noise(generator)));
        }
        if (p == 5) view.pixels[4].x() += 9;
        data.observations.corners.push_back(view);
      }
      data.placement_names.push_back(p == 2 ? "two, \"bent\"" : std::to_string(p));
      data.board_of.push_back(0);
    }
    data.observations.placement_count = 12;
    calibration_ = calibrate(data, {}).value();
    source_.rig = calibrated_rig(*calibration_);
    write_content(home_ / "placements.yaml", placements_yaml(placements_of(*calibration_, data.boards)));
    write_content(home_ / "residuals.csv", residuals_csv(*calibration_, data.observations));
    source_.record = read_calibration_record(home_.path()).value();
  }

  TemporaryFolder home_;
  std::optional<Calibration> calibration_;
  RigToExport source_;
};

using MrcalInputs = Solved;

TEST_F(MrcalInputs, AreSolvedAsMrcalSeesItToo) {
  if (!python_has("mrcal")) GTEST_SKIP() << "Debian's python3-mrcal is not installed";
  const TemporaryFolder folder;
  const auto lost = rig_format("mrcal")->write(source_, folder.path());
  ASSERT_TRUE(lost) << lost.error().message;
  EXPECT_THAT(*lost, ElementsAre(HasSubstr("covariance"), HasSubstr("sigma_px")));
  // Residuals as predicted minus measured, the weight undone; -1 weights are outliers and unseen corners.
  const std::string script =
      "import mrcal, sys, numpy as np\n"
      "m = mrcal.cameramodel(sys.argv[1] + '/right.cameramodel')\n"
      "o = m.optimization_inputs()\n"
      "b, x, j, factors = mrcal.optimizer_callback(**o)\n"
      "weight = o['observations_board'][..., 2]\n"
      "assert factors is not None and m.icam_intrinsics() == 1\n"
      "assert np.max(np.abs(j.T @ x)) < 1e-2, np.max(np.abs(j.T @ x))\n"
      "r = x[:weight.size * 2].reshape(weight.shape[0], -1, 2) / np.abs(weight).reshape(weight.shape[0], -1, 1)\n"
      "for view, w in zip(r, weight.reshape(weight.shape[0], -1)):\n"
      "    print(*('%.17g %.17g' % tuple(e) if k > 0 else '0 0' for e, k in zip(view, w)))\n"
      "v = mrcal.unproject(np.array(((640., 512.), (200., 900.))), *m.intrinsics(), normalize=True)\n"
      "for distance in (1, 400):\n"
      "    s = mrcal.projection_uncertainty(v * distance, m, atinfinity=distance == 1, what='worstdirection-stdev')\n"
      "    assert np.all(s > 0.005) and np.all(s < 2), s\n";
  std::istringstream answer(run_python(script, folder.path().string()));
  std::size_t compared = 0;
  for (const ViewSummary& view : calibration_->bundle.views) {
    // mrcal's views go by placement, then camera, as those made here.
    const bool first_is_missing = view.placement == 3;
    for (std::size_t corner = 0; corner < 35; ++corner) {
      Eigen::Vector2d theirs;
      ASSERT_TRUE(answer >> theirs.x() >> theirs.y()) << answer.str();
      if (first_is_missing && corner == 0) continue;
      const std::size_t i = corner - (first_is_missing ? 1 : 0);
      if (view.inlier[i] == 0) continue;
      EXPECT_LT((theirs - view.residuals_px.segment<2>(2 * static_cast<Eigen::Index>(i))).norm(), 1e-9);
      ++compared;
    }
  }
  EXPECT_GT(compared, 24U * 35U - 10U);
  EXPECT_LT(compared, 24U * 35U - 2U);  // the outliers and what was not seen
}

// Terms that corners hardly tell apart are regularised there, or nothing would say how sure they are.
TEST_F(MrcalInputs, OpenForLensesWithPriorsToo) {
  if (!python_has("mrcal")) GTEST_SKIP() << "Debian's python3-mrcal is not installed";
  for (const std::string model : {"LENSMODEL_OPENCV8", "LENSMODEL_OPENCV12", "LENSMODEL_CAHVOR"}) {
    solve(model);
    const TemporaryFolder folder;
    ASSERT_TRUE(rig_format("mrcal")->write(source_, folder.path())) << model;
    const std::string script =
        "import mrcal, sys, numpy as np\n"
        "m = mrcal.cameramodel(sys.argv[1] + '/right.cameramodel')\n"
        "o = m.optimization_inputs()\n"
        "assert o['do_apply_regularization']\n"
        "v = mrcal.unproject(np.array(((640., 512.), (400., 700.))), *m.intrinsics(), normalize=True)\n"
        "s = mrcal.projection_uncertainty(v * 400, m, what='worstdirection-stdev')\n"
        "assert np.all(s > 0.005) and np.all(s < 2), s\n"
        "print(o['lensmodel'])\n";
    EXPECT_EQ(run_python(script, folder.path().string()), model + "\n");
  }
}

// The same problem in metres: residuals do not know the unit.
TEST_F(MrcalInputs, InMetres) {
  if (!python_has("mrcal")) GTEST_SKIP() << "Debian's python3-mrcal is not installed";
  const TemporaryFolder folder;
  source_.mm_per_unit = 1000;
  ASSERT_TRUE(rig_format("mrcal")->write(source_, folder.path()));
  EXPECT_THAT(content_of(folder / "left.cameramodel"), HasSubstr("translation in m\n"));
  const std::string script =
      "import mrcal, sys, numpy as np\n"
      "m = mrcal.cameramodel(sys.argv[1] + '/right.cameramodel')\n"
      "o = m.optimization_inputs()\n"
      "assert np.allclose(m.extrinsics_rt_fromref(), o['extrinsics_rt_fromref'][0], rtol=0, atol=1e-15)\n"
      "assert abs(m.extrinsics_rt_fromref()[3] + 0.1) < 0.002 and o['calibration_object_spacing'] == 0.03\n"
      "x = mrcal.optimizer_callback(**o)[1]\n"
      "print('%.17g' % np.sum(x**2))\n";
  const double in_metres = std::stod(run_python(script, folder.path().string()));
  source_.mm_per_unit = 1;
  ASSERT_TRUE(rig_format("mrcal")->write(source_, folder.path()));
  const std::string plain =
      "import mrcal, sys, numpy as np\no = mrcal.cameramodel(sys.argv[1] + '/left.cameramodel')\n"
      "x = mrcal.optimizer_callback(**o.optimization_inputs())[1]\nprint('%.17g' % np.sum(x**2))\n";
  EXPECT_NEAR(in_metres / std::stod(run_python(plain, folder.path().string())), 1, 1e-9);
}

TEST_F(MrcalInputs, LackAndTheReasonIsSaid) {
  const auto said = [&](auto&& change) {
    RigToExport source = source_;
    change(source);
    const TemporaryFolder folder;
    const auto lost = rig_format("mrcal")->write(source, folder.path());
    EXPECT_EQ(content_of(folder / "left.cameramodel").find("optimization_inputs"), std::string::npos);
    return lost.value().back();
  };
  EXPECT_THAT(said([](RigToExport& s) { s.record.reset(); }), HasSubstr("holds no observations"));
  EXPECT_THAT(said([](RigToExport& s) { s.record->placements.boards[0].target.kind = TargetKind::dots; }),
              HasSubstr("kind dots"));
  EXPECT_THAT(said([](RigToExport& s) { s.record->placements.boards.emplace_back(); }), HasSubstr("there are 2"));
  EXPECT_THAT(said([](RigToExport& s) { s.rig.sensors[1].lens = made_lens("LENSMODEL_OPENCV4", 1000); }),
              HasSubstr("right has LENSMODEL_OPENCV4"));
  EXPECT_THAT(
      said([](RigToExport& s) { std::erase_if(s.record->corners, [](auto& v) { return v.camera == "right"; }); }),
      HasSubstr("no corners of right"));
  EXPECT_THAT(said([](RigToExport& s) { s.rig.sensors[0].sensor_from_mount.translation.x() = 1; }),
              HasSubstr("not the reference"));
}

using CalibrationRecordFiles = Solved;

TEST_F(CalibrationRecordFiles, AreReadBackExactly) {
  const CalibrationState& state = calibration_->bundle.state;
  const Placements& placements = source_.record->placements;
  ASSERT_EQ(placements.placements.size(), 12U);
  EXPECT_EQ(placements.placements[2].name, "two, \"bent\"");
  for (std::size_t p = 0; p < 12; ++p) {
    EXPECT_EQ(placements.placements[p].world_from_board.translation, state.world_from_board[p].translation);
    EXPECT_EQ(placements.placements[p].world_from_board.rotation.coeffs(), state.world_from_board[p].rotation.coeffs());
  }
  EXPECT_EQ(placements.boards[0].target.pitch_mm, 30);
  EXPECT_EQ(placements.boards[0].warp_mm, state.boards[0].warp_mm);
  ASSERT_EQ(source_.record->corners.size(), 24U);
  EXPECT_EQ(source_.record->corners[4].placement, "two, \"bent\"");
  for (std::size_t v = 0; v < 24; ++v) {
    const ViewSummary& view = calibration_->bundle.views[v];
    const RecordedCorners& recorded = source_.record->corners[v];
    ASSERT_EQ(recorded.accepted.size(), view.inlier.size());
    EXPECT_EQ(recorded.accepted, view.inlier);
    for (std::size_t i = 0; i < recorded.residuals_px.size(); ++i) {
      EXPECT_EQ(recorded.residuals_px[i], (view.residuals_px.segment<2>(2 * static_cast<Eigen::Index>(i))));
    }
  }
}

TEST_F(CalibrationRecordFiles, TellTheRedundancyOfWhatWasAccepted) {
  std::istringstream lines(content_of(home_ / "residuals.csv"));
  std::string line;
  std::getline(lines, line);
  EXPECT_THAT(line, testing::EndsWith(",accepted,redundancy,standardised_residual"));
  std::size_t left_out = 0;
  for (const ViewSummary& view : calibration_->bundle.views) {
    for (std::size_t i = 0; i < view.inlier.size(); ++i) {
      ASSERT_TRUE(std::getline(lines, line));
      const std::size_t last = line.rfind(','), before = line.rfind(',', last - 1);
      const std::string redundancy = line.substr(before + 1, last - before - 1);
      EXPECT_EQ(std::stof(line.substr(last + 1)), view.standardised[i]);
      EXPECT_EQ(line[before - 1], view.inlier[i] != 0 ? '1' : '0');
      if (view.inlier[i] != 0) {
        EXPECT_EQ(std::stof(redundancy), view.redundancy[i]);
      } else {
        EXPECT_EQ(redundancy, "");
        EXPECT_GT(view.standardised[i], 4);
        ++left_out;
      }
    }
  }
  EXPECT_GE(left_out, 2U);
}

struct RecordDamage {
  const char* file;
  const char* old_text;
  const char* new_text;
  const char* said;
};

TEST_F(CalibrationRecordFiles, DamageIsNamed) {
  const std::string placements = content_of(home_ / "placements.yaml"), residuals = content_of(home_ / "residuals.csv");
  for (const RecordDamage& damage :
       {RecordDamage{"placements.yaml", "placements/1", "placements/3", "schema"},
        RecordDamage{"placements.yaml", "board: \"board\"", "board: \"bord\"", "one of the boards"},
        RecordDamage{"placements.yaml", "warp_mm", "warp_cm", "warp_mm"},
        RecordDamage{"placements.yaml", "[7, 5]", "[5, 4]", "beyond the 20"},
        RecordDamage{"placements.yaml", "name: \"7\"", "name: \"99\"", "placement 7 is not in placements.yaml"},
        RecordDamage{"residuals.csv", "placement,camera", "placement;camera", "residuals.csv:1"},
        RecordDamage{"residuals.csv", "0,left,left,corners,1,", "0,left,left,corners,1,,", "residuals.csv:3: has 13"},
        RecordDamage{"residuals.csv", "0,left,left,corners,1,", "0,left,left,corners,1.5,", "residuals.csv:3"},
        RecordDamage{"residuals.csv", "0,left,left,corners,1,", "0,left,left,corners,-1,", "points beyond"}}) {
    write_content(home_ / "placements.yaml", placements);
    write_content(home_ / "residuals.csv", residuals);
    ASSERT_THAT(content_of(home_ / damage.file), HasSubstr(damage.old_text));
    replace_in(home_ / damage.file, damage.old_text, damage.new_text);
    const auto read = read_calibration_record(home_.path());
    ASSERT_FALSE(read) << damage.old_text;
    EXPECT_THAT(read.error().message, HasSubstr(damage.said));
  }
  std::filesystem::remove(home_ / "residuals.csv");
  EXPECT_FALSE(read_calibration_record(home_.path()));
  std::filesystem::remove(home_ / "placements.yaml");
  EXPECT_FALSE(read_calibration_record(home_.path()).value());
}

TEST(Base85, IsPythons) {
  EXPECT_EQ(base85(""), "");
  EXPECT_EQ(base85("a"), "VE");  // base64.b85encode(b'a')
  EXPECT_EQ(base85("Crumple!"), "LvnR(aBO8E");
}

TEST(MrcalRig, AFileThatIsNoneIsNamed) {
  const TemporaryFolder home;
  write_content(home / "a.cameramodel", "{}");
  EXPECT_THAT(rig_format("mrcal")->read({home / "a.cameramodel"}).error().message,
              testing::AllOf(HasSubstr("a.cameramodel"), HasSubstr("'lensmodel' is missing")));
}

}  // namespace
}  // namespace crumple
