// A constant force of each record's own: another preload, or another load on the damper.
//
// It moves the whole course of a record, and not its mean alone. It is a state of the model that
// does not change: each record's start of it is fitted together with the other initial states
// (transient_response.hpp), at every theta of every hypothesis. So it is exact at any size, and no
// effect with a memory gets credit for it.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "estimator/diagnosis/diagnosis.hpp"
#include "estimator/diagnosis/fit/internal/harmonic_fit.hpp"
#include "estimator/diagnosis/internal/run_datum.hpp"

namespace shaker::estimator::diagnosis {

struct OwnForces {
  double deviation = 0.0;  // standard deviation over the recordings, in the model's unit of force
};

// Gives each record a constant force of its own where the records differ in it: where that leaves
// less than one force for all does, by more than chance. `largest`: force of the motion, per unit
// mass. Changes `fit`. Empty: `fit` stays as it is, because the records do not differ, there are
// fewer than two recordings, or forces are compared.
std::optional<OwnForces> let_forces_differ(HarmonicFit& fit, double largest,
                                           const std::vector<RunDatum>& data,
                                           const FitOptions& options);

// The force of each recording beside the effects of `fit`; empty: they have none of their own.
std::map<std::string, double> own_forces_of(const HarmonicFit& fit,
                                            const std::vector<RunDatum>& data);

// Takes these forces out of all models that the answer holds. Where they still differ beside the
// named effects, puts their deviation in place and tells the operator: a friction that holds a mass
// off its centre looks like a force of each record until it is named.
void take_out(const OwnForces& own, Diagnosis& said);

}  // namespace shaker::estimator::diagnosis
