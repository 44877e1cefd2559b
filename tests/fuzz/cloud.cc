// PLY clouds. What is accepted is finite, and every point's station has a name.
#include <cmath>
#include <sstream>

#include "datasets/cloud_file.h"
#include "tests/fuzz/input.h"

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace crumple;
  std::istringstream stream(text_of(data, size));
  const auto cloud = read_cloud(stream, size);
  if (!cloud) return 0;
  for (const CloudPoint& point : cloud->points) {
    require(point.position_mm.allFinite() && point.normal.allFinite() && point.covariance_mm2.allFinite(),
            "points are finite");
    require(cloud->stations.empty() || point.station < cloud->stations.size(), "stations have names");
  }
  return 0;
}
