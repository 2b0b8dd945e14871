#include "estimator/math/fourier.hpp"

#include <unsupported/Eigen/FFT>

namespace shaker::estimator {

struct FourierTransform::Plans {
  Eigen::FFT<double> fft;
};

FourierTransform::FourierTransform() : plans_(std::make_unique<Plans>()) {
  plans_->fft.SetFlag(Eigen::FFT<double>::HalfSpectrum);
}
FourierTransform::~FourierTransform() = default;

void FourierTransform::forward(const double* values, int n, std::complex<double>* harmonics) {
  plans_->fft.fwd(harmonics, values, n);
}

void FourierTransform::backward(const std::complex<double>* harmonics, int n, double* values) {
  plans_->fft.inv(values, harmonics, n);
}

void FourierTransform::backward(const std::complex<double>* spectrum, int n,
                                std::complex<double>* values) {
  plans_->fft.inv(values, spectrum, n);
}

}  // namespace shaker::estimator
