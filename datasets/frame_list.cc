#include "datasets/frame_list.h"

#include <algorithm>
#include <array>
#include <map>
#include <tuple>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace crumple {
namespace {

using Kind = FrameContent::Kind;

constexpr std::size_t kMostFrames = 10000;

const std::map<std::string, Kind>& plain_kinds() {
  static const std::map<std::string, Kind> kinds = {
      {"white", Kind::white}, {"black", Kind::black}, {"ambient", Kind::ambient}, {"chessboard", Kind::chessboard}};
  return kinds;
}

// Appends frames; an unused image takes a number and nothing else.
class FrameAppender {
 public:
  explicit FrameAppender(Capture& capture) : capture_(capture) {}
  void skip(int count) { next_number_ += count; }
  void add(const FrameContent& content) {
    capture_.frames.push_back(content);
    capture_.frame_numbers.push_back(next_number_++);
  }

 private:
  Capture& capture_;
  int next_number_ = 0;
};

// An orientation's index; past the last one where it is out of range.
std::size_t read_orientation_index(const YamlValue& value, const Capture& capture) {
  if (capture.orientations.empty()) {
    value.problem("there is no such orientation: list it under `patterns.orientations`");
    return 0;
  }
  return static_cast<std::size_t>(value.integer(0, static_cast<int>(capture.orientations.size()) - 1));
}

void add_stripes(YamlMap& map, const YamlValue& stripes, const Capture& capture, FrameAppender& frames) {
  const std::size_t index = read_orientation_index(stripes, capture);
  const auto show = map.find("show");
  const auto order = map.find("order");
  if (capture.orientations.empty()) return;
  const StripeOrientation& orientation = capture.orientations[index];
  const std::string shown = show ? show->one_of({"pairs", "patterns", "inverses"}) : "pairs";
  const bool finest_first = order && order->one_of({"coarsest_first", "finest_first"}) == "finest_first";
  for (int i = 0; i < orientation.bits; ++i) {
    const int bit = finest_first ? orientation.bits - 1 - i : i;
    if (shown != "inverses") frames.add({Kind::stripes, index, bit, false});
    if (shown == "inverses" || (shown == "pairs" && orientation.inverse)) frames.add({Kind::stripes, index, bit, true});
  }
}

void add_single_stripe_frame(YamlMap& map, const YamlValue& index_value, const Capture& capture,
                             FrameAppender& frames) {
  const std::size_t index = read_orientation_index(index_value, capture);
  const int most = capture.orientations.empty() ? 16 : capture.orientations[index].bits;
  const auto bit_value = map.require("bit", "0 is the coarsest");
  const int bit = bit_value ? bit_value->integer(0, most - 1) : 0;
  const auto inverse = map.find("inverse");
  frames.add({Kind::stripes, index, bit, inverse && inverse->boolean()});
}

void read_item(const YamlValue& item, const Capture& capture, FrameAppender& frames) {
  if (item.is_scalar()) {
    const std::string word = item.one_of({"white", "black", "ambient", "chessboard", "unused"});
    const auto kind = plain_kinds().find(word);
    if (kind == plain_kinds().end()) return frames.skip(1);
    return frames.add({kind->second, 0, 0, false});
  }
  YamlMap map = item.map();
  const auto stripes = map.find("stripes");
  const auto orientation = map.find("orientation");
  const auto unused = map.find("unused");
  if (int{stripes.has_value()} + int{orientation.has_value()} + int{unused.has_value()} != 1) {
    item.problem(
        "must be white, black, ambient, chessboard, unused, {stripes: 0}, "
        "{orientation: 0, bit: 3, inverse: true} or {unused: 2}");
    return;
  }
  if (stripes) add_stripes(map, *stripes, capture, frames);
  if (orientation) add_single_stripe_frame(map, *orientation, capture, frames);
  if (unused) frames.skip(unused->integer(1, 100000));
  map.finish();
}

// Each orientation's patterns and inverses must all be there, and once.
void check_bits(const YamlValue& value, const Capture& capture) {
  std::map<std::tuple<std::size_t, int, bool>, std::vector<std::size_t>> shown;
  for (std::size_t i = 0; i < capture.frames.size(); ++i) {
    const FrameContent& frame = capture.frames[i];
    if (frame.kind == Kind::stripes) shown[{frame.orientation, frame.bit, frame.inverted}].push_back(i);
  }
  for (const auto& [key, at] : shown) {
    const auto& [orientation, bit, inverted] = key;
    if (at.size() > 1) {
      value.problem(fmt::format("{} is shown by frames {}: mark the ones not to be used as `unused`",
                                frame_words(capture.frames[at[0]]), fmt::join(at, " and ")));
    }
    if (inverted && !capture.orientations[orientation].inverse) {
      value.problem(
          fmt::format("frame {} is an inverse, but orientation {} says `inverse: false`", at[0], orientation));
    }
  }
  for (std::size_t o = 0; o < capture.orientations.size(); ++o) {
    std::vector<std::string> missing;
    for (int bit = 0; bit < capture.orientations[o].bits; ++bit) {
      if (!shown.contains({o, bit, false})) missing.push_back(fmt::format("bit {}", bit));
      if (capture.orientations[o].inverse && !shown.contains({o, bit, true})) {
        missing.push_back(fmt::format("the inverse of bit {}", bit));
      }
    }
    if (!missing.empty()) {
      value.problem(fmt::format("orientation {} lacks {}: add the frames, or correct the orientation", o,
                                fmt::join(missing, ", ")));
    }
  }
}

void check_plain_frames(const YamlValue& value, const Capture& capture) {
  for (const auto& [word, kind] : plain_kinds()) {
    std::vector<std::size_t> at;
    for (std::size_t i = 0; i < capture.frames.size(); ++i) {
      if (capture.frames[i].kind == kind) at.push_back(i);
    }
    if (at.size() > 1) {
      value.problem(fmt::format("{} is shown by frames {}: mark the ones not to be used as `unused`", word,
                                fmt::join(at, " and ")));
    }
    if (!at.empty() && kind != Kind::ambient && !capture.projector) {
      value.problem(fmt::format("frame {} is {}, but no `patterns` say which projector shows it", at[0], word));
    }
  }
  if (capture.find_frame(Kind::chessboard) && capture.projector && !capture.projected_chessboard) {
    value.problem("has a chessboard frame: describe the board under `patterns.chessboard`");
  }
}

// Contrast is white minus black; without inverses, the threshold is between them.
void check_references(const YamlValue& value, const Capture& capture) {
  if (capture.orientations.empty()) return;
  if (!capture.find_frame(Kind::white)) value.problem("has stripes but no white frame, which decoding needs: add it");
  for (std::size_t o = 0; o < capture.orientations.size(); ++o) {
    if (!capture.orientations[o].inverse && !capture.find_frame(Kind::black)) {
      value.problem(fmt::format("orientation {} has no inverses, so decoding needs a black frame: add it", o));
    }
  }
}

}  // namespace

void read_frames(const YamlValue& value, Capture& capture) {
  FrameAppender frames(capture);
  for (const YamlValue& item : value.list()) {
    read_item(item, capture, frames);
    if (capture.frames.size() > kMostFrames) {
      value.problem(fmt::format("has more than {} frames", kMostFrames));
      return;
    }
  }
  if (capture.frames.empty()) value.problem("at least one frame that is used is needed");
  check_bits(value, capture);
  check_plain_frames(value, capture);
  check_references(value, capture);
}

}  // namespace crumple
