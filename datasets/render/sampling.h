// Where the renderer looks within a pixel and an aperture.
//
// Points come from Sobol's sequence with the direction numbers of Joe and Kuo (2008), its digits scrambled per pixel
// and dimension: any prefix of 4^k points is spread evenly, and more points may be added to a pixel later. Each point
// is followed by its mirror image in the middle of the square: the mean of an even number of samples lies exactly
// there, or else every pixel would look a little beside its centre, in all frames alike.
#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>

namespace crumple {

// A well-mixed hash of a stream of numbers, to seed each pixel and each noise row on its own.
std::uint64_t mix(std::uint64_t seed, std::uint64_t value);

// Numbers in a row from `mix`: a small, quick generator for the standard library's distributions.
class MixGenerator {
 public:
  using result_type = std::uint64_t;
  explicit MixGenerator(std::uint64_t seed) : seed_(seed) {}
  static constexpr result_type min() { return 0; }
  static constexpr result_type max() { return ~result_type{0}; }
  result_type operator()() { return mix(seed_, ++counter_); }

 private:
  std::uint64_t seed_;
  std::uint64_t counter_ = 0;
};

// What a sample needs coordinates for, two dimensions each.
enum class SampleUse : std::uint32_t { footprint, camera_aperture, projector_aperture };

// Sample `index` in the unit square, scrambled by the pixel's own bits.
Eigen::Vector2d sample_point(std::uint32_t index, SampleUse use, std::uint64_t pixel_bits);

// The unit square onto the unit disc, keeping areas (Shirley and Chiu 1997).
Eigen::Vector2d on_disc(const Eigen::Vector2d& unit);

// A pixel's footprint along one axis: a unit box convolved with a Gaussian of sigma `blur_px`.
class Footprint {
 public:
  explicit Footprint(double blur_px);
  double offset_px(double unit) const;  // the quantile at `unit` in [0, 1)
  double reach_px() const { return quantiles_.back(); }

 private:
  std::vector<double> quantiles_;
};

}  // namespace crumple
