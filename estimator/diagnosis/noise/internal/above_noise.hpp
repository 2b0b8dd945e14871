// Refuses campaigns whose noise is as large as the motion. Any model passes the test there, so the
// verdict `adequate` would mean nothing.
#pragma once

#include <string>
#include <vector>

#include "base/result.hpp"
#include "estimator/diagnosis/internal/run_datum.hpp"

namespace shaker::estimator::diagnosis {

// Root mean square of a curve about its mean, over the cycle or the record.
double motion_of(const Eigen::VectorXd& harmonics);
// The same of a run. Where a balance of forces is compared, an excitation may be in another unit, as
// a voltage, which the model's gain turns into a force: the force of the inertia counts if it is
// larger.
double motion_in(const RunDatum& datum);

// Returns an Error if no fitted run moves by more than its errors. Warns of a run whose errors are
// more than a third of its motion, because a third of the motion could be missing there unseen.
// `motions`: motion_of each run's measured response, before the correction for a wandering
// excitation. `unit`: unit of the response.
Result<void> above_noise(const std::vector<RunDatum>& data, const std::vector<double>& motions,
                         const std::string& unit, std::vector<std::string>& warnings);

}  // namespace shaker::estimator::diagnosis
