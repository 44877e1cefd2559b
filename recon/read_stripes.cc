#include "recon/read_stripes.h"

namespace crumple {

Expected<std::vector<StripeCoordinates>> read_stripes(const StripeImages& images, const DecodeOptions& decode,
                                                      const PhaseOptions& phase) {
  if (auto sound = check_images(images); !sound) return tl::unexpected(sound.error());
  const cv::Mat lit = lit_mask(images, decode);
  std::vector<StripeCoordinates> coordinates;
  for (std::size_t i = 0; i < images.stacks.size(); ++i) {
    const auto decoded = decode_stripes(images, i, lit, decode);
    if (!decoded) return tl::unexpected(decoded.error());
    coordinates.push_back(estimate_stripe_phase(images, i, *decoded, phase));
  }
  return coordinates;
}

}  // namespace crumple
