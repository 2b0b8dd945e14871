#include "estimator/diagnosis/noise/internal/above_noise.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "estimator/diagnosis/records/internal/transient_run.hpp"

namespace shaker::estimator::diagnosis {
namespace {

constexpr double kDrowned = 1.0;
constexpr double kFaint = 1.0 / 3.0;

struct MotionAndError {
  const RunDatum* run = nullptr;
  double motion = 0.0, error = 0.0;
  double share() const {
    if (motion > 0.0) return error / motion;
    return error > 0.0 ? std::numeric_limits<double>::infinity() : 0.0;
  }
  std::string words(const std::string& unit) const {
    return fmt::format(
        "errors of {:.3g} {} beside a {} of {:.3g} {} (root mean squares)", error, unit,
        run->kind == Kind::imposed_motion || run->by_force ? "force" : "motion", motion, unit);
  }
};

}  // namespace

double motion_of(const Eigen::VectorXd& harmonics) {
  Eigen::VectorXd curve = harmonics;
  curve[0] = 0.0;
  return root_mean_square(curve);
}

double motion_in(const RunDatum& datum) {
  const double compared = motion_of(datum.response);
  if (!datum.by_force || datum.kind != Kind::transient) return compared;
  const Eigen::VectorXd& inertia = datum.sampled->a;
  return std::max(compared, std::sqrt((inertia.array() - inertia.mean()).square().mean()));
}

Result<void> above_noise(const std::vector<RunDatum>& data, const std::vector<double>& motions,
                         const std::string& unit, std::vector<std::string>& warnings) {
  std::vector<MotionAndError> runs;
  MotionAndError clearest;
  for (std::size_t r = 0; r < motions.size(); ++r) {
    const double error = motion_of(data[r].error);
    // What was measured holds the errors too.
    const double motion = std::sqrt(std::max(0.0, motions[r] * motions[r] - error * error));
    runs.push_back({&data[r], motion, error});
    if (data[r].role != Role::fit) continue;
    if (clearest.run == nullptr || runs[r].share() < clearest.share()) clearest = runs[r];
  }
  if (clearest.run != nullptr && !(clearest.share() < kDrowned))
    return Error{
        ErrorKind::not_converged,
        fmt::format("no run stands out of its noise, not even run {}, with {}: any model would do; "
                    "drive harder, record more cycles, or, where the sensors' noise is far less, "
                    "give start values nearer to the damper's, as errors of the excitation count "
                    "by what the model makes of them",
                    clearest.run->name, clearest.words(unit))};
  for (const MotionAndError& run : runs) {
    if (run.share() < kFaint) continue;
    warnings.push_back(
        fmt::format("run {} hardly stands out of its noise, with {}: {:.0f} % of what it does "
                    "could be missing there unseen",
                    run.run->name, run.words(unit), 100.0 * std::min(run.share(), 1.0)));
  }
  return {};
}

}  // namespace shaker::estimator::diagnosis
