// The noise of a pixel's differences as a function of its brightness, estimated from the data: light brings shot noise.
#pragma once

#include <vector>

namespace crumple {

class NoiseModel {
 public:
  struct Sample {
    float brightness;   // any measure that grows with the light, such as the gain
    float mean_square;  // of residuals that hold nothing but noise, per degree of freedom
  };
  // Medians over eight classes of equal count, linear in between; outliers among the samples do not matter. `freedom`
  // is the degrees of freedom behind each mean square. Never below the rounding of two frames to whole grey levels.
  NoiseModel(std::vector<Sample> samples, double freedom);

  double variance(double brightness) const;  // of a difference, grey levels squared

 private:
  struct Class {
    double brightness;
    double variance;
  };
  std::vector<Class> classes_;
};

}  // namespace crumple
