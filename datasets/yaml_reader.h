// A strict, typed layer over yaml-cpp.
//
// Values are asked for by key, type and range. A key that nobody asked for is unknown, and the nearest known one is
// suggested: units are part of keys, so `pitch_m` where `pitch_mm` is known is such a mistake. Problems are collected,
// each as `file:line:column: field: sentence`, so that one run shows them all; the values handed out beside a problem
// are placeholders, and the caller drops them when `YamlProblems::error()` is set. No exception leaves these functions.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include <yaml-cpp/yaml.h>

#include "solvers/expected.h"

namespace crumple {

class YamlProblems {
 public:
  explicit YamlProblems(std::string file_name) : file_name_(std::move(file_name)) {}
  void add(const YAML::Mark& mark, const std::string& field, const std::string& sentence);
  // All problems, one a line, in the order of their lines; the first twenty where there are more.
  std::optional<Error> error() const;

 private:
  struct Problem {
    int line;
    int column;
    std::string text;
  };
  std::string file_name_;
  std::vector<Problem> problems_;
};

// The one document of a text; fails on bad syntax, an empty text, more than one document, and one that aliases blow up.
Expected<YAML::Node> parse_yaml(const std::string& text, const std::string& file_name);

class YamlMap;

class YamlValue {
 public:
  // `problems` outlives the value.
  YamlValue(const YAML::Node& node, std::string field, YamlProblems* problems);

  bool is_map() const { return node_.IsMap(); }
  bool is_scalar() const { return node_.IsScalar(); }
  const std::string& field() const { return field_; }
  void problem(const std::string& sentence) const;

  std::string text() const;                            // never empty
  int integer(int lowest, int highest) const;          // unquoted decimal digits
  double number(double lowest, double highest) const;  // unquoted, finite
  double positive_number() const;
  bool boolean() const;  // true or false, nothing else
  std::string one_of(const std::vector<std::string>& words) const;
  std::vector<YamlValue> list() const;
  YamlMap map() const;

 private:
  YAML::Node node_;
  std::string field_;
  YamlProblems* problems_;
};

class YamlMap {
 public:
  // Reports keys that are not plain words and keys given twice.
  YamlMap(const YAML::Node& node, std::string field, YamlProblems* problems);

  // A value that may be missing, and one that must not: the latter's absence is a problem, said with `what`.
  std::optional<YamlValue> find(const std::string& key);
  std::optional<YamlValue> require(const std::string& key, const std::string& what);

  // The entries of a map whose keys the user chooses.
  std::vector<std::pair<std::string, YamlValue>> entries();

  void problem(const std::string& sentence) const;
  // Reports the keys that were not asked for. Call it after the last find or require.
  void finish() const;

 private:
  std::string suggestion(const std::string& key) const;
  std::string path_of(const std::string& key) const;

  YAML::Node node_;
  std::string field_;
  YamlProblems* problems_;
  std::map<std::string, YAML::Mark> key_marks_;
  std::map<std::string, YAML::Node> values_;
  std::vector<std::string> order_;
  std::vector<std::string> known_;
};

}  // namespace crumple
