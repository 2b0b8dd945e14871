#include "estimator/drop/drop_mixture.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <random>
#include <utility>

#include <Eigen/Dense>
#include <fmt/format.h>

#include "estimator/drop/internal/drop_surrogate.hpp"
#include "estimator/drop/internal/ended_table.hpp"
#include "estimator/drop/unnamed_force.hpp"
#include "estimator/math/statistics.hpp"

namespace shaker::estimator {
namespace {

constexpr double kLittle = 0.05;  // probability of a part that one treatment is enough for
constexpr double kNegligibleUnnamed = 0.01;  // of hypotheses beside a force that acts for certain
constexpr std::size_t kUnnamedModes = 6;     // of the unnamed force: each takes two drops
constexpr double kUnnamedLeft = 3e-3;        // of its variance, that they leave
constexpr double kNegligible = 1e-3;  // probability: less than the tail quantiles' scatter by draws

// A part of the mixture: a hypothesis with its parameters alone, or with an unnamed force too.
struct Component {
  double weight = 0.0;
  DropSurrogate drop;
};

// The smallest value below which `probability` of the weight lies, interpolated.
double weighted_quantile(const std::vector<WeightedValue>& sorted, double probability) {
  double all = 0.0;
  for (const WeightedValue& one : sorted)
    all += one.weight;
  double below = 0.0;
  for (std::size_t i = 0; i < sorted.size(); ++i) {
    const double next = below + sorted[i].weight;
    if (next >= probability * all) {
      if (i == 0) return sorted[i].value;
      const double share = (probability * all - below) / sorted[i].weight;
      return sorted[i - 1].value + share * (sorted[i].value - sorted[i - 1].value);
    }
    below = next;
  }
  return sorted.back().value;
}

double outside_share(const DropRun& run, const VisitedRegion& visited) {
  if (visited.empty()) return 1.0;
  const DropHistory& h = run.history;
  double all = 0.0, outside = 0.0;
  for (std::size_t i = 0; i + 1 < h.t.size() && h.speed[i] > 0.0; ++i) {
    const double work = h.load[i] * h.speed[i] * (h.t[i + 1] - h.t[i]);
    all += work;
    if (!visited.holds(h.stroke[i], h.speed[i])) outside += work;
  }
  return all > 0.0 ? std::clamp(outside / all, 0.0, 1.0) : 1.0;
}

class Mixer {
  using Modes = std::vector<std::vector<double>>;

 public:
  Mixer(const IdentifiedDamper& damper, const DropConditions& conditions,
        const MixtureOptions& options)
      : damper_(damper),
        conditions_(conditions),
        options_(options),
        priors_(options.priors),
        random_(options.seed) {
    priors_.runs = damper.spread;
  }

  Result<DropMixture> run() {
    if (auto good = gather(); !good) return good.error();
    DropMixture out;
    auto whole = components_.front().drop.whole();
    if (!whole) return whole.error();
    out.run = std::move(*whole);
    out.extrapolated_energy_share = outside_share(out.run, VisitedRegion(damper_.visited));
    out.warnings = std::move(warnings_);
    draw(out);
    return out;
  }

 private:
  // Makes the components. A hypothesis without a drop is left out with a warning, and the next one is
  // the first; an Error where none is left.
  Result<void> gather() {
    const double least = least_probability();
    for (std::size_t h = 0; h < damper_.hypotheses.size(); ++h) {
      const bool first = components_.empty();
      if (!first && damper_.hypotheses[h].probability < least) continue;
      const DamperHypothesis one = without_instruments(damper_.hypotheses[h]);
      const bool unnamed = damper_.unnamed_probability > 0.0 && (first || !one.left.empty());
      auto drop = with_priors(one, first || !unnamed ? one.probability : 0.0);
      if (!drop && h + 1 == damper_.hypotheses.size() && first) return drop.error();
      if (!drop) {
        warnings_.push_back(
            fmt::format("the hypothesis {} (probability {:.2g}) gives no drop and is left out: {}",
                        name_of(one), one.probability, drop.error().what));
        continue;
      }
      double weight = one.probability;
      if (unnamed) weight -= add_unnamed(*drop, one);
      if (!first && !(weight > 0.0)) continue;
      if (!first && unnamed) drop = with_priors(one, weight);
      if (!drop) continue;
      weight -= add_held(one, weight);
      weight -= add_zeroed(damper_.hypotheses[h], one, weight);
      weight -= add_ended(one, *drop, weight);
      components_.insert(first ? components_.begin() : components_.end(),
                         Component{weight, std::move(*drop)});
    }
    return {};
  }

