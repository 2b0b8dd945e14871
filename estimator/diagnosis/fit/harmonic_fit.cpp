#include "estimator/diagnosis/fit/internal/harmonic_fit.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "estimator/diagnosis/fit/internal/jumping_friction.hpp"
#include "estimator/diagnosis/fit/internal/model_of_run.hpp"
#include "estimator/diagnosis/fit/internal/normal_equations.hpp"
#include "estimator/diagnosis/fit/internal/predicted_runs.hpp"
#include "estimator/diagnosis/fit/internal/smoothing.hpp"
#include "estimator/math/box_minimum.hpp"
#include "estimator/math/damped_minimum.hpp"
#include "estimator/math/dense.hpp"
#include "estimator/model/run_models.hpp"

namespace shaker::estimator::diagnosis {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kMaxNegligibleGain = 0.1;  // of chi-squared
constexpr double kExact = 1e-6;             // of chi-squared: what predictions are exact to
// Chi-squared a datum from where on nobody asks for more than three digits and a half of it.
constexpr double kFar = 100.0, kExactFar = 3e-4;
constexpr double kFirstDamping = 1e-3, kLeastDamping = 1e-6;  // of the unit diagonal
constexpr double kLeastCurvature = 1e-14;  // of the unit diagonal: what the data leave open stays
constexpr double kStraight = 0.75;         // of what a step promised: the valley bends little
constexpr double kUnderstated = 1.25;      // of what a step promised: longer ones may win more
constexpr int kMaxDoublings = 5;           // of a step
constexpr int kSmallSteps = 3, kMostRefused = 12, kHopelessSteps = 10;  // one after the other
constexpr double kComesNearer = 0.5;  // of chi-squared, left by hopeless steps that go on

// The step of (gram + lambda diag) step = gradient inside the box.
VectorXd box_step(const HarmonicFit& fit, const NormalEquations& n, const VectorXd& gradient,
                  const std::vector<double>& theta, double lambda) {
  const auto q = static_cast<Index>(fit.free.size());
  VectorXd to_lower(q), to_upper(q);
  for (Index k = 0; k < q; ++k) {
    const auto parameter = static_cast<std::size_t>(fit.free[static_cast<std::size_t>(k)]);
    const ModelParameter& p = fit.model->parameters()[parameter];
    to_lower[k] = p.lower - theta[parameter];
    to_upper[k] = p.upper - theta[parameter];
  }
  return damped_box_step(n.gram, gradient, to_lower, to_upper, lambda + kLeastCurvature);
}

std::vector<double> stepped(const HarmonicFit& fit, std::vector<double> theta,
                            const VectorXd& step) {
  for (std::size_t k = 0; k < fit.free.size(); ++k)
    theta[static_cast<std::size_t>(fit.free[k])] += step[static_cast<Index>(k)];
  return theta;
}

// In what the data see of them.
bool shorter(const VectorXd& a, const VectorXd& b, const NormalEquations& n) {
  return a.dot(n.gram * a) < b.dot(n.gram * b);
}

const char* solution_of(const std::vector<RunDatum>& data) {
  return data.front().sampled ? "motion through the record" : "periodic solution";
}

MatrixXd nothing_known(const HarmonicFit& fit) {
  const auto q = static_cast<Index>(fit.free.size());
  return MatrixXd::Constant(q, q, std::numeric_limits<double>::quiet_NaN());
}

void finish(HarmonicFit& fit, const NormalEquations& n) {
  fit.chi_squared = n.chi_squared;
  const auto q = static_cast<Index>(fit.free.size());
  fit.covariance = nothing_known(fit);
  if (q == 0) return;
  const VectorXd scale = n.gram.diagonal().cwiseMax(1e-300).cwiseSqrt();
  const MatrixXd unit =
      scale.cwiseInverse().asDiagonal() * n.gram * scale.cwiseInverse().asDiagonal();
  const Spectrum eigen = spectrum_of(unit);
  const VectorXd values = eigen.values.cwiseMax(1e-16);
  fit.condition = std::sqrt(values[q - 1] / values[0]);
  const MatrixXd inverse =
      eigen.vectors * values.cwiseInverse().asDiagonal() * eigen.vectors.transpose();
  fit.covariance = scale.cwiseInverse().asDiagonal() * inverse * scale.cwiseInverse().asDiagonal();
}

void hold(HarmonicFit& fit) {
  for (Prediction& prediction : fit.predictions)
    prediction.hold();
}

void go_back(HarmonicFit& fit) {
  for (Prediction& prediction : fit.predictions)
    prediction.go_back();
}

struct Trial {
  std::vector<double> theta;
  bool predicted = false;
  NormalEquations normal;  // where it is
};

// Where chi-squared rises the step ended on the side of a bent valley, as a rule: back down from
// there by the same slopes.
Trial tried(HarmonicFit& fit, const std::vector<RunDatum>& data, const NormalEquations& now,
            const VectorXd& step, double lambda, HowFar search) {
  Trial trial{stepped(fit, fit.theta, step), false, {}};
  trial.predicted = predict_all(fit, data, trial.theta, search);
  if (!trial.predicted) return trial;
  trial.normal = normal_equations(fit, data, trial.theta);
  if (trial.normal.chi_squared < now.chi_squared) return trial;
  const VectorXd back =
      box_step(fit, now, gradient_by(now, fit, data, trial.theta), trial.theta, lambda);
  if (!shorter(back, step, now)) return trial;
  std::vector<double> theta = stepped(fit, trial.theta, back);
  if (predict_all(fit, data, theta, search)) {
    NormalEquations normal = normal_equations(fit, data, theta);
    trial = {std::move(theta), true, std::move(normal)};
  }
  return trial;
}

// No solution.
void lose(HarmonicFit& fit) {
  fit.converged = false;
  fit.chi_squared = std::numeric_limits<double>::infinity();
  fit.covariance = nothing_known(fit);
}

bool is_far(const HarmonicFit& fit, double chi_squared) {
  return chi_squared > kFar * fit.observations;
}

HowFar how_far(const FitOptions& options) {
  return options.from_near ? HowFar::patient : HowFar::from_rest;
}

double promised(const NormalEquations& n, const VectorXd& step) {
  return 2.0 * step.dot(n.gradient) - step.dot(n.gram * step);
}

VectorXd inside(const HarmonicFit& fit, const std::vector<double>& theta, VectorXd step) {
  for (std::size_t k = 0; k < fit.free.size(); ++k) {
    const auto parameter = static_cast<std::size_t>(fit.free[k]);
    const ModelParameter& p = fit.model->parameters()[parameter];
    double& move = step[static_cast<Index>(k)];
    move = std::clamp(move, p.lower - theta[parameter], p.upper - theta[parameter]);
  }
  return step;
}

// Far from the data the slopes exaggerate how much chi-squared bends along a valley: steps are too
// short by factors. Doubles the step that led to `trial` while this wins more.
void go_further(HarmonicFit& fit, const std::vector<RunDatum>& data, VectorXd step, Trial& trial,
                HowFar search) {
  for (int doubled = 0; doubled < kMaxDoublings; ++doubled) {
    hold(fit);
    step = inside(fit, fit.theta, 2.0 * step);
    Trial longer{stepped(fit, fit.theta, step), false, {}};
    longer.predicted = predict_all(fit, data, longer.theta, search);
    if (longer.predicted) longer.normal = normal_equations(fit, data, longer.theta);
    if (!longer.predicted || !(longer.normal.chi_squared < trial.normal.chi_squared)) break;
    trial = std::move(longer);
  }
  go_back(fit);
}

// What the loop asks: math/damped_minimum.hpp. Whether there is anything to gain is asked of the
// step without damping.
struct Minimisation {
  HarmonicFit& fit;
  const std::vector<RunDatum>& data;
  const FitOptions& options;
  NormalEquations now = {};
  VectorXd whole = {}, step = {};  // without damping, and with it
  double lambda = 0.0;             // the damping of `step`
  double gain = 0.0;               // that `whole` promises
  double exact = 0.0;              // change of chi-squared to which predictions are exact
  double trifle = 0.0;             // change of chi-squared that nobody asks for
  bool predicted = false;          // there is a solution where the step led
  bool refused = false;            // the step before was taken back
  bool straight = false;           // the step won what it promised
  int small = 0;                   // steps, one after the other, that won a trifle
  int beyond = 0;                  // steps, one after the other, that promised nothing of use
  double beyond_from = 0.0;        // chi-squared where these began

