// Campaigns for measure_coverage that go through rendered images: boards are rendered with a camera's noise under
// projected stripes, corners and stripes are found in the images, and the rig is calibrated from nothing.
#pragma once

#include "solvers/expected.h"
#include "tests/calib/coverage_configurations.h"

namespace crumple {

// datasets/scenes/small.yaml with its boards put down twice; board poses, sampling and noise are drawn anew for each
// campaign. Fails where the scene cannot be read.
Expected<CoverageConfiguration> rendered_configuration();

}  // namespace crumple
