// Photogrammetry's lens model, which corrects what was measured instead of distorting what is predicted, as one more
// residual of the joint refinement. For comparisons with adjustments that use it; the product's lenses are forward.
//
// With a mark at pixel (u, v), all in mm, x right and y down in the image, r the distance from the principal point:
//   x = (u size - px)(1 + as),  y = v size - py
//   corrected = (x, y)(1 + K1 r^2 + K2 r^4 + K3 r^6) + (P1 (r^2 + 2 x^2) - 2 P2 x y, 2 P1 x y - P2 (r^2 + 2 y^2))
//   residual  = (cc (X / Z, Y / Z) - corrected) / size                                                  px, 2 per mark
// P2 has the sign that it has where y points up. The aspect may stand at other places (Aspect).
// Source: Brown, Close-range camera calibration, 1971; Boerlin & Grussenmeyer, Camera calibration using the damped
// bundle adjustment toolbox, ISPRS Annals 2014, and the toolbox's backward models 1 to 5.
//
// The nine parameters stand in the nine of LENSMODEL_OPENCV5: fx = cc (mm), fy = 1 + as, cx cy = px py (mm), k1 k2 k3 =
// K1 K2 K3, p1 p2 = P1 P2.
#pragma once

#include <memory>
#include <vector>

#include "solvers/residuals.h"

namespace crumple {

enum class Aspect { before_distortion, after_distortion, before_principal_point };  // models 3, 4 and 5

// One photograph. `view` has a station; it must outlive the residuals.
std::unique_ptr<View> backward_brown_residuals(const LedView& view, double pixel_size_mm, Aspect aspect);

}  // namespace crumple
