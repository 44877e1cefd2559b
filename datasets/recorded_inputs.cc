#include "datasets/recorded_inputs.h"

#include <algorithm>

#include <fmt/core.h>
#include <nlohmann/json.hpp>

#include "datasets/output_folder.h"
#include "datasets/run_record.h"

namespace crumple {
namespace fs = std::filesystem;
namespace {

using nlohmann::json;

std::string text_in(const json& node, const char* key) {
  const auto found = node.is_object() ? node.find(key) : node.end();
  return found != node.end() && found->is_string() ? found->get<std::string>() : std::string();
}

const json* list_in(const json& node, const char* key) {
  const auto found = node.is_object() ? node.find(key) : node.end();
  return found != node.end() && found->is_array() ? &*found : nullptr;
}

Expected<bool> went_into(const fs::path& rig, const std::optional<RecordedInputs>& inputs) {
  if (!inputs) return false;
  const auto hash = sha256_of_file(rig / "rig.yaml");
  if (!hash) return tl::unexpected(hash.error());
  return inputs->count(*hash) > 0;
}

bool is_description(const std::string& name) { return fs::path(name).extension() == ".yaml"; }

}  // namespace

Expected<std::optional<RecordedInputs>> read_recorded_inputs(const fs::path& folder) {
  const fs::path file = folder / run_record_name;
  std::error_code error;
  if (!fs::exists(file, error)) return std::optional<RecordedInputs>();
  const auto text = read_file(file);
  if (!text) return tl::unexpected(text.error());
  const json crate = json::parse(*text, nullptr, false);
  const json* const graph = list_in(crate, "@graph");
  std::map<std::string, const json*> nodes;
  if (graph) {
    for (const json& node : *graph) nodes.emplace(text_in(node, "@id"), &node);
  }
  const auto run = nodes.find("#run");
  const json* const objects = run == nodes.end() ? nullptr : list_in(*run->second, "object");
  if (!objects) {
    return fail(fmt::format(
        "{} is not a run record as Crumple writes it: it tells of no run. Restore or remove the file.", file.string()));
  }
  RecordedInputs inputs;
  for (const json& object : *objects) {
    const auto node = nodes.find(text_in(object, "@id"));
    if (node == nodes.end()) continue;
    const std::string hash = text_in(*node->second, "sha256");  // flags and seeds have none
    if (!hash.empty()) inputs.emplace(hash, text_in(*node->second, "name"));
  }
  return std::optional<RecordedInputs>(std::move(inputs));
}

Expected<SharedInputs> shared_inputs(const fs::path& first, const fs::path& second) {
  const auto of_first = read_recorded_inputs(first), of_second = read_recorded_inputs(second);
  for (const auto* inputs : {&of_first, &of_second}) {
    if (!*inputs) return tl::unexpected(inputs->error());
  }
  const auto second_from_first = went_into(first, *of_second), first_from_second = went_into(second, *of_first);
  for (const auto* went : {&second_from_first, &first_from_second}) {
    if (!*went) return tl::unexpected(went->error());
  }
  SharedInputs shared{*second_from_first, *first_from_second, {}};
  if (*of_first && *of_second) {
    for (const auto& [hash, name] : **of_first) {
      if (!is_description(name) && (*of_second)->count(hash) > 0) shared.common.push_back(name);
    }
    std::sort(shared.common.begin(), shared.common.end());
  }
  return shared;
}

}  // namespace crumple
