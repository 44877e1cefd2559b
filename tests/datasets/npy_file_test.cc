#include "datasets/npy_file.h"

#include <cmath>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/python.h"
#include "tests/temporary_folder.h"

namespace crumple {
namespace {

using testing::HasSubstr;

Eigen::MatrixXd awkward_numbers() {
  Eigen::MatrixXd matrix(2, 3);
  matrix << 0.1, -0.0, 1e-310, std::numeric_limits<double>::max(), 1.0 / 3, -1.23e-7;
  return matrix;
}

TEST(NpyFile, EveryBitSurvives) {
  const TemporaryFolder home;
  const Eigen::MatrixXd matrix = awkward_numbers();
  ASSERT_TRUE(write_npy(home / "m.npy", matrix));
  const auto read = read_npy(home / "m.npy");
  ASSERT_TRUE(read);
  ASSERT_EQ(read->rows(), 2);
  ASSERT_EQ(read->cols(), 3);
  EXPECT_EQ(std::memcmp(read->data(), matrix.data(), 6 * sizeof(double)), 0);
}

TEST(NpyFile, EmptyMatrix) {
  const TemporaryFolder home;
  ASSERT_TRUE(write_npy(home / "m.npy", Eigen::MatrixXd(0, 0)));
  EXPECT_EQ(read_npy(home / "m.npy").value().size(), 0);
}

TEST(NpyFile, NumpyReadsOursAndWeReadNumpys) {
  const TemporaryFolder home;
  ASSERT_TRUE(write_npy(home / "m.npy", awkward_numbers()));
  const std::string script =
      "import numpy as np, sys\n"
      "m = np.load(sys.argv[1] + '/m.npy')\n"
      "assert m.shape == (2, 3) and m[0, 0] == 0.1 and m[1, 1] == 1 / 3 and m[1, 2] == -1.23e-7, m\n"
      "np.save(sys.argv[1] + '/c.npy', m)\n"
      "np.save(sys.argv[1] + '/f.npy', np.asfortranarray(m))\n"
      "np.save(sys.argv[1] + '/i.npy', np.arange(6).reshape(2, 3))\n"
      "np.save(sys.argv[1] + '/v.npy', np.zeros(6))\n";
  if (!python_has("numpy")) GTEST_SKIP() << "Debian's python3-numpy is not installed";
  ASSERT_EQ(run_python(script, home.path().string()), "");
  EXPECT_EQ(read_npy(home / "c.npy").value(), awkward_numbers());
  EXPECT_EQ(read_npy(home / "f.npy").value(), awkward_numbers());
  EXPECT_THAT(read_npy(home / "i.npy").error().message, HasSubstr("float64"));
  EXPECT_THAT(read_npy(home / "v.npy").error().message, HasSubstr("two dimensions"));
}

TEST(NpyFile, RefusesDamage) {
  const TemporaryFolder home;
  ASSERT_TRUE(write_npy(home / "m.npy", awkward_numbers()));
  const std::string good = content_of(home / "m.npy");
  for (std::size_t length = 0; length < good.size(); ++length) {
    write_content(home / "cut.npy", good.substr(0, length));
    EXPECT_FALSE(read_npy(home / "cut.npy")) << length;
  }
  write_content(home / "long.npy", good + "x");
  EXPECT_FALSE(read_npy(home / "long.npy"));
  EXPECT_THAT(read_npy(home / "none.npy").error().message, HasSubstr("none.npy"));
}

TEST(NpyFile, RefusesNaN) {
  const TemporaryFolder home;
  ASSERT_TRUE(write_npy(home / "m.npy", Eigen::MatrixXd::Constant(1, 1, std::nan(""))));
  EXPECT_THAT(read_npy(home / "m.npy").error().message, HasSubstr("not finite"));
}

}  // namespace
}  // namespace crumple
