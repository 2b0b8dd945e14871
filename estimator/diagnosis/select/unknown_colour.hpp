// The noise of a record is read above its response; where the response is, it may be larger by
// orders, and then everything seems to be missing. So what is left, by the base model or by the
// best hypothesis, is tried as the noise's own spectrum (noise/noise_colour.hpp): an effect that is
// missing lies along the motion, noise does not.
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "estimator/diagnosis/select/selection.hpp"

namespace shaker::estimator::diagnosis {

struct OfUnknownColour {
  Selection found;             // adequate or explained
  std::vector<RunDatum> data;  // with such noise
};

// Nothing is missing, and what the base model leaves is noise. Nothing for runs with a period, and
// where the noise above the response is enough. After the search: what bends the base model far may
// have no gain where that fits best, and all of it elsewhere.
std::optional<OfUnknownColour> nothing_but_colour(const Selection& searched,
                                                  const std::vector<RunDatum>& data,
                                                  const std::vector<Candidate>& catalogue,
                                                  const SelectionOptions& options);

// The search again with what its best hypothesis left as noise; nothing where that is a force.
std::optional<OfUnknownColour> explained_but_for_colour(
    const Selection& searched, const std::vector<RunDatum>& data,
    const std::vector<Candidate>& catalogue, const SelectionOptions& options,
    const std::function<void(double)>& progress);

}  // namespace shaker::estimator::diagnosis
