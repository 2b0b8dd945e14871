// The few distribution functions that estimates need (Boost.Math behind them).
#pragma once

namespace shaker::estimator {

// Quantile of Student's t: student_t_quantile(0.975, 36) = 2.028. `degrees` may be fractional, > 0.
double student_t_quantile(double probability, double degrees);

}  // namespace shaker::estimator
