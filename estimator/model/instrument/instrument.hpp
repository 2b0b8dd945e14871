// An instrument: one stage of the chain from the motion to the measured number. The stages
// follow each other in the order of the model file and act on the displacement signal.
//
// A stage is either pointwise, y_out = F(y, load, t; theta), or a linear filter with a transfer
// function. Filters act on the harmonics of a periodic signal. A time integration treats them
// in its own way: a delay by interpolation, a lag as an additional state.
#pragma once

#include <complex>

#include "estimator/model/effects/effect.hpp"

namespace shaker::estimator {

// A signal at n points.
struct Signal {
  int n = 0;
  const double* y = nullptr;
  const double* load = nullptr;  // of the damper per unit mass, m/s^2; null unless sees_load()
  const double* t = nullptr;     // time since the middle of the record, s; null unless sees_time()
};

// Output of a pointwise stage (overwritten): the signal after it and its partial derivatives.
struct Seen {
  double* y = nullptr;
  double* y_y = nullptr;
  double* y_load = nullptr;          // null unless sees_load()
  double* const* y_theta = nullptr;  // one array a parameter
};

// Immutable; all threads may use one object.
class Instrument {
 public:
  virtual ~Instrument() = default;
  virtual bool sees_load() const { return false; }
  virtual bool sees_time() const { return false; }

  virtual bool filters() const { return false; }  // true: a filter; false: a pointwise stage
  // For pointwise stages only: the signal after the stage, at at.n points.
  virtual void observe(const Signal& at, const double* theta, const double* constants,
                       const Seen& out) const;
  // For filters only: the factor on exp(i omega t), and its derivatives with respect to the
  // parameters (one each). omega in rad/s.
  virtual std::complex<double> transfer(double omega, const double* theta, const double* constants,
                                        std::complex<double>* d_theta) const;
};

// An effect that is a stage of the measuring chain. It has no force.
class InstrumentEffect : public Effect, public Instrument {
 public:
  Group group() const override { return Group::instrument; }
  const Instrument* instrument() const override { return this; }
  bool carries_load() const override { return false; }
  bool evaluate(const Points&, const double*, const double*, const Forces&) const override;
};

}  // namespace shaker::estimator
