#include "datasets/report/gnuplot.h"

#include <array>
#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <string_view>

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

namespace crumple {
namespace {

// An anonymous file in memory.
class MemoryFile {
 public:
  explicit MemoryFile(const char* name) : descriptor_(memfd_create(name, MFD_CLOEXEC)) {}
  ~MemoryFile() {
    if (descriptor_ >= 0) close(descriptor_);
  }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;

  int descriptor() const { return descriptor_; }
  bool write_all(std::string_view text) const {
    while (!text.empty()) {
      const ssize_t written = write(descriptor_, text.data(), text.size());
      if (written < 0 && errno == EINTR) continue;
      if (written <= 0) return false;
      text.remove_prefix(static_cast<std::size_t>(written));
    }
    return lseek(descriptor_, 0, SEEK_SET) == 0;
  }
  std::string content() const {
    std::string text;
    std::array<char, 1U << 16U> block{};
    off_t offset = 0;
    while (const ssize_t count = pread(descriptor_, block.data(), block.size(), offset)) {
      if (count < 0 && errno == EINTR) continue;
      if (count < 0) break;
      text.append(block.data(), static_cast<std::size_t>(count));
      offset += count;
    }
    return text;
  }

 private:
  int descriptor_;
};

std::string failure_to_run(const std::string& why) {
  return fmt::format("gnuplot cannot be run: {}; install Debian's package gnuplot-nox", why);
}

// What gnuplot writes to stdout when it is given the commands on stdin.
Expected<std::string> run_gnuplot(const std::string& commands) {
  const MemoryFile in("gnuplot-commands"), out("gnuplot-pictures"), err("gnuplot-messages");
  if (in.descriptor() < 0 || out.descriptor() < 0 || err.descriptor() < 0 || !in.write_all(commands)) {
    return fail(failure_to_run(std::strerror(errno)));
  }
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, in.descriptor(), STDIN_FILENO);
  posix_spawn_file_actions_adddup2(&actions, out.descriptor(), STDOUT_FILENO);
  posix_spawn_file_actions_adddup2(&actions, err.descriptor(), STDERR_FILENO);
  // Settings come from nobody's files and variables.
  std::string program = "gnuplot", defaults = "-d";
  std::array<char*, 3> arguments{program.data(), defaults.data(), nullptr};
  std::string path = fmt::format("PATH={}", std::getenv("PATH") ? std::getenv("PATH") : "/usr/bin:/bin");
  std::string locale = "LC_ALL=C.UTF-8";
  std::array<char*, 3> environment{path.data(), locale.data(), nullptr};
  pid_t child = 0;
  const int failure = posix_spawnp(&child, "gnuplot", &actions, nullptr, arguments.data(), environment.data());
  posix_spawn_file_actions_destroy(&actions);
  if (failure != 0) return fail(failure_to_run(std::strerror(failure)));
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (WIFEXITED(status) && WEXITSTATUS(status) == 127) return fail(failure_to_run("it is not installed"));
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0) {
    return fail(fmt::format("gnuplot could not draw the plots: {}", err.content()));
  }
  return out.content();
}

void replace_all(std::string& text, const std::string& old_text, const std::string& new_text) {
  for (std::size_t at = 0; (at = text.find(old_text, at)) != std::string::npos; at += new_text.size()) {
    text.replace(at, old_text.size(), new_text);
  }
}

// Between two marks, these included.
void remove_between(std::string& text, const std::string& from, const std::string& to) {
  const std::size_t begin = text.find(from);
  const std::size_t end = begin == std::string::npos ? begin : text.find(to, begin);
  if (end != std::string::npos) text.erase(begin, end + to.size() - begin);
}

// One document of gnuplot's as an element among others of a page.
std::string as_element(std::string svg, std::size_t number) {
  svg.erase(0, svg.find("<svg"));
  remove_between(svg, "<title>", "</title>");
  remove_between(svg, "<desc>", "</desc>");
  // Symbols that no drawing here uses, unless there are points.
  if (svg.find("<use xlink:href='#gpPt", svg.find("</defs>")) == std::string::npos) {
    remove_between(svg, "<defs>", "</defs>");
  }
  const std::string prefix = fmt::format("plot{}-", number);
  for (const char* const before : {"id=\"", "id='", "href='#", "url(#"}) replace_all(svg, before, before + prefix);
  replace_all(svg, "\t", "");
  return svg;
}

}  // namespace

Expected<std::vector<std::string>> draw_plots(const std::vector<Plot>& plots) {
  std::string commands = "set encoding utf8\n";
  for (const Plot& plot : plots) {
    commands += fmt::format(
        "reset\nset terminal svg noenhanced size {},{} fixed font 'sans-serif,11' background 'white'\nset output\n{}\n",
        plot.width_px, plot.height_px, plot.commands);
  }
  auto output = run_gnuplot(commands + "unset output\n");
  if (!output) return tl::unexpected(output.error());
  constexpr std::string_view kEnd = "</svg>";
  std::vector<std::string> pictures;
  for (std::size_t begin = 0, end = 0; (end = output->find(kEnd, begin)) != std::string::npos; begin = end) {
    end += kEnd.size();
    pictures.push_back(as_element(output->substr(begin, end - begin), pictures.size() + 1));
  }
  if (pictures.size() != plots.size()) {
    return fail(fmt::format("gnuplot drew {} plots instead of {}", pictures.size(), plots.size()));
  }
  return pictures;
}

std::string gnuplot_text(const std::string& text) {
  std::string quoted = "'";
  for (const char c : text) {
    if (static_cast<unsigned char>(c) < ' ') {
      quoted += ' ';
    } else {
      quoted += c == '\'' ? "''" : std::string(1, c);
    }
  }
  return quoted + "'";
}

std::string gnuplot_data(const std::string& name, const std::vector<std::vector<double>>& rows) {
  std::string text = fmt::format("${} << EOD\n", name);
  for (const std::vector<double>& row : rows) {
    for (const double value : row) text += std::isfinite(value) ? fmt::format("{:.6g} ", value) : "NaN ";
    text += "\n";
  }
  return text + "EOD\n";
}

}  // namespace crumple
