#include "estimator/diagnosis/noise/internal/run_constants.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <set>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>

#include "estimator/diagnosis/fit/internal/places_of_rest.hpp"
#include "estimator/diagnosis/internal/motion_range.hpp"
#include "estimator/diagnosis/records/internal/transient_run.hpp"
#include "estimator/diagnosis/score/internal/scoring.hpp"
#include "estimator/math/dense.hpp"
#include "estimator/math/statistics.hpp"

namespace shaker::estimator::diagnosis {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr std::size_t kFewestRuns = 3;
constexpr double kBeyondChance = 8.0;    // of the log likelihood
constexpr double kZerosByChance = 0.01;  // that noise alone makes such a scatter of the means
constexpr double kMeanOfMissed = 0.1;    // of a missed motion, by which what is missing moves means
constexpr double kMostDifference = 0.1;  // of what it moves, over the response
constexpr double kLeastDifference = 1e-6;          // the same
constexpr double kSteps[] = {4.0, 2.0, 1.4, 1.2};  // ratios of the grid, one after the other

using ConstantSizes = RunConstantValues;

// One run in a basis where its noise is independent and of unit size.
struct Run {
  std::size_t index = 0;
  MatrixXd columns;    // what is left, the free parameters, the components
  MatrixXd influence;  // harmonics x kRunConstants, as measured
  VectorXd bend;       // that the response has more at the constants
};

// Of the fitted data. Stretches of one recording share its constants, and do not show how these differ.
std::size_t recordings_in(const std::vector<RunDatum>& data) {
  std::set<std::string> names;
  for (const RunDatum& datum : data)
    if (datum.role == Role::fit) names.insert(datum.sampled ? datum.sampled->record : datum.name);
  return names.size();
}

// Of a symmetric positive definite matrix with a diagonal of any scale.
double log_determinant(const MatrixXd& a) {
  const VectorXd scale = a.diagonal().cwiseMax(1e-300).cwiseSqrt();
  MatrixXd unit = scale.cwiseInverse().asDiagonal() * a * scale.cwiseInverse().asDiagonal();
  unit.diagonal().array() += 1e-12;
  return 2.0 * (Cholesky(unit).root().diagonal().array().log().sum() + scale.array().log().sum());
}

class Likelihood {
 public:
  Likelihood(std::vector<Run> runs, Index parameters)
      : runs_(std::move(runs)), parameters_(parameters) {
    for (const Run& run : runs_)
      products_.push_back(run.columns.transpose() * run.columns);
  }

  // Restricted: the parameters have a flat prior, near the fit.
  double at(const ConstantSizes& sizes) const {
    const Index inner = 1 + parameters_;
    MatrixXd all = MatrixXd::Zero(inner, inner);
    double determinant = 0.0;
    for (const MatrixXd& products : products_) {
      // Woodbury's identity.
      const MatrixXd across = sizes.asDiagonal() * products.bottomLeftCorner(kRunConstants, inner);
      const MatrixXd own = MatrixXd::Identity(kRunConstants, kRunConstants) +
                           sizes.asDiagonal() *
                               products.bottomRightCorner(kRunConstants, kRunConstants) *
                               sizes.asDiagonal();
      const MatrixXd white = Cholesky(own).whiten(across);
      all += products.topLeftCorner(inner, inner) - white.transpose() * white;
      determinant += log_determinant(own);
    }
    const MatrixXd information = all.bottomRightCorner(parameters_, parameters_);
    const VectorXd gradient = all.col(0).tail(parameters_);
    const double left =
        all(0, 0) - gradient.dot(shortest_least_squares(information, gradient).col(0));
    return -0.5 * (determinant + log_determinant(information) + left);
  }

