#include "estimator/statistics.hpp"

#include <boost/math/distributions/students_t.hpp>

namespace shaker::estimator {

double student_t_quantile(double probability, double degrees) {
  return boost::math::quantile(boost::math::students_t(degrees), probability);
}

}  // namespace shaker::estimator
