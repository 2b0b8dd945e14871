#include "estimator/model/instrument/instrument.hpp"

namespace shaker::estimator {

// Defaults for functions that are never called: a filter is not evaluated at points, and a
// pointwise stage has no transfer function.
void Instrument::observe(const Signal&, const double*, const double*, const Seen&) const {}

std::complex<double> Instrument::transfer(double, const double*, const double*,
                                          std::complex<double>*) const {
  return 1.0;
}

bool InstrumentEffect::evaluate(const Points&, const double*, const double*, const Forces&) const {
  return true;
}

}  // namespace shaker::estimator