  // All hypotheses below it are together less probable than draws can show.
  double least_probability() const {
    const double negligible = damper_.unnamed_probability < 1.0 ? kNegligible : kNegligibleUnnamed;
    std::vector<double> sorted;
    for (const DamperHypothesis& h : damper_.hypotheses)
      sorted.push_back(h.probability);
    std::sort(sorted.begin(), sorted.end());
    double below = 0.0;
    for (const double probability : sorted) {
      below += probability;
      if (below > negligible) return probability;
    }
    return 0.0;
  }

  // Root mean square of the force that the hypothesis which explains least leaves, m/s^2.
  double whole_gap() const {
    double most = 0.0;
    for (const DamperHypothesis& one : damper_.hypotheses)
      most = std::max(most, root_mean_square(one.left));
    return most;
  }

  double tested_speed() const {
    double fastest = 0.0;
    for (const VisitedCell& cell : damper_.visited)
      fastest = std::max(fastest, std::fabs(cell.velocity));
    return fastest;
  }

  // The drop of a hypothesis, with the priors as independent forces beside its parameters.
  Result<DropSurrogate> with_priors(const DamperHypothesis& one, double weight) {
    auto drop = DropSurrogate::make(one, conditions_, weight);
    if (!drop || !priors_.any()) return drop;
    std::vector<double> stroke, speed, t;
    drop->path(t, stroke, speed);
    const ForceAlongPath force = prior_forces(one, conditions_, priors_, tested_speed(), t);
    if (force.modes.empty()) return drop;
    return DropSurrogate::make(one, conditions_, weight, &force, &t);
  }

  static std::string name_of(const DamperHypothesis& one) {
    std::string all;
    for (const std::string& effect : one.effects)
      all += (all.empty() ? "" : " + ") + effect;
    return all.empty() ? "\"nothing is missing\"" : all;
  }

  // A stroke that was measured with a joint that gives under the load is 0 where the transducer was
  // zeroed: with the strut unloaded, or under the weight. One is as likely as the other. Returns the
  // weight of what was added.
  double add_zeroed(const DamperHypothesis& measured, const DamperHypothesis& one, double weight) {
    const auto zeroed = zeroed_under_weight(measured, conditions_);
    if (!zeroed || !(weight > 0.0)) return 0.0;
    auto drop = DropSurrogate::make(one, *zeroed, 0.5 * weight);
    if (!drop) return 0.0;
    components_.push_back({0.5 * weight, std::move(*drop)});
    return 0.5 * weight;
  }

  // Where the drop leaves the knots of a table: the damper whose table ends there, and its drop.
  struct Ended {
    DamperHypothesis damper;
    DropSurrogate drop;
  };
  std::optional<Ended> ended_beside(const DamperHypothesis& one, const DropSurrogate& drop) const {
    const auto& strokes = drop.center().history.stroke;
    const auto [low, high] = std::minmax_element(strokes.begin(), strokes.end());
    auto ended = ended_table(one, *low, *high);
    if (!ended) return std::nullopt;
    auto made = DropSurrogate::make(*ended, conditions_, 0.0);
    if (!made) return std::nullopt;
    return Ended{std::move(*ended), std::move(*made)};
  }

