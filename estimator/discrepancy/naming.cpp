#include "estimator/discrepancy/naming.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include <fmt/format.h>

#include "estimator/discrepancy/corners.hpp"
#include "estimator/discrepancy/nesting.hpp"
#include "estimator/effects/catalogue.hpp"

namespace shaker::estimator::discrepancy {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kWorthRefitting = 5.0;  // of chi-squared: less is chance
constexpr double kRival = 400.0;         // of chi-squared, times the best one's
constexpr std::size_t kMostRivals = 4;
constexpr double kNearlyAsMuch = 2.0 / 3.0;  // of the gap's square that the best closes
// Of log evidence that a simpler effect may be behind the richer one: with the richer one's
// interval holding the special case, and without.
constexpr double kReducedBehind = 10.0, kSimplerBehind = 1.0;
constexpr double kPredictable = 0.05;
constexpr int kCentring = 6;
constexpr int kMemorySteps = 60;
constexpr double kWorthGoingOn = 0.5;  // of chi-squared, that one more effect must leave at most

struct Ordered {
  const Candidate* candidate;
  const Probe* probe;
  double gain;
};

// The best shape of each candidate, best candidate first.
std::vector<Ordered> ordered(const Scoring& scoring) {
  std::vector<Ordered> best;
  for (const Score& s : scoring.scores) {
    auto found = std::find_if(best.begin(), best.end(),
                              [&](const Ordered& o) { return o.candidate == s.candidate; });
    if (found == best.end()) {
      best.push_back({s.candidate, &s.candidate->probes[s.probe], s.gain});
    } else if (s.gain > found->gain) {
      found->probe = &s.candidate->probes[s.probe];
      found->gain = s.gain;
    }
  }
  std::erase_if(best, [](const Ordered& o) { return o.gain < kWorthRefitting; });
  std::stable_sort(best.begin(), best.end(),
                   [](const Ordered& a, const Ordered& b) { return a.gain > b.gain; });
  return best;
}

// Index of an effect's parameter in a model, the last line of that effect's; -1: none.
int find_parameter(const Model& model, const std::string& effect, std::string_view symbol) {
  const auto& parameters = model.parameters();
  for (std::size_t k = parameters.size(); k-- > 0;) {
    if (parameters[k].effect == effect &&
        (parameters[k].name == symbol || parameters[k].name.ends_with("." + std::string(symbol))))
      return static_cast<int>(k);
  }
  return -1;
}

// An effect that a fit switches off, or drives to the end of what physics allows, is not what is
// missing. What merely shapes it may end anywhere.
std::string disqualification(const HarmonicFit& fit, std::size_t first_added) {
  if (!fit.converged) return fit.trouble.empty() ? "the fit did not settle" : fit.trouble;
  for (std::size_t i = first_added; i < fit.spec.effects.size(); ++i) {
    const std::string& name = fit.spec.effects[i].effect;
    const Effect* effect = find_effect(name);
    if (effect == nullptr) continue;
    bool switchable = false, present = false;
    for (const ParameterInfo& info : effect->parameters()) {
      const int k = find_parameter(*fit.model, name, info.symbol);
      if (k < 0 || std::isnan(info.absent)) continue;
      switchable = true;
      const double value = fit.theta[static_cast<std::size_t>(k)];
      if (value == info.absent) continue;
      present = true;
      if (fit.at_bound(k))
        return fmt::format("{} of {} ended at {:.4g} {}, the end of what is physically admissible",
                           info.symbol, name, value, info.unit);
    }
    if (switchable && !present)
      return fmt::format("{} was switched off by the fit: its sign would not be admissible", name);
  }
  return {};
}

VectorXd less_clock(const HarmonicFit& fit, const std::vector<RunDatum>& data, std::size_t run,
                    double clock) {
  const VectorXd e = whitened_residual(fit, data, run);
  if (data[run].clock.size() == 0) return e;
  return e - clock * whitened(data[run], data[run].clock);
}

class Search {
 public:
  Search(Naming& found, const std::vector<RunDatum>& data, const std::vector<Candidate>& all,
         const NamingOptions& options, const std::function<void(double)>& progress)
      : found_(found), data_(data), all_(all), options_(options), progress_(progress) {}

