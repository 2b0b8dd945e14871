#include "estimator/diagnosis/fit/internal/smoothing.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/diagnosis/cycles/harmonics.hpp"
#include "estimator/diagnosis/fit/internal/smoothing_limit.hpp"

namespace shaker::estimator::diagnosis {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kLevels = 2, kLevelsOfRecord = 3, kRounds = 4;
constexpr double kFarFromNoise = 4.0, kHopeless = 100.0;  // of chi-squared a datum
constexpr double kLittle = 0.5;                 // of chi-squared: what leaves more changes little
constexpr double kTrifle = 0.1;                 // standard errors, of all harmonics together
constexpr double kOpenAtFirst = 2.0;            // the same, of a first limit
constexpr double kOpenStill = 2.0 * kLeftOpen;  // of one that was taken with other errors
constexpr double kReach = 2.0;            // the same, that a fit at a limit may go on by its slopes
constexpr int kMaxRefitSteps = 25;        // of a fit that begins at the last grid's
constexpr double kOnTheWay = 0.5;         // of chi-squared: tolerance of the coarser grids
constexpr double kNeeded = 0.5;           // of what is needed: the parameters follow
constexpr double kZeroWidthBudget = 2.0;  // of one fit's: three to records, and limits

// True if the next finer grid (on a record: the narrowest of its widths) changes the prediction by a
// share of the residual that could matter.
bool worth_zero_width(const HarmonicFit& first, const std::vector<RunDatum>& data, int points,
                      double touched) {
  points *= on_samples(data) ? 1 << (kLevelsOfRecord - 1) : 2;
  // If half the width changes the prediction by d, no width changes it by 2 d: is that enough to come
  // down to noise? On a record whose motion dies away, each halving may change as much as the one
  // before. The change of two halvings is therefore taken as d.
  const double noise = std::sqrt(first.observations / std::max(first.chi_squared, 1e-300));
  touched = std::max(touched, kNeeded * std::pow(0.5 * std::max(1.0 - noise, 0.0), 2));
  std::vector<std::shared_ptr<const Model>> models;
  std::vector<std::unique_ptr<Prediction>> finer(data.size());
  for (std::size_t r = 0; r < data.size(); ++r) {
    if (data[r].role != Role::fit) continue;
    if (const std::size_t known = first_of_response(data, r); known < r) {
      finer[r] = std::make_unique<Prediction>(*finer[known], data[r]);
      continue;
    }
    models.push_back(rounded_model(first.spec, data[r], points));
    finer[r] = std::make_unique<Prediction>(*models.back(), data[r], points);
    finer[r]->start_from(first.predictions[r]);
  }
  double change = 0.0;
  for (std::size_t r = 0; r < data.size(); ++r) {
    if (!finer[r]) continue;
    if (!finer[r]->at(first.theta, HowFar::near)) return true;
    change += whitened(data[r], finer[r]->value() - first.predictions[r].value()).squaredNorm();
  }
  return change > touched * first.chi_squared;
}

// Corners half as wide do not bring chi-squared below `hopeless`, nor would those of no width; or
// far from noise they change little.
bool leaves_more(const HarmonicFit& wide, const HarmonicFit& half, double hopeless) {
  if (wide.chi_squared > kFarFromNoise * wide.observations)
    hopeless = std::min(hopeless, kLittle * wide.chi_squared);
  return std::min(half.chi_squared, 2.0 * half.chi_squared - wide.chi_squared) > hopeless;
}

MatrixXd value_and_slope(const Prediction& prediction) {
  MatrixXd both(prediction.value().size(), 1 + prediction.jacobian().cols());
  both << prediction.value(), prediction.jacobian();
  return both;
}

// A record has no finer grid than its samples: three widths, which go with 1, 2, 4.
std::optional<SmoothingLimit> limit_on_samples(
    const std::vector<std::shared_ptr<HarmonicFit>>& fits, const HarmonicFit& at, std::size_t run) {
  std::vector<MatrixXd> y;
  for (std::size_t k = fits.size(); k-- > 0;) {
    if (!fits[k]->predictions[run].at(at.theta)) return std::nullopt;
    y.push_back(value_and_slope(fits[k]->predictions[run]));
  }
  const MatrixXd even = (4.0 * y[0] - y[1]) / 3.0;
  const bool two = y.size() < 3;
  const MatrixXd limit = two ? even : MatrixXd((8.0 * y[0] - 6.0 * y[1] + y[2]) / 3.0);
  const VectorXd open =
      two ? VectorXd(y[0].col(0) - y[1].col(0)) : VectorXd(limit.col(0) - even.col(0));
  return SmoothingLimit{limit.col(0), limit.rightCols(limit.cols() - 1), open};
}

// What the grid of `near` lacks to a limit at theta; `near` may hold what it lacked to another one.
std::shared_ptr<const ToLimit> lacking(const SmoothingLimit& limit, const Prediction& near,
                                       const ToLimit* held, const std::vector<double>& theta) {
  auto lack = std::make_shared<ToLimit>();
  lack->theta = theta;
  lack->open = limit.open;
  lack->value = limit.value - near.value();
  lack->slope = limit.slope - near.jacobian();
  if (held == nullptr) return lack;
  lack->value += held->value;
  lack->slope += held->slope;
  for (std::size_t k = 0; k < theta.size(); ++k)
    lack->value += (theta[k] - held->theta[k]) * held->slope.col(static_cast<Index>(k));
  return lack;
}

void set_limit(RunDatum& datum, std::shared_ptr<const ToLimit> limit) {
  set_covariance(datum, covariance_of(datum) + limit->open * limit->open.transpose());
  datum.to_limit = std::move(limit);
}

using Limits = std::vector<SmoothingLimit>;  // of all runs; empty where none was asked for

// The data of one response, where data[r] is the first of them; none where it is not.
std::vector<std::size_t> channels_of(const std::vector<RunDatum>& data, std::size_t r) {
  std::vector<std::size_t> channels;
  for (std::size_t k = r; k < data.size(); ++k) {
    if (first_of_response(data, k) == r) channels.push_back(k);
  }
  return channels;
}

// At the parameters of `at`, a fit that has not been taken to a limit. Nothing where a grid has no
// solution. `fitted_only`: none of runs that are held out.
std::optional<Limits> zero_width_limits(const std::vector<std::shared_ptr<HarmonicFit>>& fits,
                                        const HarmonicFit& at, const std::vector<RunDatum>& data,
                                        int points, AnalysisMatrices& matrices, double left_open,
                                        bool fitted_only) {
  Limits all(data.size());
  for (std::size_t r = 0; r < data.size(); ++r) {
    if (fitted_only && data[r].role != Role::fit) continue;
    if (data[r].sampled) {
      auto limit = limit_on_samples(fits, at, r);
      if (!limit) return std::nullopt;
      all[r] = std::move(*limit);
      continue;
    }
    const std::vector<std::size_t> channels = channels_of(data, r);
    if (channels.empty()) continue;
    std::vector<const RunDatum*> seen;
    for (const std::size_t k : channels)
      seen.push_back(&data[k]);
    auto limits =
        smoothing_limits(at.spec, seen, at.theta, at.predictions[r], points, matrices, left_open);
    if (!limits) return std::nullopt;
    for (std::size_t k = 0; k < channels.size(); ++k)
      all[channels[k]] = std::move((*limits)[k]);
  }
  return all;
}

// The data with what the grid of `at.fit` lacks to corners of no width; what stays open is in the
// covariance.
std::shared_ptr<const std::vector<RunDatum>> with_lack(const ZeroWidthFit& at, const Limits& limits,
                                                       const std::vector<RunDatum>& data) {
  auto sharp = std::make_shared<std::vector<RunDatum>>(data);
  for (std::size_t r = 0; r < data.size(); ++r) {
    if (limits[r].value.size() > 0)
      set_limit((*sharp)[r], lacking(limits[r], at.fit->predictions[r],
                                     (*at.data)[r].to_limit.get(), at.fit->theta));
  }
  return sharp;
}

std::shared_ptr<HarmonicFit> refitted(const HarmonicFit& near, const std::vector<RunDatum>& data,
                                      const FitOptions& options) {
  return std::make_shared<HarmonicFit>(fit_harmonics(near.spec, data, near.theta, &near, options));
}

FitOptions level_of(FitOptions options, int points, int steps, double tolerance) {
  options.sharp = true;
  options.max_iterations = steps;
  options.points = points;
  options.tolerance = tolerance;
  return options;
}

// Of the runs that are fitted, how far a fit's prediction and the limits are apart, in standard
// errors.
double apart(const HarmonicFit& fit, const Limits& limits, const std::vector<RunDatum>& data) {
  double sum = 0.0;
  for (std::size_t r = 0; r < data.size(); ++r) {
    if (data[r].role != Role::fit) continue;
    sum += whitened(data[r], fit.predictions[r].value() - limits[r].value).squaredNorm();
  }
  return std::sqrt(sum);
}

// At corners of no width, by the slopes that the limit has. It bends with the parameters, so that
// it is taken again where they have gone; what slopes are off then goes with the square of the
// step, until that is a trifle.
std::optional<ZeroWidthFit> at_limit(const std::vector<std::shared_ptr<HarmonicFit>>& fits,
                                     const std::vector<RunDatum>& data, const FitOptions& options) {
  const bool record = on_samples(data);
  const int points = fits.back()->predictions.front().points();
  ZeroWidthFit sharp{fits.back(), std::make_shared<const std::vector<RunDatum>>(data)};
  AnalysisMatrices matrices;
  double last_step = 0.0;
  for (int round = 1;; ++round) {
    // The first limit is of parameters that it moves: it need not be as exact, and tells nothing of
    // runs that are held out.
    const bool first = round == 1 && !record;
    const double left_open = first ? kOpenAtFirst : kLeftOpen;
    const auto limits =
        zero_width_limits(fits, *sharp.fit, data, options.points, matrices, left_open, first);
    if (!limits) return std::nullopt;
    const double off = apart(*sharp.fit, *limits, data);
    sharp.data = with_lack(sharp, *limits, data);
    sharp.fit = refitted(*sharp.fit, *sharp.data,
                         level_of(options, points, kMaxRefitSteps, options.tolerance));
    if (!sharp.fit->predicts_all) return std::nullopt;
    const double step = apart(*sharp.fit, *limits, data);
    const bool settled = round > 1 && off * step * step < kTrifle * last_step * last_step;
    if (record || settled || (!first && step < kTrifle) || round == kRounds) return sharp;
    last_step = step;
  }
}

}  // namespace

