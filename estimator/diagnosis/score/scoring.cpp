#include "estimator/diagnosis/score/internal/scoring.hpp"

#include <algorithm>
#include <cmath>
#include <memory>

#include <fmt/format.h>

#include "estimator/diagnosis/fit/internal/jumping_friction.hpp"
#include "estimator/diagnosis/fit/internal/model_of_run.hpp"
#include "estimator/diagnosis/fit/internal/smoothing.hpp"
#include "estimator/model/effects/catalogue.hpp"
#include "estimator/model/identified_damper.hpp"
#include "estimator/model/run_models.hpp"

namespace shaker::estimator::diagnosis {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// A signature of which less than this is left after projection is one with the parameters.
constexpr double kVisible = 1e-6;

bool fitted(const RunDatum& datum) {
  return datum.role == Role::fit;
}

Index rows_of(const std::vector<RunDatum>& data) {
  Index rows = 0;
  for (const RunDatum& datum : data)
    rows += fitted(datum) ? datum.response.size() : 0;
  return rows;
}

int sign_of(const ParameterInfo& p) {
  if (p.lower >= p.absent) return 1;
  if (p.upper <= p.absent) return -1;
  return 0;
}

const ParameterInfo* info_of(const Effect& effect, const std::string& symbol) {
  for (const ParameterInfo& p : effect.parameters()) {
    if (p.symbol == symbol) return &p;
  }
  return nullptr;
}

// Columns of the probe's coefficients in the Jacobian of the model that holds it.
std::vector<int> columns_of(const Model& model, const Probe& probe) {
  std::vector<int> columns;
  const auto& parameters = model.parameters();
  for (const std::string& symbol : probe.coefficients) {
    for (std::size_t k = parameters.size(); k-- > 0;) {
      if (parameters[k].symbol != symbol || parameters[k].effect != probe.line.effect) continue;
      columns.push_back(static_cast<int>(k));
      break;
    }
  }
  return columns;
}

// The model of the fit with all parameters held: a signature needs no derivatives over them.
config::ModelSpec held(const HarmonicFit& fit) {
  config::ModelSpec spec = fit.spec;
  for (const ModelNumber& number : numbers_of(*fit.model)) {
    if (!number.constant) spec.effects[number.line].parameters[number.symbol].fixed = true;
  }
  return spec;
}

// Memory, or a coordinate more, makes a model several times as dear; for a signature half the
// points will do.
int points_for(bool dear, const HarmonicFit& fit, const FitOptions& options) {
  return dear || fit.model->coordinates() > fit.model->mechanical() ? options.points / 2
                                                                    : options.points;
}
int points_for(const Model& model, const HarmonicFit& fit, const FitOptions& options) {
  return points_for(
      model.coordinates() > model.mechanical() || model.coordinates() > fit.model->coordinates(),
      fit, options);
}

// Along an imposed motion the forces of effects add up: an effect that shares nothing with the
// others adds the same force to each model.
bool adds_its_own(const HarmonicFit& fit, const std::vector<RunDatum>& data, const Probe& probe) {
  const Effect* effect = find_effect(probe.line);
  if (effect == nullptr || effect->group() != Group::damper || effect->in_series() ||
      effect->sees_excitation() || !effect->borrows().empty())
    return false;
  const auto shares = [&](const Model::Term& term) {
    const auto borrowed = term.effect->borrows();
    return term.effect->in_series() ||
           std::any_of(borrowed.begin(), borrowed.end(),
                       [&](const Borrowed& b) { return b.effect == effect->name(); });
  };
  const auto terms = fit.model->terms();
  return std::none_of(terms.begin(), terms.end(), shares) &&
         std::all_of(data.begin(), data.end(), [](const RunDatum& datum) {
           return datum.kind == Kind::imposed_motion && !datum.sampled;
         });
}

// The fit's model with the probe; or only the probe, where that adds a force of its own.
config::ModelSpec probed_spec(const HarmonicFit& fit, const Probe& probe, bool own) {
  config::ModelSpec spec = own ? fit.spec : held(fit);
  if (own) spec.effects.clear();
  return with_line(spec, probe.line);
}

// With corners as the fit has them: its solution is this one's too.
ProbedRun probed_run(const HarmonicFit& fit, const std::vector<RunDatum>& data, std::size_t r,
                     const ProbedRuns& before, const config::ModelSpec& spec,
                     const std::shared_ptr<const Model>& model, int points) {
  ProbedRun seen{model, nullptr};
  RunDatum datum = data[r];
  datum.to_limit.reset();  // it is of the model without the probe
  if (const std::size_t first = first_of_response(data, r); first < r) {
    seen.prediction = std::make_shared<Prediction>(*before[first].prediction, datum);
  } else {
    if (fit.run_models[r] != fit.model || varies_by_run(spec))
      seen.model = fit.rounded ? rounded_model(spec, datum, fit.predictions[r].points(),
                                               fit.at_once && can_jump(spec, data))
                               : model_of_run(spec, datum);
    seen.prediction = std::make_shared<Prediction>(*seen.model, datum, points);
  }
  seen.prediction->start_from(fit.predictions[r]);
  return seen;
}

ProbedRuns probed_runs(const HarmonicFit& fit, const std::vector<RunDatum>& data,
                       const config::ModelSpec& spec, const std::shared_ptr<const Model>& model,
                       int points, const ProbedRuns* near) {
  ProbedRuns all(data.size());
  for (std::size_t r = 0; r < data.size(); ++r) {
    if (!fitted(data[r])) continue;
    all[r] = probed_run(fit, data, r, all, spec, model, points);
    if (near != nullptr && r < near->size() && (*near)[r].prediction)
      all[r].prediction->start_from(*(*near)[r].prediction);
  }
  return all;
}

// Every solution along an imposed motion begins at rest, unless it is told of another one.
bool worth_keeping(const ProbedRuns& runs) {
  return std::any_of(runs.begin(), runs.end(), [](const ProbedRun& run) {
    return run.prediction && run.prediction->imposed() != nullptr &&
           run.model->coordinates() > run.model->mechanical();
  });
}

// Of the work of a fit, that the look at one shape may take.
constexpr double kWorkOfProbe = 0.1;

// The shape at which a candidate was probed, in words.
std::string no_solution(const Probe& probe, const RunDatum& datum) {
  std::string at;
  for (const auto& [symbol, p] : probe.line.parameters) {
    if (p.start) at += fmt::format("{}{} = {:.3g}", at.empty() ? " at " : ", ", symbol, *p.start);
  }
  return fmt::format("the model with it has no {} for run {}{}",
                     datum.sampled ? "motion through the record" : "periodic solution", datum.name,
                     at);
}

// Multiplies by (I + k k')^-1/2, k the whitened influence of the time base: what it may be off by
// is noise that all runs share.
MatrixXd less_clock(const MatrixXd& stacked, const std::vector<RunDatum>& data) {
  VectorXd k = VectorXd::Zero(stacked.rows());
  Index at = 0;
  for (const RunDatum& datum : data) {
    if (!fitted(datum)) continue;
    if (datum.clock.size() > 0) k.segment(at, datum.clock.size()) = whitened(datum, datum.clock);
    at += datum.response.size();
  }
  const double size = k.squaredNorm();
  if (size == 0.0) return stacked;
  const double share = (1.0 - 1.0 / std::sqrt(1.0 + size)) / size;
  return stacked - share * k * (k.transpose() * stacked);
}

// The changes of the fitted runs in units of the noise, one run after another.
MatrixXd stacked(const std::vector<KnownChange>& changes, const std::vector<RunDatum>& data) {
  MatrixXd all;
  Index at = 0;
  for (std::size_t r = 0; r < data.size(); ++r) {
    if (!fitted(data[r])) continue;
    if (at == 0) all.resize(rows_of(data), changes[r].columns.cols());
    all.middleRows(at, changes[r].columns.rows()) = whitened(data[r], changes[r].columns);
    at += changes[r].columns.rows();
  }
  return all;
}

bool are_known(const std::vector<KnownChange>& changes, const std::vector<RunDatum>& data) {
  if (changes.size() != data.size()) return false;
  for (std::size_t r = 0; r < data.size(); ++r) {
    const KnownChange& known = changes[r];
    if (fitted(data[r]) &&
        (known.columns.rows() != data[r].response.size() ||
         known.motion.size() != data[r].driver.size() || known.motion != data[r].driver ||
         known.frequency_hz != data[r].frequency_hz))
      return false;
  }
  return true;
}

void remember_motion(const std::vector<RunDatum>& data, std::vector<KnownChange>& changes) {
  for (std::size_t r = 0; r < data.size(); ++r) {
    changes[r].frequency_hz = data[r].frequency_hz;
    changes[r].motion = data[r].driver;
  }
}

ProbeKey key_of(const HarmonicFit& fit, const std::vector<RunDatum>& data,
                const Candidate& candidate, std::size_t probe, const FitOptions& options) {
  if (!adds_its_own(fit, data, candidate.probes[probe])) return {&candidate, probe, 0, 0};
  return {&candidate, probe, points_for(!candidate.effect->internals().empty(), fit, options),
          fit.rounded ? fit.predictions.front().points() : 0};
}

// The scores of one probe, and their signatures.
void add_scores(const MatrixXd& whole, const Projector& project, const Candidate& candidate,
                std::size_t p, Scoring& scoring) {
  if (whole.cols() == 0) return;
  const Probe& probe = candidate.probes[p];
  const MatrixXd seen = project(whole);
  for (Index k = 0; k < whole.cols(); ++k) {
    Signature signature;
    const double length = whole.col(k).norm();
    const double left = seen.col(k).norm();
    if (std::isfinite(length) && left > kVisible * length && left > 0.0) {
      signature.direction = seen.col(k) / left;
      signature.visible = left;
      signature.hidden = 1.0 - left / length;
    }
    const ParameterInfo* info =
        probe.coefficients.empty()
            ? nullptr
            : info_of(*candidate.effect, probe.coefficients[static_cast<std::size_t>(k)]);
    signature.sign = info != nullptr ? sign_of(*info) : 1;
    Score s;
    s.candidate = &candidate;
    s.probe = p;
    s.coefficient = static_cast<std::size_t>(k);
    s.signature = whole.col(k);
    if (signature.visible > 0.0) {
      s.value = signature.direction.dot(scoring.residual) / signature.visible;
      s.gain = gain_of(signature, scoring.residual);
    }
    scoring.scores.push_back(std::move(s));
    scoring.design.signatures.push_back(std::move(signature));
  }
}

}  // namespace

