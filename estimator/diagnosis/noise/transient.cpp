#include "estimator/diagnosis/noise/internal/transient.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include <fmt/format.h>

#include "estimator/diagnosis/fit/internal/motion_integrator.hpp"
#include "estimator/diagnosis/fit/internal/places_of_rest.hpp"
#include "estimator/diagnosis/noise/internal/first_fit.hpp"
#include "estimator/diagnosis/noise/internal/wrong_unit.hpp"
#include "estimator/diagnosis/records/internal/transient_cosines.hpp"
#include "estimator/diagnosis/records/internal/transient_load.hpp"
#include "estimator/diagnosis/score/internal/scoring.hpp"
#include "estimator/model/effects/catalogue.hpp"
#include "estimator/model/instrument/instrument.hpp"
#include "estimator/solve/time/state_equations.hpp"

namespace shaker::estimator::diagnosis {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr std::size_t kMostProbes = 3;
constexpr double kUnknownMean = 1e3;    // of the inertia's root mean square: the error of a mean
constexpr double kRepeated = 0.02;      // of an excitation, that two runs of it may differ by
constexpr double kContradiction = 0.1;  // of a response

// Some force depends on the stroke, so that a simulation finds its way back.
bool has_spring(const Model& model, const SampledRun& run) {
  if (model.mechanical() > 1) return true;
  const std::vector<double> theta = model.start();
  Motion motion{run.dt, run.u, run.v, run.a, {}};
  MotionIntegrator here(model, motion, false);
  motion.u.array() += 0.1 * (run.u.maxCoeff() - run.u.minCoeff());
  MotionIntegrator there(model, motion, false);
  if (!here.at(theta) || !there.at(theta)) return true;
  return (here.force() - there.force()).norm() > 1e-9 * here.force().norm();
}

// True where all runs are free motions, without an excitation.
bool all_free(const std::vector<std::shared_ptr<SampledRun>>& runs) {
  return std::all_of(runs.begin(), runs.end(),
                     [](const auto& run) { return run->excitation.isZero(0.0); });
}

// A record costs many times a cycle, and the refit moves the shapes anyway.
void thin(std::vector<Probe>& probes) {
  if (probes.size() <= kMostProbes) return;
  std::vector<Probe> some;
  for (std::size_t i = 0; i < kMostProbes; ++i)
    some.push_back(probes[(2 * i + 1) * probes.size() / (2 * kMostProbes)]);
  probes = std::move(some);
}

// Why a run that is not periodic cannot show a candidate; empty: it can.
std::string not_shown(const Candidate& candidate, const config::ModelSpec& spec, bool by_force) {
  constexpr const char* kPeriodicOnly = "only a run with a period shows it";
  constexpr const char* kAlongMotion = "forces along a measured motion do not show it";
  const Instrument* instrument = candidate.effect->instrument();
  if (by_force && instrument != nullptr) return kAlongMotion;
  if (by_force && candidate.effect->in_series()) return {};
  try {
    const Model model(with_line(spec, candidate.probes.front().line));
    if (!by_force) return StateEquations(model).states() == 0 ? kPeriodicOnly : "";
    if (!can_be_carried(model)) return kAlongMotion;
    return model.needs_carrier() ? kPeriodicOnly : "";
  } catch (const std::invalid_argument&) {
    return kPeriodicOnly;
  }
}

RunDatum datum_of(const std::shared_ptr<SampledRun>& run) {
  RunDatum datum;
  datum.name = run->name;
  datum.kind = run->kind;
  datum.role = run->role;
  datum.condition = run->condition;
  datum.by_force = run->kind == Kind::imposed_motion;
  datum.response = CosineTransform(run->samples()).analyse(run->response, run->keep);
  // At the upper end of what their own uncertainty allows: one level serves a whole run, and must
  // not raise an alarm by itself.
  const Eigen::ArrayXd unsure = 1.0 + 2.0 * (2.0 / run->freedom.array()).sqrt();
  datum.error = (unsure * run->variance.array()).sqrt();
  datum.freedom = run->freedom;
  datum.sampled = run;
  return datum;
}

}  // namespace

