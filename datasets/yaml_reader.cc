#include "datasets/yaml_reader.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <sstream>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <yaml-cpp/eventhandler.h>

#include "datasets/nearest_name.h"

namespace crumple {
namespace {

constexpr std::size_t kProblemsShown = 20;

// An alias costs two characters and stands for any number of values: what the readers would walk through is counted
// before they do. A value that contains itself never ends.
constexpr std::size_t kMostValues = 200000;
constexpr int kDeepest = 64;

// Takes what `node` holds, aliases written out, off `left`; false where that is too much.
bool is_bounded(const YAML::Node& node, int depth, std::size_t& left) {
  if (depth > kDeepest || left == 0) return false;
  --left;
  if (!node.IsSequence() && !node.IsMap()) return true;
  return std::all_of(node.begin(), node.end(), [&](const YAML::const_iterator::value_type& item) {
    return node.IsMap() ? is_bounded(item.first, depth + 1, left) && is_bounded(item.second, depth + 1, left)
                        : is_bounded(item, depth + 1, left);
  });
}

// Quoted scalars carry the tag "!": a quoted 7 is a text, not a number.
bool is_quoted(const YAML::Node& node) { return node.Tag() == "!"; }

// Takes what a document holds and does nothing with it.
class Ignore final : public YAML::EventHandler {
  void OnDocumentStart(const YAML::Mark&) override {}
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark&, YAML::anchor_t) override {}
  void OnAlias(const YAML::Mark&, YAML::anchor_t) override {}
  void OnScalar(const YAML::Mark&, const std::string&, YAML::anchor_t, const std::string&) override {}
  void OnSequenceStart(const YAML::Mark&, const std::string&, YAML::anchor_t, YAML::EmitterStyle::value) override {}
  void OnSequenceEnd() override {}
  void OnMapStart(const YAML::Mark&, const std::string&, YAML::anchor_t, YAML::EmitterStyle::value) override {}
  void OnMapEnd() override {}
};

// YAML::LoadAll would find empty documents without end in a text such as ", a".
bool has_second_document(const std::string& text) {
  std::istringstream stream(text);
  YAML::Parser parser(stream);
  Ignore ignore;
  return parser.HandleNextDocument(ignore) && parser.HandleNextDocument(ignore);
}

template <typename Number>
std::optional<Number> parsed(const std::string& digits) {
  Number value{};
  const char* end = digits.data() + digits.size();
  const char* begin = digits.data() + (digits.starts_with('+') ? 1 : 0);
  const auto [stopped, failure] = std::from_chars(begin, end, value);
  if (failure != std::errc() || stopped != end) return {};
  return value;
}

// A name without its unit: "pitch" of "pitch_mm".
std::string stem(const std::string& key) { return key.substr(0, key.rfind('_')); }

std::string shortened(const std::string& text) { return text.size() <= 60 ? text : text.substr(0, 57) + "..."; }

}  // namespace

void YamlProblems::add(const YAML::Mark& mark, const std::string& field, const std::string& sentence) {
  const int line = mark.is_null() ? 1 : mark.line + 1;
  const int column = mark.is_null() ? 1 : mark.column + 1;
  const std::string subject = field.empty() ? "" : field + ": ";
  problems_.push_back({line, column, fmt::format("{}:{}:{}: {}{}", file_name_, line, column, subject, sentence)});
}

std::optional<Error> YamlProblems::error() const {
  if (problems_.empty()) return {};
  std::vector<Problem> sorted = problems_;
  std::stable_sort(sorted.begin(), sorted.end(), [](const Problem& a, const Problem& b) {
    return std::pair(a.line, a.column) < std::pair(b.line, b.column);
  });
  std::vector<std::string> lines;
  for (const Problem& problem : sorted) {
    if (lines.size() == kProblemsShown) break;
    lines.push_back(problem.text);
  }
  if (sorted.size() > kProblemsShown) {
    lines.push_back(fmt::format("{}: and {} more problems", file_name_, sorted.size() - kProblemsShown));
  }
  return Error{fmt::format("{}", fmt::join(lines, "\n"))};
}

Expected<YAML::Node> parse_yaml(const std::string& text, const std::string& file_name) {
  try {
    const YAML::Node document = YAML::Load(text);
    if (document.IsNull()) return fail(file_name + ":1:1: the file is empty");
    if (has_second_document(text)) return fail(file_name + ": more than one document (`---`): keep one to a file");
    std::size_t left = kMostValues;
    if (!is_bounded(document, 0, left)) {
      return fail(fmt::format("{}: holds more than {} values, or is nested deeper than {}: write it without aliases",
                              file_name, kMostValues, kDeepest));
    }
    return document;
  } catch (const YAML::Exception& exception) {
    YamlProblems problems(file_name);
    problems.add(exception.mark, "", "not valid YAML: " + exception.msg);
    return tl::unexpected<Error>(*problems.error());
  }
}

YamlValue::YamlValue(const YAML::Node& node, std::string field, YamlProblems* problems)
    : node_(node), field_(std::move(field)), problems_(problems) {}

void YamlValue::problem(const std::string& sentence) const { problems_->add(node_.Mark(), field_, sentence); }

std::string YamlValue::text() const {
  if (node_.IsScalar() && !node_.Scalar().empty()) return node_.Scalar();
  problem("must be a text" + std::string(node_.IsScalar() || node_.IsNull() ? ", and is empty" : ""));
  return {};
}

