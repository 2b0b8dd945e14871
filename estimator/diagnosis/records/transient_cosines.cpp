#include "estimator/diagnosis/records/internal/transient_cosines.hpp"

#include <cmath>
#include <complex>
#include <numbers>
#include <unsupported/Eigen/FFT>
#include <vector>

namespace shaker::estimator::diagnosis {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using Complex = std::complex<double>;

struct CosineTransform::Plan {
  Eigen::FFT<double> fft;
  std::vector<Complex> turn, in, out;  // turn: exp(i pi k / 2 n)
};

Index fast_length(Index n) {
  for (; n > 1; --n) {
    Index rest = n;
    for (const Index prime : {2, 3, 5}) {
      while (rest % prime == 0)
        rest /= prime;
    }
    if (rest == 1) break;
  }
  return n;
}

CosineTransform::CosineTransform(Index samples) : n_(samples), plan_(std::make_unique<Plan>()) {
  const auto wide = static_cast<std::size_t>(2 * n_);
  plan_->in.resize(wide);
  plan_->out.resize(wide);
  plan_->fft.SetFlag(Eigen::FFT<double>::Unscaled);
  for (Index k = 0; k < n_; ++k)
    plan_->turn.push_back(std::polar(
        1.0, std::numbers::pi * static_cast<double>(k) / (2.0 * static_cast<double>(n_))));
}

CosineTransform::~CosineTransform() = default;
CosineTransform::CosineTransform(CosineTransform&&) noexcept = default;
CosineTransform& CosineTransform::operator=(CosineTransform&&) noexcept = default;

// Two columns at once, as real and imaginary part of one record: the even samples forth, the odd ones
// back (Makhoul, IEEE Transactions on Acoustics, Speech, and Signal Processing 28 (1980) 27-34).
MatrixXd CosineTransform::analyse(const MatrixXd& columns, Index keep) const {
  MatrixXd series(keep, columns.cols());
  const auto n = static_cast<std::size_t>(n_);
  for (Index c = 0; c < columns.cols(); c += 2) {
    const bool two = c + 1 < columns.cols();
    for (Index i = 0; i < n_; ++i) {
      const auto at = static_cast<std::size_t>(i / 2);
      plan_->in[i % 2 == 0 ? at : n - 1 - at] =
          Complex(columns(i, c), two ? columns(i, c + 1) : 0.0);
    }
    plan_->fft.fwd(plan_->out.data(), plan_->in.data(), n_);
    for (Index k = 0; k < keep; ++k) {
      const auto at = static_cast<std::size_t>(k);
      const Complex forth = plan_->out[at], back = std::conj(plan_->out[k == 0 ? 0 : n - at]);
      const Complex turn = std::conj(plan_->turn[at]);
      const double scale = (k == 0 ? 0.5 : 1.0) / static_cast<double>(n_);
      series(k, c) = scale * (turn * (forth + back)).real();
      if (two) series(k, c + 1) = scale * (turn * (forth - back)).imag();
    }
  }
  return series;
}

VectorXd CosineTransform::synthesise(const VectorXd& series, int order, double length) const {
  std::fill(plan_->in.begin(), plan_->in.end(), Complex());
  const Complex i(0.0, 1.0);
  for (Index k = 0; k < std::min(series.size(), n_); ++k) {
    Complex value = series[k] * plan_->turn[static_cast<std::size_t>(k)];
    for (int d = 0; d < order; ++d)
      value *= i * std::numbers::pi * static_cast<double>(k) / length;
    plan_->in[static_cast<std::size_t>(k)] = value;
  }
  plan_->fft.inv(plan_->out.data(), plan_->in.data(), 2 * n_);
  VectorXd curve(n_);
  for (Index j = 0; j < n_; ++j)
    curve[j] = plan_->out[static_cast<std::size_t>(j)].real();
  return curve;
}

}  // namespace shaker::estimator::diagnosis
