// The covariance of many points of a cloud by itself; `./dev bench uncertainty` has the same rows.
#include <gflags/gflags.h>

#include "tests/benchmark/point_rows.h"

DEFINE_int32(points, 1000000, "how many");
DEFINE_int32(threads, 2, "how many");
DEFINE_int32(turns, 3, "the best of so many counts");

int main(int argc, char** argv) {
  gflags::ParseCommandLineFlags(&argc, &argv, true);
  crumple::report("points", crumple::point_rows(FLAGS_points, FLAGS_turns, FLAGS_threads));
}