std::optional<ZeroWidthFit> carried(const HarmonicFit& fit, const std::vector<RunDatum>& limits,
                                    const std::vector<RunDatum>& data, const FitOptions& options) {
  if (limits.size() != data.size()) return std::nullopt;
  auto sharp = std::make_shared<std::vector<RunDatum>>(data);
  for (std::size_t r = 0; r < data.size(); ++r) {
    const auto& limit = limits[r].to_limit;
    if (!limit || limit->value.size() != data[r].response.size()) return std::nullopt;
    if (whitened(data[r], limit->open).norm() > kOpenStill) return std::nullopt;
    set_limit((*sharp)[r], limit);
  }
  const int points = fit.predictions.front().points();
  auto again = refitted(fit, *sharp, level_of(options, points, kMaxRefitSteps, options.tolerance));
  if (!again->converged || !again->predicts_all) return std::nullopt;
  const auto size = static_cast<Index>(fit.theta.size());
  const VectorXd by =
      VectorXd::Map(again->theta.data(), size) - VectorXd::Map(fit.theta.data(), size);
  double moved = 0.0;
  for (std::size_t r = 0; r < data.size(); ++r) {
    if (data[r].role != Role::fit) continue;
    moved += whitened(data[r], again->predictions[r].jacobian() * by).squaredNorm();
  }
  if (moved > kReach * kReach) return std::nullopt;
  return ZeroWidthFit{std::move(again), std::move(sharp)};
}

