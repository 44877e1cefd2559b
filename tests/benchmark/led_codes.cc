// Blink words decoded from simulated captures: several LEDs in step from an unknown start phase, states flipped, frames
// missing and known as missing. Counts wrong and refused LEDs, beside what is predicted of the word decoder alone.
#include <chrono>
#include <random>
#include <set>

#include <fmt/format.h>
#include <gflags/gflags.h>

#include "tracking/blink_code.h"

DEFINE_int32(captures, 100000, "simulated captures of each length");
DEFINE_int32(leds, 8, "LEDs on the probe, all of them seen");
DEFINE_double(flipped, 0.02, "share of the states that are read wrongly");
DEFINE_double(missing, 0.3, "share of the frames that are missing");
DEFINE_int32(shortest, 15, "shortest word, frames");
DEFINE_int32(longest, 24, "longest word, frames");
DEFINE_int32(most_cycles, 3, "the words are read once, twice ... up to that many times");

namespace crumple {
namespace {

struct Counts {
  long wrong = 0, refused = 0, wrong_before_duplicates = 0, wrong_phases = 0;
  long word_wrong = 0, word_refused = 0;
};

class Campaign {
 public:
  Campaign(const BlinkCode& code, int cycles) : code_(code), frames_(cycles * code.length()) {}

  Counts run(int captures) {
    for (int i = 0; i < captures; ++i) capture();
    return counts_;
  }

 private:
  std::vector<BlinkReading> readings(int phase) {
    std::vector<BlinkReading> rows(code_.size(), BlinkReading(static_cast<std::size_t>(frames_), BlinkState::missing));
    for (int k = 0; k < frames_; ++k) {
      if (uniform_(random_) < FLAGS_missing) continue;
      for (std::size_t led = 0; led < rows.size(); ++led) {
        const bool on = code_.lit(led, k + phase) != (uniform_(random_) < FLAGS_flipped);
        rows[led][static_cast<std::size_t>(k)] = on ? BlinkState::on : BlinkState::off;
      }
    }
    return rows;
  }

  void capture() {
    const int phase = std::uniform_int_distribution<int>(0, code_.length() - 1)(random_);
    const std::vector<BlinkReading> rows = readings(phase);
    const BlinkDecoding decoding = decode_blinks(code_, rows);
    counts_.wrong_phases += decoding.start_phase_told && decoding.start_phase != phase;
    std::multiset<std::size_t> told;
    for (const BlinkDecoded& led : decoding.leds) {
      if (led.led) told.insert(*led.led);
    }
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const auto led = decoding.leds[i].led;
      const bool accepted = led && told.count(*led) == 1;  // two places that blink the same word are both left out
      counts_.wrong_before_duplicates += led && *led != i;
      counts_.wrong += accepted && *led != i;
      counts_.refused += !accepted;
      const BlinkDecoded alone = decode_word(code_, rows[i], phase);
      counts_.word_refused += !alone.led;
      counts_.word_wrong += alone.led && *alone.led != i;
    }
  }

  const BlinkCode& code_;
  int frames_;
  std::mt19937_64 random_{1};
  std::uniform_real_distribution<double> uniform_{0, 1};
  Counts counts_;
};

void row(const BlinkCode& code, int cycles) {
  BlinkRates predicted;
  for (std::size_t led = 0; led < code.size(); ++led) {
    const BlinkRates of_led = predicted_blink_rates(code, led, cycles, FLAGS_flipped, FLAGS_missing);
    predicted.refused += of_led.refused / static_cast<double>(code.size());
    predicted.wrong += of_led.wrong / static_cast<double>(code.size());
  }
  const auto start = std::chrono::steady_clock::now();
  const Counts counts = Campaign(code, cycles).run(FLAGS_captures);
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  const double leds = double(FLAGS_captures) * static_cast<double>(code.size());
  fmt::print("| {} x {} = {} | {} / {} | {} ({}) | {:.2f} % | {} | {:.2f} % ({:.2f} %) | {:.1e} ({:.1e}) | {:.1f} |\n",
             cycles, code.length(), cycles * code.length(), code.distance(), code.distance_in_step(), counts.wrong,
             counts.wrong_before_duplicates, 100 * double(counts.refused) / leds, counts.wrong_phases,
             100 * double(counts.word_refused) / leds, 100 * predicted.refused, double(counts.word_wrong) / leds,
             predicted.wrong, 1e6 * seconds / FLAGS_captures);
  std::fflush(stdout);
}

int run() {
  fmt::print(
      "{} captures of {} LEDs, {:g} % of the states flipped, {:g} % of the frames missing, seed 1\n\n"
      "| frames | distance, any turn / in step | wrong (before the duplicates rule) | refused | wrong phases | word "
      "alone: refused (predicted) | wrong (predicted) | us per capture |\n|---|---|---|---|---|---|---|---|\n",
      FLAGS_captures, FLAGS_leds, 100 * FLAGS_flipped, 100 * FLAGS_missing);
  for (int length = FLAGS_shortest; length <= FLAGS_longest; ++length) {
    const auto code = BlinkCode::generate(static_cast<std::size_t>(FLAGS_leds), length);
    if (!code) {
      fmt::print("{}\n", code.error().message);
      continue;
    }
    for (int cycles = 1; cycles <= FLAGS_most_cycles; ++cycles) row(*code, cycles);
  }
  return 0;
}

}  // namespace
}  // namespace crumple

int main(int argc, char** argv) {
  gflags::ParseCommandLineFlags(&argc, &argv, true);
  return crumple::run();
}
