// mrcal's .cameramodel files, one per sensor, and in those of the cameras the inputs of the optimization that they are
// the solution of, so that mrcal's own tools (mrcal.projection_uncertainty, mrcal-show-...) take them up.
//
// Holds every lens model; projectors as models without inputs. States no unit of length.
//
// The inputs hold the corners, the board's placements and its warp as calibrated; what our gate left out is an outlier
// there; a camera's weight is the smallest sigma of the cameras over its own. Not in them are stripes, projected
// features, priors and the correlation of corners (corner_inflation): mrcal's uncertainty is that of independent
// corners alone. Where a lens has terms that our priors hold (OPENCV8, OPENCV12, CAHVOR, SPLINED), mrcal's
// regularization is on.
//
// mrcal's problem has one lens model for all cameras and one board with corners in rows and columns. Where the rig's
// folder does not hold that the plain models are written, and what is left behind says why.
#pragma once

#include "datasets/formats/rig_format.h"

namespace crumple {

Expected<std::vector<std::string>> write_mrcal_rig(const RigToExport& source, const std::filesystem::path& folder);

// From files, the first being the reference; or from a folder, where the camera whose pose is the identity is.
// Optimization inputs are passed over.
Expected<Rig> read_mrcal_rig(const std::vector<std::filesystem::path>& inputs);

}  // namespace crumple