  HowFar search() const { return options.from_rest ? HowFar::from_rest : HowFar::near; }

  bool compute_step(double damping) {
    lambda = damping;
    whole = box_step(fit, now, now.gradient, fit.theta, 0.0);
    gain = promised(now, whole);
    if (!std::isfinite(gain) || is_hopeless()) return false;
    // Where the model is far off, no more can be asked than the prediction is exact to.
    exact = now.chi_squared * (is_far(fit, now.chi_squared) ? kExactFar : kExact);
    trifle = std::max({kMaxNegligibleGain, exact, options.tolerance});
    step = lambda > 0.0 ? box_step(fit, now, now.gradient, fit.theta, lambda) : whole;
    return true;
  }

  // Near a minimum a step promises what it wins. Far from it, one that wins much goes on.
  bool is_hopeless() {
    if (now.chi_squared < kComesNearer * beyond_from) beyond = 0;
    if (beyond == 0) beyond_from = now.chi_squared;
    beyond = now.chi_squared - gain > options.hopeless ? beyond + 1 : 0;
    return fit.given_up = beyond > kHopelessSteps;
  }

  bool converged_before_step() const {
    return gain < std::max(options.tolerance, exact) && !refused;
  }

  // Steps that were too long may have led to another branch of solutions.
  bool step_is_successful() {
    ++fit.iterations;
    Trial trial = tried(fit, data, now, step, lambda, search());
    predicted = trial.predicted;
    refused = !predicted || !(trial.normal.chi_squared < now.chi_squared);
    if (refused) {
      go_back(fit);
      return false;
    }
    if (is_far(fit, trial.normal.chi_squared) &&
        now.chi_squared - trial.normal.chi_squared > kUnderstated * promised(now, step))
      go_further(fit, data, step, trial, search());
    const double won = now.chi_squared - trial.normal.chi_squared;
    straight = won < trifle || won > kStraight * promised(now, step);
    small = won < trifle ? small + 1 : 0;
    fit.theta = std::move(trial.theta);
    now = std::move(trial.normal);
    hold(fit);
    return true;
  }

