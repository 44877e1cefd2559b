#include "datasets/sequence_order.h"

#include <algorithm>
#include <functional>
#include <numeric>
#include <optional>

namespace crumple {
namespace {

using Kind = FrameContent::Kind;

constexpr int kMissing = -1;
constexpr int kFewestEdges = 50;
constexpr double kLeastAmplitude = 0.1;  // a frame blurred further says nothing
constexpr double kSound = 0.4;           // terms above this are as they should be; clean captures stay above 0.8
constexpr double kTolerated = 0.5;       // summed penalty of a sequence that is in order
constexpr double kTie = 0.25;
constexpr int kMostRepairs = 4;

// Which image shows each content: contents index -> image index or kMissing.
using Order = std::vector<int>;

struct Term {
  enum class What { complement, edge, white, black };
  What what;
  std::size_t source;
  std::size_t target;
  double expected;
};

std::vector<Term> terms_of(const std::vector<FrameContent>& contents) {
  std::vector<Term> terms;
  for (std::size_t i = 0; i < contents.size(); ++i) {
    if (contents[i].kind == Kind::white) terms.push_back({Term::What::white, i, i, 1});
    if (contents[i].kind == Kind::black) terms.push_back({Term::What::black, i, i, 1});
    if (contents[i].kind != Kind::stripes) continue;
    for (std::size_t j = 0; j < contents.size(); ++j) {
      if (contents[j].kind != Kind::stripes || contents[j].orientation != contents[i].orientation) continue;
      const int finer = contents[j].bit - contents[i].bit;
      if (finer == 0 && !contents[i].inverted && contents[j].inverted) {
        terms.push_back({Term::What::complement, i, j, -1});
      }
      const double lit = finer == 1 ? 1 : -1;
      if (finer > 0) terms.push_back({Term::What::edge, i, j, contents[j].inverted ? -lit : lit});
    }
  }
  return terms;
}

class Score {
 public:
  Score(const std::vector<FrameContent>& contents, const SequenceStatistics& statistics)
      : terms_(terms_of(contents)), statistics_(statistics) {}

  double penalty(const Order& order) const {
    double sum = 0;
    for (const Term& term : terms_) sum += penalty(term, order);
    return sum;
  }

  // The penalty of the terms that frame `content` takes part in.
  double penalty_of(std::size_t content, const Order& order) const {
    double sum = 0;
    for (const Term& term : terms_) {
      if (term.source == content || term.target == content) sum += penalty(term, order);
    }
    return sum;
  }

 private:
  double penalty(const Term& term, const Order& order) const {
    const int source = order[term.source];
    const int target = order[term.target];
    if (source == kMissing || target == kMissing) return 0;
    const std::optional<double> v = value(term, source, target);
    return v ? std::max(0.0, (kSound - *v) / kSound) : 0;
  }

  std::optional<double> value(const Term& term, int source, int target) const {
    const double amplitude = statistics_.amplitude[target];
    if (amplitude < kLeastAmplitude) return {};
    switch (term.what) {
      case Term::What::complement:
        return term.expected * statistics_.correlation(source, target);
      case Term::What::edge:
        if (statistics_.edge_count[source] < kFewestEdges) return {};
        return std::clamp(term.expected * statistics_.along_edges(source, target) / amplitude, -1.0, 1.0);
      // A white frame is lit everywhere, and not just mostly, as a coarse pattern may be.
      case Term::What::white:
        return std::max(-1.0, 1 - 6 * statistics_.dark_share[source]);
      case Term::What::black:
        return std::max(-1.0, 1 - 6 * (1 - statistics_.dark_share[source]));
    }
    return {};
  }

  std::vector<Term> terms_;
  const SequenceStatistics& statistics_;
};

Order described_order(const SequenceStatistics& statistics) {
  Order order(statistics.scaled.size());
  for (std::size_t i = 0; i < order.size(); ++i) {
    order[i] = statistics.scaled[i].empty() ? kMissing : static_cast<int>(i);
  }
  return order;
}

// Contents from `first` on are found `shift` images further.
Order shifted(const Order& described, std::size_t first, int shift) {
  Order order = described;
  for (std::size_t i = first; i < order.size(); ++i) {
    const int source = static_cast<int>(i) + shift;
    order[i] = source < 0 || source >= static_cast<int>(order.size()) ? kMissing : described[source];
  }
  if (shift < 0) order[first] = kMissing;
  return order;
}

// The contents of one orientation put in another order: `other` names the content whose image each one's is.
Order rearranged(const Order& order, const std::vector<FrameContent>& contents, std::size_t orientation,
                 const std::function<FrameContent(const FrameContent&)>& other) {
  Order result = order;
  for (std::size_t i = 0; i < contents.size(); ++i) {
    if (contents[i].kind != Kind::stripes || contents[i].orientation != orientation) continue;
    const FrameContent wanted = other(contents[i]);
    for (std::size_t j = 0; j < contents.size(); ++j) {
      const FrameContent& c = contents[j];
      const bool same = c.kind == Kind::stripes && c.orientation == orientation && c.bit == wanted.bit &&
                        c.inverted == wanted.inverted;
      if (same) result[i] = order[j];
    }
  }
  return result;
}

class Search {
 public:
  Search(const std::vector<FrameContent>& contents, const SequenceStatistics& statistics)
      : contents_(contents), score_(contents, statistics), described_(described_order(statistics)) {
    described_penalty_ = score_.penalty(described_);
    enough_ = kTolerated + 0.03 * described_penalty_;
    for (const FrameContent& content : contents) {
      if (content.kind != Kind::stripes) continue;
      bits_.resize(std::max(bits_.size(), content.orientation + 1));
      bits_[content.orientation] = std::max(bits_[content.orientation], content.bit + 1);
    }
  }

