#include "estimator/online/online_estimator.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>

#include "estimator/fit/estimation.hpp"
#include "estimator/online/change_watch.hpp"
#include "estimator/online/internal/bias_watch.hpp"
#include "estimator/online/internal/run_view.hpp"

namespace shaker::estimator {
namespace {

constexpr double kLeastWeight = 1e-9;

}  // namespace

namespace online {

// Running mean of the cycles of one run, point by point, and scatter about it (Welford).
struct RunMean {
  int run = 0;
  RunData data;
  double excitation_variance = 0.0;  // sum over the cycles

  bool same_shape(const MeasuredCycle& cycle) const {
    return data.displacement.size() == cycle.displacement.size() &&
           data.excitation.size() == cycle.excitation.size();
  }
  // Reduces the weight of these cycles by one step of forgetting. The mean does not change.
  void forget(double forgetting) {
    data.cycles *= forgetting;
    data.scatter *= forgetting;
    excitation_variance *= forgetting * forgetting;
    data.cycles = std::max(data.cycles, kLeastWeight);
  }
  void add(const MeasuredCycle& cycle) {
    data.cycles += 1.0;
    const double share = 1.0 / data.cycles;
    data.frequency_hz += share * (cycle.frequency_hz - data.frequency_hz);
    data.amplitude += share * (cycle.amplitude - data.amplitude);
    // Error of the mean: the errors of the single cycles are independent.
    excitation_variance += cycle.excitation_error * cycle.excitation_error;
    data.excitation_error = std::sqrt(excitation_variance) / data.cycles;
    for (std::size_t i = 0; i < data.excitation.size(); ++i)
      data.excitation[i] += share * (cycle.excitation[i] - data.excitation[i]);
    for (std::size_t i = 0; i < data.displacement.size(); ++i) {
      const double off = cycle.displacement[i] - data.displacement[i];
      data.displacement[i] += share * off;
      data.scatter += off * (cycle.displacement[i] - data.displacement[i]);
    }
  }
};

static RunMean first_of(const MeasuredCycle& cycle) {
  RunMean mean;
  mean.run = cycle.run;
  mean.data.cycles = 1.0;
  mean.data.frequency_hz = cycle.frequency_hz;
  mean.data.amplitude = cycle.amplitude;
  mean.data.displacement = cycle.displacement;
  mean.data.excitation = cycle.excitation;
  mean.data.excitation_error = cycle.excitation_error;
  mean.excitation_variance = cycle.excitation_error * cycle.excitation_error;
  return mean;
}

}  // namespace online

using online::RunMean;

struct OnlineEstimator::State {
  State(const config::ModelSpec& stated, OnlineOptions opt)
      : spec(stated), model(spec), conditions(std::move(opt.runs)) {
    options.grid = {Scheme::order6, opt.grid_points, true};
    options.max_iterations = opt.max_iterations;
    forgetting = opt.forgetting;
    if (!(forgetting > 0.0) || forgetting > 1.0)
      throw std::invalid_argument(
          fmt::format("forgetting is {}; it must be above 0 and at most 1", forgetting));
    if (opt.false_alarms_per_cycle > 0.0)
      watch =
          std::make_unique<online::ChangeWatch>(model, opt.grid_points, opt.false_alarms_per_cycle);
    if (!varies_by_run(spec)) conditions.clear();
    theta = model.start();
  }

  // Adds a cycle to its run, the r-th, or as a new run. If the estimator refuses the cycle (an
  // exception), all runs stay as they were.
  void take(const MeasuredCycle& cycle, std::size_t r) {
    if (r == runs.size()) {
      begin_run(cycle);
    } else {
      RunMean run = runs[r];
      run.forget(forgetting);
      run.add(cycle);
      estimator->update_run(r, run.data);
      runs[r] = std::move(run);
    }
    forget_except(r);
  }
  void begin_run(const MeasuredCycle& cycle) {
    std::vector<RunMean> all = runs;
    all.push_back(online::first_of(cycle));
    RunModels own;
    std::vector<double> start = theta;
    if (!conditions.empty()) {
      own = models_of(all);
      start = carried_to(own);
      for (std::size_t k = 0; k < all.size(); ++k)
        all[k].data.model = own.of_run[k];
    }
    std::vector<RunData> data;
    for (const RunMean& run : all)
      data.push_back(run.data);
    estimator = std::make_unique<Estimator>(own.of_run.empty() ? model : own.joint(),
                                            std::move(data), options);
    runs = std::move(all);
    models = std::move(own);
    theta = std::move(start);
    warm = false;
    bias.reset();
  }
  // Throws std::invalid_argument for a run that the campaign does not have, or that lacks a
  // condition.
  RunModels models_of(const std::vector<RunMean>& measured) const {
    std::vector<config::RunCondition> known;
    for (const RunMean& run : measured) {
      if (run.run < 0 || static_cast<std::size_t>(run.run) >= conditions.size())
        throw std::invalid_argument(
            fmt::format("run {} is not one of the campaign's {}", run.run + 1, conditions.size()));
      known.push_back(conditions[static_cast<std::size_t>(run.run)]);
    }
    auto made = run_models(spec, known);
    if (!made) throw std::invalid_argument(made.error().what);
    return std::move(*made);
  }
  // The joint parameters for the start of a new run: the present ones, and for values that only the
  // new run has those of the run before. The reference of a condition may move with a new run.
  std::vector<double> carried_to(const RunModels& own) const {
    std::vector<double> start = own.joint().start();
    if (models.of_run.empty()) return start;
    const auto& known = models.joint().parameters();
    const auto& wanted = own.joint().parameters();
    for (std::size_t k = 0; k < wanted.size(); ++k) {
      const auto found = std::ranges::find(known, wanted[k].name, &ModelParameter::name);
      if (found != known.end()) start[k] = theta[static_cast<std::size_t>(found - known.begin())];
    }
    const std::size_t last = runs.size() - 1;
    const auto before = online::places_in(models, model, last);
    const auto now = online::places_in(own, model, last);
    const auto fresh = online::places_in(own, model, last + 1);
    for (std::size_t k = 0; k < before.size(); ++k) {
      const double value = before[k].factor * theta[static_cast<std::size_t>(before[k].index)];
      if (now[k].factor != 0.0)
        start[static_cast<std::size_t>(now[k].index)] = value / now[k].factor;
      const auto at = static_cast<std::size_t>(fresh[k].index);
      if (std::ranges::find(known, wanted[at].name, &ModelParameter::name) == known.end())
        start[at] = value;
    }
    return start;
  }
  const Model& joint() const { return models.of_run.empty() ? model : models.joint(); }
  // The model file's parameters in a run.
  std::vector<double> theta_in(std::size_t run) const {
    if (models.of_run.empty()) return theta;
    return online::values_in(online::places_in(models, model, run), theta);
  }
  // Applies the forgetting factor to the cycles of the other runs.
  void forget_except(std::size_t added) {
    if (forgetting == 1.0) return;
    for (std::size_t r = 0; r < runs.size(); ++r) {
      if (r == added) continue;
      runs[r].forget(forgetting);
      estimator->update_run(r, runs[r].data);
    }
  }

