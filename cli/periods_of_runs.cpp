#include "cli/periods_of_runs.hpp"

#include <fmt/format.h>

#include "cli/repetition.hpp"

namespace shaker::cli {

int PeriodsOfRuns::of(const std::string& run) const {
  const auto found = named.find(run);
  return found == named.end() ? all : found->second;
}

Result<PeriodsOfRuns> parse_periods(const std::vector<std::string>& words) {
  PeriodsOfRuns out;
  for (const std::string& word : words) {
    const std::size_t equals = word.rfind('=');
    const std::string number = equals == std::string::npos ? word : word.substr(equals + 1);
    const bool digit = number.size() == 1 && number[0] >= '1' && number[0] <= '0' + kMostPeriods;
    if (!digit || equals == 0)
      return Error{ErrorKind::invalid,
                   fmt::format("--periods \"{}\": a response is fitted over 1 to {} periods of the "
                               "excitation; say M for all runs or RUN=M for one of a database",
                               word, kMostPeriods)};
    (equals == std::string::npos ? out.all : out.named[word.substr(0, equals)]) = number[0] - '0';
  }
  return out;
}

}  // namespace shaker::cli
