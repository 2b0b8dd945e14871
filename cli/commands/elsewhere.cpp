// The commands of shakerctl that need most of the estimator are in a program of their own,
// shakerctl-analysis, so that the operator's program is small and quickly built. shakerctl hands
// such a command over to it, with the whole command line as it was given.
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <unistd.h>

#include "cli/commands.hpp"

namespace shaker::cli {
namespace {

constexpr const char* kProgram = "shakerctl-analysis";

std::vector<std::string> own_arguments() {
  std::ifstream in("/proc/self/cmdline", std::ios::binary);
  const std::string all{std::istreambuf_iterator<char>(in), {}};
  std::vector<std::string> arguments;
  for (std::size_t at = 0; at < all.size(); at += arguments.back().size() + 1)
    arguments.emplace_back(all.c_str() + at);
  return arguments;
}

// Replaces this process. Returns only where that has failed.
int hand_over(const Common& common) {
  std::error_code trouble;
  const auto own = std::filesystem::read_symlink("/proc/self/exe", trouble);
  std::vector<std::string> arguments = own_arguments();
  std::vector<char*> words;
  for (std::string& argument : arguments)
    words.push_back(argument.data());
  words.push_back(nullptr);
  int reason = ENOENT;
  for (const auto& file : {own.parent_path() / kProgram,
                           own.parent_path().parent_path() / "libexec" / "shakerd" / kProgram}) {
    ::execv(file.c_str(), words.data());
    if (errno != ENOENT) reason = errno;
  }
  return fail(common, kNegative,
              fmt::format("this command is in {}, which cannot be started from {} ({}); in a "
                          "clone, build it with `ninja -C build`, else install the package again",
                          kProgram, own.parent_path().string(), std::strerror(reason)));
}

}  // namespace

int estimate(const Common& common, const EstimateOptions&) {
  return hand_over(common);
}
int estimate_channels(const Common& common, const EstimateOptions&) {
  return hand_over(common);
}
int estimate_transient(const Common& common, const EstimateOptions&) {
  return hand_over(common);
}
int compare(const Common& common, const CompareOptions&) {
  return hand_over(common);
}
int drop(const Common& common, const DropOptions&) {
  return hand_over(common);
}
int response(const Common& common, const ResponseOptions&) {
  return hand_over(common);
}
int reproduce(const Common& common, const ReproduceOptions&) {
  return hand_over(common);
}
int plan(const Common& common, const PlanCommand&) {
  return hand_over(common);
}
int monte_carlo(const Common& common, const MonteCarloCommand&) {
  return hand_over(common);
}

}  // namespace shaker::cli
