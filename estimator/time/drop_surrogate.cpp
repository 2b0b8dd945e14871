#include "estimator/time/drop_surrogate.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include <Eigen/Dense>

#include "estimator/math/dense.hpp"
#include "estimator/statistics.hpp"
#include "estimator/time/excitation.hpp"

namespace shaker::estimator {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kStep = 2.0;           // standard deviations at which the drops beside are taken
constexpr double kCurved = 0.5;         // of the slope's part, that the bend's may be there
constexpr std::size_t kPathPoints = 90;     // of a force along the drop
constexpr std::size_t kHistoryEvery = 20;   // times of a history that have a band
constexpr int kHistoryDraws = 200;

double freedom_of_draws(const DamperHypothesis& damper) {
  return std::max(2.0, damper.degrees_of_freedom);
}

// Principal axes of the covariance, in units of the standard errors so that no unit counts.
std::vector<std::vector<double>> axes_of(const DamperHypothesis& damper) {
  const auto size = static_cast<Index>(damper.numbers.size());
  std::vector<std::vector<double>> axes;
  if (size == 0 || damper.covariance.size() != static_cast<std::size_t>(size * size)) return axes;
  MatrixXd v = Eigen::Map<const MatrixXd>(damper.covariance.data(), size, size);
  const VectorXd error = v.diagonal().cwiseMax(0.0).cwiseSqrt();
  const VectorXd inverse = error.unaryExpr([](double e) { return e > 0.0 ? 1.0 / e : 0.0; });
  v = inverse.asDiagonal() * v * inverse.asDiagonal();
  const Spectrum eigen = spectrum_of(0.5 * (v + v.transpose()));
  for (Index k = 0; k < size; ++k) {
    if (!(eigen.values[k] > 0.0)) continue;
    const VectorXd axis = std::sqrt(eigen.values[k]) * error.asDiagonal() * eigen.vectors.col(k);
    axes.emplace_back(axis.data(), axis.data() + size);
  }
  return axes;
}

}  // namespace

