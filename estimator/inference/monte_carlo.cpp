#include "estimator/inference/monte_carlo.hpp"

#include <algorithm>
#include <cmath>
#include <random>

#include <fmt/format.h>

#include "estimator/inference/internal/profile.hpp"
#include "estimator/math/numbers.hpp"
#include "estimator/math/parallel.hpp"

namespace shaker::estimator {
namespace {

constexpr int kAccuratePoints = 1600;

std::vector<int> free_parameters(const Model& model) {
  std::vector<int> free;
  for (int k = 0; k < model.parameter_count(); ++k) {
    if (!model.parameters()[static_cast<std::size_t>(k)].fixed) free.push_back(k);
  }
  return free;
}

// The workspace of one thread.
class MonteCarloWorker {
 public:
  MonteCarloWorker(const Model& model, const MonteCarloOptions& options,
                   const std::vector<RunData>& exact, const std::vector<int>& free,
                   const std::vector<double>& start)
      : model_(model),
        options_(options),
        exact_(exact),
        noisy_(exact),
        free_(free),
        start_(start),
        estimator_(model, exact, options.estimation) {}

  Replication replicate(long index) {
    // The seed depends on the replication, so that the thread has no influence.
    std::seed_seq sequence{static_cast<std::uint32_t>(options_.seed),
                           static_cast<std::uint32_t>(options_.seed >> 32),
                           static_cast<std::uint32_t>(index)};
    std::mt19937_64 random(sequence);
    for (std::size_t r = 0; r < exact_.size(); ++r) {
      add_noise(exact_[r], noisy_[r], random);
      estimator_.update_run(r, noisy_[r]);
    }
    const Fit& fit = estimator_.fit(start_);
    Replication out;
    out.status = fit.status;
    out.noise = fit.noise;
    if (fit.status != FitStatus::converged) return out;
    for (std::size_t k = 0; options_.profile && k < free_.size(); ++k) {
      const double truth = options_.truth[static_cast<std::size_t>(free_[k])];
      out.inside_profile.push_back(profile_contains(estimator_, model_, free_[k], truth));
    }
    Fit published = fit;
    if (options_.bias != Bias::off)
      out.bias = take_off_bias(published, second_order(estimator_, model_), options_.bias);
    for (const int k : free_) {
      const auto at = static_cast<std::size_t>(k);
      // The interval stays that of the optimum, see take_off_bias.
      const double error = fit.theta[at] - options_.truth[at];
      out.on_bound = out.on_bound || fit.at_bound[at] != 0;
      out.theta.push_back(published.theta[at]);
      out.error.push_back(fit.standard_error[at]);
      out.inside.push_back(std::fabs(error) <= fit.quantile * fit.standard_error[at]);
    }
    return out;
  }

 private:
  // Adds the mean of the noise of `cycles` cycles; the scatter is that of the cycles about the
  // mean.
  void add_noise(const RunData& exact, RunData& noisy, std::mt19937_64& random) const {
    std::normal_distribution<double> normal(0.0, 1.0);
    const double half = std::sqrt(3.0);
    std::uniform_real_distribution<double> uniform(-half, half);
    const double deviation = options_.noise;
    const auto draw = [&] {
      return options_.kind == NoiseKind::normal ? normal(random) : uniform(random);
    };
    const auto cycles = static_cast<int>(exact.cycles + 0.5);
    noisy.scatter = 0.0;
    for (std::size_t j = 0; j < exact.displacement.size(); ++j) {
      double sum = 0.0, squares = 0.0;
      for (int c = 0; c < cycles; ++c) {
        const double e = deviation * draw();
        sum += e;
        squares += e * e;
      }
      const double mean = sum / cycles;
      noisy.displacement[j] = exact.displacement[j] + mean;
      noisy.scatter += squares - cycles * mean * mean;
    }
  }

