#include "estimator/fit/several_starts.hpp"

#include <algorithm>
#include <cmath>
#include <random>

#include <boost/random/sobol.hpp>

namespace shaker::estimator {
namespace {

constexpr double kDecade = 10.0;
// Largest relative difference of two ends in one minimum.
constexpr double kMaxEndDifference = 1e-4;
// Of the unit cube's diagonal: least distance of two starts.
constexpr double kMinStartDistance = 0.05;
// Of a parameter that may be negative: how many times its start, or 1, the range goes to each side.
constexpr double kReach = 10.0;

struct Range {
  std::size_t parameter = 0;
  double low = 0.0, high = 1.0;
  bool logarithmic = false;
  double at(double share) const {
    return logarithmic ? low * std::pow(high / low, share) : low + share * (high - low);
  }
};

std::vector<Range> ranges_of(const Model& model, const std::vector<double>& start, double span) {
  std::vector<Range> ranges;
  for (std::size_t k = 0; k < start.size(); ++k) {
    const ModelParameter& p = model.parameters()[k];
    if (p.fixed) continue;
    Range range;
    range.parameter = k;
    const double reach = kReach * std::max(std::fabs(start[k]), 1.0);
    const bool positive = start[k] > 0.0 && p.lower >= 0.0;
    range.low = std::max(p.lower, positive ? start[k] / span : start[k] - reach);
    range.high = std::min(p.upper, positive ? start[k] * span : start[k] + reach);
    range.logarithmic = positive && range.high > kDecade * range.low;
    ranges.push_back(range);
  }
  return ranges;
}

struct Look {
  std::vector<double> share, theta;  // of the ranges; all parameters
  double sum_of_squares = 0.0;
};

// The points with a periodic solution, by increasing sum of squares.
std::vector<Look> look_around(Estimator& evaluator, const std::vector<double>& start,
                              const std::vector<Range>& ranges, int count, std::uint32_t seed) {
  boost::random::sobol sequence(ranges.size());
  std::mt19937 random(seed);
  std::vector<double> shift;
  for (std::size_t k = 0; k < ranges.size(); ++k)
    shift.push_back(std::uniform_real_distribution<double>(0.0, 1.0)(random));
  const double whole = static_cast<double>(boost::random::sobol::max()) + 1.0;
  std::vector<Look> looks;
  for (int i = 0; i < count; ++i) {
    Look look;
    look.theta = start;
    for (std::size_t k = 0; k < ranges.size(); ++k) {
      look.share.push_back(std::fmod(static_cast<double>(sequence()) / whole + shift[k], 1.0));
      look.theta[ranges[k].parameter] = ranges[k].at(look.share.back());
    }
    const Fit& fit = evaluator.fit(look.theta);
    if (fit.status == FitStatus::no_solution || !std::isfinite(fit.sum_of_squares)) continue;
    look.sum_of_squares = fit.sum_of_squares;
    looks.push_back(std::move(look));
  }
  std::stable_sort(looks.begin(), looks.end(), [](const Look& a, const Look& b) {
    return a.sum_of_squares < b.sum_of_squares;
  });
  return looks;
}

double distance(const std::vector<double>& a, const std::vector<double>& b) {
  double sum = 0.0;
  for (std::size_t k = 0; k < a.size(); ++k)
    sum += (a[k] - b[k]) * (a[k] - b[k]);
  return std::sqrt(sum);
}

std::vector<std::vector<double>> best_apart(const std::vector<Look>& looks, int count) {
  std::vector<const Look*> chosen;
  for (const Look& look : looks) {
    if (static_cast<int>(chosen.size()) >= count) break;
    const double apart = kMinStartDistance * std::sqrt(static_cast<double>(look.share.size()));
    if (std::all_of(chosen.begin(), chosen.end(),
                    [&](const Look* other) { return distance(other->share, look.share) > apart; }))
      chosen.push_back(&look);
  }
  std::vector<std::vector<double>> starts;
  for (const Look* look : chosen)
    starts.push_back(look->theta);
  return starts;
}

bool same_end(const std::vector<double>& a, const std::vector<double>& b) {
  for (std::size_t k = 0; k < a.size(); ++k) {
    if (std::fabs(a[k] - b[k]) > kMaxEndDifference * std::fabs(a[k])) return false;
  }
  return true;
}

void add(Minima& minima, const Fit& fit, const std::vector<double>& from) {
  for (Minimum& known : minima.found) {
    if (!same_end(known.theta, fit.theta)) continue;
    known.from.push_back(from);
    if (fit.sum_of_squares < known.sum_of_squares) {
      known.status = fit.status;
      known.theta = fit.theta;
      known.sum_of_squares = fit.sum_of_squares;
    }
    return;
  }
  minima.found.push_back({fit.status, fit.theta, fit.sum_of_squares, {from}});
}

}  // namespace

Minima several_starts(const Model& model, const std::vector<RunData>& runs,
                      const EstimationOptions& how, const std::vector<double>& start,
                      const StartOptions& options) {
  const std::vector<Range> ranges = ranges_of(model, start, options.span);
  Minima minima;
  std::vector<std::vector<double>> starts = {start};
  if (options.starts > 1 && !ranges.empty()) {
    EstimationOptions evaluated = how;  // full steps, of which there is none
    evaluated.method = Method::gauss_newton;
    evaluated.max_iterations = 0;
    Estimator evaluator(model, runs, evaluated);
    minima.looks = options.starts * options.looks;
    const auto looks = look_around(evaluator, start, ranges, minima.looks, options.seed);
    minima.admissible = static_cast<int>(looks.size());
    for (auto& theta : best_apart(looks, options.starts - 1))
      starts.push_back(std::move(theta));
  }
  EstimationOptions damped = how;
  damped.method = Method::levenberg_marquardt;
  Estimator estimator(model, runs, damped);
  for (const std::vector<double>& from : starts) {
    const Fit& fit = estimator.fit(from);
    if (fit.status != FitStatus::no_solution) add(minima, fit, from);
  }
  const auto converged = [](const Minimum& m) { return m.status == FitStatus::converged; };
  std::stable_sort(minima.found.begin(), minima.found.end(),
                   [&](const Minimum& a, const Minimum& b) {
                     if (converged(a) != converged(b)) return converged(a);
                     return a.sum_of_squares < b.sum_of_squares;
                   });
  return minima;
}

}  // namespace shaker::estimator
