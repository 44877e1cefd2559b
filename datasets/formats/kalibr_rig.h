// Kalibr's camchain.yaml (its wiki, "yaml formats"): cam0, cam1, ..., each with
//
//   camera_model: pinhole       intrinsics: [fu, fv, pu, pv]
//   distortion_model: radtan    distortion_coeffs: [k1, k2, r1, r2]   (k1 k2 p1 p2; none: [])
//   resolution: [width, height]
//   rostopic: /NAME/image_raw
//   T_cn_cnm1: 4 x 4            x_in_this = T x_in_the_camera_before; m; all but cam0
//
// Holds LENSMODEL_PINHOLE and LENSMODEL_OPENCV4; no projectors. The first camera is cam0. On reading, names come from
// topics of that form, else they are cam0, cam1, ...; what only concerns an IMU is passed over.
#pragma once

#include "datasets/formats/rig_format.h"

namespace crumple {

Expected<std::vector<std::string>> write_kalibr_rig(const RigToExport& source, const std::filesystem::path& folder);

// From one file, or a folder with one.
Expected<Rig> read_kalibr_rig(const std::vector<std::filesystem::path>& inputs);

}  // namespace crumple
