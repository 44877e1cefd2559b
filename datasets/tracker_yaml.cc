#include "datasets/tracker_yaml.h"

#include <algorithm>
#include <array>
#include <set>

#include <fmt/format.h>

#include "datasets/limits.h"
#include "datasets/target_yaml.h"
#include "datasets/yaml_values.h"

namespace crumple {
namespace {

using Kind = FrameContent::Kind;

constexpr std::size_t kLongestWord = 1000;

CaptureLed read_capture_led(const std::string& name, const YamlValue& value) {
  if (!is_plain_name(name)) value.problem("an LED's name is made of letters, digits, _ and -");
  YamlMap map = value.map();
  CaptureLed led;
  led.name = name;
  if (const auto word = map.require("word", "when it is lit, such as \"0110\", one character a time step")) {
    led.word = read_word(*word);
  }
  led.mount = read_mount(map.find("mount"));
  if (const auto nominal = map.find("nominal_mm")) {
    led.nominal_mm = read_vector<3>(*nominal, -kLargestValue, kLargestValue);
  }
  map.finish();
  return led;
}

std::array<std::string, 2> read_ends(const YamlValue& value, const std::vector<CaptureLed>& leds) {
  std::array<std::string, 2> ends;
  const std::vector<YamlValue> items = value.list();
  if (items.size() != 2) {
    value.problem("must be the names of two LEDs, one at each end");
    return ends;
  }
  for (std::size_t i = 0; i < 2; ++i) {
    ends[i] = items[i].text();
    const bool known = std::any_of(leds.begin(), leds.end(), [&](const CaptureLed& led) {
      return led.name == ends[i] && led.mount == Mount::world;
    });
    if (!known) items[i].problem("is not an LED of `leds` with `mount: world`");
  }
  if (ends[0] == ends[1]) value.problem("must be two different LEDs");
  return ends;
}

BoardCertificate read_length_certificate(const YamlValue& value) {
  YamlMap map = value.map();
  BoardCertificate certificate;
  if (const auto sigma = map.require("length_sigma_mm", "the standard uncertainty of the length")) {
    certificate.pitch_sigma_mm = sigma->positive_number();
  }
  read_expansion_and_record(map, certificate);
  map.finish();
  return certificate;
}

CaptureBar read_scale_bar(const std::string& name, const YamlValue& value, const std::vector<CaptureLed>& leds) {
  if (!is_plain_name(name)) value.problem("a scale bar's name is made of letters, digits, _ and -");
  YamlMap map = value.map();
  CaptureBar bar;
  bar.name = name;
  if (const auto ends = map.require("leds", "the two LEDs at its ends")) bar.leds = read_ends(*ends, leds);
  bar.length_mm = required_number(map, "length_mm", "the distance of its LEDs", 1, kLargestValue);
  if (const auto certificate = map.require("certificate", "what is known of its length")) {
    bar.certificate = read_length_certificate(*certificate);
  }
  if (const auto placing = map.find("placing_sigma_mm")) bar.placing_sigma_mm = placing->positive_number();
  if (const auto places = map.find("places")) {
    for (const YamlValue& place : places->list()) {
      bar.places.emplace_back();
      for (const YamlValue& station : place.list()) bar.places.back().push_back(station.text());
    }
  }
  map.finish();
  return bar;
}

}  // namespace

Mount read_mount(const std::optional<YamlValue>& value) {
  return value && value->one_of({"probe", "world"}) == "world" ? Mount::world : Mount::probe;
}

std::string read_word(const YamlValue& value) {
  const std::string word = value.text();
  if (word.find_first_not_of("01") != std::string::npos || word.size() < 2 || word.size() > kLongestWord) {
    value.problem(
        fmt::format("must be 2 to {} characters, 1 where the LED is lit and 0 where it is dark", kLongestWord));
  }
  return word;
}

void check_words(const std::vector<std::string>& words, const YamlValue& value) {
  std::set<std::string> seen;
  for (const std::string& word : words) {
    if (word.size() != words.front().size()) {
      return value.problem(fmt::format("have words of {} and of {} steps: give all of them one length",
                                       words.front().size(), word.size()));
    }
    if (!seen.insert(word).second) return value.problem(fmt::format("two LEDs have the word {}", word));
  }
}

std::vector<FrameContent> read_tracker_frames(const YamlValue& value) {
  std::vector<FrameContent> frames;
  std::size_t step = 0;
  for (const YamlValue& item : value.list()) {
    if (item.is_scalar()) {
      item.one_of({"ambient"});
      frames.push_back({});
      continue;
    }
    YamlMap map = item.map();
    if (const auto leds = map.require("leds", "the number of images of the blinking sequence, one a time step")) {
      const int count = leds->integer(1, 10000);
      for (int i = 0; i < count; ++i) frames.push_back({Kind::leds, 0, 0, false, step++});
    }
    map.finish();
  }
  const auto ambient =
      std::count_if(frames.begin(), frames.end(), [](const FrameContent& f) { return f.kind == Kind::ambient; });
  if (ambient > 1) value.problem("shows ambient light more than once: keep one");
  if (frames.empty()) value.problem("at least one image is needed, such as {leds: 16}");
  return frames;
}

std::vector<CaptureLed> read_capture_leds(const YamlValue& value) {
  std::vector<CaptureLed> leds;
  std::vector<std::string> words;
  YamlMap map = value.map();
  for (const auto& [name, led] : map.entries()) {
    leds.push_back(read_capture_led(name, led));
    words.push_back(leds.back().word);
  }
  check_words(words, value);
  return leds;
}

std::vector<CaptureBar> read_scale_bars(const YamlValue& value, const std::vector<CaptureLed>& leds) {
  std::vector<CaptureBar> bars;
  std::set<std::string> taken;
  YamlMap map = value.map();
  for (const auto& [name, bar] : map.entries()) {
    bars.push_back(read_scale_bar(name, bar, leds));
    for (const std::string& led : bars.back().leds) {
      if (!led.empty() && !taken.insert(led).second)
        bar.problem(fmt::format("shares the LED {} with another bar", led));
    }
  }
  return bars;
}

}  // namespace crumple
