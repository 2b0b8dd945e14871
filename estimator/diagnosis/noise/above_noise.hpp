// Runs whose errors are no smaller than their motion: any model passes there, and "nothing is
// missing" says nothing.
#pragma once

#include <string>
#include <vector>

#include "base/result.hpp"
#include "estimator/diagnosis/run_datum.hpp"

namespace shaker::estimator::diagnosis {

// Root mean square over the cycle, or record, of what a curve does beside its mean.
double motion_of(const Eigen::VectorXd& harmonics);

// `motions`: of each run's response as it was measured; the weighed one is corrected by what the
// model makes of a wandering excitation. An Error where no fitted run moves by more than its
// errors. A run whose errors are more than a third of its motion is a warning: a third of it could
// be missing there and not be seen. `unit`: of the response.
Result<void> above_noise(const std::vector<RunDatum>& data, const std::vector<double>& motions,
                         const std::string& unit, std::vector<std::string>& warnings);

}  // namespace shaker::estimator::diagnosis
