#include "datasets/python_literal.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <string_view>

#include <fmt/core.h>
#include <nlohmann/json.hpp>

namespace crumple {
namespace {

using nlohmann::json;

constexpr int deepest = 32;

class Parser {
 public:
  explicit Parser(std::string_view text) : text_(text) {}

  Expected<json> document() {
    auto result = value(0);
    if (!result) return result;
    skip_blank();
    if (at_ < text_.size()) return wrong("something follows the closing bracket");
    return result;
  }

 private:
  tl::unexpected<Error> wrong(const std::string& what) const {
    const std::string_view before = text_.substr(0, at_);
    const auto line = std::count(before.begin(), before.end(), '\n') + 1;
    const std::size_t start_of_line = before.rfind('\n') + 1;  // npos + 1 is 0
    return fail(fmt::format("line {}, column {}: {}", line, at_ - start_of_line + 1, what));
  }

  void skip_blank() {
    while (at_ < text_.size()) {
      if (text_[at_] == '#')
        at_ = std::min(text_.find('\n', at_), text_.size());
      else if (std::string_view(" \t\r\n").find(text_[at_]) != std::string_view::npos)
        ++at_;
      else
        return;
    }
  }

  bool take(char wanted) {
    skip_blank();
    if (at_ >= text_.size() || text_[at_] != wanted) return false;
    ++at_;
    return true;
  }

  Expected<json> value(int depth) {
    if (depth > deepest) return wrong("brackets are nested too deeply");
    skip_blank();
    if (at_ >= text_.size()) return wrong("the file ends too early");
    if (take('{')) return dict(depth);
    if (take('[')) return list(']', depth);
    if (take('(')) return list(')', depth);
    const char c = text_[at_];
    if (c == 'b' && at_ + 1 < text_.size() && (text_[at_ + 1] == '\'' || text_[at_ + 1] == '"')) {
      ++at_;
      return string();
    }
    if (c == '\'' || c == '"') return string();
    return word();
  }

  Expected<json> dict(int depth) {
    json result = json::object();
    while (!take('}')) {
      skip_blank();
      if (at_ >= text_.size() || (text_[at_] != '\'' && text_[at_] != '"')) return wrong("a quoted key is expected");
      const auto key = string();
      if (!key) return key;
      const std::string& name = key->get_ref<const std::string&>();
      if (!take(':')) return wrong(fmt::format("a colon is expected behind '{}'", name));
      if (result.contains(name)) return wrong(fmt::format("'{}' is given twice", name));
      auto item = value(depth + 1);
      if (!item) return item;
      result[name] = std::move(*item);
      if (take(',')) continue;
      if (take('}')) break;
      return wrong("a comma or } is expected");
    }
    return result;
  }

  Expected<json> list(char closing, int depth) {
    json result = json::array();
    while (!take(closing)) {
      auto item = value(depth + 1);
      if (!item) return item;
      result.push_back(std::move(*item));
      if (take(',')) continue;
      if (take(closing)) break;
      return wrong(fmt::format("a comma or {} is expected", closing));
    }
    return result;
  }

  Expected<json> string() {
    const char quote = text_[at_++];
    std::string result;
    while (at_ < text_.size() && text_[at_] != quote) {
      if (text_[at_] == '\n') break;
      if (text_[at_] == '\\' && at_ + 1 < text_.size()) {
        const char escaped = text_[at_ + 1];
        if (escaped != '\\' && escaped != '\'' && escaped != '"') return wrong("this escape is not supported");
        ++at_;
      }
      result += text_[at_++];
    }
    if (at_ >= text_.size() || text_[at_] != quote) return wrong("a text is not closed");
    ++at_;
    return json(result);
  }

  Expected<json> word() {
    const std::size_t end = std::min(text_.find_first_of(" \t\r\n,:]})#", at_), text_.size());
    const std::string_view word = text_.substr(at_, end - at_);
    json result;
    if (word == "True" || word == "False") {
      result = word == "True";
    } else if (word != "None") {
      const auto number = parse_number(word);
      if (!number) return wrong(fmt::format("'{}' is not a value", word.substr(0, 40)));
      result = *number;
    }
    at_ = end;
    return result;
  }

  static std::optional<json> parse_number(std::string_view word) {
    const std::string_view digits = word.substr(!word.empty() && word[0] == '+' ? 1 : 0);
    const char* const end = digits.data() + digits.size();
    long long whole = 0;
    if (const auto [stop, error] = std::from_chars(digits.data(), end, whole); error == std::errc() && stop == end)
      return json(whole);
    double number = 0;
    const auto [stop, error] = std::from_chars(digits.data(), end, number);
    if (error != std::errc() || stop != end || !std::isfinite(number)) return std::nullopt;
    return json(number);
  }

  std::string_view text_;
  std::size_t at_ = 0;
};

}  // namespace

Expected<json> parse_python_literal(const std::string& text) { return Parser(text).document(); }

}  // namespace crumple
