#include "estimator/drop/internal/drop_surrogate.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "estimator/drop/internal/covariance_axes.hpp"
#include "estimator/solve/time/excitation.hpp"

namespace shaker::estimator {
namespace {

constexpr std::size_t kPathPoints = 90;        // of a force along the drop
constexpr double kPastRebound = 1.3;           // times until the rebound ends
constexpr double kLinearStep = 1.0;            // standard deviations, of an axis with one drop
constexpr std::size_t kLeading[] = {0, 3, 9};  // peak stroke, peak load, efficiency
constexpr double kRough = 1e-6;                // tolerance of a drop beside the estimates
constexpr int kRoughSteps = 600;               // in its history
constexpr double kInaccurate = 0.02;  // of what a standard deviation moves, that this may cost
constexpr double kMinor = 0.1;        // of what all axes move, by an axis whose bend is left out

}  // namespace

Result<DropSurrogate> DropSurrogate::make(const DamperHypothesis& damper,
                                          const DropConditions& conditions, double weight,
                                          const ForceAlongPath* force,
                                          const std::vector<double>* t) {
  DropSurrogate out;
  out.damper_ = damper;
  out.conditions_ = conditions;
  out.whole_duration_ = conditions.duration;
  out.weight_ = weight;
  out.test_ = std::make_shared<const DropTest>(damper.model, conditions);
  if (force != nullptr && t != nullptr) {
    out.force_ = *force;
    out.force_t_ = *t;
  }
  const auto places = numbers_of(out.test_->model());
  for (const ModelNumber& number : damper.numbers) {
    const auto at = std::find_if(places.begin(), places.end(), [&](const ModelNumber& p) {
      return !number.constant && p.line == number.line && p.symbol == number.symbol;
    });
    out.parameter_of_.push_back(at == places.end() ? -1 : static_cast<int>(at - places.begin()));
  }
  out.keep_within_bounds();
  out.effort_ = {kRough, false, kRoughSteps};
  const auto rough = out.run_at({});
  if (!rough) return rough.error();
  // What follows the rebound has no figure: the drops beside this one are shorter.
  out.conditions_.duration =
      std::min(conditions.duration, kPastRebound * end_of_rebound(rough->history));
  out.test_ = std::make_shared<const DropTest>(damper.model, out.conditions_);
  out.effort_ = {};
  out.effort_.stiff = rough->stiff;
  auto center = out.run_at({});
  if (!center) return center.error();
  out.center_ = std::move(*center);
  if (!(weight > 0.0)) return out;
  out.effort_ = {kRough, rough->stiff, kRoughSteps};
  const auto wanted = out.wanted_axes();
  auto probes = out.probe_axes(wanted);
  if (!out.accurate_enough(probes)) {
    out.effort_ = {};
    out.effort_.stiff = out.center_.stiff;
    probes = out.probe_axes(wanted);
  }
  out.follow(probes);
  return out;
}

// The principal axes of the covariance, and those of the force.
std::vector<DropSurrogate::Axis> DropSurrogate::wanted_axes() const {
  std::vector<double> half_range;
  for (const int k : parameter_of_) {
    const ModelParameter* p =
        k < 0 ? nullptr : &test_->model().parameters()[static_cast<std::size_t>(k)];
    half_range.push_back(p == nullptr ? std::numeric_limits<double>::infinity()
                                      : 0.5 * (p->upper - p->lower));
  }
  std::vector<Axis> axes;
  for (auto& numbers : covariance_axes(damper_, half_range)) {
    axes.emplace_back();
    axes.back().numbers = std::move(numbers);
  }
  for (std::size_t m = 0; m < force_.modes.size(); ++m) {
    axes.emplace_back();
    axes.back().mode = static_cast<int>(m);
    if (m < force_.shifts.size()) axes.back().numbers = force_.shifts[m];
  }
  return axes;
}

// The numbers with the mean force are no farther than at their bounds.
void DropSurrogate::keep_within_bounds() {
  for (std::size_t k = 0; k < force_.mean_shift.size(); ++k) {
    if (parameter_of_[k] < 0) continue;
    const ModelParameter& p =
        test_->model().parameters()[static_cast<std::size_t>(parameter_of_[k])];
    force_.mean_shift[k] = std::clamp(force_.mean_shift[k], p.lower - p.start, p.upper - p.start);
  }
}

// How far a number is from the estimate.
double DropSurrogate::step_of(std::size_t number, const std::vector<double>& variates) const {
  double step = force_.mean_shift.empty() ? 0.0 : force_.mean_shift[number];
  for (std::size_t a = 0; a < variates.size(); ++a) {
    if (!axes_[a].numbers.empty()) step += variates[a] * axes_[a].numbers[number];
  }
  return step;
}

// Within the bounds of the model's parameters.
bool DropSurrogate::admissible(const std::vector<double>& variates) const {
  for (std::size_t k = 0; k < damper_.numbers.size(); ++k) {
    if (parameter_of_[k] < 0) continue;
    const ModelParameter& p =
        test_->model().parameters()[static_cast<std::size_t>(parameter_of_[k])];
    const double value = p.start + step_of(k, variates);
    const double rounding = 1e-9 * std::fabs(p.start);
    if (value < p.lower - rounding || value > p.upper + rounding) return false;
  }
  return true;
}

// The model's parameters.
std::vector<double> DropSurrogate::theta_at(const std::vector<double>& variates) const {
  std::vector<double> theta = test_->model().start();
  for (std::size_t k = 0; k < damper_.numbers.size(); ++k) {
    if (parameter_of_[k] >= 0)
      theta[static_cast<std::size_t>(parameter_of_[k])] += step_of(k, variates);
  }
  return theta;
}

// One drop, `variates` in the order of the axes; those that are left out are 0.
Result<DropRun> DropSurrogate::run_at(const std::vector<double>& variates) const {
  if (!admissible(variates)) return Error{ErrorKind::invalid, "outside of the bounds"};
  const std::vector<double> theta = theta_at(variates);
  config::ModelSpec moved;
  bool constants = false;
  for (std::size_t k = 0; k < damper_.numbers.size(); ++k) {
    const double step = step_of(k, variates);
    if (step == 0.0 || parameter_of_[k] >= 0 || !damper_.numbers[k].constant) continue;
    if (!constants) moved = damper_.model;
    constants = true;
    set_value(moved, damper_.numbers[k], value_of(moved, damper_.numbers[k]) + step);
  }
  std::vector<double> x;
  if (!force_t_.empty()) {
    x.assign(force_t_.size(), 0.0);
    for (std::size_t i = 0; i < x.size(); ++i) {
      x[i] = -force_.mean[i];
      for (std::size_t a = 0; a < variates.size(); ++a) {
        const int mode = axes_[a].mode;
        if (mode >= 0) x[i] -= variates[a] * force_.modes[static_cast<std::size_t>(mode)][i];
      }
    }
  }
  const Excitation push = x.empty() ? Excitation() : Excitation::sampled(force_t_, x);
  if (!constants) return test_->run(theta, false, push, effort_);
  try {
    return DropTest(moved, conditions_).run(theta, false, push, effort_);
  } catch (const std::invalid_argument& error) {
    return Error{ErrorKind::invalid, error.what()};
  }
}

Result<DropRun> DropSurrogate::whole() const {
  DropConditions all = conditions_;
  all.duration = whole_duration_;
  return DropTest(damper_.model, all).run(test_->model().start(), false);
}

Result<DropRun> DropSurrogate::run_along(std::size_t axis, double variate) const {
  std::vector<double> at(axis + 1, 0.0);
  at.back() = variate;
  return run_at(at);
}

// Drops at the variates `first` and `second` (of one axis; the centre is 0) give slope and
// bend of everything along it; the first alone gives the slope.
void DropSurrogate::fit_axis(Axis& own, double first, const DropRun& one, double second,
                             const DropRun* other) const {
  const auto both = [&](double centre, double a, double b, double& slope, double& bend) {
    const double da = (a - centre) / first, db = (b - centre) / second;
    bend = other == nullptr ? 0.0 : 2.0 * (da - db) / (first - second);
    slope = da - 0.5 * bend * first;
  };
  const DropRun& beyond = other == nullptr ? one : *other;
  for (std::size_t f = 0; f < kDropFigureCount; ++f) {
    double slope = 0.0, bend = 0.0;
    both(beside_.figures[f], one.figures[f], beyond.figures[f], slope, bend);
    own.slope.push_back(slope);
    own.bend.push_back(bend);
  }
  double unused = 0.0;
  const std::size_t every =
      kHistoryEvery * (beside_.history.t.size() - 1) / (center_.history.t.size() - 1);
  for (std::size_t i = 0; i < beside_.history.t.size(); i += every) {
    double slope = 0.0;
    both(beside_.history.stroke[i], one.history.stroke[i], beyond.history.stroke[i], slope, unused);
    own.stroke.push_back(slope);
    both(beside_.history.speed[i], one.history.speed[i], beyond.history.speed[i], slope, unused);
    own.speed.push_back(slope);
    both(beside_.history.load[i], one.history.load[i], beyond.history.load[i], slope, unused);
    own.load.push_back(slope);
  }
}

// The drop nearest to the wanted distance, on the side that has one; nothing where none is found (a
// bound, no drop).
std::optional<DropSurrogate::Probe> DropSurrogate::probe(std::size_t axis) const {
  const double first = weight_ < kLittleWeight ? kLinearStep : kStep;
  for (double step = first; step > 0.02; step *= 0.5) {
    for (const double side : {step, -step}) {
      if (auto drop = run_along(axis, side)) return Probe{side, std::move(*drop)};
    }
  }
  return std::nullopt;
}

// The axes along which a drop is found, each with that drop.
std::vector<DropSurrogate::Probe> DropSurrogate::probe_axes(const std::vector<Axis>& wanted) {
  axes_.clear();
  std::vector<Probe> probes;
  if (auto base = run_at({}))
    beside_ = std::move(*base);
  else
    beside_ = center_;
  for (const Axis& axis : wanted) {
    axes_.push_back(axis);
    if (auto found = probe(axes_.size() - 1))
      probes.push_back(std::move(*found));
    else
      axes_.pop_back();
  }
  return probes;
}

// How far all axes together move each figure, for one standard deviation.
std::vector<double> DropSurrogate::spread_of(const std::vector<Probe>& probes) const {
  std::vector<double> spread(kDropFigureCount, 0.0);
  for (std::size_t f = 0; f < spread.size(); ++f) {
    for (const Probe& probe : probes)
      spread[f] += std::pow((probe.run.figures[f] - beside_.figures[f]) / probe.variate, 2);
    spread[f] = std::sqrt(spread[f]);
  }
  return spread;
}

bool DropSurrogate::accurate_enough(const std::vector<Probe>& probes) const {
  const auto spread = spread_of(probes);
  return std::all_of(std::begin(kLeading), std::end(kLeading), [&](std::size_t f) {
    return !(std::fabs(beside_.figures[f] - center_.figures[f]) > kInaccurate * spread[f]);
  });
}

bool DropSurrogate::matters(const Probe& probe, const std::vector<double>& spread) const {
  return std::any_of(std::begin(kLeading), std::end(kLeading), [&](std::size_t f) {
    const double moved = std::fabs(probe.run.figures[f] - beside_.figures[f]);
    return moved > kMinor * spread[f] * std::fabs(probe.variate);
  });
}

// Takes a second drop along each axis that matters: on the other side of the estimate, or half-way
// where that has none.
void DropSurrogate::follow(const std::vector<Probe>& probes) {
  const auto spread = spread_of(probes);
  for (std::size_t a = 0; a < probes.size(); ++a) {
    const Probe& one = probes[a];
    Axis& own = axes_[a];
    own.reach = std::fabs(one.variate);
    std::optional<DropRun> other;
    double second = -one.variate;
    if (weight_ >= kLittleWeight && matters(one, spread)) {
      for (const double variate : {-one.variate, 0.5 * one.variate}) {
        auto drop = run_along(a, variate);
        if (!drop) continue;
        other = std::move(*drop);
        second = variate;
        break;
      }
    }
    fit_axis(own, one.variate, one.run, second, other ? &*other : nullptr);
  }
}

void DropSurrogate::path(std::vector<double>& t, std::vector<double>& stroke,
                         std::vector<double>& speed) const {
  const DropHistory& h = center_.history;
  for (std::size_t i = 0; i < kPathPoints; ++i) {
    const double share = static_cast<double>(i) / (kPathPoints - 1);
    const auto at = static_cast<std::size_t>(share * static_cast<double>(h.t.size() - 1));
    if (!t.empty() && h.t[at] <= t.back()) continue;
    t.push_back(h.t[at]);
    stroke.push_back(h.stroke[at]);
    speed.push_back(h.speed[at]);
  }
}

}  // namespace shaker::estimator