  void run() {
    if (!judge_base()) return;
    std::vector<std::size_t> level = extend(found_.base, found_.base_scoring, options_.refits);
    choose();
    for (int size = 2; size <= options_.most_effects && !settled(); ++size) {
      progress_(0.4 + 0.2 * size);
      std::vector<std::size_t> next;
      sort_by_evidence(level);
      if (options_.simple_first) put_simple_first(level);
      for (std::size_t i = 0; i < level.size() && i < 2U; ++i) {
        // Not a reference: extending grows the vector.
        Hypothesis parent = found_.hypotheses[level[i]];
        if (parent.rounded) parent.fit = parent.rounded;
        for (const std::size_t h : extend(parent, scored(parent.fit), size == 2 ? 5 : 3))
          next.push_back(h);
      }
      if (next.empty()) break;
      level = std::move(next);
      const double before = left_by_best();
      choose();
      if (!options_.simple_first && left_by_best() > kWorthGoingOn * before) break;
    }
    prune();
  }

 private:
  double left_by_best() const {
    return chosen_ ? found_.hypotheses[found_.best].fit->chi_squared : found_.base.fit->chi_squared;
  }

  // False when there is nothing to look for.
  bool judge_base() {
    // What has no coefficient is probed where it does something, which may be far away; later on
    // only what lies near by.
    FitOptions far = options_.fit;
    far.from_rest = true;
    found_.base_scoring = score(*found_.base.fit, data_, all_, far);
    progress_(0.2);
    found_.probability_base = probability(found_.base_scoring);
    found_.adequate = found_.probability_base > options_.false_alarm_rate;
    describe(found_.base);
    return !found_.adequate || options_.simple_first;
  }

  // Each fit once: that the best is judged by is what it is extended by.
  const Scoring& scored(const std::shared_ptr<const HarmonicFit>& fit) {
    auto& known = scored_[fit];
    if (!known) known = std::make_shared<const Scoring>(score(*fit, data_, all_, options_.fit));
    return *known;
  }

  double probability(const Scoring& scoring) const {
    if (options_.calibrations != nullptr)
      return options_.calibrations->get(scoring.design, options_.draws, options_.seed)
          ->combined(scoring.chi_squared, scoring.best_gain());
    const Calibration calibration(scoring.design, options_.draws, options_.seed);
    return calibration.combined(scoring.chi_squared, scoring.best_gain());
  }

  void describe(Hypothesis& h) const {
    const auto added =
        h.fitted_constants + static_cast<int>(h.fit->free.size() - found_.base.fit->free.size());
    const std::vector<RunDatum>& data = h.data ? *h.data : data_;
    h.log_evidence = log_evidence(*h.fit, data, added);
    for (std::size_t r = 0; r < data.size(); ++r) {
      if (data[r].role != Role::fit) continue;
      h.log_evidence -= log_scale(data[r]) - log_scale(data_[r]);
    }
    h.cross_validated = cross_validate(*h.fit, data);
  }

  std::vector<std::size_t> extend(const Hypothesis& parent, const Scoring& scoring, int most) {
    std::vector<std::size_t> made;
    int tried = 0;
    for (const Ordered& next : ordered(scoring)) {
      // What has no coefficient is scored at a guess of its shape, far from where it would end: the
      // score says little, so that all of these are tried once.
      const bool guessed = next.probe->coefficients.empty() && parent.effects.empty();
      if (tried >= most && !guessed) continue;
      Hypothesis h;
      h.fitted_constants = parent.fitted_constants;
      h.effects = parent.effects;
      const std::string added(next.candidate->effect->name());
      // Of two that hold one another only one is wanted; but on a damper that no model explains the
      // simple one is named first, and the richer one may add what is still missing.
      const auto stands = [&](const std::string& e) {
        const bool adds = options_.simple_first && simpler_than(added) == e;
        return e == added || (related(e, added) && !adds);
      };
      if (std::any_of(h.effects.begin(), h.effects.end(), stands)) continue;
      h.effects.push_back(added);
      std::sort(h.effects.begin(), h.effects.end());
      if (!known_.insert(h.effects).second) continue;
      tried += guessed ? 0 : 1;
      const auto spec = with_line(parent.fit->spec, next.probe->line);
      const Model model(spec);
      h.fit = refitted(spec, carried_over(model, *parent.fit), parent.fit.get());
      centre(h);
      h.disqualified = disqualification(*h.fit, found_.base.fit->spec.effects.size());
      if (std::isfinite(h.fit->chi_squared)) describe(h);
      made.push_back(found_.hypotheses.size());
      found_.hypotheses.push_back(std::move(h));
    }
    std::erase_if(
        made, [&](std::size_t h) { return !std::isfinite(found_.hypotheses[h].fit->chi_squared); });
    return made;
  }

