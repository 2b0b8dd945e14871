// A record in which samples are missing, as the parts between its gaps.
#pragma once

#include <vector>

#include "estimator/diagnosis/campaign.hpp"

namespace shaker::estimator::diagnosis {

struct RecordParts {
  std::vector<Recording>
      parts;  // in their order in time; the record itself where nothing is missing
  // A sentence for each gap, and for what is too short to be used; empty where nothing is missing.
  std::vector<std::string> notes;
};

// A gap is longer than eight of the record's median steps. A part with fewer than `fewest` samples, or
// with less than a tenth of the longest part's, is left out. Times increase.
RecordParts parts_between_gaps(const Recording& record, std::size_t fewest);

}  // namespace shaker::estimator::diagnosis
