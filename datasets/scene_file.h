// scene.yaml: the description of a scene to render (docs/scenes.md).
#pragma once

#include <filesystem>
#include <string>

#include "datasets/render/scene.h"
#include "solvers/expected.h"

namespace crumple {

// Strict: unknown keys, wrong types, units or ranges are rejected, each as `file:line:column: field: sentence`.
Expected<Scene> parse_scene(const std::string& text, const std::string& file_name);
Expected<Scene> read_scene(const std::filesystem::path& file);

}  // namespace crumple
