// Do regions of 95 % contain the truth in 95 of 100 campaigns? Monte-Carlo campaigns at observation level, several
// thousand of each configuration, and fewer through rendered images; the seed is fixed before, every row is printed,
// none is run again. A run of some configurations keeps what a run with the same seed wrote of the others; where the
// file is of another seed, it writes one of its own.
//
// A row's bounds: coverage 95 +- 1.1 % (3.3 standard errors of 4000 campaigns; of fewer campaigns 3.3 of theirs), NEES
// per degree of freedom within 3.3 standard errors of 1, and along every direction of the predicted covariance of all
// parameters a variance within 4 standard errors of 1.
#include "tests/calib/coverage.h"

#include <cmath>
#include <filesystem>
#include <set>

#include <fmt/format.h>
#include <gflags/gflags.h>
#include <nlohmann/json.hpp>

#include "datasets/json_text.h"
#include "datasets/output_folder.h"
#include "tests/benchmark/rendered_coverage.h"

DEFINE_int32(campaigns, 4000, "of each configuration");
DEFINE_int32(seed, 20261126, "of all");
DEFINE_int32(rendered, 200, "campaigns through rendered images");
DEFINE_bool(quick, false, "fewer campaigns, about five minutes: 120 of each configuration, 20 through images");
DEFINE_string(only, "", "of the configurations, those with this in their name");
DEFINE_string(out, "out/bench/coverage.json", "the result");

namespace crumple {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kBound = 3.3;
constexpr double kDirectionBound = 4;

struct Misses {
  int coverage = 0;
  int nees = 0;
  int directions = 0;
  int rows = 0;
};

const char* mark(double error, double bound) { return std::abs(error) <= bound ? "" : " !"; }

void print_result(const std::string& configuration, const CoverageResult& result, Misses& misses, Json& rows) {
  for (const CoverageRow& row : result.rows) {
    const double off = row.coverage95 - 0.95, nees_off = row.nees_per_dof - 1;
    misses.coverage += std::abs(off) > kBound * row.coverage_error ? 1 : 0;
    misses.nees += std::abs(nees_off) > kBound * row.nees_error ? 1 : 0;
    ++misses.rows;
    fmt::print("| {} | {} | {}{} | {} | {:.2f}{} | {:.4f}{} |\n", configuration, row.quantity, row.dimension,
               row.regions > 1 ? fmt::format(", {} times", row.regions) : "", row.trials, 100 * row.coverage95,
               mark(off, kBound * row.coverage_error), row.nees_per_dof, mark(nees_off, kBound * row.nees_error));
    rows.push_back({{"configuration", configuration},
                    {"quantity", row.quantity},
                    {"dimension", row.dimension},
                    {"trials", row.trials},
                    {"coverage95", row.coverage95},
                    {"coverage95_standard_error", row.coverage_error},
                    {"nees_per_dof", row.nees_per_dof},
                    {"nees_per_dof_standard_error", row.nees_error}});
  }
  if (result.directions > 0) {
    misses.directions += std::abs(result.worst_direction_z) > kDirectionBound ? 1 : 0;
    fmt::print("| {} | worst of {} directions: variance {:.3f}, {:+.1f} standard errors{} | | | | |\n", configuration,
               result.directions, result.worst_direction_variance, result.worst_direction_z,
               mark(result.worst_direction_z, kDirectionBound));
  }
  if (result.failed > 0) fmt::print("| {} | {} refused: {} | | | | |\n", configuration, result.failed, result.failure);
  std::fflush(stdout);
}

// The rows of all configurations in their order: those of `measured` from this run, the others from an earlier one.
Json joined(const std::vector<CoverageConfiguration>& configurations, const std::set<std::string>& measured,
            const Json& ours, const Json& earlier) {
  Json rows = Json::array();
  for (const CoverageConfiguration& configuration : configurations) {
    for (const Json& row : measured.contains(configuration.name) ? ours : earlier) {
      if (row.at("configuration") == configuration.name) rows.push_back(row);
    }
  }
  return rows;
}

bool write_result(const std::vector<CoverageConfiguration>& configurations, const std::set<std::string>& measured,
                  Json rows, Json directions) {
  std::filesystem::path file = FLAGS_out;
  if (measured.size() < configurations.size() && std::filesystem::exists(file)) {
    const auto text = read_file(file);
    const Json earlier = text ? Json::parse(*text, nullptr, false) : Json();
    if (earlier.is_object() && earlier.value("seed", Json()) == FLAGS_seed) {
      rows = joined(configurations, measured, rows, earlier.value("rows", Json::array()));
      directions = joined(configurations, measured, directions, earlier.value("directions", Json::array()));
      fmt::print("configurations that were not run are kept in {} as they were\n", file.string());
    } else {
      file.replace_filename(fmt::format("{}_{}{}", file.stem().string(), FLAGS_seed, file.extension().string()));
      fmt::print("{} is of another seed and stays; these rows are in {}\n", FLAGS_out, file.string());
    }
  }
  const auto text = json_text(Json{{"seed", FLAGS_seed}, {"rows", rows}, {"directions", directions}});
  return text && write_file(file, *text);
}

int run() {
  auto configurations = coverage_configurations();
  if (!configurations) {
    fmt::print(stderr, "{}\n", configurations.error().message);
    return 1;
  }
  const auto rendered = rendered_configuration();
  if (!rendered) {
    fmt::print(stderr, "{}\n", rendered.error().message);
    return 1;
  }
  configurations->push_back(*rendered);
  Json rows = Json::array(), directions = Json::array();
  std::set<std::string> measured;
  Misses misses;
  fmt::print(
      "| configuration | quantity | dimension | campaigns | coverage of 95 %, % | NEES per degree of freedom |\n");
  fmt::print("|---|---|---|---:|---:|---:|\n");
  for (std::size_t c = 0; c < configurations->size(); ++c) {
    const CoverageConfiguration& configuration = (*configurations)[c];
    if (configuration.name.find(FLAGS_only) == std::string::npos) continue;
    const int campaigns =
        configuration.rendered ? (FLAGS_quick ? 20 : FLAGS_rendered) : (FLAGS_quick ? 120 : FLAGS_campaigns);
    if (campaigns == 0) continue;
    measured.insert(configuration.name);
    const auto seed = static_cast<std::uint32_t>(FLAGS_seed) + 1000 * static_cast<std::uint32_t>(c);
    const CoverageResult result = measure_coverage(configuration, seed, campaigns, 2, [&](int done) {
      if (configuration.rendered || done % 512 == 0)
        fmt::print(stderr, "{}: {} of {}\n", configuration.name, done, campaigns);
    });
    print_result(configuration.name, result, misses, rows);
    directions.push_back({{"configuration", configuration.name},
                          {"directions", result.directions},
                          {"worst_variance", result.worst_direction_variance},
                          {"worst_in_standard_errors", result.worst_direction_z},
                          {"refused", result.failed}});
  }
  fmt::print(
      "\nof {} rows {} have a coverage and {} a NEES beyond {} standard errors (marked !); {} configurations "
      "have a direction beyond {}\n",
      misses.rows, misses.coverage, misses.nees, kBound, misses.directions, kDirectionBound);
  return write_result(*configurations, measured, rows, directions) ? 0 : 1;
}

}  // namespace
}  // namespace crumple

int main(int argc, char** argv) {
  gflags::ParseCommandLineFlags(&argc, &argv, true);
  return crumple::run();
}
