#include "estimator/diagnosis/cycles/record_checks.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace shaker::estimator::diagnosis {

Error mistake_in(const Recording& run, const std::string& why) {
  return {ErrorKind::invalid, fmt::format("run {}: {}", run.name, why)};
}

Error unfit(const Recording& run, const std::string& why) {
  return {ErrorKind::not_converged, fmt::format("run {}: {}", run.name, why)};
}

Result<void> check_times(const Recording& run) {
  for (std::size_t i = 0; i < run.t.size(); ++i) {
    if (std::isfinite(run.t[i]) && (i == 0 || run.t[i] > run.t[i - 1])) continue;
    return mistake_in(
        run, fmt::format("time does not increase: t = {:.9g} is followed by {:.9g} (sample {}); "
                         "are the channels on one clock?",
                         i > 0 ? run.t[i - 1] : 0.0, run.t[i], i + 1));
  }
  return {};
}

Result<void> check_column(const Recording& run, const std::vector<double>& column,
                          const char* name) {
  if (column.size() != run.t.size())
    return mistake_in(run, fmt::format("{} samples of the {} for {} times: the channels are not on "
                                       "one clock; give them on common times",
                                       column.size(), name, run.t.size()));
  for (std::size_t i = 0; i < column.size(); ++i) {
    if (!std::isfinite(column[i]))
      return mistake_in(
          run, fmt::format("sample {} of the {} is missing or not finite; leave such lines out",
                           i + 1, name));
  }
  return {};
}

std::string clipped_sentence(const char* name, bool top) {
  return fmt::format("the {} stays on its {} value: {}; record the run within the sensor's range",
                     name, top ? "highest" : "lowest", kClipped);
}

double range_of(const std::vector<double>& column) {
  const auto [low, high] = std::minmax_element(column.begin(), column.end());
  return *high - *low;
}

}  // namespace shaker::estimator::diagnosis
