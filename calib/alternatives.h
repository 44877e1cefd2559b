// What would explain a calibration's residuals better than the model does: alternatives with a name that a person can
// act on, each tested at the refinement's optimum (solvers/score_test.h).
//
//   LED            from some station on an LED sits elsewhere on its probe
//   place          from some station, or still probe's placement, on a sensor stands elsewhere; trackers also: between
//                  their boards and the LEDs
//   shape          a board's height over its plane in polynomials of second and third degree
//   size           a board is larger or smaller than the others, bars and certificates say; or its pitches along and
//                  across differ, or are not square
//   lens           further terms: OPENCV8's rational ones for a lens with fewer; polynomials of degree 2 to 4 over the
//                  image, as a spline has them
//   polarity       stripes' rising and falling edges are off to opposite sides, as a gamma makes them where no inverse
//                  patterns were taken
//
// Found is an alternative whose gain is less likely by chance than 1 in 1000 over all that are tested, and that
// matters: it moves the observations it is about by 0.3 of their sigma at least (RMS), or some combination of
// parameters by three of its own, correlated observations allowed for (calib/correlation.h). With enough observations
// everything is significant, and a model is never exact: nor does anything matter but a board's size or shape that
// moves observations by less than 0.01 px. Of several the one with the largest gain, less the logarithm of the number
// of observations for each degree of freedom (Schwarz, Annals of Statistics, 1978), is found; then the others are
// tested beside it, three times at most. Observations count as independent where significance is concerned.
#pragma once

#include <string>
#include <vector>

#include "calib/calibrate.h"
#include "solvers/score_test.h"

namespace crumple {

enum class AlternativeKind { led, place, shape, size, lens, polarity };

// No detector and no lens model is better than that: what is off by less, per axis, is no fault.
inline constexpr double kExactEnough_px = 0.01;

struct Alternative {
  AlternativeKind kind = AlternativeKind::lens;
  std::string subject;   // the board, sensor or LED it is about
  std::string sentence;  // what it is, how much, what to do
  double gain = 0;
  int degrees = 0;
  double effect = 0;  // sigmas of the observations
  double bias = 0;    // sigmas of the parameters
};

// From how much on a board's wrong size, as a share of it, would be found: with 80 % probability (Baarda, A testing
// procedure for use in geodetic networks, 1968: the minimal detectable bias).
struct SizeLimit {
  std::string subject;
  double detectable = 0;
};

struct AlternativeTests {
  int tested = 0;
  // Boards whose size nothing else could contradict; in the order of the data's boards.
  std::vector<std::string> untestable_sizes;
  std::vector<SizeLimit> size_limits;  // of the others
  std::vector<std::string> tested_lenses;
  std::vector<Alternative> found;  // the most obvious first
  // Lenses that further terms would describe better as well; of more than three faults not all are found.
  std::vector<std::string> further_lenses;
};

// `data` and `calibration` belong together. Fails where the refinement's equations have no inverse.
Expected<AlternativeTests> test_alternatives(const CalibrationData& data, const Calibration& calibration, int threads);

}  // namespace crumple