  bool converged_after_success() const { return small >= kSmallSteps; }
  // A promised gain that rounding and the grid do not let come true is no gain.
  bool converged_after_failure() const { return gain < trifle; }
};

struct HarmonicDamping {
  const Minimisation& steps;
  double lambda = 0.0;
  double enough = kFirstDamping;  // that made a step succeed
  int refused = 0;                // steps, one after the other

  bool raise_after_invalid_step() const { return false; }
  // To find that there is no solution is dear.
  bool raise_after_failure() {
    if (++refused > kMostRefused) return false;
    lambda = lambda > 0.0 ? 6.0 * lambda : enough;
    if (steps.predicted) return true;
    lambda *= 6.0;
    ++refused;
    return true;
  }
  // Straight after a refusal, and where the valley bends, the damping is right as it is.
  void lower_after_success() {
    if (lambda > 0.0) enough = std::max(lambda, kLeastDamping);
    if (refused == 0 && steps.straight) lambda = lambda < kLeastDamping ? 0.0 : 0.1 * lambda;
    refused = 0;
  }
};

// Levenberg-Marquardt from the fit's theta, where all runs have been predicted.
void iterate(HarmonicFit& fit, const std::vector<RunDatum>& data, const FitOptions& options) {
  Minimisation steps{fit, data, options, normal_equations(fit, data, fit.theta)};
  hold(fit);
  HarmonicDamping damping{steps};
  fit.converged = minimise_damped(steps, damping, options.max_iterations) == LoopEnd::converged;
  if (predict_all(fit, data, fit.theta, how_far(options))) {
    finish(fit, normal_equations(fit, data, fit.theta));
  } else {
    lose(fit);
  }
}

}  // namespace

bool HarmonicFit::at_bound(int parameter) const {
  const ModelParameter& p = model->parameters()[static_cast<std::size_t>(parameter)];
  const double value = theta[static_cast<std::size_t>(parameter)];
  return !p.fixed && (value <= p.lower || value >= p.upper);
}

double HarmonicFit::standard_error(int parameter) const {
  const auto found = std::find(free.begin(), free.end(), parameter);
  if (found == free.end()) return 0.0;
  const auto k = static_cast<Index>(found - free.begin());
  if (!constant) return std::sqrt(covariance(k, k));
  return std::hypot(std::sqrt(covariance(k, k)), constant->bends[k] * constant->standard_error);
}

VectorXd whitened_residual(const HarmonicFit& fit, const std::vector<RunDatum>& data,
                           std::size_t run) {
  return whitened(data[run], data[run].response - fit.predictions[run].value());
}