  // Where a table ends, the orifice may be another beyond it, as much as it changes over the table.
  Modes beyond_modes(const DamperHypothesis& one, const Ended& ended) const {
    std::vector<double> stroke, speed, t;
    ended.drop.path(t, stroke, speed);
    const auto line = std::find_if(one.model.effects.begin(), one.model.effects.end(),
                                   [](const auto& effect) { return effect.table.has_value(); });
    const auto at = static_cast<std::size_t>(line - one.model.effects.begin());
    const double fall = value_of(one.model, {at, "fall", false});
    return beyond_table(ended.damper, *line->table, fall, conditions_, t).modes;
  }

  // Beyond its knots a table goes on with its last taper, or ends. One is as likely as the other.
  // Returns the weight of what was added.
  double add_ended(const DamperHypothesis& one, const DropSurrogate& drop, double weight) {
    if (!(weight > 0.0)) return 0.0;
    const auto ended = ended_beside(one, drop);
    if (!ended) return 0.0;
    std::vector<double> stroke, speed, t;
    ended->drop.path(t, stroke, speed);
    ForceAlongPath force = prior_forces(ended->damper, conditions_, priors_, tested_speed(), t);
    for (auto& mode : beyond_modes(one, *ended))
      force.modes.push_back(std::move(mode));
    auto made = DropSurrogate::make(ended->damper, conditions_, 0.5 * weight, &force, &t);
    if (!made) return 0.0;
    components_.push_back({0.5 * weight, std::move(*made)});
    return 0.5 * weight;
  }

  // A number near its bound is exactly there, as where an effect is absent, or on this side of it.
  // Returns the weight of what was added.
  double add_held(const DamperHypothesis& one, double weight) {
    const auto held = held_at_bounds(one);
    if (!held) return 0.0;
    const double share = weight * held->probability / one.probability;
    if (!(share > kNegligible)) return 0.0;
    auto drop = with_priors(*held, share);
    if (!drop) return 0.0;
    components_.push_back({share, std::move(*drop)});
    return share;
  }

  // With the force that the hypothesis leaves, or that all leave. Either the parameters have taken a
  // part of it, as of a smooth force, or none, as of a rough one: both count alike, and the first
  // alone where both are worth little. Returns the weight of what was added.
  double add_unnamed(const DropSurrogate& drop, const DamperHypothesis& one) {
    const double weight = one.probability * damper_.unnamed_probability;
    const auto ended = weight > kNegligible ? ended_beside(one, drop) : std::nullopt;
    if (!ended) return add_unnamed(drop, one, weight, {});
    return add_unnamed(drop, one, 0.5 * weight, {}) +
           add_unnamed(ended->drop, ended->damper, 0.5 * weight, beyond_modes(one, *ended));
  }

  double add_unnamed(const DropSurrogate& drop, const DamperHypothesis& one, double weight,
                     const Modes& beside) {
    std::vector<double> stroke, speed, t;
    drop.path(t, stroke, speed);
    const auto& left = one.left.empty() ? damper_.visited : one.left;
    const auto along = [&](const DamperHypothesis* bent) {
      return unnamed_force_along(left, {damper_.unnamed_force, whole_gap()}, stroke, speed, bent,
                                 kUnnamedModes, kUnnamedLeft);
    };
    std::vector<ForceAlongPath> forces = {along(&one)};
    if (!forces.front().shifts.empty() && weight > kLittle) forces.push_back(along(nullptr));
    double added = 0.0;
    for (ForceAlongPath& force : forces) {
      if (force.modes.empty()) {
        warnings_.push_back(
            "it is not known which strokes and velocities the campaign visited, so the band holds "
            "no unnamed force");
        break;
      }
      for (auto& mode : prior_forces(one, conditions_, priors_, tested_speed(), t).modes)
        force.modes.push_back(std::move(mode));
      force.modes.insert(force.modes.end(), beside.begin(), beside.end());
      const double share = weight / static_cast<double>(forces.size());
      auto with = DropSurrogate::make(one, conditions_, share, &force, &t);
      if (!with) {
        warnings_.push_back("with an unnamed force the drop gives no answer: " + with.error().what);
        continue;
      }
      components_.push_back({share, std::move(*with)});
      added += share;
    }
    return added;
  }

