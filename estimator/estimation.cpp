// Data, starts and the two loops: lifted Gauss-Newton and the nested methods.
#include "estimator/estimation.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>

#include <fmt/format.h>

#include "estimator/estimation_impl.hpp"

namespace shaker::estimator {
namespace {

constexpr int kStartHarmonics = 3;  // more would carry the noise into the accelerations
constexpr std::size_t kFewestCoarse = 24;
constexpr double kCloseEnough = 1e-2;  // of theta, where the approach on few points ends
constexpr double kNearlyUndamped = 1e-5;

void check(const RunData& run, std::size_t index) {
  const auto reject = [&](const std::string& why) {
    throw std::invalid_argument(fmt::format("run {}: {}", index + 1, why));
  };
  if (!(run.frequency_hz > 0.0) || !std::isfinite(run.frequency_hz))
    reject(fmt::format("the frequency is {} Hz; it must be positive", run.frequency_hz));
  if (run.displacement.size() < 8)
    reject(fmt::format("{} points of displacement are too few; a period needs at least 8",
                       run.displacement.size()));
  if (!run.tau.empty() && run.tau.size() != run.displacement.size())
    reject(fmt::format("{} times for {} displacements", run.tau.size(), run.displacement.size()));
  const auto all_finite = [](const std::vector<double>& values) {
    return std::all_of(values.begin(), values.end(), [](double v) { return std::isfinite(v); });
  };
  if (!all_finite(run.displacement) || !all_finite(run.tau) || !all_finite(run.excitation))
    reject("a sample is missing or not finite; leave such samples out");
  double largest = std::fabs(run.amplitude);
  for (const double x : run.excitation)
    largest = std::max(largest, std::fabs(x));
  if (run.excitation.empty() ? largest == 0.0 : run.excitation.size() < 3)
    reject("the excitation has no amplitude; without motion there is nothing to estimate from");
  if (!(run.cycles > 0.0) || !(run.weight > 0.0)) reject("cycles and weight must be positive");
}

// What is left to go after this step, from the rate at which steps shrink.
double left_after(double step, double previous) {
  const double rate = step / previous;
  return std::isfinite(previous) && rate < 0.5 ? step * rate / (1.0 - rate) : step;
}

// Least multiple of the data's points that is at least `least`, when the data are on equal steps.
int grid_points(const RunData& run, int least) {
  if (!run.tau.empty()) return least;
  const int count = static_cast<int>(run.displacement.size());
  return count * ((least + count - 1) / count);
}

}  // namespace

Estimator::Impl::Impl(const Model& the_model, std::vector<RunData> data, EstimationOptions opt)
    : model(the_model), options(opt) {
  if (data.empty()) throw std::invalid_argument("there is no run to estimate from");
  const auto p = static_cast<std::size_t>(model.parameter_count());
  for (std::size_t k = 0; k < p; ++k) {
    if (!model.parameters()[k].fixed) free.push_back(static_cast<int>(k));
  }
  systems.reserve(data.size());
  for (std::size_t r = 0; r < data.size(); ++r) {
    check(data[r], r);
    GridOptions grid = options.grid;
    grid.points = grid_points(data[r], grid.points);
    systems.emplace_back(model, grid);
    runs.emplace_back();
    runs[r].data = std::move(data[r]);
    prepare_readings(runs[r], grid.points);
    prepare_harmonics(runs[r], grid.points);
    runs[r].saved.resize(systems[r].state().size());
  }
  make_coarse_level();
  for (std::size_t r = 0; r < runs.size(); ++r)
    load(r);
  const std::size_t q = free.size();
  gram.resize(q * q);
  scratch_matrix.resize(q * q);
  factors.resize(q * q);
  gradient.resize(q);
  scratch_vector.resize(q);
  delta.resize(q);
  held.resize(q);
  delta_full.resize(p);
  theta_saved.resize(p);
  mixed_.resize(1 + p);
  products.resize((1 + p) * (1 + p));
  fit.theta.resize(p);
  fit.standard_error.resize(p);
  fit.at_bound.resize(p);
  fit.determined.resize(p);
  fit.covariance.resize(q * q);
}

void Estimator::Impl::make_coarse_level() {
  const bool possible = options.method == Method::lifted &&
                        options.grid.scheme != Scheme::fourier &&
                        std::all_of(runs.begin(), runs.end(), [](const RunState& run) {
                          return run.every >= 2 && run.data.displacement.size() >= kFewestCoarse;
                        });
  if (!possible) return;
  coarse.reserve(runs.size());
  for (const RunState& run : runs) {
    GridOptions grid = options.grid;
    grid.points = static_cast<int>(run.data.displacement.size());
    coarse.emplace_back(model, grid);
  }
}

void Estimator::Impl::load(std::size_t r) {
  RunState& run = runs[r];
  run.inverse_variance = run.data.cycles * run.data.weight;
  const auto put = [&](PeriodicSystem& system) {
    if (run.data.excitation.empty())
      system.set_excitation(run.data.frequency_hz, run.data.amplitude);
    else
      system.set_excitation(run.data.frequency_hz, run.data.excitation,
                            options.excitation_harmonics);
  };
  put(systems[r]);
  if (!coarse.empty()) put(coarse[r]);
}

void Estimator::Impl::prepare_readings(RunState& run, int points) {
  const std::size_t count = run.data.displacement.size();
  run.readings.resize(count);
  for (std::size_t j = 0; j < count; ++j) {
    Reading& reading = run.readings[j];
    if (run.data.tau.empty()) {
      run.every = points / static_cast<int>(count);
      reading.base = static_cast<int>(j) * run.every;
      continue;
    }
    // Lagrange interpolation of degree 5 on the six points around tau.
    double at = run.data.tau[j] - std::floor(run.data.tau[j]);
    at *= points;
    const int first = static_cast<int>(std::floor(at)) - 2;
    reading.base = (first + points) % points;
    reading.count = 6;
    for (int k = 0; k < 6; ++k) {
      double w = 1.0;
      for (int m = 0; m < 6; ++m) {
        if (m != k) w *= (at - (first + m)) / (k - m);
      }
      reading.weight[k] = w;
    }
  }
}

// Tables that turn the data into their first harmonics and those into a state on the grid.
void Estimator::Impl::prepare_harmonics(RunState& run, int points) {
  if (model.coordinates() != 1 || !run.data.tau.empty()) return;
  const int count = static_cast<int>(run.data.displacement.size());
  const int terms = 1 + 2 * std::min(kStartHarmonics, (count - 1) / 2);
  const auto fill = [&](std::vector<double>& table, int n, double mean, double rest) {
    table.resize(static_cast<std::size_t>(n) * terms);
    for (int i = 0; i < n; ++i) {
      for (int t = 0; t < terms; ++t) {
        const double angle = 2.0 * std::numbers::pi * ((t + 1) / 2) * i / n;
        table[i * terms + t] =
            t == 0 ? mean : rest * (t % 2 == 1 ? std::cos(angle) : std::sin(angle));
      }
    }
  };
  fill(run.analysis, count, 1.0 / count, 2.0 / count);
  fill(run.synthesis, points, 1.0, 1.0);
  run.coefficients.resize(terms);
}

bool Estimator::Impl::start_from_data(std::size_t r, PeriodicSystem& system) {
  RunState& run = runs[r];
  if (run.analysis.empty()) return false;
  const std::size_t terms = run.coefficients.size();
  std::fill(run.coefficients.begin(), run.coefficients.end(), 0.0);
  for (std::size_t j = 0; j < run.data.displacement.size(); ++j) {
    const double* table = &run.analysis[j * terms];
    for (std::size_t t = 0; t < terms; ++t)
      run.coefficients[t] += table[t] * run.data.displacement[j];
  }
  const auto state = system.state();
  const std::size_t every = run.synthesis.size() / terms / state.size();
  for (std::size_t i = 0; i < state.size(); ++i) {
    const double* table = &run.synthesis[i * every * terms];
    double sum = 0.0;
    for (std::size_t t = 0; t < terms; ++t)
      sum += table[t] * run.coefficients[t];
    state[i] = sum;
  }
  return true;
}

void Estimator::Impl::accumulate(std::vector<PeriodicSystem>& level, bool with_newton) {
  const std::size_t q = free.size();
  const std::size_t size = 1 + fit.theta.size();
  std::fill(products.begin(), products.end(), 0.0);
  for (std::size_t r = 0; r < runs.size(); ++r) {
    const RunState& run = runs[r];
    const int every = &level == &coarse ? 1 : run.every;
    if (every > 0 && level[r].add_products(run.data.displacement, every, with_newton,
                                           run.inverse_variance, products.data()))
      continue;
    for_each_datum(r, with_newton, [&](const double* row, double residual, double weight) {
      products[0] += weight * residual * residual;
      for (std::size_t k = 1; k < size; ++k) {
        products[k * size] += weight * row[k] * residual;
        for (std::size_t l = 1; l <= k; ++l)
          products[k * size + l] += weight * row[k] * row[l];
      }
    });
  }
  sum_of_squares = products[0];
  for (std::size_t k = 0; k < q; ++k) {
    const std::size_t row = static_cast<std::size_t>(1 + free[k]) * size;
    gradient[k] = products[row];
    for (std::size_t l = 0; l <= k; ++l)
      gram[k * q + l] = products[row + static_cast<std::size_t>(1 + free[l])];
  }
}

// Cholesky on the parameters that are not held; a parameter that would leave its box is put on the
// bound and held, and the rest solved again.
bool Estimator::Impl::box_step(double lambda) {
  const std::size_t q = free.size();
  const auto& parameters = model.parameters();
  for (std::size_t k = 0; k < q; ++k) {
    const ModelParameter& p = parameters[free[k]];
    const double theta = fit.theta[free[k]];
    held[k] = (theta <= p.lower && gradient[k] < 0.0) || (theta >= p.upper && gradient[k] > 0.0);
    delta[k] = 0.0;
  }
  for (std::size_t round = 0; round <= q; ++round) {
    for (std::size_t k = 0; k < q; ++k) {
      scratch_vector[k] = gradient[k];
      for (std::size_t l = 0; l <= k; ++l) {
        double value = gram[k * q + l];
        if (k == l) value *= 1.0 + lambda;
        if (held[k] || held[l]) {
          if (held[l] && !held[k]) scratch_vector[k] -= value * delta[l];
          if (held[k] && !held[l]) scratch_vector[l] -= value * delta[k];
          value = k == l ? 1.0 : 0.0;
        }
        factors[k * q + l] = value;
      }
    }
    for (std::size_t k = 0; k < q; ++k) {
      if (held[k]) scratch_vector[k] = delta[k];
    }
    // Cholesky, then forward and back substitution, in place.
    for (std::size_t k = 0; k < q; ++k) {
      const double diagonal = factors[k * q + k];
      double sum = diagonal;
      for (std::size_t m = 0; m < k; ++m)
        sum -= factors[k * q + m] * factors[k * q + m];
      if (!(sum > 1e-13 * diagonal)) return false;
      const double root = std::sqrt(sum);
      factors[k * q + k] = root;
      for (std::size_t r = k + 1; r < q; ++r) {
        double value = factors[r * q + k];
        for (std::size_t m = 0; m < k; ++m)
          value -= factors[r * q + m] * factors[k * q + m];
        factors[r * q + k] = value / root;
      }
    }
    for (std::size_t k = 0; k < q; ++k) {
      for (std::size_t m = 0; m < k; ++m)
        scratch_vector[k] -= factors[k * q + m] * scratch_vector[m];
      scratch_vector[k] /= factors[k * q + k];
    }
    for (std::size_t k = q; k-- > 0;) {
      for (std::size_t r = k + 1; r < q; ++r)
        scratch_vector[k] -= factors[r * q + k] * scratch_vector[r];
      scratch_vector[k] /= factors[k * q + k];
    }
    bool inside = true;
    for (std::size_t k = 0; k < q; ++k) {
      if (held[k]) continue;
      const ModelParameter& p = parameters[free[k]];
      const double target = fit.theta[free[k]] + scratch_vector[k];
      delta[k] = std::clamp(target, p.lower, p.upper) - fit.theta[free[k]];
      if (target < p.lower || target > p.upper) {
        held[k] = 1;
        inside = false;
      }
    }
    if (inside) break;
  }
  std::fill(delta_full.begin(), delta_full.end(), 0.0);
  for (std::size_t k = 0; k < q; ++k)
    delta_full[free[k]] = delta[k];
  return true;
}

double Estimator::Impl::relative_step() const {
  double worst = 0.0;
  for (std::size_t k = 0; k < free.size(); ++k) {
    const double theta = std::fabs(fit.theta[free[k]]);
    worst = std::max(worst, std::fabs(delta[k]) / std::max(theta, 1e-12));
  }
  return worst;
}

// One linearisation a step moves theta and all states together. Trusted only while it contracts:
// anything odd (an inadmissible point, a singular matrix, steps that do not shrink) gives up, and
// the caller starts the nested method from the parameters that were given. The first steps, which
// only have to come near, are taken on the data's own few points.
bool Estimator::Impl::fit_lifted(bool warm) {
  last_step = std::numeric_limits<double>::infinity();
  if (!warm) {
    auto& first = coarse.empty() ? systems : coarse;
    for (std::size_t r = 0; r < runs.size(); ++r) {
      if (!start_from_data(r, first[r])) return false;
    }
    if (!coarse.empty()) {
      if (!lifted_steps(coarse)) return false;
      for (std::size_t r = 0; r < runs.size(); ++r)
        systems[r].interpolate_from(coarse[r]);
    }
  }
  return lifted_steps(systems);
}

// Largest relative Newton step of a state.
double newton_step(const PeriodicSystem& system) {
  double step = 0.0;
  double size = 1e-300;
  const int c = system.model().observed();
  for (int i = 0; i < system.points(); ++i) {
    step = std::max(step, std::fabs(system.row(i, c)[0]));
    size = std::max(size, std::fabs(system.value(i, c)));
  }
  return step / size;
}

bool Estimator::Impl::lifted_steps(std::vector<PeriodicSystem>& level) {
  const bool approach = &level == &coarse;
  int without_progress = 0;
  for (int iteration = 1; iteration <= options.max_iterations; ++iteration) {
    for (PeriodicSystem& system : level) {
      if (!system.linearise(fit.theta) || !system.solve_step()) return false;
    }
    accumulate(level, true);
    if (!box_step(0.0)) return false;
    double state_step = 0.0;
    for (PeriodicSystem& system : level) {
      state_step = std::max(state_step, newton_step(system));
      system.advance(1.0, delta_full);
    }
    const double step = std::max(relative_step(), state_step);
    for (std::size_t k = 0; k < fit.theta.size(); ++k)
      fit.theta[k] += delta_full[k];
    if (options.keep_iterates) fit.iterates.push_back(fit.theta);
    ++fit.iterations;
    if (!std::isfinite(step) || step > 1e3) return false;
    if (approach && step <= kCloseEnough) {
      last_step = step;
      return true;
    }
    if (left_after(step, last_step) <= options.tolerance && state_step < 1e-6) {
      fit.status = FitStatus::converged;
      return true;
    }
    if (step > 0.9 * last_step && iteration > 2 && ++without_progress > 3) return false;
    last_step = step;
  }
  return false;
}

bool Estimator::Impl::solve_all(bool warm) {
  for (std::size_t r = 0; r < systems.size(); ++r) {
    SolveReport report;
    if (warm) report = systems[r].solve(fit.theta);
    if (!warm || report.status != SolveStatus::converged)
      report = systems[r].solve_from_rest(fit.theta);
    if (report.status != SolveStatus::converged) {
      fit.trouble =
          fmt::format("run {} ({:g} Hz): {}", r + 1, runs[r].data.frequency_hz, report.sentence());
      return false;
    }
  }
  return true;
}

// Far from the optimum the linearisation sends badly determined parameters off by orders of
// magnitude, down valleys that take long to come back from: no step more than doubles a parameter.
bool Estimator::Impl::cap_step(const std::vector<double>& start) {
  double share = 1.0;
  for (std::size_t k = 0; k < delta_full.size(); ++k) {
    const double most = std::max(std::fabs(fit.theta[k]), std::fabs(start[k]));
    if (std::fabs(delta_full[k]) * share > most && most > 0.0)
      share = most / std::fabs(delta_full[k]);
  }
  for (double& d : delta_full)
    d *= share;
  for (double& d : delta)
    d *= share;
  return share < 1.0;
}

void Estimator::Impl::fit_nested(const std::vector<double>& start, bool warm, bool damped) {
  fit.trouble.clear();
  if (!solve_all(warm)) {
    fit.status = FitStatus::no_solution;
    return;
  }
  double lambda = damped ? 1e-4 : 0.0;
  double grow = 2.0;
  accumulate(systems, false);
  double previous = std::numeric_limits<double>::infinity();
  int refused = 0;
  for (int iteration = 1; iteration <= options.max_iterations; ++iteration) {
    fit.iterations = iteration;
    const double before = sum_of_squares;
    if (!box_step(lambda)) {
      if (!damped) {
        fit.status = FitStatus::undetermined;
        return;
      }
      lambda = std::max(4.0 * lambda, 1e-10);
      if (lambda > 1e8) break;
      continue;
    }
    const double used_lambda = lambda;
    const bool capped = damped && cap_step(start);
    theta_saved = fit.theta;
    for (std::size_t r = 0; r < systems.size(); ++r) {
      const auto state = systems[r].state();
      std::copy(state.begin(), state.end(), runs[r].saved.begin());
      systems[r].advance(0.0, delta_full);
    }
    const double step = relative_step();
    for (std::size_t k = 0; k < fit.theta.size(); ++k)
      fit.theta[k] += delta_full[k];
    bool accepted = true;
    for (std::size_t r = 0; r < systems.size() && accepted; ++r) {
      accepted = systems[r].solve(fit.theta).status == SolveStatus::converged;
      if (!accepted && !damped) {
        const auto report = systems[r].solve_from_rest(fit.theta);
        accepted = report.status == SolveStatus::converged;
        if (!accepted) fit.trouble = fmt::format("run {}: {}", r + 1, report.sentence());
      }
    }
    if (accepted) accumulate(systems, false);
    // At the bottom rounding decides whether the sum goes up or down.
    if (damped) accepted = accepted && sum_of_squares <= before * (1.0 + 1e-13) + 1e-300;
    if (!accepted) {
      if (!damped) {
        fit.status = FitStatus::no_solution;
        return;
      }
      fit.theta = theta_saved;
      for (std::size_t r = 0; r < systems.size(); ++r) {
        std::copy(runs[r].saved.begin(), runs[r].saved.end(), systems[r].state().begin());
        systems[r].solve(fit.theta);
      }
      accumulate(systems, false);
      if (step <= 1e3 * options.tolerance && ++refused > 8) {
        fit.status = FitStatus::converged;
        return;
      }
      lambda = std::max(lambda, 1e-12) * grow;
      grow *= 2.0;
      if (lambda > 1e12) break;
      continue;
    }
    refused = 0;
    grow = 2.0;
    lambda /= 8.0;
    if (options.keep_iterates) fit.iterates.push_back(fit.theta);
    // A step that is short because it was damped proves nothing.
    if (used_lambda <= kNearlyUndamped && !capped &&
        left_after(step, previous) <= options.tolerance) {
      fit.status = FitStatus::converged;
      return;
    }
    previous =
        used_lambda <= kNearlyUndamped && !capped ? step : std::numeric_limits<double>::infinity();
  }
  fit.status = FitStatus::not_converged;
  fit.trouble = fmt::format(
      "no convergence in {} iterations; the last step still changed a "
      "parameter by {:.1e} of its value",
      fit.iterations, relative_step());
}

Estimator::Estimator(const Model& model, std::vector<RunData> runs, EstimationOptions options)
    : impl_(std::make_unique<Impl>(model, std::move(runs), options)) {}
Estimator::~Estimator() = default;
Estimator::Estimator(Estimator&&) noexcept = default;
Estimator& Estimator::operator=(Estimator&&) noexcept = default;

void Estimator::update_run(std::size_t run, const RunData& data) {
  RunState& state = impl_->runs.at(run);
  if (data.displacement.size() != state.data.displacement.size() ||
      data.excitation.size() != state.data.excitation.size() ||
      data.tau.size() != state.data.tau.size())
    throw std::invalid_argument("update_run: the data have another shape than the run");
  check(data, run);
  state.data = data;
  impl_->load(run);
}

const Fit& Estimator::fit(const std::vector<double>& start, bool warm) {
  Impl& impl = *impl_;
  Fit& fit = impl.fit;
  if (start.size() != fit.theta.size())
    throw std::invalid_argument(
        fmt::format("the start has {} parameters, the model {}", start.size(), fit.theta.size()));
  fit.theta = start;
  fit.iterates.clear();
  fit.trouble.clear();
  fit.iterations = 0;
  fit.status = FitStatus::not_converged;
  const bool lifted = impl.options.method == Method::lifted;
  if (!lifted || !impl.fit_lifted(warm)) {
    fit.theta = start;
    fit.iterates.clear();
    impl.fit_nested(start, warm && !lifted, impl.options.method != Method::gauss_newton);
  }
  impl.finish();
  return fit;
}

const Fit& Estimator::last() const {
  return impl_->fit;
}
const std::vector<PeriodicSystem>& Estimator::solutions() const {
  return impl_->systems;
}

std::vector<double> Estimator::predicted(std::size_t run) const {
  const RunState& state = impl_->runs.at(run);
  const PeriodicSystem& system = impl_->systems[run];
  std::vector<double> y;
  for (const Reading& reading : state.readings) {
    double sum = 0.0;
    for (int k = 0; k < reading.count; ++k)
      sum += reading.weight[k] *
             system.value((reading.base + k) % system.points(), impl_->model.observed());
    y.push_back(sum);
  }
  return y;
}

}  // namespace shaker::estimator
