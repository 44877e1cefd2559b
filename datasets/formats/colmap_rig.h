// COLMAP's sparse model as text (its documentation, "Output Format"): one frame of one rig, without points.
//
//   cameras.txt   CAMERA_ID MODEL WIDTH HEIGHT PARAMS[]
//   rigs.txt      RIG_ID NUM_SENSORS CAMERA REF_ID, then for each other
//                 CAMERA ID 1 QW QX QY QZ TX TY TZ (sensor_from_rig)
//   frames.txt    FRAME_ID RIG_ID RIG_FROM_WORLD[7] NUM_DATA_IDS (CAMERA CAMERA_ID IMAGE_ID)[]
//   images.txt    per image IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME, and a line of its points: none
//   points3D.txt  empty
//
// COLMAP counts pixels from the image's corner, so the centre of the first pixel is (0.5, 0.5): principal points are
// half a pixel larger there. Images are named CAMERA/0000.png, as its rigs want them. Holds LENSMODEL_PINHOLE
// (PINHOLE), _OPENCV4 (OPENCV), _OPENCV5 and _OPENCV8 (FULL_OPENCV, the former with k4 = k5 = k6 = 0 and read back as
// such); no projectors. States no unit of length.
//
// Read are also SIMPLE_PINHOLE, SIMPLE_RADIAL and RADIAL, as LENSMODEL_PINHOLE and _OPENCV4. Poses come from rigs.txt;
// without it (COLMAP before 3.12) from images.txt, which then has one image per camera. Names come from the images.
#pragma once

#include "datasets/formats/rig_format.h"

namespace crumple {

Expected<std::vector<std::string>> write_colmap_rig(const RigToExport& source, const std::filesystem::path& folder);

// From the folder of the model.
Expected<Rig> read_colmap_rig(const std::vector<std::filesystem::path>& inputs);

}  // namespace crumple
