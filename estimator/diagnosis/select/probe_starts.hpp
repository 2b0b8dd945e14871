// Where else than at its probe the fit of an effect may begin.
#pragma once

#include <vector>

#include "config/model.hpp"
#include "estimator/diagnosis/score/candidates.hpp"

namespace shaker::estimator::diagnosis {

// Lines with what switches an effect on well inside of its range: as the catalogue begins it, and
// halfway between its absence and a bound that is near. The probe's own where nothing does.
std::vector<config::EffectSpec> starts_of(const Probe& probe);

// Of an effect without a coefficient, which is wholly there wherever it begins: a good deal lower
// and higher in what it begins with. None for others.
std::vector<config::EffectSpec> placed_apart(const Probe& probe);

}  // namespace shaker::estimator::diagnosis
