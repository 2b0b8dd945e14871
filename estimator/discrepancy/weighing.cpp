#include "estimator/discrepancy/weighing.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/discrepancy/harmonics.hpp"

namespace shaker::estimator::discrepancy {
namespace {

constexpr double kAboveNoise = 16.0;  // squared ratio of a harmonic's amplitude to its error
constexpr int kFewest = 5, kBeyond = 2;

// The last harmonic that rises above its noise, and two more for what an effect may add.
int harmonics_above_noise(const Eigen::VectorXd& mean, const Eigen::VectorXd& variance) {
  const auto most = static_cast<int>((mean.size() - 1) / 2);
  int last = 0;
  for (int h = 1; h <= most; ++h) {
    const double power = mean[2 * h - 1] * mean[2 * h - 1] + mean[2 * h] * mean[2 * h];
    if (power > kAboveNoise * (variance[2 * h - 1] + variance[2 * h])) last = h;
  }
  return std::min(most, std::max(kFewest, last + kBeyond));
}

Weighed weigh_with(const std::vector<SteadyRun>& runs, const std::vector<Scatter>& scatter) {
  const CampaignNoise noise = campaign_noise(scatter);
  Weighed weighed;
  weighed.carry_over = noise.carry_over;
  for (std::size_t r = 0; r < runs.size(); ++r) {
    const SteadyRun& run = runs[r];
    RunDatum datum;
    datum.name = run.name;
    datum.kind = run.kind;
    datum.role = run.role;
    datum.frequency_hz = run.frequency_hz;
    datum.driver = run.mean_driver();
    datum.response = run.mean();
    const auto size = harmonic_size(harmonics_above_noise(datum.response, noise.runs[r].variance));
    datum.response.conservativeResize(size);
    datum.error = noise.runs[r].variance.head(size).cwiseSqrt();
    datum.freedom = noise.runs[r].freedom.head(size);
    weighed.data.push_back(std::move(datum));
  }
  return weighed;
}

}  // namespace

Weighed weigh(const std::vector<SteadyRun>& runs) {
  std::vector<Scatter> scatter;
  for (const SteadyRun& run : runs)
    scatter.push_back({run.frequency_hz, run.response});
  return weigh_with(runs, scatter);
}

Weighed weigh(const std::vector<SteadyRun>& runs, HarmonicFit& fit) {
  std::vector<Scatter> scatter;
  for (std::size_t r = 0; r < runs.size(); ++r) {
    const SteadyRun& run = runs[r];
    Eigen::MatrixXd innovation = run.response;
    if (run.driver_measured && run.kind == Kind::periodic) {
      const Eigen::MatrixXd slope = fit.predictions[r].over_excitation(run.driver_harmonics);
      const Eigen::MatrixXd wander = run.driver.rowwise() - run.driver.colwise().mean();
      const auto shared = std::min(innovation.cols(), slope.rows());
      innovation.leftCols(shared) -=
          wander.rightCols(wander.cols() - 1) * slope.topRows(shared).transpose();
    }
    scatter.push_back({run.frequency_hz, std::move(innovation)});
  }
  return weigh_with(runs, scatter);
}

}  // namespace shaker::estimator::discrepancy
