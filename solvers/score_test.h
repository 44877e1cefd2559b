// Would further parameters explain a refinement's residuals significantly better? Rao's score test (Rao, Proc.
// Cambridge Phil. Soc. 1948), in adjustment known as Baarda's test of an alternative hypothesis (Baarda 1968): nothing
// is refined anew.
//
// With r and J the whitened residuals and Jacobian, H = J'J with the priors, G the whitened derivative of the residuals
// by the further parameters d:
//   a = G'r - G'J H^-1 J'r,   N = G'G - G'J H^-1 J'G,   estimate d = -N^-1 a,   gain = a' N^-1 a
// The gain is what the sum of squares falls by, chi-square distributed with as many degrees of freedom as d has where d
// is zero. Directions of d that the refinement's own parameters can follow (the equilibrated N has an eigenvalue below
// 1e-6) are not testable and take no part.
//
// Outliers of the refinement are what a fault makes; so corners, features and LEDs up to `most_sigmas` away are counted
// in here, and the refinement's optimum is moved accordingly, to first order. Stripes' outliers stay out: they are
// decoding errors.
#pragma once

#include <map>
#include <memory>
#include <utility>
#include <vector>

#include "solvers/bundle.h"

namespace crumple {

struct ScoreOutcome {
  double gain = 0;
  int degrees = 0;           // that could be tested
  Eigen::VectorXd estimate;  // of the further parameters
  Eigen::VectorXd sigma;     // their standard uncertainties
  // What the further parameters explain, RMS over the observations they are about: in their sigmas, and in pixels, of
  // observations of several groups weighted as the refinement does.
  double effect = 0;
  double effect_px = 0;
  // By how many of their sigmas the refinement's parameters are off for want of the further ones, in the direction
  // where that is most (Baarda's external reliability): the root of d' G'J H^-1 J'G d, over directions of d that are
  // beyond three sigma.
  double bias = 0;
};

class ScoreTester {
 public:
  // Views by number, in the order of make_views, with the derivative of their residuals, px, by the further parameters.
  using Columns = std::vector<std::pair<std::size_t, Eigen::MatrixXd>>;

  // Result and options are those of the refinement of these observations, which must outlive the tester. Fails where
  // the equations have no inverse.
  static Expected<ScoreTester> create(const Observations& observations, const BundleResult& result,
                                      const BundleOptions& options, double most_sigmas = 15);

  const std::vector<std::unique_ptr<View>>& views() const { return views_; }
  const ViewEvaluation& evaluation(std::size_t view) const { return evaluations_[view]; }  // px, not whitened

  ScoreOutcome test(const Columns& columns) const;

 private:
  explicit ScoreTester(JointCovariance covariance) : covariance_(std::move(covariance)) {}

  std::vector<std::unique_ptr<View>> views_;
  std::vector<ViewEvaluation> evaluations_;
  std::vector<Eigen::VectorXd> row_weights_;  // what whitens a row; 0 leaves it out
  JointCovariance covariance_;
  Eigen::VectorXd step_common_;       // H^-1 J'r: C (g_a - sum gain_j g_j)
  std::vector<Vector6d> step_poses_;  // D_j^-1 g_j, the poses' own part
};

}  // namespace crumple
