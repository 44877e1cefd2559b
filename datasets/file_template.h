// File names with placeholders, such as "capture_{station}/graycode_{frame:02}.png".
//
// {station}, {sensor}, {frame_name}: texts. {frame}, {frame:04}: a number, with zeros in front up to that width.
// {{ and }} stand for the braces themselves.
#pragma once

#include <string>
#include <vector>

#include "solvers/expected.h"

namespace crumple {

struct FileTemplateValues {
  std::string station;
  std::string sensor;
  int frame = 0;
  std::string frame_name;
};

// Whether {station} or {frame_name} may stand for this text: a relative path without parts that are dots alone, which,
// joined to the template's own text, could lead out of the folder.
bool stays_below(const std::string& text);

class FileTemplate {
 public:
  // Fails on an unknown placeholder, an odd brace, an absolute path and on "..".
  static Expected<FileTemplate> parse(const std::string& text);

  bool uses(const std::string& placeholder) const;
  std::string expand(const FileTemplateValues& values) const;

 private:
  struct Part {
    std::string placeholder;  // empty for plain text
    std::string text;
    int width = 0;
  };
  std::vector<Part> parts_;
};

}  // namespace crumple