RunDatum balance_of_forces(const RunDatum& response) {
  RunDatum datum = response;
  const SampledRun& run = *response.sampled;
  datum.by_force = true;
  datum.whitening.reset();  // these are of the response
  datum.to_limit.reset();
  if (run.excitation.size() > 0)
    datum.response = CosineTransform(run.samples()).analyse(run.excitation, run.keep);
  else
    datum.response = VectorXd::Zero(run.keep);
  for (Index k = 0; k < run.keep; ++k) {
    const double omega = std::numbers::pi * static_cast<double>(k) / run.length();
    datum.error[k] = std::sqrt(run.motion_noise[k]) * omega * omega;
  }
  // The excitation's own floor, and no cosine surer than the others by orders.
  const double floor =
      1e-3 * root_mean_square(datum.response) / std::sqrt(0.5 * static_cast<double>(run.keep));
  const double middle = datum.error[run.keep / 2];
  for (Index k = 0; k < run.keep; ++k)
    datum.error[k] =
        std::sqrt(datum.error[k] * datum.error[k] + floor * floor + 1e-4 * middle * middle + 1e-60);
  return datum;
}

std::vector<RunDatum> forces_of_records(const std::vector<RunDatum>& data, const Model& model) {
  std::vector<RunDatum> all;
  for (const RunDatum& datum : data) {
    all.push_back(balance_of_forces(datum));
    // Nothing balances the force of a spring at a sensor's wrong zero, so that the spring would have
    // to vanish.
    if (rests_at_zero(model, model.start()))
      all.back().error[0] = kUnknownMean * std::sqrt(datum.sampled->a.array().square().mean());
  }
  return all;
}

Result<TransientRuns> transient_runs(const std::vector<Recording>& recordings,
                                     const config::ModelSpec& spec) {
  const Model model(spec);
  auto sampled = sampled_runs(recordings);
  if (!sampled) return sampled.error();
  TransientRuns runs;
  runs.warnings = sampled->left_out;
  for (const auto& run : sampled->runs) {
    runs.data.push_back(datum_of(run));
    runs.warnings.insert(runs.warnings.end(), run->notes.begin(), run->notes.end());
  }
  const bool imposed = recordings.front().kind == Kind::imposed_motion;
  if (!imposed) {
    runs.forces = forces_of_records(runs.data, model);
    runs.by_force = !has_spring(model, *sampled->runs.front());
    if (runs.by_force) {
      if (all_free(sampled->runs))
        return Error{ErrorKind::invalid,
                     "no force of the model depends on the displacement, and no run has an "
                     "excitation: such a model does not move by itself; give it a spring, for "
                     "example linear_stiffness, or a formula with u, the displacement"};
      if (sees_load(model))
        return Error{ErrorKind::invalid,
                     fmt::format("model '{}' has a joint that yields (series_compliance), which "
                                 "forces along a measured motion do not show; give it a spring, so "
                                 "that its motion is compared, or leave the joint out",
                                 model.name())};
      runs.data.clear();
      for (const auto& run : sampled->runs)
        runs.data.push_back(balance_of_forces(datum_of(run)));
      runs.forces.clear();
      runs.warnings.push_back(
          "no force of the model depends on the stroke, so that a simulation would drift: the "
          "forces along the measured motion are compared instead of the motion");
    }
  } else {
    if (auto good = takes_in_energy(sampled->runs); !good) return good.error();
    runs.by_force = true;
  }
  runs.warnings.push_back(
      "there are no cycles whose scatter would be the noise: it is the floor of the spectrum above "
      "all that moves, carried down to lower frequencies with its trend; noise that is only slow "
      "is "
      "not seen so, and two records of one excitation would show it");
  return runs;
}