void HistoryDraws::into(double tail, std::vector<double>& times, std::vector<double>& stroke_lower,
                        std::vector<double>& stroke_upper, std::vector<double>& load_lower,
                        std::vector<double>& load_upper) const {
  times = t;
  const auto ends = [&](const std::vector<double>& values, std::vector<double>& lower,
                        std::vector<double>& upper) {
    std::vector<std::size_t> order(values.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::sort(order.begin(), order.end(),
              [&](std::size_t a, std::size_t b) { return values[a] < values[b]; });
    double all = 0.0, below = 0.0;
    for (const double w : weight)
      all += w;
    double low = values[order.front()], high = values[order.back()];
    for (const std::size_t i : order) {
      if (below <= tail * all) low = values[i];
      if (below <= (1.0 - tail) * all) high = values[i];
      below += weight[i];
    }
    lower.push_back(low);
    upper.push_back(high);
  };
  for (std::size_t i = 0; i < t.size(); ++i) {
    ends(stroke[i], stroke_lower, stroke_upper);
    ends(load[i], load_lower, load_upper);
  }
}

Result<DropSurrogate> DropSurrogate::make(const DamperHypothesis& damper,
                                          const DropConditions& conditions,
                                          const ForceAlongPath* force,
                                          const std::vector<double>* t) {
  DropSurrogate out;
  out.damper_ = damper;
  out.conditions_ = conditions;
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
  auto center = out.run_at({});
  if (!center) return center.error();
  out.center_ = std::move(*center);
  for (auto& numbers : axes_of(damper)) {
    Axis axis;
    axis.numbers = std::move(numbers);
    out.add_axis(std::move(axis));
  }
  for (std::size_t m = 0; m < out.force_.modes.size(); ++m) {
    Axis axis;
    axis.mode = m;
    out.add_axis(std::move(axis));
  }
  return out;
}

// One drop, `variates` in the order of the axes; those that are left out are 0.
Result<DropRun> DropSurrogate::run_at(const std::vector<double>& variates) const {
  std::vector<double> theta = test_->model().start();
  config::ModelSpec moved;
  bool constants = false;
  for (std::size_t k = 0; k < damper_.numbers.size(); ++k) {
    double step = 0.0;
    for (std::size_t a = 0; a < variates.size(); ++a) {
      if (!axes_[a].numbers.empty()) step += variates[a] * axes_[a].numbers[k];
    }
    if (step == 0.0) continue;
    if (parameter_of_[k] >= 0) {
      const auto at = static_cast<std::size_t>(parameter_of_[k]);
      const ModelParameter& p = test_->model().parameters()[at];
      theta[at] = std::clamp(theta[at] + step, p.lower, p.upper);
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
        if (axes_[a].numbers.empty()) x[i] -= variates[a] * force_.modes[axes_[a].mode][i];
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

// False where the axis changes nothing that could be found.
bool DropSurrogate::add_axis(Axis axis) {
  axes_.push_back(std::move(axis));
  Axis& own = axes_.back();
  std::vector<double> at(axes_.size(), 0.0);
  Result<DropRun> up = Error{}, down = Error{};
  double step = kStep;
  for (; step > 0.05; step *= 0.5) {
    at.back() = step;
    up = run_at(at);
    at.back() = -step;
    down = run_at(at);
    if (up || down) break;
  }
  if (!up && !down) {
    axes_.pop_back();
    return false;
  }
  own.one_sided = !up || !down;
  const DropRun& high = up ? *up : center_;
  const DropRun& low = down ? *down : center_;
  const double apart = (up ? step : 0.0) + (down ? step : 0.0);
  for (std::size_t f = 0; f < kDropFigureCount; ++f) {
    own.slope.push_back((high.figures[f] - low.figures[f]) / apart);
    own.bend.push_back(own.one_sided ? 0.0
                                     : (high.figures[f] + low.figures[f] -
                                        2.0 * center_.figures[f]) /
                                           (step * step));
  }
  for (std::size_t i = 0; i < center_.history.t.size(); i += kHistoryEvery) {
    own.stroke.push_back((high.history.stroke[i] - low.history.stroke[i]) / apart);
    own.load.push_back((high.history.load[i] - low.history.load[i]) / apart);
  }
  return true;
}

void DropSurrogate::path(std::vector<double>& t, std::vector<double>& stroke,
                         std::vector<double>& speed) const {
  const DropHistory& h = center_.history;
  // Even in time would miss the blow at touch-down: the points are closer there.
  for (std::size_t i = 0; i < kPathPoints; ++i) {
    const double share = static_cast<double>(i) / (kPathPoints - 1);
    const auto at = static_cast<std::size_t>(share * share * static_cast<double>(h.t.size() - 1));
    if (!t.empty() && h.t[at] <= t.back()) continue;
    t.push_back(h.t[at]);
    stroke.push_back(h.stroke[at]);
    speed.push_back(h.speed[at]);
  }
}

double DropSurrogate::linear_error(std::size_t figure) const {
  double squares = 0.0;
  for (const Axis& axis : axes_) {
    if (!axis.numbers.empty()) squares += axis.slope[figure] * axis.slope[figure];
  }
  return std::sqrt(squares);
}

double DropSurrogate::quantile(double probability) const {
  return student_t_quantile(probability, freedom_of_draws(damper_));
}

std::vector<double> DropSurrogate::variates(std::mt19937_64& random) const {
  std::normal_distribution<double> normal;
  const double freedom = freedom_of_draws(damper_);
  std::chi_squared_distribution<double> chi(freedom);
  const double spread = std::sqrt(freedom / chi(random));
  std::vector<double> z;
  for (const Axis& axis : axes_)
    z.push_back((axis.numbers.empty() ? 1.0 : spread) * normal(random));
  return z;
}

// Peak stroke and peak load: the others follow.
bool DropSurrogate::quadratic_enough() const {
  for (const std::size_t f : {std::size_t{0}, std::size_t{3}}) {
    double slopes = 0.0, bends = 0.0;
    for (const Axis& axis : axes_) {
      if (axis.one_sided) return false;
      slopes += axis.slope[f] * axis.slope[f];
      bends += axis.bend[f] * axis.bend[f];
    }
    if (0.5 * kStep * std::sqrt(bends) > kCurved * std::sqrt(slopes)) return false;
  }
  return true;
}

DrawnFigures DropSurrogate::draw(int draws, int exact_draws, std::mt19937_64& random) const {
  DrawnFigures out;
  if (!quadratic_enough()) {
    for (int i = 0; i < exact_draws; ++i) {
      const auto run = run_at(variates(random));
      if (run) out.figures.push_back(run->figures);
    }
    if (!out.figures.empty()) {
      out.lost_share = 1.0 - static_cast<double>(out.figures.size()) / exact_draws;
      return out;
    }
  }
  for (int i = 0; i < draws; ++i) {
    const auto z = variates(random);
    std::vector<double> figures = center_.figures;
    for (std::size_t a = 0; a < axes_.size(); ++a) {
      for (std::size_t f = 0; f < kDropFigureCount; ++f)
        figures[f] += axes_[a].slope[f] * z[a] + 0.5 * axes_[a].bend[f] * z[a] * z[a];
    }
    out.figures.push_back(std::move(figures));
  }
  return out;
}

void DropSurrogate::draw_history(double weight, std::mt19937_64& random,
                                 HistoryDraws& into) const {
  const DropHistory& h = center_.history;
  const std::size_t count = (h.t.size() + kHistoryEvery - 1) / kHistoryEvery;
  if (into.t.empty()) {
    for (std::size_t i = 0; i < h.t.size(); i += kHistoryEvery)
      into.t.push_back(h.t[i]);
    into.stroke.resize(count);
    into.load.resize(count);
  }
  for (int d = 0; d < kHistoryDraws; ++d) {
    const auto z = variates(random);
    for (std::size_t i = 0; i < count; ++i) {
      double stroke = h.stroke[i * kHistoryEvery], load = h.load[i * kHistoryEvery];
      for (std::size_t a = 0; a < axes_.size(); ++a) {
        stroke += z[a] * axes_[a].stroke[i];
        load += z[a] * axes_[a].load[i];
      }
      into.stroke[i].push_back(stroke);
      into.load[i].push_back(load);
    }
    into.weight.push_back(weight / kHistoryDraws);
  }
}

}  // namespace shaker::estimator