  // Where the last line's force has a place of rest that the model file does not give, that place
  // is fitted too: parabolas through chi-squared, as it is a constant and has no derivative.
  void centre(Hypothesis& h) const {
    const auto given = h.fit->spec.effects.back().constants.find("u0");
    if (given == h.fit->spec.effects.back().constants.end()) return;
    double middle = given->second, step = 0.05 * std::fabs(middle);
    const double at_first = h.fit->chi_squared;
    const auto at = [&](double u0) {
      config::ModelSpec spec = h.fit->spec;
      spec.effects.back().constants["u0"] = u0;
      return refitted(spec, h.fit->theta, h.fit.get());
    };
    for (int round = 0; round < kCentring && std::isfinite(h.fit->chi_squared); ++round) {
      const auto low = at(middle - step), high = at(middle + step);
      const double now = h.fit->chi_squared;
      const double slope = high->chi_squared - low->chi_squared;
      const double bend = high->chi_squared - 2.0 * now + low->chi_squared;
      if (!std::isfinite(slope) || !std::isfinite(bend)) return;
      const double share =
          bend > 0.0 ? std::clamp(-0.5 * slope / bend, -2.0, 2.0) : (slope > 0.0 ? -2.0 : 2.0);
      auto next = at(middle + share * step);
      for (const auto& other : {low, high}) {
        if (other->chi_squared < next->chi_squared) next = other;
      }
      if (next->chi_squared < now) h.fit = next;
      middle = h.fit->spec.effects.back().constants.at("u0");
      step = std::max(std::fabs(share) < 0.5 ? 0.3 * step : step, 1e-6);
      if (now - next->chi_squared < 0.1 && std::fabs(share) < 0.5) break;
    }
    if (at_first - h.fit->chi_squared > kWorthRefitting) h.fitted_constants = 1;
  }

  void sort_by_evidence(std::vector<std::size_t>& level) const {
    std::stable_sort(level.begin(), level.end(), [&](std::size_t a, std::size_t b) {
      return found_.hypotheses[a].log_evidence > found_.hypotheses[b].log_evidence;
    });
  }

  void put_simple_first(std::vector<std::size_t>& level) const {
    double most = 0.0;
    const auto closed = [&](std::size_t h) {
      return found_.base.fit->chi_squared - found_.hypotheses[h].fit->chi_squared;
    };
    for (const std::size_t h : level) {
      if (found_.hypotheses[h].disqualified.empty()) most = std::max(most, closed(h));
    }
    const auto simple = [&](std::size_t h) {
      return found_.hypotheses[h].disqualified.empty() && closed(h) > kNearlyAsMuch * most;
    };
    std::stable_sort(level.begin(), level.end(), [&](std::size_t a, std::size_t b) {
      if (!simple(a) || !simple(b)) return simple(a) && !simple(b);
      return found_.hypotheses[a].fit->free.size() < found_.hypotheses[b].fit->free.size();
    });
  }

  bool any_best() {
    bool any = false;
    for (std::size_t h = 0; h < found_.hypotheses.size(); ++h) {
      const Hypothesis& now = found_.hypotheses[h];
      if (!now.disqualified.empty() || !std::isfinite(now.fit->chi_squared)) continue;
      if (!any || now.log_evidence > found_.hypotheses[found_.best].log_evidence) found_.best = h;
      any = true;
    }
    return any;
  }

