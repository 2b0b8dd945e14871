#include "estimator/record.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Dense>
#include <fmt/format.h>

#include "estimator/math/dense.hpp"
#include "estimator/math/numbers.hpp"

namespace shaker::estimator {
namespace {

constexpr int kHarmonics = 8;
constexpr int kHarmonicsForFrequency = 3;
constexpr int kExcitationPoints = 64;

Error invalid(std::string why) {
  return {ErrorKind::invalid, std::move(why)};
}

Result<void> check(const Record& r, double frequency_hz) {
  if (!(frequency_hz > 0.0)) return invalid("the frequency must be positive");
  if (r.displacement.size() != r.t.size() ||
      (!r.excitation.empty() && r.excitation.size() != r.t.size()))
    return invalid("the columns have different lengths");
  if (r.t.size() < 8)
    return invalid(fmt::format("{} samples are too few; a period needs at least 8", r.t.size()));
  for (std::size_t i = 0; i < r.t.size(); ++i) {
    if (!std::isfinite(r.t[i]) || !std::isfinite(r.displacement[i]) ||
        (!r.excitation.empty() && !std::isfinite(r.excitation[i])))
      return invalid(fmt::format("sample {} is missing or not finite", i + 1));
    if (i > 0 && !(r.t[i] > r.t[i - 1]))
      return invalid(
          fmt::format("sample {}: time {} does not come after {}", i + 1, r.t[i], r.t[i - 1]));
  }
  const double step = (r.t.back() - r.t.front()) / static_cast<double>(r.t.size() - 1);
  const double length = r.t.back() - r.t.front() + step;
  if (length * frequency_hz < 1.0 - 1e-6)
    return invalid(fmt::format("the record covers {:.2f} periods of {:g} Hz; it must cover one",
                               length * frequency_hz, frequency_hz));
  if (1.0 / (step * frequency_hz) < 8.0)
    return invalid(fmt::format("{:.1f} samples a period are too few; there must be 8",
                               1.0 / (step * frequency_hz)));
  return {};
}

// Fits harmonics of the excitation at the frequency f by least squares. Returns the residual
// sum of squares.
double fit_harmonics(const Record& r, double f, int harmonics, Eigen::VectorXd& c) {
  const auto n = static_cast<Eigen::Index>(r.t.size());
  Eigen::MatrixXd basis(n, 1 + 2 * harmonics);
  Eigen::VectorXd x(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const auto at = static_cast<std::size_t>(i);
    x[i] = r.excitation[at];
    basis(i, 0) = 1.0;
    for (int h = 1; h <= harmonics; ++h) {
      const double angle = kTwoPi * h * f * (r.t[at] - r.t[0]);
      basis(i, 2 * h - 1) = std::cos(angle);
      basis(i, 2 * h) = std::sin(angle);
    }
  }
  c = least_squares(basis, x);
  return (x - basis * c).squaredNorm();
}

// Returns the frequency, within 1 % of the nominal one, at which a few harmonics fit the
// excitation best.
double refine_frequency(const Record& r, double nominal) {
  if ((r.t.back() - r.t.front()) * nominal < 1.5) return nominal;  // too short to decide
  Eigen::VectorXd c;
  double low = 0.99 * nominal;
  double high = 1.01 * nominal;
  constexpr double kGolden = 0.6180339887498949;
  double a = high - kGolden * (high - low);
  double b = low + kGolden * (high - low);
  double fa = fit_harmonics(r, a, kHarmonicsForFrequency, c);
  double fb = fit_harmonics(r, b, kHarmonicsForFrequency, c);
  while (high - low > 1e-9 * nominal) {
    if (fa < fb) {
      high = b;
      b = a;
      fb = fa;
      a = high - kGolden * (high - low);
      fa = fit_harmonics(r, a, kHarmonicsForFrequency, c);
    } else {
      low = a;
      a = b;
      fa = fb;
      b = low + kGolden * (high - low);
      fb = fit_harmonics(r, b, kHarmonicsForFrequency, c);
    }
  }
  return 0.5 * (low + high);
}

// True for exactly one period on equal steps from tau = 0: grid points then meet samples.
bool is_one_period(const Record& r, double f) {
  const double n = static_cast<double>(r.t.size());
  for (std::size_t i = 0; i < r.t.size(); ++i) {
    if (std::fabs(f * r.t[i] - static_cast<double>(i) / n) > 1e-9) return false;
  }
  return true;
}

}  // namespace

Result<RunData> run_from_record(const Record& record, double frequency_hz, double amplitude) {
  if (const auto good = check(record, frequency_hz); !good) return good.error();
  RunData run;
  run.frequency_hz = frequency_hz;
  run.amplitude = amplitude;
  run.displacement = record.displacement;
  double shift = 0.0;
  if (!record.excitation.empty()) {
    run.frequency_hz = refine_frequency(record, frequency_hz);
    Eigen::VectorXd c;
    const double samples_a_period = static_cast<double>(record.t.size() - 1) /
                                    ((record.t.back() - record.t.front()) * frequency_hz);
    const int harmonics = std::min(kHarmonics, static_cast<int>(samples_a_period / 2.0) - 1);
    fit_harmonics(record, run.frequency_hz, harmonics, c);
    run.amplitude = std::hypot(c[1], c[2]);
    if (!(run.amplitude > 1e-9 * (std::fabs(c[0]) + 1.0)))
      return invalid("the excitation never changes");
    // x = A cos(2 pi f (t - t0) - phi): the fundamental peaks where 2 pi f (t - t0) = phi.
    const double phi = std::atan2(c[2], c[1]);
    shift = -phi / kTwoPi - run.frequency_hz * record.t[0];
    run.excitation.assign(kExcitationPoints, 0.0);
    for (int i = 0; i < kExcitationPoints; ++i) {
      for (int h = 1; h <= harmonics; ++h) {
        const double angle = h * (kTwoPi * i / kExcitationPoints + phi);
        run.excitation[static_cast<std::size_t>(i)] +=
            c[2 * h - 1] * std::cos(angle) + c[2 * h] * std::sin(angle);
      }
    }
  } else if (is_one_period(record, frequency_hz)) {
    return run;
  }
  for (const double t : record.t) {
    const double tau = run.frequency_hz * t + shift;
    run.tau.push_back(tau - std::floor(tau));
  }
  return run;
}

}  // namespace shaker::estimator
