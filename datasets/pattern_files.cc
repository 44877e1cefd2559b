#include "datasets/pattern_files.h"

#include <bit>
#include <cassert>
#include <cmath>

#include <fmt/core.h>

#include "datasets/image_io.h"
#include "datasets/output_folder.h"

namespace crumple {
namespace {

double degrees(double angle_rad) {
  return std::round(angle_rad * 180 / M_PI * 1e9) / 1e9;  // 60, not 59.99999999999999
}

std::string description(const FrameContent& frame, const std::vector<StripeOrientation>& orientations) {
  if (frame.kind == FrameContent::Kind::white) return "white";
  if (frame.kind == FrameContent::Kind::black) return "black";
  return fmt::format("{:.6g}deg_bit{}{}", degrees(orientations[frame.orientation].angle_rad), frame.bit,
                     frame.inverted ? "_inverse" : "");
}

// The keys of capture.yaml that follow from the patterns, and a list of the images.
std::string description_yaml(const std::vector<StripeOrientation>& orientations, ImageSize projector,
                             const std::vector<std::string>& names) {
  std::string text = fmt::format(
      "# What the projector shows. Copy these keys into capture.yaml and add the cameras, the board and the stations.\n"
      "sensors:\n"
      "  projector: {{kind: projector, size_px: [{}, {}]}}\n"
      "patterns:\n"
      "  projector: projector\n"
      "  orientations:\n",
      projector.width_px, projector.height_px);
  for (const StripeOrientation& orientation : orientations)
    text += fmt::format("    - {{angle_deg: {}, stripe_width_px: {}, bits: {}, code_offset: {}, inverse: {}}}\n",
                        degrees(orientation.angle_rad), orientation.stripe_width_px, orientation.bits,
                        orientation.code_offset, orientation.inverse);
  text += "frames: [white, black";
  for (std::size_t i = 0; i < orientations.size(); ++i) text += fmt::format(", {{stripes: {}}}", i);
  text += "]\n# The images, frame by frame:\n";
  for (std::size_t i = 0; i < names.size(); ++i) text += fmt::format("#   {}: {}\n", i, names[i]);
  return text;
}

}  // namespace

Expected<int> sufficient_bits(const StripeOrientation& orientation, ImageSize projector) {
  StripeOrientation widest = orientation;
  widest.bits = 16;
  if (auto sound = checked(widest, projector); !sound) return tl::unexpected(sound.error());
  const int last_code = stripe_count(orientation, projector) + orientation.code_offset - 1;
  return std::max(1, static_cast<int>(std::bit_width(static_cast<unsigned>(last_code))));
}

std::vector<FrameContent> pattern_sequence(const std::vector<StripeOrientation>& orientations) {
  std::vector<FrameContent> frames = {{FrameContent::Kind::white}, {FrameContent::Kind::black}};
  for (std::size_t i = 0; i < orientations.size(); ++i) {
    for (int bit = 0; bit < orientations[i].bits; ++bit) {
      frames.push_back({FrameContent::Kind::stripes, i, bit, false});
      if (orientations[i].inverse) frames.push_back({FrameContent::Kind::stripes, i, bit, true});
    }
  }
  return frames;
}

cv::Mat draw_pattern(const FrameContent& content, const std::vector<StripeOrientation>& orientations,
                     ImageSize projector) {
  if (content.kind == FrameContent::Kind::stripes)
    return draw_stripes(orientations[content.orientation], projector, content.bit, content.inverted);
  assert(content.kind == FrameContent::Kind::white || content.kind == FrameContent::Kind::black);
  const int level = content.kind == FrameContent::Kind::white ? 255 : 0;
  return {projector.height_px, projector.width_px, CV_8UC1, cv::Scalar(level)};
}

std::vector<std::string> pattern_file_names(const std::vector<FrameContent>& frames,
                                            const std::vector<StripeOrientation>& orientations) {
  const std::size_t digits = std::max<std::size_t>(2, std::to_string(frames.size() - 1).size());
  std::vector<std::string> names;
  for (std::size_t i = 0; i < frames.size(); ++i)
    names.push_back(fmt::format("{:0{}}_{}.png", i, digits, description(frames[i], orientations)));
  return names;
}

Expected<std::vector<std::string>> write_patterns(const std::filesystem::path& folder,
                                                  const std::vector<StripeOrientation>& orientations,
                                                  ImageSize projector, const std::function<void()>& written) {
  for (const StripeOrientation& orientation : orientations)
    if (auto sound = checked(orientation, projector); !sound) return tl::unexpected(sound.error());
  const std::vector<FrameContent> frames = pattern_sequence(orientations);
  std::vector<std::string> names = pattern_file_names(frames, orientations);
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const cv::Mat image = draw_pattern(frames[i], orientations, projector);
    if (auto done = write_png(folder / names[i], image); !done) return tl::unexpected(done.error());
    if (written) written();
  }
  const auto described = write_file(folder / "patterns.yaml", description_yaml(orientations, projector, names));
  if (!described) return tl::unexpected(described.error());
  return names;
}

}  // namespace crumple
