// The distribution functions that estimates need, computed by Boost.Math.
#pragma once

namespace shaker::estimator {

// Quantile of Student's t: student_t_quantile(0.975, 36) = 2.028. `degrees` is positive and may
// be fractional; infinite gives the normal distribution.
double student_t_quantile(double probability, double degrees);

// Probability of more than `value` for chi-squared and for Fisher's F. A negative value counts
// as 0.
double chi_squared_above(double value, double degrees);
double fisher_f_above(double value, double degrees1, double degrees2);

// Probability that |t| of Student's t exceeds the given one.
double student_t_two_sided(double t, double degrees);

// First, second and third derivative of the logarithm of the gamma function, for x > 0.
double digamma(double x);
double trigamma(double x);
double tetragamma(double x);

}  // namespace shaker::estimator