  OrderVerdict verdict() const {
    if (described_penalty_ <= kTolerated) return {};
    const OrderVerdict exchanged = exchanges();
    const OrderVerdict bad = bad_frames();
    if (exchanged.involved.size() == 2) return exchanged;
    const auto inverse_first = [](FrameContent c) { return c.inverted = !c.inverted, c; };
    const auto finest_first = [&](FrameContent c) { return c.bit = bits_[c.orientation] - 1 - c.bit, c; };
    for (const OrderVerdict& candidate :
         {orientations(OrderFault::inverses_first, inverse_first), orientations(OrderFault::finest_first, finest_first),
          shifts(OrderFault::dropped, -1), shifts(OrderFault::repeated, 1)}) {
      if (!candidate.involved.empty()) return candidate;
    }
    if (bad.involved.size() == 1) return bad;
    if (!exchanged.involved.empty()) return exchanged;
    return bad.involved.empty() ? worst_frames() : bad;
  }

 private:
  // Exchanges the two frames that help most, again where more than one exchange is needed.
  OrderVerdict exchanges() const {
    OrderVerdict verdict{OrderFault::exchanged, {}};
    Order order = described_;
    for (int repair = 0; repair < kMostRepairs; ++repair) {
      double least = score_.penalty(order);
      std::optional<std::pair<std::size_t, std::size_t>> best;
      for (std::size_t i = 0; i < order.size(); ++i) {
        for (std::size_t j = i + 1; j < order.size(); ++j) {
          if (order[i] == kMissing || order[j] == kMissing) continue;
          std::swap(order[i], order[j]);
          const double penalty = score_.penalty(order);
          if (penalty < least - kTie) {
            least = penalty;
            best = {i, j};
          }
          std::swap(order[i], order[j]);
        }
      }
      if (!best) return {};
      std::swap(order[best->first], order[best->second]);
      verdict.involved.insert(verdict.involved.end(), {best->first, best->second});
      if (least <= enough_) return verdict;
    }
    return {};
  }

  OrderVerdict bad_frames() const {
    OrderVerdict verdict{OrderFault::bad_frame, {}};
    Order order = described_;
    for (int repair = 0; repair < kMostRepairs; ++repair) {
      double least = score_.penalty(order);
      std::optional<std::size_t> best;
      for (std::size_t i = 0; i < order.size(); ++i) {
        const int kept = std::exchange(order[i], kMissing);
        const double penalty = score_.penalty(order);
        if (penalty < least - kTie) {
          least = penalty;
          best = i;
        }
        order[i] = kept;
      }
      if (!best) return {};
      order[*best] = kMissing;
      verdict.involved.push_back(*best);
      if (least <= enough_) return verdict;
    }
    return {};
  }

  OrderVerdict orientations(OrderFault fault, const std::function<FrameContent(const FrameContent&)>& other) const {
    OrderVerdict verdict{fault, {}};
    Order order = described_;
    for (std::size_t o = 0; o < bits_.size(); ++o) {
      const Order changed = rearranged(order, contents_, o, other);
      if (score_.penalty(changed) >= score_.penalty(order) - kTie) continue;
      order = changed;
      verdict.involved.push_back(o);
    }
    if (score_.penalty(order) > enough_) verdict.involved.clear();
    return verdict;
  }

  OrderVerdict shifts(OrderFault fault, int shift) const {
    std::vector<double> penalties;
    // From the last frame on, a shift is no more than that frame's being bad.
    for (std::size_t first = 0; first + 1 < described_.size(); ++first) {
      penalties.push_back(score_.penalty(shifted(described_, first, shift)));
    }
    OrderVerdict verdict{fault, {}};
    if (penalties.empty()) return verdict;
    const double least = *std::min_element(penalties.begin(), penalties.end());
    for (std::size_t first = 0; first < penalties.size() && least <= enough_; ++first) {
      if (penalties[first] <= least + kTie) verdict.involved.push_back(first);
    }
    return verdict;
  }

  OrderVerdict worst_frames() const {
    OrderVerdict verdict{OrderFault::unclear, {}};
    std::vector<std::size_t> frames(contents_.size());
    std::iota(frames.begin(), frames.end(), std::size_t{0});
    std::vector<double> penalties;
    for (const std::size_t frame : frames) penalties.push_back(score_.penalty_of(frame, described_));
    std::stable_sort(frames.begin(), frames.end(),
                     [&](std::size_t a, std::size_t b) { return penalties[a] > penalties[b]; });
    for (std::size_t i = 0; i < std::min<std::size_t>(4, frames.size()); ++i) verdict.involved.push_back(frames[i]);
    return verdict;
  }

  const std::vector<FrameContent>& contents_;
  Score score_;
  Order described_;
  double described_penalty_ = 0;
  double enough_ = 0;
  std::vector<int> bits_;
};

}  // namespace

OrderVerdict find_order(const std::vector<FrameContent>& contents, const SequenceStatistics& statistics) {
  return Search(contents, statistics).verdict();
}

}  // namespace crumple
