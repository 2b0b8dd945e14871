#include "estimator/drop/internal/drop_curves.hpp"

#include <algorithm>
#include <cmath>

namespace shaker::estimator {
namespace {

constexpr double kFirstSteps = 0.02;  // of equal steps, at the begin of a history
constexpr double kJumps = 8.0;        // times the bend beside: a curve that jumps

// The time's derivative over the index; exact, as the times are quadratic in it.
double time_rate(const std::vector<double>& t, std::size_t i) {
  if (i == 0) return 0.5 * (4.0 * t[1] - 3.0 * t[0] - t[2]);
  if (i + 1 == t.size()) return 0.5 * (3.0 * t[i] - 4.0 * t[i - 1] + t[i - 2]);
  return 0.5 * (t[i + 1] - t[i - 1]);
}

}  // namespace

double drop_time_share(double share) {
  return share * (kFirstSteps + (1.0 - kFirstSteps) * share);
}

double CurvePlace::of(const std::vector<double>& values) const {
  const std::size_t first = std::min(before > 0 ? before - 1 : 0, values.size() - 4);
  const double at = static_cast<double>(before - first) + share;
  double sum = 0.0;
  for (int i = 0; i < 4; ++i) {
    double weight = 1.0;
    for (int k = 0; k < 4; ++k) {
      if (k != i) weight *= (at - k) / (i - k);
    }
    sum += weight * values[first + static_cast<std::size_t>(i)];
  }
  return sum;
}

double CurvePlace::time(const std::vector<double>& t) const {
  return t[before] + share * (t[before + 1] - t[before]);
}

double linear_at(const std::vector<double>& t, const std::vector<double>& values, double time) {
  const auto above = std::upper_bound(t.begin(), t.end(), time) - t.begin();
  const auto i = static_cast<std::size_t>(
      std::clamp<std::ptrdiff_t>(above, 1, static_cast<std::ptrdiff_t>(t.size()) - 1));
  const double share = (time - t[i - 1]) / (t[i] - t[i - 1]);
  return values[i - 1] + share * (values[i] - values[i - 1]);
}

double value_at(const std::vector<double>& t, const std::vector<double>& value,
                const std::vector<double>& rate, const CurvePlace& p) {
  const double dt = t[p.before + 1] - t[p.before], s = p.share, s2 = s * s, s3 = s2 * s;
  return (2 * s3 - 3 * s2 + 1) * value[p.before] + (s3 - 2 * s2 + s) * dt * rate[p.before] +
         (3 * s2 - 2 * s3) * value[p.before + 1] + (s3 - s2) * dt * rate[p.before + 1];
}

CurvePlace turn_after(const std::vector<double>& rate, std::size_t from, double sign) {
  for (std::size_t i = from; i + 1 < rate.size(); ++i) {
    if (sign * rate[i] > 0.0 && sign * rate[i + 1] <= 0.0)
      return {i, rate[i] / (rate[i] - rate[i + 1])};
  }
  return {rate.size(), 0.0};
}

CurvePlace deepest_turn(const std::vector<double>& t, const std::vector<double>& value,
                        const std::vector<double>& rate) {
  CurvePlace deepest = turn_after(rate, 0, 1.0);
  for (CurvePlace next = deepest; next.before < t.size();
       next = turn_after(rate, next.before + 1, 1.0)) {
    if (value_at(t, value, rate, next) > value_at(t, value, rate, deepest)) deepest = next;
  }
  return deepest;
}

double work_between(const std::vector<double>& t, const std::vector<double>& load,
                    const std::vector<double>& speed, std::size_t from, std::size_t to) {
  const std::size_t n = t.size();
  const auto power = [&](std::size_t i) { return load[i] * speed[i] * time_rate(t, i); };
  double sum = 0.0;
  for (std::size_t i = from; i < to; ++i) {
    const double here = power(i), next = power(i + 1);
    if (i == 0 && n > 3) {
      sum += (9.0 * here + 19.0 * next - 5.0 * power(2) + power(3)) / 24.0;
      continue;
    }
    sum += 0.5 * (here + next);
    if (i > 0 && i + 2 < n) sum -= (power(i + 2) - next - here + power(i - 1)) / 24.0;
  }
  return sum;
}

CurveTop top_of(const std::vector<double>& t, const std::vector<double>& values) {
  const auto at =
      static_cast<std::size_t>(std::max_element(values.begin(), values.end()) - values.begin());
  const CurveTop plain = {values[at], t[at]};
  if (at < 2 || at + 2 >= values.size()) return plain;
  const auto bend = [&](std::size_t i) { return values[i + 1] - 2.0 * values[i] + values[i - 1]; };
  const double beside = std::min(std::fabs(bend(at - 1)), std::fabs(bend(at + 1)));
  if (!(bend(at) < 0.0) || -bend(at) > kJumps * beside) return plain;
  const double slope = 0.5 * (values[at + 1] - values[at - 1]);
  const double shift = -slope / bend(at);
  return {values[at] + 0.5 * slope * shift, t[at] + shift * time_rate(t, at)};
}

}  // namespace shaker::estimator