HarmonicFit fit_transient(const config::ModelSpec& model, const TransientRuns& runs,
                          const FitOptions& options) {
  if (runs.forces.empty()) return fit_harmonics(model, runs.data, {}, nullptr, options);
  const HarmonicFit forces = fit_harmonics(model, runs.forces, {}, nullptr, options);
  HarmonicFit best = fit_harmonics(model, runs.data, forces.theta, nullptr, options);
  if (best.converged && forces.converged && is_near_noise(best)) return best;
  HarmonicFit other = fit_harmonics(model, runs.data, {}, nullptr, options);
  if (std::isfinite(best.chi_squared))
    return is_better(other, best) ? std::move(other) : std::move(best);
  if (std::isfinite(other.chi_squared)) return other;
  FitOptions correcting = options;
  correcting.correct_start = true;
  HarmonicFit corrected = fit_harmonics(model, runs.data, forces.theta, nullptr, correcting);
  if (std::isfinite(corrected.chi_squared)) return corrected;
  return fit_harmonics(model, runs.data, {}, nullptr, correcting);
}

Result<void> use_repetitions(TransientRuns& runs, const HarmonicFit& fit) {
  std::set<std::size_t>& done = runs.repeated;
  for (std::size_t i = 0; i < runs.data.size(); ++i) {
    for (std::size_t j = i + 1; j < runs.data.size(); ++j) {
      RunDatum& a = runs.data[i];
      RunDatum& b = runs.data[j];
      const SampledRun& one = *a.sampled;
      const SampledRun& two = *b.sampled;
      const VectorXd& first = a.kind == Kind::imposed_motion ? one.u : one.excitation;
      const VectorXd& second = a.kind == Kind::imposed_motion ? two.u : two.excitation;
      if (done.contains(i) || done.contains(j) || first.size() == 0 || a.condition != b.condition ||
          first.size() != second.size() || std::fabs(one.dt / two.dt - 1.0) > 1e-6 ||
          (first - second).norm() > kRepeated * first.norm())
        continue;
      const Index keep = std::min(a.response.size(), b.response.size());
      const VectorXd apart = (a.response - fit.predictions[i].value()).head(keep) -
                             (b.response - fit.predictions[j].value()).head(keep);
      const double size = root_mean_square(a.response);
      if (root_mean_square(apart) > kContradiction * size &&
          root_mean_square(apart) > 10.0 * root_mean_square(a.error))
        return Error{ErrorKind::invalid,
                     fmt::format("runs {} and {} contradict each other: of one excitation, their "
                                 "responses differ by {:.0f} %; something changed between them "
                                 "(temperature, gas charge, the sensor's mounting): repeat one of "
                                 "them or leave one out",
                                 a.name, b.name, 100.0 * root_mean_square(apart) / size)};
      done.insert({i, j});
      // Power in bands that widen with frequency; half of the difference's is each run's.
      for (Index from = 0; from < keep;) {
        const Index to = std::min(keep, from + std::max<Index>(12, from / 4));
        const auto count = static_cast<double>(to - from);
        const double power = 0.5 * apart.segment(from, to - from).squaredNorm() / count;
        for (RunDatum* datum : {&a, &b}) {
          for (Index k = from; k < to; ++k) {
            datum->error[k] = std::sqrt(power);
            datum->freedom[k] = count;
          }
        }
        from = to;
      }
      runs.warnings.push_back(
          fmt::format("the noise of runs {} and {}, which are records of one "
                      "excitation, is what one does that the other does not",
                      a.name, b.name));
    }
  }
  return {};
}

bool shown_by_forces(const Candidate& candidate, const config::ModelSpec& spec) {
  return not_shown(candidate, spec, true).empty();
}

Catalogue shown_by_transients(Catalogue all, const config::ModelSpec& spec,
                              const TransientRuns& runs) {
  const bool shaken = std::ranges::any_of(
      runs.data, [](const RunDatum& run) { return !run.sampled->excitation.isZero(0.0); });
  std::erase_if(all.tried, [&](const Candidate& candidate) {
    std::string reason = not_shown(candidate, spec, runs.by_force);
    const Instrument* instrument = candidate.effect->instrument();
    if (reason.empty() && !shaken && instrument != nullptr && instrument->sees_load())
      reason = "free motions hardly tell it from another start";
    if (reason.empty()) return false;
    all.not_tried.push_back({candidate.name(), std::move(reason)});
    return true;
  });
  for (Candidate& candidate : all.tried)
    thin(candidate.probes);
  return all;
}

}  // namespace shaker::estimator::diagnosis
