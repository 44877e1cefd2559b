// Boards in capture.yaml and in scenes: the keys of docs/formats.md.
#pragma once

#include "calib/board_spec.h"
#include "datasets/yaml_reader.h"

namespace crumple {

// The keys that say what is printed. Those of the caller's own may stand beside them; finish() is the caller's.
Target read_target(YamlMap& map);

// A whole board: the target and its certificate.
BoardSpec read_board(const YamlValue& value, const std::string& name);

// What board certificates and scale bars have in common: temperature, expansion, serial, issuer, date.
void read_expansion_and_record(YamlMap& map, BoardCertificate& certificate);

// The target's keys, as read_target takes them, for inside braces: "kind: chessboard, inner_corners: [9, 6], ...".
std::string target_yaml(const Target& target);

}  // namespace crumple