double Scoring::best_gain() const {
  double best = 0.0;
  for (const Score& s : scores)
    best = std::max(best, s.gain);
  return best;
}

bool Scoring::has(const Candidate& candidate, std::size_t probe) const {
  return std::any_of(scores.begin(), scores.end(),
                     [&](const Score& s) { return s.candidate == &candidate && s.probe == probe; });
}

config::ModelSpec with_line(const config::ModelSpec& spec, const config::EffectSpec& line) {
  config::ModelSpec larger = spec;
  larger.effects.push_back(line);
  return larger;
}

std::vector<double> carried_over(const Model& model, const HarmonicFit& fit) {
  std::vector<double> theta = model.start();
  const auto& mine = model.parameters();
  const auto& theirs = fit.model->parameters();
  for (std::size_t k = 0; k < mine.size(); ++k) {
    for (std::size_t l = 0; l < theirs.size(); ++l) {
      if (theirs[l].name == mine[k].name && theirs[l].effect == mine[k].effect)
        theta[k] = std::clamp(fit.theta[l], mine[k].lower, mine[k].upper);
    }
  }
  return theta;
}

VectorXd stacked_residual(const HarmonicFit& fit, const std::vector<RunDatum>& data) {
  VectorXd all(rows_of(data));
  Index at = 0;
  for (std::size_t r = 0; r < data.size(); ++r) {
    if (!fitted(data[r])) continue;
    all.segment(at, data[r].response.size()) = whitened_residual(fit, data, r);
    at += data[r].response.size();
  }
  return less_clock(all, data);
}