  void draw(DropMixture& out) {
    double all = 0.0;
    for (const Component& one : components_)
      all += one.weight;
    std::vector<std::vector<WeightedValue>> found(kDropFigureCount);
    HistoryDraws histories;
    double lost = 0.0;
    for (Component& one : components_) {
      if (!(one.weight > 0.0)) continue;
      const double weight = one.weight / all;
      const int draws = std::max(400, static_cast<int>(weight * options_.draws));
      const DrawnFigures drawn = one.drop.draw(weight, draws, options_.exact_draws, random_);
      lost += weight * drawn.lost_share;
      for (const auto& figures : drawn.figures) {
        for (std::size_t f = 0; f < kDropFigureCount; ++f) {
          if (std::isfinite(figures[f]))
            found[f].push_back({figures[f], weight / static_cast<double>(drawn.figures.size())});
        }
      }
      one.drop.draw_history(weight, random_, histories);
    }
    out.bottoming_probability = lost;
    const double tail = 0.5 * (1.0 - options_.confidence);
    const DropSurrogate& first = components_.front().drop;
    for (std::size_t f = 0; f < kDropFigureCount; ++f) {
      MixtureBand band;
      band.value = first.center().figures[f];
      band.linear_error = first.linear_error(f);
      const double quantile = first.quantile(1.0 - tail);
      band.linear_lower = band.value - quantile * band.linear_error;
      band.linear_upper = band.value + quantile * band.linear_error;
      std::sort(found[f].begin(), found[f].end(),
                [](const auto& a, const auto& b) { return a.value < b.value; });
      band.lower = found[f].empty() ? band.value : weighted_quantile(found[f], tail);
      band.upper = found[f].empty() ? band.value : weighted_quantile(found[f], 1.0 - tail);
      band.median = band.value < band.lower || band.value > band.upper;
      if (band.median) band.value = weighted_quantile(found[f], 0.5);
      out.bands.push_back(band);
    }
    if (std::any_of(out.bands.begin(), out.bands.end(), [](const auto& b) { return b.median; }))
      out.warnings.emplace_back(
          "the answer of the diagnosis is outside of an interval, since other hypotheses are "
          "likelier "
          "in a drop: the value of such a figure is the median of all (value_of says so)");
    HistoryBand& band = out.history;
    band.t = histories.t;
    histories.ends(histories.stroke, tail, band.stroke_lower, band.stroke_upper);
    histories.ends(histories.speed, tail, band.speed_lower, band.speed_upper);
    histories.ends(histories.load, tail, band.load_lower, band.load_upper);
    out.drawn = std::move(found);
  }

  const IdentifiedDamper& damper_;
  const DropConditions& conditions_;
  const MixtureOptions& options_;
  ExtrapolationPriors priors_;
  std::mt19937_64 random_;
  std::vector<Component> components_;
  std::vector<std::string> warnings_;
};

}  // namespace

std::optional<DropConditions> zeroed_under_weight(const DamperHypothesis& measured,
                                                  DropConditions conditions) {
  const auto& lines = measured.model.effects;
  const auto joint = std::find_if(lines.begin(), lines.end(), [](const auto& line) {
    return line.effect == "series_compliance" && !line.in_series;
  });
  if (joint == lines.end()) return std::nullopt;
  const double stiffness =
      value_of(measured.model, {static_cast<std::size_t>(joint - lines.begin()), "k_n", false});
  conditions.extended = -measured.model.gravity / stiffness;
  return conditions;
}

double DropMixture::probability_within(std::size_t figure, double limit) const {
  double all = 0.0, within = 0.0;
  for (const WeightedValue& one : drawn.at(figure)) {
    all += one.weight;
    if (one.value <= limit) within += one.weight;
  }
  return (1.0 - bottoming_probability) * within / all;
}

Result<DropMixture> predict_drop(const IdentifiedDamper& damper, const DropConditions& conditions,
                                 const MixtureOptions& options) {
  return Mixer(damper, conditions, options).run();
}

}  // namespace shaker::estimator