 private:
  std::vector<Run> runs_;
  std::vector<MatrixXd> products_;
  Index parameters_;
};

// The response to a constant force, of all fitted runs one after the other; no columns where such a
// force cannot be added to the model.
MatrixXd to_constant_force(const HarmonicFit& fit, const std::vector<RunDatum>& data,
                           const FitOptions& options) {
  Probe probe;
  probe.line.effect = "constant_force";
  probe.line.formula = "k0";
  probe.line.parameters["k0"].start = 0.0;
  probe.coefficients = {"k0"};
  try {
    return signatures_of(fit, data, probe, options).columns;
  } catch (const std::invalid_argument&) {
    return {};  // a motion cannot be imposed on this model
  }
}

std::vector<Run> runs_of(const HarmonicFit& fit, const std::vector<RunDatum>& fitted,
                         const FitOptions& options) {
  std::vector<RunDatum> alone = fitted;  // without the error of the time base, which all runs share
  for (RunDatum& datum : alone) {
    datum.clock.resize(0);
    datum.to_limit.reset();                               // it is of the model without the force
    datum.budget = std::make_shared<EvaluationBudget>();  // a fixed amount of work
  }
  const MatrixXd forces = to_constant_force(fit, alone, options);
  const std::array<int, 2> scaled = {parameter_of(*fit.model, "gas_spring", "theta2"),
                                     parameter_of(*fit.model, "viscous_damping", "c")};
  std::vector<Run> runs;
  Index at = 0;
  for (std::size_t r = 0; r < alone.size(); ++r) {
    const RunDatum& datum = alone[r];
    if (datum.role != Role::fit) continue;
    const Index size = datum.response.size();
    Run run;
    run.index = r;
    run.influence = MatrixXd::Zero(size, kRunConstants);
    if (datum.quantity == Quantity::displacement) run.influence(0, 0) = 1.0;
    const bool forced = datum.kind == Kind::imposed_motion || datum.by_force;
    if (forces.cols() > 0 && !forced)  // a constant force is a load cell's zero
      run.influence.col(1) = coloured(datum, forces.col(0).segment(at, size));
    for (std::size_t k = 0; k < scaled.size(); ++k) {
      if (scaled[k] >= 0)
        run.influence.col(2 + static_cast<Index>(k)) =
            fit.theta[static_cast<std::size_t>(scaled[k])] *
            fit.predictions[r].jacobian().col(scaled[k]);
    }
    run.bend = VectorXd::Zero(size);
    run.columns.resize(size, 1 + static_cast<Index>(fit.free.size()) + kRunConstants);
    run.columns << whitened_residual(fit, alone, r), whitened_jacobian(fit, alone, r, fit.free),
        whitened(datum, run.influence);
    at += size;
    runs.push_back(std::move(run));
  }
  return runs;
}

// About the likeliest constants of each run, by a fit to data that hold them already.
void take_about(const WithRunConstants& before, const HarmonicFit& fit,
                const std::vector<RunDatum>& fitted, std::vector<Run>& runs) {
  for (Run& run : runs) {
    const RunDatum& datum = fitted[run.index];
    if (datum.kind != Kind::periodic) continue;
    const RunDatum& with = before.data[run.index];
    const MatrixXd& influence = before.influence[run.index];
    const VectorXd left = with.response - fit.predictions[run.index].value();
    const RunConstantValues likeliest = before.sizes.cwiseAbs2().asDiagonal() *
                                        (influence.transpose() * over_covariance(with, left));
    auto moved = moved_run(fit, datum, run.index, likeliest);
    if (!moved) continue;
    run.influence = std::move(moved->influence);
    run.bend = std::move(moved->bend);
    run.columns.col(0) = whitened_residual(fit, fitted, run.index) - whitened(datum, run.bend);
    run.columns.rightCols(kRunConstants) = whitened(datum, run.influence);
  }
}

// Each in turn, on a grid of ratios that gets finer.
ConstantSizes likeliest(const Likelihood& likelihood, const ConstantSizes& largest) {
  ConstantSizes best = ConstantSizes::Zero();
  double most = likelihood.at(best);
  for (const double step : kSteps) {
    for (Index k = 0; k < best.size(); ++k) {
      const ConstantSizes middle = best;
      for (double size = largest[k]; size > kLeastDifference * largest[k]; size /= step) {
        ConstantSizes now = middle;
        now[k] = size;
        const double probable = likelihood.at(now);
        if (!(probable > most)) continue;
        most = probable;
        best = now;
      }
      ConstantSizes without = best;
      without[k] = 0.0;
      if (const double probable = likelihood.at(without); probable > most) {
        most = probable;
        best = without;
      }
    }
  }
  return best;
}

// Without those that a campaign does not need: each is one more number to fit.
ConstantSizes needed(const Likelihood& likelihood, ConstantSizes sizes, int observations) {
  const double cost = 0.5 * std::log(static_cast<double>(observations));
  for (bool dropped = true; dropped;) {
    dropped = false;
    double most = likelihood.at(sizes) - cost;
    const ConstantSizes all = sizes;
    for (Index k = 0; k < all.size(); ++k) {
      ConstantSizes without = all;
      without[k] = 0.0;
      if (all[k] == 0.0 || !(likelihood.at(without) > most)) continue;
      most = likelihood.at(without);
      sizes = without;
      dropped = true;
    }
  }
  return sizes;
}

// What a fit leaves of the means of the fitted runs.
struct Means {
  std::vector<double> left;
  double expected = 0.0;  // variance of all together: noise, and what the model lacks
  bool of_force = false;
};
// None where the runs are neither records nor imposed motions.
std::optional<Means> means_of(const HarmonicFit& fit, const std::vector<RunDatum>& data) {
  Means means;
  for (std::size_t r = 0; r < data.size(); ++r) {
    const RunDatum& datum = data[r];
    const bool imposed = datum.kind == Kind::imposed_motion;
    if (datum.sampled ? datum.whitening != nullptr : !imposed) return std::nullopt;
    means.of_force = means.of_force || datum.by_force || imposed;
    if (datum.role != Role::fit) continue;
    VectorXd missed = datum.response - fit.predictions[r].value();
    means.left.push_back(missed[0]);
    missed[0] = 0.0;
    means.expected +=
        std::pow(datum.error[0], 2) + std::pow(kMeanOfMissed * root_mean_square(missed), 2);
  }
  return means;
}

void let_mean_vary(RunDatum& datum, double variance, double freedom) {
  datum.own_zero = std::sqrt(variance);
  if (datum.whitening) {
    MatrixXd covariance = covariance_of(datum);
    covariance(0, 0) += variance;
    set_covariance(datum, covariance);
  } else {
    datum.error[0] = std::hypot(datum.error[0], datum.own_zero);
  }
  datum.freedom[0] = std::min(datum.freedom[0], freedom);
}

}  // namespace

