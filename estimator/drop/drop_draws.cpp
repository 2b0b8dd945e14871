// Draws from the drop of one hypothesis (drop_surrogate.hpp).
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "estimator/drop/internal/drop_surrogate.hpp"
#include "estimator/math/statistics.hpp"

namespace shaker::estimator {
namespace {

constexpr std::size_t kPeakStroke = figure_called("peak_stroke");
constexpr double kCurved = 0.5;     // of the slope's part, that the bend's may be there
constexpr int kHistoryDraws = 300;  // of all parts together
constexpr int kFewestHistoryDraws = 25;
constexpr int kMostRedraws = 200;
constexpr int kFewestExactDraws = 15;

// The quadratic goes on beyond what a figure can be, and a random force may push where no damper
// can. What has no value (NaN) keeps none.
void keep_possible(std::vector<double>& figures) {
  for (std::size_t f = 0; f < kDropFigureCount; ++f)
    figures[f] = std::clamp(figures[f], kDropFigures[f].lower, kDropFigures[f].upper);
}

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
  const double freedom = std::min(kMostCampaignFreedom, freedom_of(damper_));
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
  figures[kPeakStroke] = std::min(figures[kPeakStroke], gas_end(z));
  return figures;
}

// The stroke at which no gas is left; infinite where something else ends the stroke.
double DropSurrogate::gas_end(const std::vector<double>& variates) const {
  const StrokeEnd end = test_->stroke_end(theta_at(variates));
  return end.by == StrokeEnd::By::gas ? end.stroke : std::numeric_limits<double>::infinity();
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
  for (auto& figures : out.figures)
    keep_possible(figures);
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
  const int draws =
      std::max(kFewestHistoryDraws, static_cast<int>(std::lround(weight * kHistoryDraws)));
  for (int d = 0; d < draws; ++d) {
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
    into.weight.push_back(weight / draws);
  }
}

}  // namespace shaker::estimator
