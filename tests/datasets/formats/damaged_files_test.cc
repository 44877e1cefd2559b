// Every format's reader takes files with a few bytes changed, or refuses them with a sentence; what it takes is finite.
#include <algorithm>
#include <random>

#include "datasets/rig_file.h"
#include "tests/datasets/formats/made_rig.h"

namespace crumple {
namespace {

std::vector<std::filesystem::path> files_in(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  return files;
}

std::string with_slips(std::string text, std::mt19937& generator) {
  static const std::string marks = "0123456789.-eE,:[]{}()'\"#!&*? \n\tnaif";
  const auto below = [&](std::size_t count) {
    return std::uniform_int_distribution<std::size_t>(0, count - 1)(generator);
  };
  for (std::size_t slips = 1 + below(3); slips > 0 && !text.empty(); --slips) {
    const std::size_t at = below(text.size());
    switch (below(4)) {
      case 0:
        text.erase(at, 1 + below(8));
        break;
      case 1:
        text.insert(at, 1, marks[below(marks.size())]);
        break;
      case 2:
        text[at] = static_cast<char>(below(256));
        break;
      default:
        text[at] = marks[below(marks.size())];
    }
  }
  return text;
}

TEST(EveryFormat, SurvivesSlips) {
  std::mt19937 generator(20);
  for (const RigFormat& format : rig_formats()) {
    const TemporaryFolder home;
    ASSERT_TRUE(format.write(made_rig("LENSMODEL_OPENCV4", 2), home.path()));
    int taken = 0;
    for (int round = 0; round < 200; ++round) {
      const auto files = files_in(home.path());
      const std::filesystem::path& file = files[static_cast<std::size_t>(round) % files.size()];
      const std::string sound = content_of(file);
      write_content(file, with_slips(sound, generator));
      const auto rig = format.read({home.path()});
      if (rig) {
        const TemporaryFolder again;
        // Two sensors may have come to one name; nothing else of what was read may be unfit for a rig's folder.
        const auto written = write_rig(again.path(), *rig);
        EXPECT_TRUE(written || written.error().message.find("Two sensors") == 0) << written.error().message;
        if (written) {
          const auto read = read_rig(again.path());
          EXPECT_TRUE(read) << format.name << ": " << read.error().message;
        }
        ++taken;
      } else {
        EXPECT_FALSE(rig.error().message.empty());
      }
      write_content(file, sound);
    }
    EXPECT_GT(taken, 0) << format.name;  // a slip in a name or a digit
    EXPECT_LT(taken, 200) << format.name;
  }
}

}  // namespace
}  // namespace crumple
