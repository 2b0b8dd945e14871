#include "estimator/diagnosis/noise/internal/agreement.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace shaker::estimator::diagnosis {

using Eigen::VectorXd;

Result<void> check_agreement(const std::vector<RunDatum>& data, HarmonicFit& fit) {
  for (std::size_t a = 0; a < data.size(); ++a) {
    for (std::size_t b = a + 1; b < data.size(); ++b) {
      const auto size = std::min(data[a].driver.size(), data[b].driver.size());
      const VectorXd drive = data[b].driver.head(size) - data[a].driver.head(size);
      if (data[a].condition != data[b].condition ||
          std::fabs(data[a].frequency_hz / data[b].frequency_hz - 1.0) > 2e-3 ||
          drive.norm() > 0.02 * data[a].driver.norm())
        continue;
      const auto shared = std::min(data[a].response.size(), data[b].response.size());
      const Eigen::MatrixXd slope =
          fit.predictions[a].over_excitation(static_cast<int>((size - 1) / 2));
      const VectorXd expected = slope.topRows(shared) * drive.tail(size - 1);
      const VectorXd apart =
          data[b].response.head(shared) - data[a].response.head(shared) - expected;
      const VectorXd error = (data[a].error.head(shared).cwiseAbs2() +
                              data[b].error.head(shared).cwiseAbs2() + 1e-3 * expected.cwiseAbs2())
                                 .cwiseSqrt();
      const double distance = apart.cwiseQuotient(error).squaredNorm();
      const auto n = static_cast<double>(shared);
      if (distance < n + 12.0 * std::sqrt(2.0 * n)) continue;
      return Error{
          ErrorKind::invalid,
          fmt::format(
              "runs {} and {} contradict each other: driven alike at {:.4g} Hz, they answer {:.2g} "
              "standard errors apart; something changed between them (temperature, gas charge, the "
              "sensor's mounting): repeat one of them or leave one out",
              data[a].name, data[b].name, data[a].frequency_hz, std::sqrt(distance / n))};
    }
  }
  return {};
}

}  // namespace shaker::estimator::diagnosis