  config::ModelSpec spec;
  Model model;                                   // of the file
  std::vector<config::RunCondition> conditions;  // of all runs; empty: no parameter differs
  RunModels models;                              // of the measured runs; empty: `model`
  EstimationOptions options;
  double forgetting = 1.0;
  std::vector<RunMean> runs;
  std::unique_ptr<Estimator> estimator;
  std::unique_ptr<online::ChangeWatch> watch;  // null: no test for changes
  online::BiasWatch bias;
  std::vector<std::string> seen;     // sentences on changes, repeated in all later estimates
  std::vector<double> theta;         // last good one, joint: start of the next fit
  std::vector<double> theta_in_run;  // of the model file, in the run of the last cycle
  std::vector<double> response;      // of the run of the last cycle at theta; empty: no estimate
  bool warm = false;                 // true: the periodic solutions of all runs belong to theta
};

OnlineEstimator::OnlineEstimator(const config::ModelSpec& model, OnlineOptions options)
    : state_(std::make_unique<State>(model, options)) {}
OnlineEstimator::~OnlineEstimator() = default;
OnlineEstimator::OnlineEstimator(OnlineEstimator&&) noexcept = default;
OnlineEstimator& OnlineEstimator::operator=(OnlineEstimator&&) noexcept = default;

void OnlineEstimator::reset() {
  state_->runs.clear();
  state_->estimator.reset();
  state_->models = {};
  state_->theta = state_->model.start();
  state_->response.clear();
  state_->warm = false;
  state_->seen.clear();
  state_->bias.reset();
  if (state_->watch) state_->watch->reset();
}

Result<Estimate> OnlineEstimator::add(const MeasuredCycle& cycle) {
  State& s = *state_;
  s.response.clear();
  const auto finite = [](double v) { return std::isfinite(v); };
  if (!std::all_of(cycle.displacement.begin(), cycle.displacement.end(), finite) ||
      !std::all_of(cycle.excitation.begin(), cycle.excitation.end(), finite))
    return Error{
        ErrorKind::invalid,
        fmt::format("cycle {} of run {} holds a sample that is not finite; it was left out",
                    cycle.index, cycle.run + 1)};
  auto found = std::find_if(s.runs.begin(), s.runs.end(),
                            [&](const RunMean& r) { return r.run == cycle.run; });
  if (found != s.runs.end() && !found->same_shape(cycle))
    return Error{ErrorKind::invalid,
                 fmt::format("cycle {} of run {} has {} points, its run has {}; it was left out",
                             cycle.index, cycle.run + 1, cycle.displacement.size(),
                             found->data.displacement.size())};
  const auto run = static_cast<std::size_t>(found - s.runs.begin());
  try {
    s.take(cycle, run);
  } catch (const std::invalid_argument& e) {
    return Error{ErrorKind::invalid, e.what()};
  }
  const Fit& fit = s.estimator->fit(s.theta, s.warm);
  if (fit.status == FitStatus::no_solution || fit.status == FitStatus::not_converged) {
    s.warm = false;
    return Error{ErrorKind::not_converged, fit.trouble};
  }
  s.theta = fit.theta;
  s.response = s.estimator->predicted(run);  // before the bias moves the solutions
  Estimate estimate = s.estimator->describe();
  s.warm = s.bias.take_off(estimate, *s.estimator, s.joint());
  s.theta_in_run = s.theta_in(run);
  if (!s.models.of_run.empty())
    estimate =
        online::seen_in(online::places_in(s.models, s.model, run), estimate, s.models.varying[run],
                        s.conditions[static_cast<std::size_t>(cycle.run)].run);
  if (s.watch) {
    estimate.changes = s.watch->add(cycle, s.theta_in_run);
    if (!estimate.changes.empty()) s.seen.push_back(online::sentence(estimate.changes));
    estimate.warnings.insert(estimate.warnings.end(), s.seen.begin(), s.seen.end());
  }
  return estimate;
}

CyclePicture OnlineEstimator::picture(const MeasuredCycle& cycle) const {
  const State& s = *state_;
  if (s.response.empty()) return {};
  return {s.response, online::missing_force(s.model, s.theta_in_run, cycle)};
}

}  // namespace shaker::estimator
