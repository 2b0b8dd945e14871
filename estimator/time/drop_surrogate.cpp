#include "estimator/time/drop_surrogate.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "estimator/math/statistics.hpp"
#include "estimator/time/covariance_axes.hpp"
#include "estimator/time/excitation.hpp"

namespace shaker::estimator {
namespace {

constexpr double kStep = 2.0;            // standard deviations at which the drops beside are taken
constexpr double kCurved = 0.5;          // of the slope's part, that the bend's may be there
constexpr std::size_t kPathPoints = 90;  // of a force along the drop
constexpr std::size_t kHistoryEvery = 20;  // times of a history that have a band
constexpr int kHistoryDraws = 200;
constexpr int kMostRedraws = 200;
// Degrees of freedom of the draws: standard errors from a dozen cycles are not surer, whatever their
// pooled count says. With this the blind suite's intervals hold (docs/drop.md).
constexpr double kMostFreedom = 10.0;
constexpr double kPastRebound = 1.3;    // times until the rebound ends
constexpr double kLittleWeight = 0.05;  // of a part of the mixture that is worth few drops
constexpr double kLinearStep = 1.0;     // standard deviations, of an axis with one drop
constexpr int kFewestExactDraws = 25;

double freedom_of(const DamperHypothesis& damper) {
  return std::max(2.0, damper.degrees_of_freedom);
}

}  // namespace

void HistoryDraws::ends(const std::vector<std::vector<double>>& curve, double tail,
                        std::vector<double>& lower, std::vector<double>& upper) const {
  const double all = std::accumulate(weight.begin(), weight.end(), 0.0);
  for (const std::vector<double>& values : curve) {
    std::vector<std::size_t> order(values.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::sort(order.begin(), order.end(),
              [&](std::size_t a, std::size_t b) { return values[a] < values[b]; });
    double below = 0.0, low = values[order.front()], high = low;
    for (const std::size_t i : order) {
      if (below <= tail * all) low = values[i];
      if (below <= (1.0 - tail) * all) high = values[i];
      below += weight[i];
    }
    lower.push_back(low);
    upper.push_back(high);
  }
}

Result<DropSurrogate> DropSurrogate::make(const DamperHypothesis& damper,
                                          const DropConditions& conditions, double weight,
                                          const ForceAlongPath* force,
                                          const std::vector<double>* t) {
  DropSurrogate out;
  out.damper_ = damper;
  out.conditions_ = conditions;
  out.weight_ = weight;
  out.test_ = std::make_shared<const DropTest>(damper.model, conditions);
  if (force != nullptr && t != nullptr) {
    out.force_ = *force;
    out.force_t_ = *t;
  }
  const auto places = numbers_of(damper.model, out.test_->model());
  for (const ModelNumber& number : damper.numbers) {
    const auto at = std::find_if(places.begin(), places.end(), [&](const ModelNumber& p) {
      return !number.constant && p.line == number.line && p.symbol == number.symbol;
    });
    out.parameter_of_.push_back(at == places.end() ? -1 : static_cast<int>(at - places.begin()));
  }
  out.keep_within_bounds();
  auto center = out.run_at({});
  if (!center) return center.error();
  // What follows the rebound has no figure: the drops beside this one are shorter.
  out.conditions_.duration =
      std::min(conditions.duration, kPastRebound * end_of_rebound(center->history));
  out.test_ = std::make_shared<const DropTest>(damper.model, out.conditions_);
  auto shorter = out.run_at({});
  if (!shorter) return shorter.error();
  out.whole_ = std::move(*center);
  out.center_ = std::move(*shorter);
  if (!(weight > 0.0)) return out;
  std::vector<double> half_range;
  for (const int k : out.parameter_of_) {
    const ModelParameter* p =
        k < 0 ? nullptr : &out.test_->model().parameters()[static_cast<std::size_t>(k)];
    half_range.push_back(p == nullptr ? std::numeric_limits<double>::infinity()
                                      : 0.5 * (p->upper - p->lower));
  }
  for (auto& numbers : covariance_axes(damper, half_range)) {
    Axis axis;
    axis.numbers = std::move(numbers);
    out.add_axis(std::move(axis));
  }
  for (std::size_t m = 0; m < out.force_.modes.size(); ++m) {
    Axis axis;
    axis.mode = static_cast<int>(m);
    if (m < out.force_.shifts.size()) axis.numbers = out.force_.shifts[m];
    out.add_axis(std::move(axis));
  }
  return out;
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

// One drop, `variates` in the order of the axes; those that are left out are 0.
Result<DropRun> DropSurrogate::run_at(const std::vector<double>& variates) const {
  if (!admissible(variates)) return Error{ErrorKind::invalid, "outside of the bounds"};
  std::vector<double> theta = test_->model().start();
  config::ModelSpec moved;
  bool constants = false;
  for (std::size_t k = 0; k < damper_.numbers.size(); ++k) {
    const double step = step_of(k, variates);
    if (step == 0.0) continue;
    if (parameter_of_[k] >= 0) {
      const auto at = static_cast<std::size_t>(parameter_of_[k]);
      theta[at] += step;
    } else if (damper_.numbers[k].constant) {
      if (!constants) moved = damper_.model;
      constants = true;
      set_value(moved, damper_.numbers[k], value_of(moved, damper_.numbers[k]) + step);
    }
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
  if (!constants) return test_->run(theta, false, push);
  try {
    return DropTest(moved, conditions_).run(theta, false, push);
  } catch (const std::invalid_argument& error) {
    return Error{ErrorKind::invalid, error.what()};
  }
}

// Drops at the variates `first` and `second` (of the newest axis; the centre is 0) give slope and
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
    both(center_.figures[f], one.figures[f], beyond.figures[f], slope, bend);
    own.slope.push_back(slope);
    own.bend.push_back(bend);
  }
  double unused = 0.0;
  for (std::size_t i = 0; i < center_.history.t.size(); i += kHistoryEvery) {
    double slope = 0.0;
    both(center_.history.stroke[i], one.history.stroke[i], beyond.history.stroke[i], slope, unused);
    own.stroke.push_back(slope);
    both(center_.history.speed[i], one.history.speed[i], beyond.history.speed[i], slope, unused);
    own.speed.push_back(slope);
    both(center_.history.load[i], one.history.load[i], beyond.history.load[i], slope, unused);
    own.load.push_back(slope);
  }
}

// One drop at a standard deviation, on the side that has one.
bool DropSurrogate::add_linear_axis(Axis& own, std::vector<double> at) const {
  for (const double step : {kLinearStep, -kLinearStep}) {
    at.back() = step;
    const auto drop = run_at(at);
    if (!drop) continue;
    own.reach = kLinearStep;
    fit_axis(own, step, *drop, -step, nullptr);
    return true;
  }
  return false;
}

// Takes drops on either side of the estimate, or two on one side where the other has none (a bound,
// no drop). An axis along which no drop is found is left out.
void DropSurrogate::add_axis(Axis axis) {
  axes_.push_back(std::move(axis));
  Axis& own = axes_.back();
  std::vector<double> at(axes_.size(), 0.0);
  if (weight_ < kLittleWeight && add_linear_axis(own, at)) return;
  const auto drop_at = [&](double variate) {
    at.back() = variate;
    return run_at(at);
  };
  for (double step = kStep; step > 0.02; step *= 0.5) {
    const auto up = drop_at(step), down = drop_at(-step);
    if (!up && !down) continue;
    own.reach = step;
    if (up && down) return fit_axis(own, step, *up, -step, &*down);
    own.one_sided = true;
    const double side = up ? step : -step;
    const auto half = drop_at(0.5 * side);
    if (half) return fit_axis(own, side, up ? *up : *down, 0.5 * side, &*half);
  }
  axes_.pop_back();
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

double DropSurrogate::linear_error(std::size_t figure) const {
  double squares = 0.0;
  for (const Axis& axis : axes_) {
    if (axis.mode < 0) squares += axis.slope[figure] * axis.slope[figure];
  }
  return std::sqrt(squares);
}

double DropSurrogate::quantile(double probability) const {
  return student_t_quantile(probability, freedom_of(damper_));
}

std::vector<double> DropSurrogate::variates(std::mt19937_64& random) const {
  std::normal_distribution<double> normal;
  const double freedom = std::min(kMostFreedom, freedom_of(damper_));
  std::chi_squared_distribution<double> chi(freedom);
  const double spread = std::sqrt(freedom / chi(random));
  std::vector<double> z;
  for (const Axis& axis : axes_)
    z.push_back((axis.mode >= 0 ? 1.0 : spread) * normal(random));
  return z;
}

// Peak stroke and peak load: the others follow. An axis that could only be followed for a part of a
// standard error says too little.
bool DropSurrogate::quadratic_enough() const {
  for (const std::size_t f : {std::size_t{0}, std::size_t{3}}) {
    double slopes = 0.0, bends = 0.0;
    for (const Axis& axis : axes_) {
      if (axis.reach < 0.5 * kStep) return false;
      slopes += axis.slope[f] * axis.slope[f];
      bends += axis.bend[f] * axis.bend[f];
    }
    if (0.5 * kStep * std::sqrt(bends) > kCurved * std::sqrt(slopes)) return false;
  }
  return true;
}

std::vector<double> DropSurrogate::figures_at(const std::vector<double>& z) const {
  std::vector<double> figures = center_.figures;
  for (std::size_t a = 0; a < axes_.size(); ++a) {
    for (std::size_t f = 0; f < kDropFigureCount; ++f)
      figures[f] += axes_[a].slope[f] * z[a] + 0.5 * axes_[a].bend[f] * z[a] * z[a];
  }
  return figures;
}

// Draws outside of the bounds are drawn again.
std::vector<double> DropSurrogate::admissible_variates(std::mt19937_64& random) const {
  std::vector<double> z;
  for (int i = 0; i < kMostRedraws; ++i) {
    z = variates(random);
    if (admissible(z)) return z;
  }
  return std::vector<double>(axes_.size(), 0.0);
}

DrawnFigures DropSurrogate::draw(double weight, int draws, int exact_draws,
                                 std::mt19937_64& random) const {
  DrawnFigures out;
  const bool exact = weight > kLittleWeight && !quadratic_enough();
  const int worth =
      std::max(kFewestExactDraws, static_cast<int>(std::lround(weight * exact_draws)));
  const int wanted = exact ? worth : draws;
  int lost = 0;
  for (int i = 0; i < wanted; ++i) {
    const auto z = admissible_variates(random);
    if (!exact) {
      out.figures.push_back(figures_at(z));
      continue;
    }
    const auto run = run_at(z);
    if (run)
      out.figures.push_back(run->figures);
    else
      ++lost;
  }
  out.lost_share = static_cast<double>(lost) / wanted;
  if (out.figures.empty()) out.figures.push_back(center_.figures);
  return out;
}

// The times are those of the first part that is drawn; another part's curves are interpolated.
void DropSurrogate::draw_history(double weight, std::mt19937_64& random, HistoryDraws& into) const {
  const DropHistory& h = center_.history;
  if (into.t.empty()) {
    for (std::size_t i = 0; i < h.t.size(); i += kHistoryEvery)
      into.t.push_back(h.t[i]);
    for (auto* curve : {&into.stroke, &into.speed, &into.load})
      curve->resize(into.t.size());
  }
  const auto at = [&](const std::vector<double>& values, double place) {
    const double inside = std::min(place, static_cast<double>(values.size() - 1));
    const auto below = std::min(static_cast<std::size_t>(inside), values.size() - 2);
    return values[below] +
           (inside - static_cast<double>(below)) * (values[below + 1] - values[below]);
  };
  const auto place_of = [&](double t) {
    const auto next = std::upper_bound(h.t.begin() + 1, h.t.end() - 1, t);
    const double begin = *(next - 1);
    return static_cast<double>(next - 1 - h.t.begin()) + (t - begin) / (*next - begin);
  };
  for (int d = 0; d < kHistoryDraws; ++d) {
    const auto z = admissible_variates(random);
    for (std::size_t i = 0; i < into.t.size(); ++i) {
      const double place = place_of(into.t[i]);
      const auto drawn = [&](const std::vector<double>& center, const auto slopes) {
        double value = at(center, place);
        for (std::size_t a = 0; a < axes_.size(); ++a)
          value += z[a] * at(axes_[a].*slopes, place / kHistoryEvery);
        return value;
      };
      into.stroke[i].push_back(drawn(h.stroke, &Axis::stroke));
      into.speed[i].push_back(drawn(h.speed, &Axis::speed));
      into.load[i].push_back(drawn(h.load, &Axis::load));
    }
    into.weight.push_back(weight / kHistoryDraws);
  }
}

}  // namespace shaker::estimator