MatrixXd stacked_jacobian(const HarmonicFit& fit, const std::vector<RunDatum>& data,
                          const std::vector<int>& columns) {
  MatrixXd all(rows_of(data), static_cast<Index>(columns.size()));
  Index at = 0;
  for (std::size_t r = 0; r < data.size(); ++r) {
    if (!fitted(data[r])) continue;
    all.middleRows(at, data[r].response.size()) = whitened_jacobian(fit, data, r, columns);
    at += data[r].response.size();
  }
  return less_clock(all, data);
}

Signatures signatures_of(const HarmonicFit& fit, const std::vector<RunDatum>& data,
                         const Probe& probe, const FitOptions& options, const Probed* near) {
  if (is_in_series(probe.line) && fit.model->coordinate_in_series() >= 0)
    return {{}, std::string(kOnePartInSeries), false, {}};
  const bool own = adds_its_own(fit, data, probe);
  if (own && near != nullptr && are_known(near->changes, data))
    return {less_clock(stacked(near->changes, data), data), {}, false, {}};
  const config::ModelSpec spec = probed_spec(fit, probe, own);
  const auto shared = std::make_shared<const Model>(spec);
  const Model& model = *shared;
  const std::vector<double> theta = own ? model.start() : carried_over(model, fit);
  const std::vector<int> columns = columns_of(model, probe);
  const HowFar search = options.from_rest ? HowFar::from_rest : HowFar::near;
  const Task task(data.front().budget, kWorkOfProbe * options.fit_budget);
  Probed found{probed_runs(fit, data, spec, shared, points_for(model, fit, options),
                           near != nullptr ? &near->runs : nullptr),
               std::vector<KnownChange>(data.size())};
  for (std::size_t r = 0; r < data.size(); ++r) {
    if (!fitted(data[r])) continue;
    Prediction& prediction = *found.runs[r].prediction;
    if (!prediction.at(theta, search))
      return {{}, task.over() ? kTooLong : no_solution(probe, data[r]), task.over(), {}};
    MatrixXd& change = found.changes[r].columns;
    if (columns.empty()) change = prediction.value();
    if (columns.empty() && !own) change -= fit.predictions[r].value();
    if (!columns.empty()) change = prediction.jacobian()(Eigen::all, columns);
  }
  MatrixXd whitened = less_clock(stacked(found.changes, data), data);
  if (own) {
    remember_motion(data, found.changes);
    found.runs.clear();
  } else {
    found.changes.clear();
  }
  return {std::move(whitened), {}, false, std::move(found)};
}

