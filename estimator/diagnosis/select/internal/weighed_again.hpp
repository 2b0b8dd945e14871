// Computes errors that came from the base model again, from the best hypothesis.
//
// The rest of the transient is removed from the cycles by the modes of the model, and the response
// to a wandering excitation by its slope. A model that lacks a large effect has other modes and
// another slope. The transient of a metering pin, removed by the modes of a plain orifice, stays in
// the mean, and then not even the pin explains it.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "estimator/diagnosis/cycles/steady_cycles.hpp"
#include "estimator/diagnosis/select/internal/selection.hpp"

namespace shaker::estimator::diagnosis {

struct WeighedAgain {
  Selection found;             // explained
  std::vector<RunDatum> data;  // as the best hypothesis weighs them
  std::string differ;          // what it tells of the runs' zeros; empty: nothing new
};

// Returns a hypothesis that is a better guide than the base model, or null: the best of a search that
// explains nothing, if it closes most of the gap.
const Hypothesis* guide_of(const Selection& searched, const std::vector<RunDatum>& data);

// Repeats the search with the errors from `guide`, with the guide among its hypotheses and with the
// same test. Empty if that explains nothing either. `base`: the fit of the base model to `data`,
// which are the data of `runs`. Sets `cut_short` if the search was.
std::optional<WeighedAgain> explained_by_own_errors(
    const Hypothesis& guide, const HarmonicFit& base, const std::vector<SteadyRun>& runs,
    const std::vector<RunDatum>& data, const std::vector<Candidate>& catalogue,
    const SelectionOptions& options, const std::function<void(double)>& progress, bool& cut_short);

}  // namespace shaker::estimator::diagnosis
