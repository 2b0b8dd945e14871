#include "estimator/paper/optimisers/several_starts.hpp"

#include <algorithm>
#include <cmath>
#include <random>

#include <boost/random/sobol.hpp>

#include "estimator/paper/optimisers/evaluator.hpp"

namespace shaker::estimator::optimisers {
namespace {

constexpr double kDecade = 10.0;
constexpr double kMaxEndDifference =
    1e-4;  // largest relative difference of two ends in one minimum
constexpr double kMinStartDistance =
    0.05;  // of the unit cube's diagonal: least distance of two starts

struct Range {
  double low = 0.0, high = 1.0;
  bool logarithmic = false;
  double at(double share) const {
    return logarithmic ? low * std::pow(high / low, share) : low + share * (high - low);
  }
};

Range range_of(double start, double lower, double upper, double span) {
  Range range;
  if (start > 0.0 && lower >= 0.0) {
    range.low = std::max(lower, start / span);
    range.high = std::min(upper, start * span);
    range.logarithmic = range.high > kDecade * range.low;
  } else {
    const double reach = 10.0 * std::max(std::fabs(start), 1.0);
    range.low = std::max(lower, start - reach);
    range.high = std::min(upper, start + reach);
  }
  return range;
}

struct Look {
  Eigen::VectorXd unit, theta;
  double phi = 0.0;
};

std::vector<Look> look_around(Evaluator& evaluator, const std::vector<Range>& ranges, int count,
                              std::uint32_t seed) {
  const std::size_t p = ranges.size();
  boost::random::sobol sequence(p);
  std::mt19937 random(seed);
  std::vector<double> shift;
  for (std::size_t k = 0; k < p; ++k)
    shift.push_back(std::uniform_real_distribution<double>(0.0, 1.0)(random));
  const double whole = static_cast<double>(boost::random::sobol::max()) + 1.0;
  std::vector<Look> looks;
  for (int i = 0; i < count; ++i) {
    Point point;
    point.theta.resize(static_cast<Eigen::Index>(p));
    Look look;
    look.unit.resize(static_cast<Eigen::Index>(p));
    for (std::size_t k = 0; k < p; ++k) {
      const double share = std::fmod(static_cast<double>(sequence()) / whole + shift[k], 1.0);
      look.unit[static_cast<Eigen::Index>(k)] = share;
      point.theta[static_cast<Eigen::Index>(k)] = ranges[k].at(share);
    }
    if (!evaluator.at(point, false)) continue;
    look.theta = point.theta;
    look.phi = point.phi;
    looks.push_back(std::move(look));
  }
  std::stable_sort(looks.begin(), looks.end(),
                   [](const Look& a, const Look& b) { return a.phi < b.phi; });
  return looks;
}

std::vector<Eigen::VectorXd> best_apart(const std::vector<Look>& looks, int count) {
  std::vector<const Look*> chosen;
  for (const Look& look : looks) {
    if (static_cast<int>(chosen.size()) >= count) break;
    const double apart = kMinStartDistance * std::sqrt(static_cast<double>(look.unit.size()));
    const bool fresh = std::all_of(chosen.begin(), chosen.end(), [&](const Look* other) {
      return (other->unit - look.unit).norm() > apart;
    });
    if (fresh) chosen.push_back(&look);
  }
  std::vector<Eigen::VectorXd> starts;
  for (const Look* look : chosen)
    starts.push_back(look->theta);
  return starts;
}

bool same(const Summary& a, const Summary& b) {
  return relative(a.theta - b.theta, a.theta) <= kMaxEndDifference;
}

void add(Minima& minima, const Summary& summary, const Eigen::VectorXd& from) {
  for (Minimum& known : minima.found) {
    if (!same(known.summary, summary)) continue;
    ++known.hits;
    known.from.push_back(from);
    if (summary.sum_of_squares < known.summary.sum_of_squares) known.summary = summary;
    return;
  }
  minima.found.push_back({summary, 1, {from}});
}

}  // namespace

Minima several_starts(LeastSquaresProblem& problem, const Eigen::VectorXd& start,
                      const Method& method, const Options& options, const StartOptions& wanted) {
  Evaluator evaluator(problem, {});
  const Eigen::VectorXd lower = problem.lower(), upper = problem.upper();
  std::vector<Range> ranges;
  for (Eigen::Index k = 0; k < start.size(); ++k)
    ranges.push_back(range_of(start[k], lower[k], upper[k], wanted.span));
  Minima minima;
  std::vector<Eigen::VectorXd> starts = {start};
  if (wanted.starts > 1 && start.size() > 0) {
    minima.looks = wanted.starts * wanted.looks;
    const auto looks = look_around(evaluator, ranges, minima.looks, wanted.seed);
    minima.admissible = static_cast<int>(looks.size());
    for (auto& theta : best_apart(looks, wanted.starts - 1))
      starts.push_back(std::move(theta));
  }
  for (const Eigen::VectorXd& from : starts) {
    const Summary summary = method.minimise(problem, from, options);
    if (summary.status != Status::inadmissible) add(minima, summary, from);
  }
  const auto converged = [](const Minimum& m) { return m.summary.status == Status::converged; };
  std::stable_sort(minima.found.begin(), minima.found.end(),
                   [&](const Minimum& a, const Minimum& b) {
                     if (converged(a) != converged(b)) return converged(a);
                     return a.summary.sum_of_squares < b.summary.sum_of_squares;
                   });
  return minima;
}

}  // namespace shaker::estimator::optimisers