std::optional<ZeroWidthFit> to_zero_width(const HarmonicFit& first,
                                          const std::vector<RunDatum>& data,
                                          const FitOptions& stated, const ZeroWidthOptions& worth) {
  if (!std::isfinite(first.chi_squared)) return std::nullopt;  // it has no solution
  FitOptions options = stated;
  const Task task(data.front().budget, kZeroWidthBudget * options.fit_budget);
  // Far from noise the long way to a solution on fine grids is not worth its time.
  options.from_near = first.chi_squared > kHopeless * first.observations;
  if (!worth_zero_width(first, data, options.points, worth.touched)) return std::nullopt;
  const bool record = on_samples(data);
  std::vector<std::shared_ptr<HarmonicFit>> fits;
  int points = options.points;
  for (int k = 0; k < (record ? kLevelsOfRecord : kLevels); ++k, points *= 2) {
    auto finer = refitted(fits.empty() ? first : *fits.back(), data,
                          level_of(options, points, kMaxRefitSteps, kOnTheWay));
    if (!finer->predicts_all) break;
    fits.push_back(std::move(finer));
    if (!record && k > 0 && leaves_more(*fits[0], *fits[1], worth.hopeless)) return std::nullopt;
  }
  if (fits.size() < 2) return std::nullopt;
  if (worth.on_grids)
    return ZeroWidthFit{fits.back(), std::make_shared<const std::vector<RunDatum>>(data)};
  return at_limit(fits, data, options);
}

}  // namespace shaker::estimator::diagnosis
