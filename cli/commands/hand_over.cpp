#include "cli/commands/hand_over.hpp"

#include <cerrno>
#include <cstring>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <unistd.h>

#include "base/program_places.hpp"

namespace shaker::cli {
namespace {

std::vector<std::string> own_arguments() {
  std::ifstream in("/proc/self/cmdline", std::ios::binary);
  const std::string all{std::istreambuf_iterator<char>(in), {}};
  std::vector<std::string> arguments;
  for (std::size_t at = 0; at < all.size(); at += arguments.back().size() + 1)
    arguments.emplace_back(all.c_str() + at);
  return arguments;
}

}  // namespace

int hand_over(const Common& common, const char* program) {
  std::vector<std::string> arguments = own_arguments();
  std::vector<char*> words;
  for (std::string& argument : arguments)
    words.push_back(argument.data());
  words.push_back(nullptr);
  int reason = ENOENT;
  const auto places = program_places(program);
  for (const auto& file : places) {
    ::execv(file.c_str(), words.data());
    if (errno != ENOENT) reason = errno;
  }
  return fail(common, kNegative,
              fmt::format("this command is in {}, which cannot be started from {} ({}); in a "
                          "clone, build it with `ninja -C build`, else install the package again",
                          program, places.front().parent_path().string(), std::strerror(reason)));
}

}  // namespace shaker::cli