std::string RunConstants::words(const std::string& response_unit,
                                const std::string& force_unit) const {
  std::vector<std::string> said;
  if (zero > 0.0) said.push_back(fmt::format("the zero, by {:.2g} {}", zero, response_unit));
  if (force > 0.0)
    said.push_back(fmt::format("a constant force (preload), by {:.2g} {}", force, force_unit));
  if (gas_pressure > 0.0)
    said.push_back(fmt::format("the gas pressure, by {:.2g} %", 100.0 * gas_pressure));
  if (damping > 0.0)
    said.push_back(fmt::format("the viscous damping, by {:.2g} %", 100.0 * damping));
  return fmt::format("the runs differ (standard deviations): in {}", fmt::join(said, ", and in "));
}

std::optional<WithRunConstants> with_run_constants(const HarmonicFit& fit,
                                                   const std::vector<RunDatum>& fitted,
                                                   const std::vector<RunDatum>& data,
                                                   const FitOptions& options,
                                                   const WithRunConstants* before) {
  if (recordings_in(fitted) < kFewestRuns || fit.free.empty()) return std::nullopt;
  std::vector<Run> runs = runs_of(fit, fitted, options);
  if (before != nullptr) take_about(*before, fit, fitted, runs);
  double response = 0.0;
  ConstantSizes influence = ConstantSizes::Zero();
  for (const Run& run : runs) {
    if (!run.columns.allFinite()) return std::nullopt;
    response = std::max(response, root_mean_square(data[run.index].response));
    influence = influence.cwiseMax(run.influence.colwise().norm().transpose());
  }
  ConstantSizes largest = ConstantSizes::Zero();
  for (Index k = 0; k < largest.size(); ++k)
    if (influence[k] > 0.0) largest[k] = kMostDifference * response / influence[k];
  const Likelihood likelihood(runs, static_cast<Index>(fit.free.size()));
  const ConstantSizes sizes = needed(likelihood, likeliest(likelihood, largest), fit.observations);
  WithRunConstants out;
  out.constants = {sizes[0], sizes[1], sizes[2], sizes[3],
                   likelihood.at(sizes) - likelihood.at(ConstantSizes::Zero())};
  if (out.constants.count() == 0) return std::nullopt;
  out.data = data;
  out.sizes = sizes;
  out.influence.resize(data.size());
  for (Run& run : runs) {
    const MatrixXd moved = run.influence * sizes.asDiagonal();
    RunDatum& datum = out.data[run.index];
    set_covariance(datum, covariance_of(datum) + moved * moved.transpose());
    datum.response -= run.bend;
    out.influence[run.index] = std::move(run.influence);
  }
  return out;
}

