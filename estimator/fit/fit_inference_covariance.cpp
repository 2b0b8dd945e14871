// Contributions that widen the covariance (3.27) of an estimate: the error of the measured
// excitation, and a covariance of the data that is estimated from few cycles.
#include <algorithm>
#include <cmath>

#include "estimator/fit/internal/fit_inference.hpp"
#include "estimator/math/statistics.hpp"

namespace shaker::estimator {
namespace {

void multiply(const std::vector<double>& a, const std::vector<double>& b, std::vector<double>& out,
              std::size_t q) {
  for (std::size_t i = 0; i < q; ++i) {
    for (std::size_t j = 0; j < q; ++j) {
      double sum = 0.0;
      for (std::size_t k = 0; k < q; ++k)
        sum += a[i * q + k] * b[k * q + j];
      out[i * q + j] = sum;
    }
  }
}

}  // namespace

// Adds the contribution of the excitation's error. The excitation is measured with a noisy sensor,
// and its error shifts the parameters in the same way at all points of the period. With S the
// response to a harmonic of the excitation and e that harmonic's standard error, theta moves by
// H^-1 J^T W S e. The contributions of independent parts add up. Without them the intervals are too
// narrow by the ratio of that error to the displacement's own noise: 1.6 for an accelerometer of
// 5e-3 m/s^2 beside 2e-5 m. In a record of m periods the excitation's harmonics are the m-th,
// 2 m-th, ... of the record.
void FitInference::add_excitation_error() {
  constexpr int kHarmonics = 3;  // the response to higher ones is small
  constexpr std::size_t kParts = 2 * kHarmonics;
  const std::size_t q = data_.free.size();
  std::vector<double> response;
  for (std::size_t r = 0; r < data_.runs.size(); ++r) {
    const RunState& run = data_.runs[r];
    const double error = run.data.excitation_error;
    const int periods = run.data.periods;
    if (!(error > 0.0) ||
        !solutions_.systems[r].excitation_response(kHarmonics * periods, response))
      continue;
    const auto stride = static_cast<std::size_t>(periods);
    std::vector<double> moved(q * kParts, 0.0);
    std::size_t j = 0;
    const int s = data_.model.coordinates();
    data_.for_each_datum(
        r, solutions_.systems[r], false, [&](const double* row, double, double weight) {
          const auto add = [&](int point, double share) {
            const double* parts =
                &response[static_cast<std::size_t>(point * s + data_.model.observed()) * kParts *
                          stride];
            for (std::size_t a = 0; a < q; ++a) {
              const double w = weight * row[1 + data_.free[a]] * share;
              for (std::size_t m = 0; m < kParts; ++m)
                moved[a * kParts + m] += w * parts[2 * ((m / 2 + 1) * stride - 1) + m % 2];
            }
          };
          const int n = solutions_.systems[r].points();
          if (run.harmonic()) {
            for (int i = 0; i < n; ++i)
              add(i, run.projector[static_cast<std::size_t>(i) * run.count() + j]);
          } else {
            const GridReading& reading = run.readings[j];
            for (int k = 0; k < reading.count; ++k)
              add((reading.base + k) % n, reading.weight[k]);
          }
          ++j;
        });
    for (std::size_t m = 0; m < kParts; ++m) {
      std::vector<double> shift(q, 0.0);
      for (std::size_t a = 0; a < q; ++a) {
        for (std::size_t b = 0; b < q; ++b)
          shift[a] += inverse_gram_[a * q + b] * moved[b * kParts + m];
      }
      for (std::size_t a = 0; a < q; ++a) {
        for (std::size_t b = 0; b < q; ++b)
          fit_.covariance[a * q + b] += error * error * shift[a] * shift[b];
      }
    }
  }
}

// Adjusts for a data covariance S that is estimated from few cycles (nu degrees of freedom). Such
// an S is itself uncertain, and intervals that take it as exact are too narrow. For one run and a
// linear model Rao (1965) gives the exact answer. With m data, q parameters and T^2 the weighted
// sum of squared residuals,
//   (theta - truth) / sqrt(f c),  f = nu / (nu - m + q) (1 + T^2 / nu),  c of (J^T S^-1 J)^-1,
// has Student's t distribution with nu - m + q degrees of freedom. With several runs each has its
// own f_r. Its share q_r of the parameters is the trace of its information times the inverse of the
// total information, and the degrees of freedom follow Satterthwaite.
void FitInference::adjust_for_estimated_covariance() {
  const std::size_t q = data_.free.size();
  const std::vector<double> inverse = fit_.covariance;
  std::vector<double> middle(q * q, 0.0), own(q * q), half(q * q);
  double shares = 0.0, shares_over_degrees = 0.0;
  double lack = 0.0, lack_degrees = 0.0;
  bool estimated = false;
  for (std::size_t r = 0; r < data_.runs.size(); ++r) {
    std::fill(own.begin(), own.end(), 0.0);
    double left = 0.0;
    data_.for_each_datum(
        r, solutions_.systems[r], false, [&](const double* row, double residual, double weight) {
          left += weight * residual * residual;
          for (std::size_t k = 0; k < q; ++k) {
            for (std::size_t l = 0; l < q; ++l)
              own[k * q + l] += weight * row[1 + data_.free[k]] * row[1 + data_.free[l]];
          }
        });
    double share = 0.0;
    for (std::size_t i = 0; i < q * q; ++i)
      share += std::isfinite(inverse[i]) ? inverse[i] * own[i] : 0.0;
    const double surplus = static_cast<double>(data_.runs[r].count()) - share;
    double factor = 1.0;
    const double nu = data_.runs[r].data.covariance_degrees;
    if (nu > 0.0) {
      estimated = true;
      const double degrees = nu - surplus;
      factor = nu / degrees * (1.0 + left / nu);
      shares_over_degrees += share * factor * share * factor / degrees;
      // The expectation of T^2 with an estimated S is nu / (nu - surplus - 1) surplus: scale back.
      lack += left * std::max(degrees - 1.0, 0.5) / nu;
    } else {
      lack += left;
    }
    lack_degrees += surplus;
    shares += share * factor;
    for (std::size_t i = 0; i < q * q; ++i)
      middle[i] += factor * own[i];
  }
  if (!estimated) return;
  if (shares_over_degrees > 0.0) fit_.interval_degrees = shares * shares / shares_over_degrees;
  if (data_.runs.size() == 1 && !data_.priors) {  // Hotelling: exact
    const double nu = data_.runs[0].data.covariance_degrees;
    const double degrees = nu - lack_degrees + 1.0;
    const double f = fit_.sum_of_squares * degrees / (nu * lack_degrees);
    fit_.lack_of_fit = fisher_f_above(f, lack_degrees, degrees);
  } else if (!data_.priors) {
    fit_.lack_of_fit = chi_squared_above(lack, lack_degrees);
  }
  // The information of a prior is exact: it has no factor.
  for (std::size_t k = 0; k < q; ++k) {
    const ModelParameter& p = data_.model.parameters()[static_cast<std::size_t>(data_.free[k])];
    if (p.prior_mean)
      middle[k * q + k] += 1.0 / (*p.prior_standard_deviation * *p.prior_standard_deviation);
  }
  multiply(inverse, middle, half, q);
  multiply(half, inverse, fit_.covariance, q);
}

}  // namespace shaker::estimator
