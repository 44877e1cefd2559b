// A board as a capture describes it.
#pragma once

#include <optional>
#include <string>

#include "calib/certificate.h"
#include "calib/target.h"

namespace crumple {

struct BoardSpec {
  std::string name = "board";
  Target target;
  std::optional<BoardCertificate> certificate;
};

}  // namespace crumple
