// What an instrument does to a signal: one stage of the chain from the motion to the measured
// number. Stages follow each other in the order of the model file, each on the displacement signal.
//
// A stage is either pointwise, y_out = F(y, load, t; theta), or a linear filter given by its
// transfer function. Filters act on the harmonics of a periodic signal; a time integration runs
// them as it can (a delay by interpolation, a lag as one more state).
#pragma once

#include <complex>

#include "estimator/effects/effect.hpp"

namespace shaker::estimator {

// A signal at n points.
struct Signal {
  int n = 0;
  const double* y = nullptr;
  const double* load = nullptr;  // of the damper per unit mass, m/s^2; null unless sees_load()
  const double* t = nullptr;     // time since the middle of the record, s; null unless sees_time()
};

// Overwritten: the signal after the stage and its partial derivatives.
struct Seen {
  double* y = nullptr;
  double* y_y = nullptr;
  double* y_load = nullptr;          // null unless sees_load()
  double* const* y_theta = nullptr;  // one array a parameter
};

class Instrument {
 public:
  virtual ~Instrument() = default;
  virtual bool sees_load() const { return false; }
  virtual bool sees_time() const { return false; }

  virtual bool filters() const { return false; }
  // Pointwise stages.
  virtual void observe(const Signal& at, const double* theta, const double* constants,
                       const Seen& out) const;
  // Filters: the factor on exp(i omega t), and its derivatives over the parameters.
  virtual std::complex<double> transfer(double omega, const double* theta, const double* constants,
                                        std::complex<double>* d_theta) const;
};

// An effect that is a stage of the measuring chain: no force.
class InstrumentEffect : public Effect, public Instrument {
 public:
  Group group() const override { return Group::instrument; }
  const Instrument* instrument() const override { return this; }
  bool carries_load() const override { return false; }
  bool evaluate(const Points&, const double*, const double*, const Forces&) const override;
};

}  // namespace shaker::estimator
