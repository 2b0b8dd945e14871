// Represents a record without a period by cosines over its length, as harmonics represent a cycle.
//
//     y(t) = c0 + sum of c_k cos(pi k t / T),   samples at t = (i + 1/2) T / n
//
// The half-waves need not close, so the ends do not leak as in a Fourier series. The cosines are
// orthogonal on the samples. Therefore white noise stays white, the root mean square is sqrt(c0^2 +
// sum of c_k^2 / 2) as for harmonics, and leaving out the last ones decimates without aliasing.
// Lengths with small prime factors are fast.
#pragma once

#include <memory>

#include <Eigen/Dense>

namespace shaker::estimator::diagnosis {

// Largest length not above n of which 2, 3 and 5 are the only primes.
Eigen::Index fast_length(Eigen::Index n);

// For samples of one length. Not for several threads at once.
class CosineTransform {
 public:
  explicit CosineTransform(Eigen::Index samples);
  ~CosineTransform();
  CosineTransform(CosineTransform&&) noexcept;
  CosineTransform& operator=(CosineTransform&&) noexcept;

  Eigen::Index samples() const { return n_; }
  // First `keep` coefficients of each column.
  Eigen::MatrixXd analyse(const Eigen::MatrixXd& columns, Eigen::Index keep) const;
  // Curve of a series of at most `samples` coefficients, and of its `order`th derivative (0, 1, 2)
  // for a record `length` seconds long.
  Eigen::VectorXd synthesise(const Eigen::VectorXd& series, int order = 0,
                             double length = 1.0) const;

 private:
  struct Plan;
  Eigen::Index n_;
  std::unique_ptr<Plan> plan_;
};

}  // namespace shaker::estimator::diagnosis
