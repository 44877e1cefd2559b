// What a check found wrong, for the person who can put it right.
#pragma once

#include <string>

namespace crumple {

enum class Severity {
  warning,  // the capture can be used; the result may be worse than it could be
  error     // what was named cannot be used as it is
};

struct Finding {
  Severity severity = Severity::error;
  std::string where;     // a file, or "station 3, camera left"
  std::string sentence;  // what is wrong and what to do
};

}  // namespace crumple
