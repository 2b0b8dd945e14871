#include "estimator/diagnosis/noise/internal/weighing.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/diagnosis/cycles/harmonics.hpp"
#include "estimator/diagnosis/cycles/internal/quantisation_step.hpp"
#include "estimator/diagnosis/noise/internal/remaining_transient.hpp"

namespace shaker::estimator::diagnosis {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kAboveNoise = 16.0;  // squared ratio of a harmonic's amplitude to its error
constexpr double kClock =
    1e-4;  // standard deviation of a quartz clock's rate, unless it is disciplined
constexpr int kWeighingRounds = 4;
constexpr int kFewest = 5, kBeyond = 2;

// The last harmonic that rises above its noise, and two more for what an effect may add.
int harmonics_above_noise(const VectorXd& mean, const VectorXd& variance) {
  const auto most = static_cast<int>((mean.size() - 1) / 2);
  int last = 0;
  for (int h = 1; h <= most; ++h) {
    const double power = mean[2 * h - 1] * mean[2 * h - 1] + mean[2 * h] * mean[2 * h];
    if (power > kAboveNoise * (variance[2 * h - 1] + variance[2 * h])) last = h;
  }
  return std::min(most, std::max(kFewest, last + kBeyond));
}

RunDatum datum_of(const SteadyRun& run, const VectorXd& mean, const RunNoise& noise) {
  RunDatum datum;
  datum.name = run.name;
  datum.kind = run.kind;
  datum.role = run.role;
  datum.condition = run.condition;
  datum.frequency_hz = run.frequency_hz;
  datum.driver = run.mean_driver();
  datum.response = mean;
  const auto size = harmonic_size(harmonics_above_noise(datum.response, noise.variance));
  datum.response.conservativeResize(size);
  datum.error = noise.variance.head(size).cwiseSqrt();
  datum.freedom = noise.freedom.head(size);
  const MatrixXd sampled = run.sampling.covariance_of_mean(size);
  if (sampled.trace() > 0.0) {
    const MatrixXd scattered = datum.error.cwiseAbs2().asDiagonal();
    set_covariance(datum, scattered + sampled);
  }
  return datum;
}

// How the response follows the driver, cycle by cycle.
struct Following {
  MatrixXd slope;      // of as many response harmonics as were predicted, over the driver's
  MatrixXd wander;     // of those harmonics of the driver, a row a cycle
  MatrixXd explained;  // of the response
  bool any() const { return slope.size() > 0; }
};

Following follow(const SteadyRun& run, Prediction& prediction) {
  Following f;
  if (!run.driver_measured || run.kind == Kind::transient) return f;
  // The mean of an excitation is an accelerometer's offset; that of a motion is where it works.
  f.slope = run.kind == Kind::imposed_motion ? prediction.over_motion()
                                             : prediction.over_excitation(run.driver_harmonics);
  const MatrixXd centred = run.driver.rowwise() - run.driver.colwise().mean();
  f.wander = centred.rightCols(f.slope.cols());
  f.explained = MatrixXd::Zero(run.response.rows(), run.response.cols());
  const auto shared = std::min(f.explained.cols(), f.slope.rows());
  f.explained.leftCols(shared) = f.wander * f.slope.topRows(shared).transpose();
  return f;
}

// With all harmonics of the run and not only those that the fit was shown: the next ones may rise
// above noise once its transient is gone.
Following follow_all(const SteadyRun& run, std::size_t r, HarmonicFit& fit) {
  RunDatum whole;
  whole.kind = run.kind;
  whole.frequency_hz = run.frequency_hz;
  whole.driver = run.mean_driver();
  whole.response = run.mean();
  Prediction prediction(*fit.run_models[r], whole, fit.predictions[r].points());
  prediction.start_from(fit.predictions[r]);
  return follow(run, prediction.at(fit.theta) ? prediction : fit.predictions[r]);
}

// Share of the driver's scatter that the response does not follow: noise of the channel that
// measures it. What is followed is real.
double unfollowed_share(const std::vector<SteadyRun>& runs, const std::vector<Following>& all) {
  double met = 0.0, sum = 0.0;
  for (std::size_t r = 0; r < runs.size(); ++r) {
    if (!all[r].any()) continue;
    const MatrixXd centred = runs[r].response.rowwise() - runs[r].response.colwise().mean();
    const MatrixXd innovation = centred - all[r].explained;
    const VectorXd power = innovation.cwiseAbs2().colwise().sum().transpose() +
                           VectorXd::Constant(innovation.cols(), 1e-60);
    for (Eigen::Index c = 0; c < innovation.cols(); ++c) {
      met -= innovation.col(c).dot(all[r].explained.col(c)) / power[c];
      sum += all[r].explained.col(c).squaredNorm() / power[c];
    }
  }
  return sum > 0.0 ? std::clamp(met / sum, 0.0, 1.0) : 0.0;
}

// Takes what is left of each run's transient out of its cycles; returns what this adds to the
// covariance of their means.
std::vector<MatrixXd> take_transients(std::vector<Scatter>& scatter, const HarmonicFit& fit) {
  const std::vector<Scatter> raw = scatter;
  std::vector<MatrixXd> added(raw.size());
  std::vector<DecayingModes> modes;
  for (std::size_t r = 0; r < raw.size(); ++r) {
    const auto harmonics = static_cast<int>((raw[r].cycles.cols() - 1) / 2);
    modes.push_back(decaying_modes(fit.predictions[r], fit.theta, harmonics,
                                   static_cast<int>(raw[r].cycles.rows())));
  }
  // Again: the transient is part of the scatter by which it is weighed first.
  for (int round = 0; round < kWeighingRounds; ++round) {
    const CampaignNoise noise = campaign_noise(scatter);
    for (std::size_t r = 0; r < raw.size(); ++r) {
      const auto count = static_cast<double>(raw[r].cycles.rows());
      WithoutTransient steady =
          without_transient(raw[r].cycles, modes[r], noise.runs[r].variance * count);
      scatter[r].cycles = std::move(steady.cycles);
      scatter[r].spent = std::move(steady.spent);
      added[r] = std::move(steady.added);
    }
  }
  return added;
}

// Change of the response when the time base is off by kClock.
VectorXd influence_of_clock(const HarmonicFit& fit, const RunDatum& datum, std::size_t run) {
  constexpr double kStep = 1e-3;
  RunDatum late = datum;
  late.frequency_hz *= 1.0 + kStep;
  const Model& model = *fit.run_models[run];
  Prediction prediction(model, late, fit.predictions[run].points());
  prediction.start_from(fit.predictions[run]);
  if (!prediction.at(fit.theta)) return {};
  Prediction same(model, datum, fit.predictions[run].points());
  same.start_from(fit.predictions[run]);
  if (!same.at(fit.theta)) return {};
  return (prediction.value() - same.value()) * (kClock / kStep);
}

// A sample's noise before it is rounded: white noise of the samples scatters harmonics by 2 / N of
// its variance, and rounding is part of it. Of the upper half of the harmonics, so that what
// wanders slowly does not count.
double noise_of_samples(const SteadyRun& run) {
  const Eigen::Index upper = run.response.cols() / 2;
  const MatrixXd centred = run.response.rowwise() - run.response.colwise().mean();
  const double variance = centred.rightCols(upper).squaredNorm() /
                          static_cast<double>(upper * (run.response.rows() - 1));
  return std::sqrt(std::max(0.0, 0.5 * run.samples_a_cycle * variance -
                                     run.quantisation_step * run.quantisation_step / 12.0));
}

// What the scatter of the cycles does not show, as it is the same in all of them: adds it to the
// noise of the means, and returns how coarse the sensor is against it.
double add_what_repeats(const std::vector<SteadyRun>& runs, CampaignNoise& noise) {
  double rounding = 0.0, scatter = 0.0;
  for (std::size_t r = 0; r < runs.size(); ++r) {
    VectorXd& variance = noise.runs[r].variance;
    scatter += variance.sum();
    const VectorXd rounded =
        rounding_variance(runs[r].mean(), runs[r].quantisation_step, noise_of_samples(runs[r]),
                          {runs[r].samples_a_cycle, runs[r].cycles()});
    rounding += rounded.sum();
    variance += rounded;
    variance[0] += runs[r].zero_error * runs[r].zero_error;
  }
  return std::sqrt(rounding / scatter);
}

}  // namespace

