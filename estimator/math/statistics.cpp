#include "estimator/math/statistics.hpp"

#include <algorithm>
#include <cmath>

#include <boost/math/distributions/chi_squared.hpp>
#include <boost/math/distributions/fisher_f.hpp>
#include <boost/math/distributions/normal.hpp>
#include <boost/math/distributions/students_t.hpp>
#include <boost/math/special_functions/digamma.hpp>
#include <boost/math/special_functions/trigamma.hpp>

namespace shaker::estimator {

double student_t_quantile(double probability, double degrees) {
  if (std::isinf(degrees)) return boost::math::quantile(boost::math::normal(), probability);
  return boost::math::quantile(boost::math::students_t(degrees), probability);
}

double chi_squared_above(double value, double degrees) {
  // Many data without noise: the result differs from 1 by less than the smallest double, and
  // Boost cannot represent it.
  constexpr double kMinDegreesForLimit = 1000.0, kMaxRatioForLimit = 0.1;
  if (degrees > kMinDegreesForLimit && value < kMaxRatioForLimit * degrees) return 1.0;
  return boost::math::cdf(
      boost::math::complement(boost::math::chi_squared(degrees), std::max(value, 0.0)));
}

double fisher_f_above(double value, double degrees1, double degrees2) {
  return boost::math::cdf(
      boost::math::complement(boost::math::fisher_f(degrees1, degrees2), std::max(value, 0.0)));
}

double student_t_two_sided(double t, double degrees) {
  return 2.0 *
         boost::math::cdf(boost::math::complement(boost::math::students_t(degrees), std::fabs(t)));
}

double digamma(double x) {
  return boost::math::digamma(x);
}
double trigamma(double x) {
  return boost::math::trigamma(x);
}
// Boost's takes a hundred times as long. The series is exact to 1e-12 of its first term from kFar on.
double tetragamma(double x) {
  constexpr double kFar = 12.0;
  double sum = 0.0;
  for (; x < kFar; x += 1.0)
    sum -= 2.0 / (x * x * x);
  const double s = 1.0 / (x * x);
  const double even = 0.5 - s * (1.0 / 6.0 - s * (1.0 / 6.0 - s * (0.3 - s * (5.0 / 6.0))));
  return sum - s * (1.0 + 1.0 / x + s * even);
}

}  // namespace shaker::estimator
