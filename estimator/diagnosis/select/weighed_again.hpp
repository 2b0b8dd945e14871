// Errors of a campaign that were read with the base model, read again with the best hypothesis.
//
// What is left of a transient is taken out of the cycles by the model's modes, and what the cycles
// do besides by its slope over the excitation. A model that lacks a large effect has other modes
// and another slope: a metering pin's transient, taken out by a plain orifice's modes, stays in the
// mean, and then not even the pin explains it.
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "estimator/diagnosis/cycles/steady_cycles.hpp"
#include "estimator/diagnosis/select/selection.hpp"

namespace shaker::estimator::diagnosis {

struct WeighedAgain {
  Selection found;             // explained
  std::vector<RunDatum> data;  // as the best hypothesis weighs them
};

// Hypotheses that are better guides than the base model; null for none. The best of a first search
// that explains nothing, where it closes most of the gap; that of a search by the gap's shares,
// where it leaves no more than a few times the noise of `data`.
const Hypothesis* guide_of(const Selection& searched);
const Hypothesis* guide_near_noise(const Selection& by_gap, const std::vector<RunDatum>& data);

// The search again, with the errors that `guide` tells and with the guide among its hypotheses, by
// the same test; nothing where that explains nothing either. `guide` may be null; `base`: the base
// model's fit to `data`, which are of `runs`. `cut_short` is set where that search was.
std::optional<WeighedAgain> explained_by_own_errors(
    const Hypothesis* guide, const HarmonicFit& base, const std::vector<SteadyRun>& runs,
    const std::vector<RunDatum>& data, const std::vector<Candidate>& catalogue,
    const SelectionOptions& options, const std::function<void(double)>& progress, bool& cut_short);

}  // namespace shaker::estimator::diagnosis
