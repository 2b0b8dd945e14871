// The lists of states and detectors in daemon/README.md must equal the tables of the code.
#include <fstream>
#include <string>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "daemon/safety/detectors.hpp"
#include "daemon/state_table.hpp"

namespace shaker::daemon {
namespace {

// The text with each line break and indentation replaced by one space.
std::string readme() {
  std::ifstream file(SHAKER_SOURCE_DIR "/daemon/README.md");
  std::string text, word;
  while (file >> word)
    text += word + ' ';
  return text;
}

TEST(Readme, ShowsEveryStateWithItsPromiseAndWhereItLeads) {
  const std::string text = readme();
  for (const auto& from : state_table()) {
    std::string to;
    for (const auto& r : state_table()) {
      if (allowed(from.state, r.state)) to += fmt::format("{}{}", to.empty() ? "" : ", ", r.name);
    }
    const std::string line =
        fmt::format("- **{}**: {}. Leads to: {}.", from.name, from.promise, to);
    EXPECT_NE(text.find(line), std::string::npos) << line;
  }
}

TEST(Readme, ShowsEveryDetector) {
  const std::string text = readme();
  for (const auto& r : detector_table()) {
    const std::string line = fmt::format("- **{}**: {}. Limit: {}.", r.code, r.trips, r.limit);
    EXPECT_NE(text.find(line), std::string::npos) << line;
  }
}

}  // namespace
}  // namespace shaker::daemon
