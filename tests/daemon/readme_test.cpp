// The tables in daemon/README.md are those of the code.
#include <fstream>
#include <iterator>
#include <string>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "daemon/safety/detectors.hpp"
#include "daemon/state_table.hpp"

namespace shaker::daemon {
namespace {

std::string readme() {
  std::ifstream file(SHAKER_SOURCE_DIR "/daemon/README.md");
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

TEST(Readme, ShowsEveryStateWithItsPromiseAndWhereItLeads) {
  const std::string text = readme();
  for (const auto& from : state_table()) {
    std::string to;
    for (const auto& r : state_table()) {
      if (allowed(from.state, r.state)) to += fmt::format("{}{}", to.empty() ? "" : ", ", r.name);
    }
    const std::string line = fmt::format("| {} | {} | {} |", from.name, from.promise, to);
    EXPECT_NE(text.find(line), std::string::npos) << line;
  }
}

TEST(Readme, ShowsEveryDetector) {
  const std::string text = readme();
  for (const auto& r : detector_table()) {
    const std::string line = fmt::format("| {} | {} | {} |", r.code, r.trips, r.limit);
    EXPECT_NE(text.find(line), std::string::npos) << line;
  }
}

}  // namespace
}  // namespace shaker::daemon