MatrixXd whitened_jacobian(const HarmonicFit& fit, const std::vector<RunDatum>& data,
                           std::size_t run, const std::vector<int>& columns) {
  const MatrixXd& all = fit.predictions[run].jacobian();
  MatrixXd some(all.rows(), static_cast<Index>(columns.size()));
  for (std::size_t k = 0; k < columns.size(); ++k)
    some.col(static_cast<Index>(k)) = all.col(columns[k]);
  return whitened(data[run], some);
}

double clock_error(const HarmonicFit& fit, const std::vector<RunDatum>& data) {
  double misfit = 0.0, size = 0.0;
  for (std::size_t r = 0; r < data.size(); ++r) {
    if (!is_fitted(data[r]) || data[r].clock.size() == 0) continue;
    const VectorXd k = whitened(data[r], data[r].clock);
    misfit += k.dot(whitened_residual(fit, data, r));
    size += k.squaredNorm();
  }
  return misfit / (1.0 + size);
}

namespace {

HarmonicFit fit_however_long(const config::ModelSpec& spec, const std::vector<RunDatum>& data,
                             const std::vector<double>& start, const HarmonicFit* near,
                             const FitOptions& options) {
  HarmonicFit fit;
  fit.spec = spec;
  fit.model = std::make_shared<const Model>(spec);
  fit.theta = start.empty() ? fit.model->start() : start;
  fit.free = free_parameters(*fit.model, data);
  fit.rounded = options.sharp && has_smoothing(spec);
  fit.at_once = fit.rounded && options.at_once && can_jump(spec, data);
  const bool varies = varies_by_run(spec);
  fit.predictions.reserve(data.size());
  for (std::size_t r = 0; r < data.size(); ++r) {
    if (const std::size_t first = first_of_response(data, r); first < r) {
      fit.run_models.push_back(fit.run_models[first]);
      fit.predictions.emplace_back(fit.predictions[first], data[r]);
    } else {
      fit.run_models.push_back(fit.rounded
                                   ? rounded_model(spec, data[r], options.points, fit.at_once)
                               : varies ? model_of_run(spec, data[r])
                                        : fit.model);
      fit.predictions.emplace_back(*fit.run_models[r], data[r], options.points);
    }
    if (options.correct_start) fit.predictions[r].be_patient();
    if (near != nullptr) fit.predictions[r].start_from(near->predictions[r]);
    for (std::size_t before = 0; before < r; ++before)
      fit.predictions[r].share(fit.predictions[before]);
    if (is_fitted(data[r])) fit.observations += static_cast<int>(data[r].response.size());
  }
  const bool correctable = options.correct_start || along_motion(data);
  if (!predict_all(fit, data, fit.theta, how_far(options)) &&
      !(correctable && admit(fit, data, how_far(options)))) {
    fit.trouble = fmt::format(
        "{}: there is no {} at the start of the estimation; give starting values nearer to the "
        "damper's",
        spec.name, solution_of(data));
    lose(fit);
    return fit;
  }
  const std::vector<double> began = fit.theta;
  iterate(fit, data, options);
  if (!std::isfinite(fit.chi_squared)) {
    fit.trouble =
        fmt::format("{}: there is no {} where the fit ended", spec.name, solution_of(data));
    return fit;
  }
  // Of what is far off nobody asks what it says of other runs.
  fit.predicts_all = predict_held_out(
      fit, data, began, is_far(fit, fit.chi_squared) ? HowFar::patient : how_far(options));
  if (!fit.predicts_all) {
    fit.converged = false;
    fit.trouble = fmt::format("{}: a held-out run has no {}", spec.name, solution_of(data));
  } else if (!fit.converged) {
    fit.trouble = fmt::format("{}: the fit did not settle in {} steps{}", spec.name, fit.iterations,
                              fit.given_up ? ", nor came anywhere near what others leave" : "");
  }
  for (Prediction& prediction : fit.predictions)
    prediction.rest();
  return fit;
}

}  // namespace

HarmonicFit fit_harmonics(const config::ModelSpec& spec, const std::vector<RunDatum>& data,
                          const std::vector<double>& start, const HarmonicFit* near,
                          const FitOptions& options) {
  const Task task(data.front().budget, options.fit_budget);
  HarmonicFit fit = fit_however_long(spec, data, start, near, options);
  if (!task.over()) return fit;
  lose(fit);
  fit.stopped = true;
  fit.trouble = fmt::format("{}: {}", spec.name, kTooLong);
  return fit;
}

}  // namespace shaker::estimator::diagnosis
