// Predictions of the measured channels of a periodic solution, with their sensitivities. The
// sensitivities of the solution are carried through the measured quantity and its instruments.
// Private to PeriodicSystem's sources.
#pragma once

#include <complex>
#include <span>
#include <vector>

#include "estimator/math/fourier.hpp"
#include "estimator/solve/periodic/periodic_system.hpp"

namespace shaker::estimator {

class PeriodicSystem::Observer {
 public:
  Observer(const PeriodicSystem& system, std::span<const Quantity> quantities);

  // True if all channels are the state itself, so that there is nothing to compute.
  bool idle() const;
  bool direct(int channel) const { return channels_[static_cast<std::size_t>(channel)].direct; }
  // Computes all channels from the last linearisation and its rows. Returns false when a point is
  // inadmissible.
  bool observe(const PeriodicSystem& system, std::span<const double> theta);
  void advance(double newton, std::span<const double> delta_theta);

  double value(int point, int channel) const {
    return channels_[static_cast<std::size_t>(channel)].y[static_cast<std::size_t>(point)];
  }
  const double* row(int point, int channel) const {
    return &channels_[static_cast<std::size_t>(channel)]
                .rows[static_cast<std::size_t>(point) * static_cast<std::size_t>(stride_)];
  }

 private:
  struct Series {  // a signal over the period with its rows
    Quantity quantity = Quantity::displacement;
    bool direct = false;
    AlignedVector y, rows;
  };
  void resize(Series& series) const;
  bool take(Quantity quantity, std::span<const double> theta, Series& out);
  void add_rows(int coordinate, int derivative, const double* slope, Series& out) const;
  void pointwise(const Model::Term& stage, std::span<const double> theta, Series& series);
  void filter(const Model::Term& stage, std::span<const double> theta, Series& series);
  void to_harmonics();
  void from_harmonics(std::size_t first);

  const PeriodicSystem* system_ = nullptr;  // set by each observe(), because systems can move
  int n_, s_, p_, stride_, padded_;
  bool sees_load_ = false;
  std::vector<Series> channels_;
  Series load_, before_;
  AlignedVector store_;
  std::vector<double*> y_u_, y_v_, y_a_, y_theta_, workspace_;
  std::vector<double> time_;
  std::vector<std::complex<double>> factors_;  // a filter's response, then its derivatives
  std::vector<double> curve_;                  // a signal over the ring; spectrum_: its harmonics
  std::vector<std::complex<double>> spectrum_, changed_;
  FourierTransform fourier_;
};

}  // namespace shaker::estimator
