// The discrete Fourier transform of any length, compiled once: Eigen's takes a compiler seconds.
#pragma once

#include <complex>
#include <memory>

namespace shaker::estimator {

// Keeps a plan for each length it has met. One thread at a time.
class FourierTransform {
 public:
  FourierTransform();
  ~FourierTransform();

  // From n real values to harmonics 0 to n / 2, and back (divided by n).
  void forward(const double* values, int n, std::complex<double>* harmonics);
  void backward(const std::complex<double>* harmonics, int n, double* values);
  // From n terms of a spectrum to n complex values, divided by n.
  void backward(const std::complex<double>* spectrum, int n, std::complex<double>* values);

 private:
  struct Plans;
  std::unique_ptr<Plans> plans_;
};

}  // namespace shaker::estimator