int YamlValue::integer(int lowest, int highest) const {
  const auto value = node_.IsScalar() && !is_quoted(node_) ? parsed<int>(node_.Scalar()) : std::nullopt;
  if (value && *value >= lowest && *value <= highest) return *value;
  const std::string given = node_.IsScalar() ? fmt::format(", not `{}`", shortened(node_.Scalar())) : "";
  problem(fmt::format("must be a whole number from {} to {} without quotes{}", lowest, highest, given));
  return lowest;
}

double YamlValue::number(double lowest, double highest) const {
  const auto value = node_.IsScalar() && !is_quoted(node_) ? parsed<double>(node_.Scalar()) : std::nullopt;
  if (value && std::isfinite(*value) && *value >= lowest && *value <= highest) return *value;
  const std::string given = node_.IsScalar() ? fmt::format(", not `{}`", shortened(node_.Scalar())) : "";
  problem(fmt::format("must be a number from {:g} to {:g} without quotes{}", lowest, highest, given));
  return lowest;
}

double YamlValue::positive_number() const {
  const auto value = node_.IsScalar() && !is_quoted(node_) ? parsed<double>(node_.Scalar()) : std::nullopt;
  if (value && std::isfinite(*value) && *value > 0) return *value;
  const std::string given = node_.IsScalar() ? fmt::format(", not `{}`", shortened(node_.Scalar())) : "";
  problem("must be a number above zero without quotes" + given);
  return 1;
}

bool YamlValue::boolean() const {
  if (node_.IsScalar() && !is_quoted(node_)) {
    if (node_.Scalar() == "true") return true;
    if (node_.Scalar() == "false") return false;
  }
  problem("must be true or false");
  return false;
}

std::string YamlValue::one_of(const std::vector<std::string>& words) const {
  if (node_.IsScalar() && std::find(words.begin(), words.end(), node_.Scalar()) != words.end()) return node_.Scalar();
  const std::string given = node_.IsScalar() ? fmt::format(", not `{}`", shortened(node_.Scalar())) : "";
  problem(fmt::format("must be {}{}", fmt::join(words, " or "), given));
  return words.front();
}

std::vector<YamlValue> YamlValue::list() const {
  std::vector<YamlValue> items;
  if (!node_.IsSequence()) {
    problem("must be a list, such as [a, b]");
    return items;
  }
  for (std::size_t i = 0; i < node_.size(); ++i) {
    items.emplace_back(node_[i], fmt::format("{}[{}]", field_, i), problems_);
  }
  return items;
}

YamlMap YamlValue::map() const {
  if (!node_.IsMap()) problem("must be a map, such as {key: value}");
  return {node_, field_, problems_};
}

YamlMap::YamlMap(const YAML::Node& node, std::string field, YamlProblems* problems)
    : node_(node), field_(std::move(field)), problems_(problems) {
  if (!node_.IsMap()) return;
  for (const auto& entry : node_) {
    if (!entry.first.IsScalar()) {
      problems_->add(entry.first.Mark(), field_, "a key must be a plain word");
      continue;
    }
    const std::string key = entry.first.Scalar();
    if (!values_.emplace(key, entry.second).second) {
      problems_->add(entry.first.Mark(), path_of(key), "is given twice: keep one");
      continue;
    }
    key_marks_[key] = entry.first.Mark();
    order_.push_back(key);
  }
}

std::string YamlMap::path_of(const std::string& key) const {
  return field_.empty() ? shortened(key) : field_ + "." + shortened(key);
}

std::optional<YamlValue> YamlMap::find(const std::string& key) {
  known_.push_back(key);
  const auto found = values_.find(key);
  if (found == values_.end()) return {};
  return YamlValue(found->second, path_of(key), problems_);
}

std::optional<YamlValue> YamlMap::require(const std::string& key, const std::string& what) {
  std::optional<YamlValue> value = find(key);
  // A node that is no map at all has been reported already.
  if (!value && node_.IsMap()) problem(fmt::format("`{}` is missing: {}", key, what));
  return value;
}

std::vector<std::pair<std::string, YamlValue>> YamlMap::entries() {
  std::vector<std::pair<std::string, YamlValue>> all;
  for (const std::string& key : order_) {
    known_.push_back(key);
    all.emplace_back(key, YamlValue(values_.at(key), path_of(key), problems_));
  }
  return all;
}

void YamlMap::problem(const std::string& sentence) const { problems_->add(node_.Mark(), field_, sentence); }

void YamlMap::finish() const {
  for (const std::string& key : order_) {
    if (std::find(known_.begin(), known_.end(), key) != known_.end()) continue;
    problems_->add(key_marks_.at(key), field_, fmt::format("unknown key `{}`{}", shortened(key), suggestion(key)));
  }
}

std::string YamlMap::suggestion(const std::string& key) const {
  const auto other_unit = std::find_if(known_.begin(), known_.end(), [&](const std::string& known) {
    return stem(known) == stem(key) || stem(known) == key;
  });
  // Long keys are no slips of the pen, and comparing them takes time.
  const std::string near = key.size() <= 60 ? nearest_name(key, known_) : "";
  const std::string& nearest = other_unit != known_.end() ? *other_unit : near;
  if (nearest.empty()) return fmt::format("; known here: {}", fmt::join(known_, ", "));
  const bool unit_is_wrong = stem(nearest) == stem(key) && nearest != stem(nearest) && stem(key) != key;
  return fmt::format("; did you mean `{}`?{}", nearest, unit_is_wrong ? " (The unit is part of the key.)" : "");
}

}  // namespace crumple
