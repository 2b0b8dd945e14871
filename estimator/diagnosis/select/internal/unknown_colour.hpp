// Tries the residual as the noise's own spectrum. The noise of a record is read above the
// frequencies of its response. Among these frequencies it may be larger by orders of magnitude, and
// then everything seems to be missing. The residual of the base model or of the best hypothesis is
// therefore tried as noise (noise/noise_colour.hpp): a missing effect correlates with the motion,
// noise does not.
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "estimator/diagnosis/noise/internal/run_constants.hpp"
#include "estimator/diagnosis/select/internal/selection.hpp"

namespace shaker::estimator::diagnosis {

struct OfUnknownColour {
  Selection found;                        // adequate or explained
  std::vector<RunDatum> data;             // with such noise
  std::optional<RunConstants> constants;  // in the errors too; empty: the runs do not differ
};

// Tests whether nothing is missing and the residual of the base model is noise, by itself or, where
// the search explained nothing, beside constants that differ from run to run. Empty for periodic
// runs, and where the search found nothing missing. Effects that explain the data beside the noise
// above the response are not there for certain while noise of another colour does as much. Call it
// after the search: an effect that bends the base model far may have no gain at the base fit.
std::optional<OfUnknownColour> nothing_but_colour(const Selection& searched,
                                                  const std::vector<RunDatum>& data,
                                                  const std::vector<Candidate>& catalogue,
                                                  const SelectionOptions& options);

// Repeats the search with the residual of its best hypothesis as noise. Empty if that residual is a
// force.
std::optional<OfUnknownColour> explained_but_for_colour(
    const Selection& searched, const std::vector<RunDatum>& data,
    const std::vector<Candidate>& catalogue, const SelectionOptions& options,
    const std::function<void(double)>& progress);

}  // namespace shaker::estimator::diagnosis
