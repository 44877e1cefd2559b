#include "cli/sentence.h"

#include <sstream>
#include <string_view>

namespace crumple {

std::string as_sentences(const std::string& message) {
  std::string text;
  std::istringstream lines(message);
  for (std::string line; std::getline(lines, line);) {
    if (!text.empty()) text += '\n';
    text += line;
    if (!line.empty() && std::string_view(".!?:").find(line.back()) == std::string_view::npos) text += '.';
  }
  return text;
}

}  // namespace crumple
