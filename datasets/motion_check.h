// Whether the rig or the object moved while a station's patterns were shown.
//
// A pattern and its inverse add up to the scene under full light, whatever the pattern: the sums of all pairs should be
// one image. Motion shows in them as shifts of whatever has edges. Each block of a sum is compared with the same block
// of the sum before it and of the first, by least squares for a shift and a change of light (Lucas & Kanade 1981); only
// the component along the block's main gradient counts. White and black taken one after the other are a pair like the
// others. A push inside a pair leaves one image of either place: the sum of it is shifted against both its neighbours,
// and these against each other. Where nothing in view has edges, motion cannot be seen, nor is it where the shift is
// more than some pixels, and orientations without inverses say nothing.
#pragma once

#include <string>
#include <vector>

#include "datasets/finding.h"
#include "datasets/sequence_check.h"

namespace crumple {

inline constexpr double kUselessShift_px = 0.7;  // from which on the points are not to be used

struct Motion {
  double shift_px = 0;
  std::string from, to;  // the frames between which something moved, by name
  std::string sentence;
  // Whether the shift also shows where either of the two pairs that it was found between is left out. Of frames in
  // wrong places it does not. At the sequence's ends there is nothing beyond to be compared.
  enum class Seen { on_both_sides, at_an_end, once };
  Seen seen = Seen::once;
};

// In the frames' order. Those without an image are passed over; `full_scale` as in SequenceSetup.
std::vector<Motion> find_motions(const std::vector<ShownFrame>& frames, double full_scale);

// Warning: something moved by 0.15 px or more between two pairs, or crept as far over several; error: by
// kUselessShift_px or more. The frames are named.
std::vector<Finding> check_motion(const std::vector<ShownFrame>& frames, double full_scale, const std::string& where);

// How far `to` is shifted against `from` where it is: the median over the blocks that moved, px; 0 where too few did.
double shift_between(const cv::Mat1f& from, const cv::Mat1f& to);

}  // namespace crumple
