// The decoding half of tracking/blink_code.h.
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "tracking/blink_code.h"

namespace crumple {
namespace {

constexpr int kCorrected = 1;
constexpr int kMargin = 3;       // errors by which every other word has to be worse
constexpr int kMostCounted = 4;  // errors of one LED in the sum that picks the phase: a lamp must not outvote the LEDs
constexpr int kPhaseSlack = 3;
constexpr int kFewestPlaces = 4;

struct PooledReading {
  std::uint32_t on = 0;
  std::uint32_t seen = 0;
};

PooledReading pooled(const BlinkReading& reading, int length) {
  std::array<int, BlinkCode::kLongest> votes{};
  for (std::size_t k = 0; k < reading.size(); ++k) {
    if (reading[k] == BlinkState::missing) continue;
    votes[k % static_cast<std::size_t>(length)] += reading[k] == BlinkState::on ? 1 : -1;
  }
  PooledReading result;
  for (int i = 0; i < length; ++i) {
    const std::uint32_t place = std::uint32_t{1} << i;
    if (votes[static_cast<std::size_t>(i)] != 0) result.seen |= place;
    if (votes[static_cast<std::size_t>(i)] > 0) result.on |= place;
  }
  return result;
}

struct NearestWord {
  std::size_t led = 0;
  int errors = BlinkCode::kLongest + 1;
  int errors_of_next = BlinkCode::kLongest + 1;
};

NearestWord nearest_word(const BlinkCode& code, const PooledReading& reading, int phase) {
  NearestWord nearest;
  for (std::size_t led = 0; led < code.size(); ++led) {
    const int errors = std::popcount((code.turned(led, phase) ^ reading.on) & reading.seen);
    if (errors < nearest.errors) {
      nearest.errors_of_next = nearest.errors;
      nearest.errors = errors;
      nearest.led = led;
    } else if (errors < nearest.errors_of_next) {
      nearest.errors_of_next = errors;
    }
  }
  return nearest;
}

// `possible` holds the nearest words at the phases that remain, the best first.
BlinkDecoded judged(const PooledReading& reading, const std::vector<NearestWord>& possible) {
  BlinkDecoded result{.led = {}, .errors = possible.front().errors, .places_read = std::popcount(reading.seen)};
  if (result.places_read < kFewestPlaces) {
    result.refusal = BlinkRefusal::too_few_frames;
    return result;
  }
  // At a phase that is not the true one an LED need not resemble any word, and that says nothing against it.
  std::optional<std::size_t> led;
  bool several = false;
  for (const NearestWord& at : possible) {
    if (at.errors >= result.errors + kMargin) continue;
    several = several || at.errors_of_next < result.errors + kMargin || (led && *led != at.led);
    led = at.led;
  }
  if (result.errors > kCorrected) {
    result.refusal = reading.on == reading.seen ? BlinkRefusal::always_on : BlinkRefusal::no_word;
  } else if (several) {
    result.refusal = BlinkRefusal::several_words;
  } else {
    result.led = possible.front().led;
  }
  return result;
}

// P(k of n) at the probabilities of three outcomes, of which one takes the rest.
double trinomial(int n, int i, double p, int k, double q) {
  const double rest = std::max(0.0, 1 - p - q);
  return std::exp(std::lgamma(n + 1) - std::lgamma(i + 1) - std::lgamma(k + 1) - std::lgamma(n - i - k + 1)) *
         std::pow(p, i) * std::pow(q, k) * std::pow(rest, n - i - k);
}

// That a place of the word, pooled over the cycles, is read rightly and wrongly.
std::array<double, 2> place_probabilities(int cycles, double flipped, double missing) {
  std::array<double, 2> result{};
  for (int right = 0; right <= cycles; ++right) {
    for (int wrong = 0; right + wrong <= cycles; ++wrong) {
      if (right == wrong) continue;
      result[right > wrong ? 0 : 1] +=
          trinomial(cycles, right, (1 - missing) * (1 - flipped), wrong, (1 - missing) * flipped);
    }
  }
  return result;
}

// Of the places in which the two words differ a are read rightly and b wrongly; of the others c are wrong.
void add_other_word(int length, int distance, double right, double wrong, BlinkRates& rates) {
  for (int a = 0; a <= distance; ++a) {
    for (int b = 0; a + b <= distance; ++b) {
      const double of_these = trinomial(distance, a, right, b, wrong);
      for (int c = 0; c <= std::min(length - distance, kCorrected); ++c) {
        const double probability = of_these * trinomial(length - distance, c, wrong, 0, 0);
        if (b + c <= kCorrected && a - b < kMargin) rates.refused += probability;
        if (a + c <= kCorrected && b - a >= kMargin) rates.wrong += probability;
      }
    }
  }
}

}  // namespace

const char* words(BlinkRefusal refusal) {
  switch (refusal) {
    case BlinkRefusal::none:
      return "told";
    case BlinkRefusal::too_few_frames:
      return "too few frames show it";
    case BlinkRefusal::always_on:
      return "always on: a lamp or its reflection";
    case BlinkRefusal::no_word:
      return "blinks no word of the code";
    case BlinkRefusal::several_words:
      return "the frames read fit several words";
  }
  return "";
}

BlinkDecoding decode_blinks(const BlinkCode& code, const std::vector<BlinkReading>& readings) {
  std::vector<PooledReading> rows;
  for (const BlinkReading& reading : readings) rows.push_back(pooled(reading, code.length()));
  std::vector<std::vector<NearestWord>> nearest(static_cast<std::size_t>(code.length()));
  std::vector<int> sums;
  for (int phase = 0; phase < code.length(); ++phase) {
    int sum = 0;
    for (const PooledReading& row : rows) {
      nearest[static_cast<std::size_t>(phase)].push_back(nearest_word(code, row, phase));
      sum += std::min(nearest[static_cast<std::size_t>(phase)].back().errors, kMostCounted);
    }
    sums.push_back(sum);
  }
  const auto best = std::min_element(sums.begin(), sums.end());
  std::vector<std::size_t> phases{static_cast<std::size_t>(best - sums.begin())};
  for (std::size_t phase = 0; phase < sums.size(); ++phase) {
    if (phase != phases.front() && sums[phase] <= *best + kPhaseSlack) phases.push_back(phase);
  }
  BlinkDecoding result{
      .start_phase = static_cast<int>(phases.front()), .start_phase_told = phases.size() == 1, .leds = {}};
  for (std::size_t i = 0; i < rows.size(); ++i) {
    std::vector<NearestWord> possible;
    for (const std::size_t phase : phases) possible.push_back(nearest[phase][i]);
    result.leds.push_back(judged(rows[i], possible));
  }
  return result;
}

BlinkDecoded decode_word(const BlinkCode& code, const BlinkReading& reading, int start_phase) {
  const PooledReading row = pooled(reading, code.length());
  return judged(row, {nearest_word(code, row, start_phase)});
}

BlinkRates predicted_blink_rates(const BlinkCode& code, std::size_t led, int cycles, double flipped, double missing) {
  const auto [right, wrong] = place_probabilities(cycles, flipped, missing);
  const int n = code.length();
  BlinkRates rates;
  for (int errors = kCorrected + 1; errors <= n; ++errors) rates.refused += trinomial(n, errors, wrong, 0, 0);
  for (std::size_t other = 0; other < code.size(); ++other) {
    if (other == led) continue;
    const int distance = std::popcount(code.words()[led] ^ code.words()[other]);
    add_other_word(n, std::min(n, distance), right, wrong, rates);
  }
  return rates;
}

}  // namespace crumple
