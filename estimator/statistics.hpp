// The few distribution functions that estimates need (Boost.Math behind them).
#pragma once

namespace shaker::estimator {

// Quantile of Student's t: student_t_quantile(0.975, 36) = 2.028. `degrees` may be fractional, > 0;
// infinite: of the normal distribution.
double student_t_quantile(double probability, double degrees);

// Probability of more than `value` under chi squared, and under Fisher's F.
double chi_squared_above(double value, double degrees);
double fisher_f_above(double value, double degrees1, double degrees2);

// Probability of a |t| of more than that under Student's t.
double student_t_two_sided(double t, double degrees);

// The first three derivatives of the logarithm of the gamma function, for x > 0.
double digamma(double x);
double trigamma(double x);
double tetragamma(double x);

}  // namespace shaker::estimator
