// mrcal, under Debian's own Python, on the same campaign from the same start.
#pragma once

#include <string>
#include <vector>

#include "solvers/prior.h"
#include "tests/benchmark/made_campaign.h"
#include "tests/temporary_folder.h"

namespace crumple {

struct PeerSolve {
  double seconds = 0;
  double cost = 0;  // half the sum of squares, px^2
};

struct PeerUncertainty {
  double seconds = 0;                           // unprojection, Jacobian, factorisation and map
  std::vector<Eigen::Matrix2d> covariance_px2;  // row by row, the outermost pixels included
};

class MrcalPeer {
 public:
  MrcalPeer(const Campaign& campaign, int corners);  // along each side of the board
  // These throw std::runtime_error with what mrcal said, where it fails.
  PeerSolve solve() const;
  // Of a point at a distance, which may be infinite, with the campaign's start as the solution and noise of 1 px.
  PeerUncertainty uncertainty(std::size_t camera, int columns, int rows, double distance_mm, bool regularised) const;
  Prior regularisation(const CalibrationState& state) const;  // what mrcal adds to the observations

 private:
  std::string said(const std::string& task) const;

  TemporaryFolder folder_;
};

}  // namespace crumple