  // The best admissible hypothesis of all, and whether it leaves but noise.
  void choose() {
    const std::shared_ptr<const HarmonicFit> before =
        chosen_ ? found_.hypotheses[found_.best].fit : nullptr;
    if (!any_best()) return;
    sharpen_rivals();
    for (int round = 0; round < 4 && any_best(); ++round) {
      if (!sharpened(found_.hypotheses[found_.best])) break;
    }
    any_best();
    prefer_simpler();
    chosen_ = true;
    const Hypothesis& best = found_.hypotheses[found_.best];
    if (before == best.fit) return;
    Scoring scoring = scored(best.rounded ? best.rounded : best.fit);
    if (best.rounded) {
      const Projector project(scoring.design.jacobian);
      scoring.residual = project(stacked_residual(*best.fit, *best.data));
      scoring.chi_squared = best.fit->chi_squared;
      for (std::size_t k = 0; k < scoring.scores.size(); ++k) {
        const Signature& signature = scoring.design.signatures[k];
        scoring.scores[k].gain =
            signature.visible > 0.0 ? gain_of(signature, scoring.residual) : 0.0;
      }
    }
    found_.probability_best = probability(scoring);
    found_.explained = found_.probability_best > options_.false_alarm_rate;
  }

  // A richer effect gives way to the simpler one that it holds where the data do not exclude that.
  void prefer_simpler() {
    for (bool changed = true; changed;) {
      changed = false;
      const Hypothesis& best = found_.hypotheses[found_.best];
      for (const std::string& effect : best.effects) {
        std::vector<std::string> wanted = best.effects;
        std::replace(wanted.begin(), wanted.end(), effect, std::string(simpler_than(effect)));
        std::sort(wanted.begin(), wanted.end());
        const auto simpler = std::find_if(found_.hypotheses.begin(), found_.hypotheses.end(),
                                          [&](const Hypothesis& h) { return h.effects == wanted; });
        if (simpler == found_.hypotheses.end() || !simpler->disqualified.empty()) continue;
        sharpened(*simpler);
        const double behind = best.log_evidence - simpler->log_evidence;
        if (behind > (reduces(*best.fit, effect) ? kReducedBehind : kSimplerBehind)) continue;
        found_.best = static_cast<std::size_t>(simpler - found_.hypotheses.begin());
        changed = true;
        break;
      }
    }
  }

  // Where the best would gain by sharper corners, so might those close behind: a rounded corner
  // must not decide between them.
  void sharpen_rivals() {
    const Hypothesis& best = found_.hypotheses[found_.best];
    const double limit = kRival * best.fit->chi_squared;
    const std::size_t size = best.effects.size();
    std::vector<std::size_t> rivals;
    for (std::size_t h = 0; h < found_.hypotheses.size(); ++h) {
      const Hypothesis& now = found_.hypotheses[h];
      if (now.disqualified.empty() && !now.rounded && now.effects.size() <= size &&
          now.fit->chi_squared < limit)
        rivals.push_back(h);
    }
    sort_by_evidence(rivals);
    for (std::size_t i = 0; i < rivals.size() && i < kMostRivals; ++i)
      sharpened(found_.hypotheses[rivals[i]]);
  }

  // Corners made as sharp as fine grids allow. False when there is no corner, or nothing to gain.
  bool sharpened(Hypothesis& h) const {
    if (h.rounded || h.fit->chi_squared < static_cast<double>(h.fit->observations) ||
        !has_corners(h.fit->spec))
      return false;
    auto sharp = sharpen(*h.fit, data_, options_.fit);
    if (!sharp || sharp->fit->chi_squared > h.fit->chi_squared) return false;
    h.rounded = h.fit;
    h.fit = sharp->fit;
    h.data = sharp->data;
    h.disqualified = disqualification(*h.fit, found_.base.fit->spec.effects.size());
    describe(h);
    return true;
  }

  // Where shares of the gap are weighed, the errors are what a first search left, and a fit that
  // leaves no more than them says nothing.
  bool settled() const { return chosen_ && found_.explained && !options_.simple_first; }

  std::shared_ptr<const HarmonicFit> refitted(const config::ModelSpec& spec,
                                              const std::vector<double>& start,
                                              const HarmonicFit* near) const {
    return std::make_shared<const HarmonicFit>(
        fit_harmonics(spec, data_, start, near, options_for(spec)));
  }

  // Models with memory are compared on half the points, and sharpened when it matters.
  FitOptions options_for(const config::ModelSpec& spec) const {
    FitOptions wanted = options_.fit;
    wanted.sharp = true;
    const Model model(spec);
    if (model.coordinates() > model.mechanical()) {
      wanted.points /= 2;
      wanted.max_iterations = kMemorySteps;
    }
    return wanted;
  }

