#include "estimator/discrepancy/naming.hpp"

#include <algorithm>
#include <cmath>
#include <set>

#include <fmt/format.h>

#include "estimator/effects/catalogue.hpp"

namespace shaker::estimator::discrepancy {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kWorthRefitting = 5.0;  // of chi-squared: less is chance
constexpr double kRival = 20.0;          // of chi-squared, times the best one's
constexpr std::size_t kMostRivals = 4;
constexpr double kNearlyAsMuch = 0.75;  // of the gap's square that the best closes
constexpr double kPredictable = 0.05;
constexpr int kFinePoints = 1024;
constexpr double kSharpMemory = 0.1;
constexpr double kSharpest = 0.02;     // of the rounding widths that the effects state
constexpr int kUnknownParameters = 6;  // what a curve of no known form would cost

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

struct Corner {
  std::size_t line;
  std::string symbol;
  double width;
};

// The rounding widths that the model's effects state.
std::vector<Corner> corner_widths(const config::ModelSpec& spec) {
  std::vector<Corner> corners;
  for (std::size_t i = 0; i < spec.effects.size(); ++i) {
    const Effect* effect = find_effect(spec.effects[i].effect);
    if (effect == nullptr) continue;
    for (const ConstantInfo& info : effect->constants()) {
      const std::string symbol(info.symbol);
      if (info.width && !spec.effects[i].constants.contains(symbol))
        corners.push_back({i, symbol, info.value});
    }
  }
  return corners;
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
        const Scoring scoring = score(*parent.fit, data_, all_, options_.fit);
        for (const std::size_t h : extend(parent, scoring, size == 2 ? 5 : 3))
          next.push_back(h);
      }
      if (next.empty()) break;
      level = std::move(next);
      choose();
    }
    prune();
  }

 private:
  // False when there is nothing to look for.
  bool judge_base() {
    found_.base_scoring = score(*found_.base.fit, data_, all_, options_.fit);
    progress_(0.2);
    found_.probability_base = probability(found_.base_scoring);
    found_.adequate = found_.probability_base > options_.false_alarm_rate;
    describe(found_.base);
    const auto n = static_cast<double>(found_.base.fit->observations);
    found_.log_evidence_unknown = ideal_evidence(n);
    return !found_.adequate;
  }

  double probability(const Scoring& scoring) const {
    const Calibration calibration(scoring.design, options_.draws, options_.seed);
    return calibration.combined(scoring.chi_squared, scoring.best_gain());
  }

  // A model of no known form that leaves just what noise leaves.
  double ideal_evidence(double n) const {
    double expected = 0.0;
    for (const RunDatum& datum : data_) {
      if (datum.role != Role::fit) continue;
      for (Index i = 0; i < datum.freedom.size(); ++i) {
        const double nu = datum.freedom[i];
        expected -= 0.5 * (nu + 1.0) * std::log1p(1.0 / nu);
      }
    }
    const auto base = static_cast<double>(found_.base.fit->free.size());
    const double share = 1.0 - (base + kUnknownParameters) / n;
    return expected * share - 0.5 * kUnknownParameters * std::log(n);
  }

  void describe(Hypothesis& h) const {
    const auto added = static_cast<int>(h.fit->free.size() - found_.base.fit->free.size());
    const std::vector<RunDatum>& data = h.data ? *h.data : data_;
    h.log_evidence = log_evidence(*h.fit, data, added);
    for (std::size_t r = 0; r < data.size(); ++r) {
      if (data[r].role != Role::fit) continue;
      h.log_evidence -= data[r].error.cwiseQuotient(data_[r].error).array().log().sum();
    }
    h.cross_validated = cross_validate(*h.fit, data);
  }

  std::vector<std::size_t> extend(const Hypothesis& parent, const Scoring& scoring, int most) {
    std::vector<std::size_t> made;
    int tried = 0;
    for (const Ordered& next : ordered(scoring)) {
      if (tried >= most) break;
      Hypothesis h;
      h.effects = parent.effects;
      const std::string added(next.candidate->effect->name());
      if (std::find(h.effects.begin(), h.effects.end(), added) != h.effects.end()) continue;
      h.effects.push_back(added);
      std::sort(h.effects.begin(), h.effects.end());
      if (!known_.insert(h.effects).second) continue;
      ++tried;
      const auto spec = with_line(parent.fit->spec, next.probe->line);
      const Model model(spec);
      h.fit = refitted(spec, carried_over(model, *parent.fit), parent.fit.get());
      h.disqualified = disqualification(*h.fit, found_.base.fit->spec.effects.size());
      if (std::isfinite(h.fit->chi_squared)) describe(h);
      made.push_back(found_.hypotheses.size());
      found_.hypotheses.push_back(std::move(h));
    }
    std::erase_if(
        made, [&](std::size_t h) { return !std::isfinite(found_.hypotheses[h].fit->chi_squared); });
    return made;
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
    for (int round = 0; round < 4; ++round) {
      if (!any_best()) return;
      Hypothesis& best = found_.hypotheses[found_.best];
      const auto n = static_cast<double>(best.fit->observations);
      if (best.rounded && !best.finest && best.fit->chi_squared > n + 2.0 * std::sqrt(2.0 * n)) {
        best.finest = true;
        if (!sharpened(best, 2)) break;
        continue;
      }
      if (best.rounded || !sharpened(best)) break;
    }
    chosen_ = true;
    const Hypothesis& best = found_.hypotheses[found_.best];
    if (before == best.fit) return;
    Scoring scoring = score(best.rounded ? *best.rounded : *best.fit, data_, all_, options_.fit);
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

  // Corners made sharper step by step, each solution begun from the last, until it makes no
  // difference or the grid cannot follow. False when there is no corner, or nothing to be gained.
  bool sharpened(Hypothesis& h, int refinement = 1) const {
    const auto n = static_cast<double>(h.fit->observations);
    if (h.fit->chi_squared < n) return false;
    const std::shared_ptr<const HarmonicFit> first_fit = h.rounded ? h.rounded : h.fit;
    config::ModelSpec spec = first_fit->spec;
    const auto widths = corner_widths(spec);
    const bool memory = h.fit->model->coordinates() > h.fit->model->mechanical();
    if (widths.empty() && !memory) return false;
    FitOptions finer = options_.fit;
    finer.points = refinement * (memory ? kFinePoints / 2 : kFinePoints);
    std::shared_ptr<const HarmonicFit> last, now = first_fit;
    const double first = memory ? 1.0 : 2.0;
    const double last_share = memory ? kSharpMemory : kSharpest;
    for (double share = first; share > last_share; share *= 0.35) {
      for (const auto& [line, symbol, width] : widths)
        spec.effects[line].constants[symbol] = share * width;
      auto next = std::make_shared<const HarmonicFit>(
          fit_harmonics(spec, data_, now->theta, last ? now.get() : nullptr, finer));
      if (!std::isfinite(next->chi_squared) || !next->converged) break;
      last = now;
      now = std::move(next);
    }
    if (!last || now->chi_squared > h.fit->chi_squared) return false;
    // What one step of sharpening still changed is what the next ones together might, and as much
    // again by the grid.
    auto data = std::make_shared<std::vector<RunDatum>>(data_);
    for (std::size_t r = 0; r < data_.size(); ++r) {
      RunDatum& datum = (*data)[r];
      const VectorXd open = now->predictions[r].value() - last->predictions[r].value();
      datum.error = (datum.error.cwiseAbs2() + 4.0 * open.cwiseAbs2()).cwiseSqrt();
    }
    h.rounded = first_fit;
    h.fit = std::make_shared<const HarmonicFit>(
        fit_harmonics(now->spec, *data, now->theta, now.get(), finer));
    h.data = std::move(data);
    h.disqualified = disqualification(*h.fit, found_.base.fit->spec.effects.size());
    describe(h);
    return true;
  }

  bool settled() const { return chosen_ && found_.explained; }

  std::shared_ptr<const HarmonicFit> refitted(const config::ModelSpec& spec,
                                              const std::vector<double>& start,
                                              const HarmonicFit* near) const {
    return std::make_shared<const HarmonicFit>(
        fit_harmonics(spec, data_, start, near, options_for(spec)));
  }

  // Models with memory are compared on half the points, and sharpened when it matters.
  FitOptions options_for(const config::ModelSpec& spec) const {
    FitOptions wanted = options_.fit;
    const Model model(spec);
    if (model.coordinates() > model.mechanical()) wanted.points /= 2;
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
  bool chosen_ = false;
};

}  // namespace

double log_evidence(const HarmonicFit& fit, const std::vector<RunDatum>& data, int added) {
  double sum = 0.0;
  for (std::size_t r = 0; r < data.size(); ++r) {
    if (data[r].role != Role::fit) continue;
    const VectorXd e = whitened_residual(fit, data, r);
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
  double sum = 0.0;
  for (std::size_t r = 0; r < data.size(); ++r) {
    if (data[r].role != Role::fit) continue;
    const VectorXd e = whitened_residual(fit, data, r);
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