Scoring score(const HarmonicFit& fit, const std::vector<RunDatum>& data,
              const std::vector<Candidate>& candidates, const FitOptions& options,
              const Scoring* before, std::shared_ptr<ProbedAll> probed) {
  Scoring scoring;
  scoring.probed = before != nullptr ? before->probed
                   : probed          ? std::move(probed)
                                     : std::make_shared<ProbedAll>();
  scoring.design.jacobian = stacked_jacobian(fit, data, fit.free);
  scoring.design.freedom.resize(rows_of(data));
  Index at = 0;
  for (const RunDatum& datum : data) {
    if (!fitted(datum)) continue;
    scoring.design.freedom.segment(at, datum.freedom.size()) = datum.freedom;
    at += datum.freedom.size();
  }
  const Projector project(scoring.design.jacobian);
  scoring.residual = project(stacked_residual(fit, data));
  scoring.chi_squared = fit.chi_squared;
  for (const Candidate& candidate : candidates) {
    const std::size_t first = scoring.scores.size();
    NotScored none{&candidate, {}, false};
    for (std::size_t p = 0; p < candidate.probes.size(); ++p) {
      if (before != nullptr && !before->has(candidate, p)) continue;
      const ProbeKey key = key_of(fit, data, candidate, p, options);
      const auto known = scoring.probed->find(key);
      Signatures found = signatures_of(fit, data, candidate.probes[p], options,
                                       known != scoring.probed->end() ? &known->second : nullptr);
      if (!found.trouble.empty()) none.reason = found.trouble;
      none.stopped = none.stopped || found.stopped;
      add_scores(found.columns, project, candidate, p, scoring);
      if (!found.probed.changes.empty() || (before == nullptr && worth_keeping(found.probed.runs)))
        scoring.probed->insert_or_assign(key, std::move(found.probed));
    }
    if (scoring.scores.size() == first) scoring.not_scored.push_back(std::move(none));
  }
  return scoring;
}

}  // namespace shaker::estimator::diagnosis
