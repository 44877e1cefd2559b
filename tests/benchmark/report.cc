#include "tests/benchmark/report.h"

#include <algorithm>
#include <chrono>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <thread>

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace crumple {
namespace {

// What the figures hang on besides the code.
std::string date_and_machine() {
  std::string processor = "unknown processor";
  std::ifstream cpuinfo("/proc/cpuinfo");
  for (std::string line; std::getline(cpuinfo, line);) {
    if (!line.starts_with("model name")) continue;
    processor = line.substr(line.find(':') + 2);
    break;
  }
  const std::time_t now = std::chrono::system_clock::to_time_t(std::chrono::system_clock::now());
  return fmt::format("{:%Y-%m-%d}, {}, {} processors, GCC {}", fmt::gmtime(now), processor,
                     std::thread::hardware_concurrency(), __VERSION__);
}

}  // namespace

double seconds_of(const std::function<void()>& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

BenchRow in_turns(const std::string& name, const std::string& peer, int turns, const std::function<double()>& ours,
                  const std::function<double()>& theirs) {
  BenchRow row{name, peer, std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()};
  for (int turn = 0; turn < turns; ++turn) {
    row.ours_s = std::min(row.ours_s, ours());
    row.peer_s = std::min(row.peer_s, theirs());
  }
  fmt::print(stderr, "{}: {:.4f} s, {} {:.4f} s\n", name, row.ours_s, peer, row.peer_s);
  return row;
}

void report(const std::string& name, const std::vector<BenchRow>& rows) {
  nlohmann::ordered_json json;
  const std::string measured = date_and_machine();
  json["measured"] = measured;
  json["rows"] = nlohmann::ordered_json::array();
  fmt::print("| work | peer | ours, s | peer, s | ratio |\n|---|---|---|---|---|\n");
  for (const BenchRow& row : rows) {
    nlohmann::ordered_json entry{
        {"name", row.name}, {"peer", row.peer}, {"ours_s", row.ours_s}, {"peer_s", nullptr}, {"ratio", nullptr}};
    if (row.peer.empty()) {
      fmt::print("| {} | | {:.4f} | | |\n", row.name, row.ours_s);
    } else {
      entry["peer_s"] = row.peer_s;
      entry["ratio"] = row.ours_s / row.peer_s;
      fmt::print("| {} | {} | {:.4f} | {:.4f} | {:.4f} |\n", row.name, row.peer, row.ours_s, row.peer_s,
                 row.ours_s / row.peer_s);
    }
    json["rows"].push_back(entry);
  }
  fmt::print("\nMeasured {}.\n", measured);
  std::filesystem::create_directories("out/bench");
  std::ofstream("out/bench/" + name + ".json") << json.dump(2) << '\n';
}

}  // namespace crumple