bool beyond_chance(const RunConstants& constants) {
  return constants.gain > kBeyondChance;
}

std::vector<RunDatum> without_constants(const HarmonicFit& fit, const std::vector<RunDatum>& with,
                                        const std::vector<RunDatum>& fitted) {
  std::vector<RunDatum> out = fitted;
  for (std::size_t r = 0; r < out.size(); ++r) {
    const VectorXd left = with[r].response - fit.predictions[r].value();
    // The constants' likeliest part is what the noise does not have of it.
    const VectorXd noise = covariance_of(fitted[r]) * over_covariance(with[r], left);
    out[r].response -= left - noise;
  }
  return out;
}

std::string let_zeros_differ(const HarmonicFit& fit, const std::string& unit,
                             std::vector<RunDatum>& data) {
  const auto found = means_of(fit, data);
  // Along a motion to one side friction makes a mean force.
  if (!found || (found->of_force && !goes_both_ways(data))) return {};
  const auto runs = static_cast<double>(found->left.size());
  const bool several = recordings_in(data) > 1;
  const double freedom = std::max(runs - 1.0, 1.0);
  const double mean = std::accumulate(found->left.begin(), found->left.end(), 0.0) / runs;
  double scatter = 0.0;
  for (const double x : found->left)
    scatter += std::pow(x - mean, 2);
  const double expected = found->expected / runs;
  const bool differ = several && chi_squared_above(scatter / expected, freedom) <= kZerosByChance;
  const double of_mean = std::max(expected, scatter / freedom) / runs;
  // A zero of the displacement that several recordings share is the sensor's: sensor_offset.
  const bool common = (found->of_force || !several) && rests_at_zero(*fit.model, fit.theta) &&
                      chi_squared_above(mean * mean / of_mean, 1.0) <= kZerosByChance;
  if (!differ && !common) return {};
  const double variance = (differ ? scatter / freedom : 0.0) + (common ? mean * mean : 0.0);
  std::vector<std::string> each;
  for (RunDatum& datum : data) {
    let_mean_vary(datum, variance, freedom);
    if (datum.role == Role::fit)
      each.push_back(
          fmt::format("{} {:+.2g}", datum.name, found->left[each.size()] - (common ? 0.0 : mean)));
  }
  if (!common)
    return fmt::format(
        "the runs differ in their zero or preload by {:.2g} {} (standard deviation; {}): "
        "the errors include this, and the gap does not count it",
        std::sqrt(variance), unit, fmt::join(each, ", "));
  return (several ? fmt::format("the runs have zeros of their own, or preloads, about {:+.3g} {} "
                                "({})",
                                mean, unit, fmt::join(each, ", "))
                  : fmt::format("the record has a zero of its own, or a preload, of {:+.3g} {}",
                                mean, unit)) +
         (found->of_force ? ", of which what is missing may make a part" : "") +
         ": the errors include this, the gap does not count it, and the improved model does not "
         "hold it";
}

}  // namespace shaker::estimator::diagnosis