  const Model& model_;
  const MonteCarloOptions& options_;
  const std::vector<RunData>& exact_;
  std::vector<RunData> noisy_;
  const std::vector<int>& free_;
  const std::vector<double>& start_;
  Estimator estimator_;
};

void add_up(const std::vector<Replication>& all, const std::vector<int>& free,
            MonteCarloResult& result) {
  const std::size_t q = free.size();
  std::vector<double> mean(q, 0.0);
  double noise = 0.0, profiles_on_bound = 0.0, held_on_bound = 0.0;
  for (const Replication& o : all) {
    if (o.status == FitStatus::undetermined) ++result.undetermined;
    if (o.status != FitStatus::converged) continue;
    ++result.converged;
    result.on_bound += o.on_bound;
    for (const char held : o.inside_profile) {
      profiles_on_bound += o.on_bound;
      held_on_bound += o.on_bound && held != 0;
    }
    result.bias_taken_off += o.bias == Correction::taken_off;
    result.bias_left_in += o.bias == Correction::left_in;
    noise += o.noise;
    for (std::size_t k = 0; k < q; ++k)
      mean[k] += o.theta[k];
  }
  const auto count = static_cast<double>(result.converged);
  result.noise = noise / count;
  result.on_bound_profile_coverage =
      profiles_on_bound > 0.0 ? held_on_bound / profiles_on_bound : kNaN;
  for (double& m : mean)
    m /= count;
  result.covariance.assign(q * q, 0.0);
  for (const Replication& o : all) {
    if (o.status != FitStatus::converged) continue;
    for (std::size_t k = 0; k < q; ++k) {
      ParameterScore& p = result.parameters[k];
      p.coverage += o.inside[k] / count;
      if (!o.inside_profile.empty()) p.profile_coverage += o.inside_profile[k] / count;
      p.stated += o.error[k] * o.error[k] / count;
      for (std::size_t l = 0; l < q; ++l)
        result.covariance[k * q + l] +=
            (o.theta[k] - mean[k]) * (o.theta[l] - mean[l]) / (count - 1.0);
    }
  }
  for (std::size_t k = 0; k < q; ++k) {
    ParameterScore& p = result.parameters[k];
    p.bias = mean[k] - p.truth;
    p.scatter = std::sqrt(result.covariance[k * q + k]);
    p.stated = std::sqrt(p.stated);
  }
}

Result<void> check(const Model& model, const MonteCarloOptions& o) {
  const auto bad = [](std::string why) { return Error{ErrorKind::invalid, std::move(why)}; };
  if (o.runs.empty()) return bad("there is no run; give at least one frequency and amplitude");
  if (static_cast<int>(o.truth.size()) != model.parameter_count())
    return bad(fmt::format("the truth has {} parameters, the model {}", o.truth.size(),
                           model.parameter_count()));
  if (!(o.noise > 0.0) || !std::isfinite(o.noise))
    return bad(fmt::format("the noise is {}; it must be above 0", o.noise));
  if (o.replications < 2)
    return bad(fmt::format("{} replications; there must be at least 2", o.replications));
  return {};
}

}  // namespace

Result<std::vector<RunData>> exact_data(const Model& model, const std::vector<RunDesign>& runs,
                                        const std::vector<double>& truth) {
  std::vector<RunData> data;
  for (const RunDesign& design : runs) {
    const int every = (kAccuratePoints + design.points - 1) / design.points;
    PeriodicSystem system(model, {Scheme::order6, every * design.points, true});
    system.set_excitation(design.frequency_hz, design.amplitude);
    const SolveReport report = system.solve_from_rest(truth);
    if (report.status != SolveStatus::converged)
      return Error{ErrorKind::not_converged,
                   fmt::format("at {:g} Hz and {:g}: {}", design.frequency_hz, design.amplitude,
                               report.sentence())};
    RunData run;
    run.frequency_hz = design.frequency_hz;
    run.amplitude = design.amplitude;
    run.cycles = design.cycles;
    for (int i = 0; i < design.points; ++i)
      run.displacement.push_back(system.value(i * every, model.observed()));
    data.push_back(std::move(run));
  }
  return data;
}

namespace {

// The bounds, and the error on data without noise. An error where the runs do not determine all.
Result<MonteCarloResult> without_scatter(const Model& model, const MonteCarloOptions& options,
                                         const std::vector<RunData>& exact) {
  const std::vector<int> free = free_parameters(model);
  const std::size_t q = free.size();
  MonteCarloResult result;
  result.replications = options.replications;

  EstimationOptions knowing = options.estimation;
  knowing.noise = options.noise;
  Estimator without_noise(model, exact, knowing);
  const Fit& fit = without_noise.fit(options.truth);
  if (fit.status != FitStatus::converged)
    return Error{ErrorKind::not_converged, fit.trouble.empty()
                                               ? "these runs do not determine all free parameters"
                                               : fit.trouble};
  result.bound = fit.covariance;
  const auto bent = second_order(without_noise, model);
  for (std::size_t k = 0; k < q; ++k) {
    const auto at = static_cast<std::size_t>(free[k]);
    ParameterScore p;
    p.parameter = free[k];
    p.truth = options.truth[at];
    p.bound = std::sqrt(fit.covariance[k * q + k]);
    p.second_bound = bent ? bent->bound[at] : kNaN;
    p.discretisation = (fit.theta[at] - p.truth) / p.bound;
    p.profile_coverage = options.profile ? 0.0 : kNaN;
    result.parameters.push_back(p);
  }
  return result;
}

}  // namespace

Result<std::vector<Replication>> replications(const Model& model, const MonteCarloOptions& options,
                                              const Shard& part) {
  if (const auto good = check(model, options); !good) return good.error();
  const auto exact = exact_data(model, options.runs, options.truth);
  if (!exact) return exact.error();
  if (const auto good = without_scatter(model, options, *exact); !good) return good.error();
  const std::vector<int> free = free_parameters(model);
  std::vector<double> start = options.start;
  if (start.empty()) {
    start = options.truth;
    for (const int k : free) {
      const ModelParameter& p = model.parameters()[static_cast<std::size_t>(k)];
      double& at = start[static_cast<std::size_t>(k)];
      at = std::clamp(1.05 * at, p.lower, p.upper);
    }
  }
  const auto first = static_cast<long>(part.index) - 1, every = static_cast<long>(part.count);
  const long count = std::max(0L, (options.replications - first + every - 1) / every);
  std::vector<Replication> all(static_cast<std::size_t>(count));
  in_parallel(
      count, options.threads, [&] { return MonteCarloWorker(model, options, *exact, free, start); },
      [&](MonteCarloWorker& worker, long i) {
        all[static_cast<std::size_t>(i)] = worker.replicate(first + i * every);
      });
  return all;
}

Result<MonteCarloResult> score(const Model& model, const MonteCarloOptions& options,
                               const std::vector<Replication>& all) {
  if (const auto good = check(model, options); !good) return good.error();
  const auto exact = exact_data(model, options.runs, options.truth);
  if (!exact) return exact.error();
  auto result = without_scatter(model, options, *exact);
  if (result) add_up(all, free_parameters(model), *result);
  return result;
}

Result<MonteCarloResult> monte_carlo(const Model& model, const MonteCarloOptions& options) {
  const auto all = replications(model, options);
  if (!all) return all.error();
  return score(model, options, *all);
}

}  // namespace shaker::estimator