  // Backward: an effect that a larger set does not need any more. Smaller sets that were on the way
  // are known already; the others are made here.
  void prune() {
    if (!chosen_) return;
    Hypothesis full = found_.hypotheses[found_.best];
    if (full.rounded) full.fit = full.rounded;
    if (full.effects.size() < 2) return;
    const std::size_t first = found_.base.fit->spec.effects.size();
    for (std::size_t out = first; out < full.fit->spec.effects.size(); ++out) {
      Hypothesis h;
      h.fitted_constants = full.fitted_constants;
      for (const std::string& effect : full.effects) {
        if (effect != full.fit->spec.effects[out].effect) h.effects.push_back(effect);
      }
      if (!known_.insert(h.effects).second) continue;
      config::ModelSpec spec = full.fit->spec;
      spec.effects.erase(spec.effects.begin() + static_cast<std::ptrdiff_t>(out));
      const Model model(spec);
      h.fit = refitted(spec, carried_over(model, *full.fit), found_.base.fit.get());
      h.disqualified = disqualification(*h.fit, first);
      if (std::isfinite(h.fit->chi_squared)) describe(h);
      found_.hypotheses.push_back(std::move(h));
    }
    choose();
  }

  Naming& found_;
  const std::vector<RunDatum>& data_;
  const std::vector<Candidate>& all_;
  const NamingOptions& options_;
  const std::function<void(double)>& progress_;
  std::set<std::vector<std::string>> known_;
  std::map<std::shared_ptr<const HarmonicFit>, std::shared_ptr<const Scoring>> scored_;
  bool chosen_ = false;
};

}  // namespace

double log_evidence(const HarmonicFit& fit, const std::vector<RunDatum>& data, int added) {
  const double clock = clock_error(fit, data);
  double sum = -0.5 * clock * clock;
  for (std::size_t r = 0; r < data.size(); ++r) {
    if (data[r].role != Role::fit) continue;
    const VectorXd e = less_clock(fit, data, r, clock);
    for (Index i = 0; i < e.size(); ++i) {
      const double nu = data[r].freedom[i];
      sum -= 0.5 * (nu + 1.0) * std::log1p(e[i] * e[i] / nu);
    }
  }
  return sum - 0.5 * added * std::log(static_cast<double>(fit.observations));
}

std::optional<double> cross_validate(const HarmonicFit& fit, const std::vector<RunDatum>& data,
                                     std::vector<VectorXd>* left_out) {
  const auto fitted = std::count_if(data.begin(), data.end(),
                                    [](const RunDatum& d) { return d.role == Role::fit; });
  if (left_out != nullptr) left_out->assign(data.size(), VectorXd());
  if (fitted < 2 || !fit.covariance.allFinite()) return std::nullopt;
  const double clock = clock_error(fit, data);
  double sum = 0.0;
  for (std::size_t r = 0; r < data.size(); ++r) {
    if (data[r].role != Role::fit) continue;
    const VectorXd e = less_clock(fit, data, r, clock);
    const MatrixXd j = whitened_jacobian(fit, data, r, fit.free);
    // What the other runs leave open of this one: e of the run left out is M^-1 e, its covariance
    // M^-1, with M = I - J (sum J'J)^-1 J'.
    // It is the identity but along the few columns of J.
    const MatrixXd root = j * Eigen::LLT<MatrixXd>(fit.covariance).matrixL().toDenseMatrix();
    const Eigen::JacobiSVD<MatrixXd> few(root, Eigen::ComputeThinU);
    const VectorXd values = (1.0 - few.singularValues().array().square()).max(1e-8);
    const VectorXd along = few.matrixU().transpose() * e;
    sum -= 0.5 * (e.squaredNorm() - along.squaredNorm() +
                  along.cwiseAbs2().cwiseQuotient(values).sum() - values.array().log().sum());
    if (left_out != nullptr) {
      // What only this run tells, the others cannot predict at all.
      (*left_out)[r] =
          e + few.matrixU() * (along.cwiseQuotient(values.cwiseMax(kPredictable)) - along);
    }
  }
  return sum;
}

Naming name_effects(HarmonicFit base, const std::vector<RunDatum>& data,
                    const std::vector<Candidate>& candidates, const NamingOptions& options,
                    const std::function<void(double)>& progress) {
  Naming found;
  found.base.fit = std::make_shared<const HarmonicFit>(std::move(base));
  Search(found, data, candidates, options, progress).run();
  return found;
}

}  // namespace shaker::estimator::discrepancy
