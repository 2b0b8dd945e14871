// Of which data is a diagnosis? The data of a campaign are identified by a hash of what was measured,
// wherever its files are and whatever is written beside them, and by the specimen that they name.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "estimator/diagnosis/campaign.hpp"
#include "estimator/model/identified_damper.hpp"

namespace shaker::cli {

// SHA-256 of the columns of all runs, in whatever order these come. Names do not count.
std::string hash_of_data(const estimator::diagnosis::Campaign& campaign);

// "name main gear, serial SN-42" of the first database that names its specimen; may be empty.
std::string specimen_of(const std::vector<std::filesystem::path>& campaigns);

// Says in `damper` of which data it is.
void put_origin(const estimator::diagnosis::Campaign& campaign,
                const std::vector<std::filesystem::path>& places,
                estimator::IdentifiedDamper& damper);

// An Error names both campaigns and the remedy where the diagnosis in `folder`, which says `damper`,
// is of other data than `places`. Nothing where the diagnosis does not say of which it is, or where
// there are no places.
Result<void> expect_origin(const estimator::IdentifiedDamper& damper,
                           const std::filesystem::path& folder,
                           const std::vector<std::filesystem::path>& places);

}  // namespace shaker::cli