Weighed weigh(const std::vector<SteadyRun>& runs) {
  std::vector<Scatter> scatter;
  for (const SteadyRun& run : runs)
    scatter.push_back({run.frequency_hz, run.response});
  CampaignNoise noise = campaign_noise(scatter);
  Weighed weighed;
  weighed.coarseness = add_what_repeats(runs, noise);
  weighed.variance_inflation = noise.variance_inflation;
  for (std::size_t r = 0; r < runs.size(); ++r)
    weighed.data.push_back(datum_of(runs[r], runs[r].mean(), noise.runs[r]));
  return weighed;
}

Weighed weigh(const std::vector<SteadyRun>& runs, HarmonicFit& fit) {
  std::vector<Following> following;
  for (std::size_t r = 0; r < runs.size(); ++r)
    following.push_back(follow_all(runs[r], r, fit));
  const double unfollowed = unfollowed_share(runs, following);
  std::vector<Scatter> scatter, of_driver;
  for (std::size_t r = 0; r < runs.size(); ++r) {
    MatrixXd own = runs[r].response;
    if (following[r].any()) own -= (1.0 - unfollowed) * following[r].explained;
    scatter.push_back({runs[r].frequency_hz, std::move(own)});
    of_driver.push_back({runs[r].frequency_hz, runs[r].driver});
  }
  const std::vector<MatrixXd> added = take_transients(scatter, fit);
  CampaignNoise noise = campaign_noise(scatter);
  const CampaignNoise driver = campaign_noise(of_driver);
  Weighed weighed;
  weighed.coarseness = add_what_repeats(runs, noise);
  weighed.variance_inflation = noise.variance_inflation;
  for (std::size_t r = 0; r < runs.size(); ++r) {
    RunDatum datum = datum_of(runs[r], scatter[r].cycles.colwise().mean(), noise.runs[r]);
    const auto shared = std::min(datum.response.size(), following[r].slope.rows());
    MatrixXd covariance = covariance_of(datum);
    covariance += added[r].topLeftCorner(datum.response.size(), datum.response.size());
    if (following[r].any() && unfollowed > 0.0) {
      const auto size = following[r].slope.cols();
      const VectorXd variance = unfollowed * driver.runs[r].variance.tail(size);
      const MatrixXd slope = following[r].slope.topRows(shared);
      covariance.topLeftCorner(shared, shared) += slope * variance.asDiagonal() * slope.transpose();
    }
    set_covariance(datum, covariance);
    datum.clock = influence_of_clock(fit, datum, r);
    weighed.data.push_back(std::move(datum));
  }
  return weighed;
}

}  // namespace shaker::estimator::diagnosis
