#include "cli/length_unit.h"

#include <fmt/format.h>

#include "cli/flags.h"

namespace crumple {

Expected<std::optional<double>> unit_from_flag(const RigFormat& format) {
  if (FLAGS_unit.empty()) return std::optional<double>();
  if (!format.lengths.empty()) {
    return fail(fmt::format("--unit={}: lengths of --format={} are {}, and not to be chosen", FLAGS_unit, format.name,
                            format.lengths));
  }
  if (FLAGS_unit == "mm") return 1.0;
  if (FLAGS_unit == "cm") return 10.0;
  if (FLAGS_unit == "m") return 1000.0;
  return fail(fmt::format("--unit={} is none of mm, cm and m", FLAGS_unit));
}

}  // namespace crumple
