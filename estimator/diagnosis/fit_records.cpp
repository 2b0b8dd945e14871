#include "estimator/diagnosis/internal/fit_records.hpp"

#include <utility>
#include <vector>

#include "estimator/diagnosis/fit/internal/jumping_friction.hpp"
#include "estimator/diagnosis/noise/internal/excitation_noise.hpp"
#include "estimator/diagnosis/noise/internal/first_fit.hpp"
#include "estimator/diagnosis/noise/internal/run_constants.hpp"

namespace shaker::estimator::diagnosis {
namespace {

constexpr int kRecordStepsOfBase = 120;

// Lets the records differ in their zeros and in a constant force, where they do. `largest`: force of
// the motion. Returns false where no fit serves.
bool let_records_differ(const std::string& unit, double largest, const FitOptions& options,
                        TransientRuns& runs, FittedRecords& fitted) {
  HarmonicFit& base = fitted.base;
  const std::vector<RunDatum> alike = runs.data;
  const auto let_zeros = [&](std::string& differ) {
    differ = let_zeros_differ(base, unit, runs.data);
    if (differ.empty()) return true;
    const config::ModelSpec spec = base.spec;
    base = fit_harmonics(spec, runs.data, base.theta, &base, options);
    return serves(base);
  };
  std::string zeros;
  if (!let_zeros(zeros)) return false;
  fitted.own_forces = let_forces_differ(base, largest, runs.data, options);
  if (fitted.own_forces) {
    runs.data = alike;  // a force moves the mean too
    if (!let_zeros(zeros)) return false;
  }
  if (!zeros.empty()) runs.warnings.push_back(zeros);
  return true;
}

// Lets the friction of the model jump, where that leaves less than its width does.
void let_jump(const std::vector<RunDatum>& data, FitOptions& options, HarmonicFit& base) {
  if (!can_jump(base.spec, data)) return;
  FitOptions jumping = options;
  jumping.sharp = jumping.at_once = true;
  HarmonicFit fit = fit_harmonics(base.spec, data, base.theta, &base, jumping);
  if (!serves(fit) || !(fit.chi_squared < base.chi_squared)) return;
  base = std::move(fit);
  options = jumping;
}

}  // namespace

Result<FittedRecords> fit_records(const config::ModelSpec& model, const std::string& unit,
                                  double largest, FitOptions options, TransientRuns& runs) {
  options.max_iterations = kRecordStepsOfBase;  // from start values that may be far off
  FittedRecords fitted{fit_transient(model, runs, options), {}};
  HarmonicFit& base = fitted.base;
  if (!serves(base)) return not_fitted(base);
  options.correct_start = true;  // what is not fitted again leaves nothing to be said
  let_jump(runs.data, options, base);
  if (auto good = use_repetitions(runs, base); !good) return good.error();
  // Done twice, because the response to the excitation depends on the fit.
  const std::vector<RunDatum> own = runs.data;
  for (int round = 0; round < 2; ++round) {
    const bool counted = count_excitation_noise(runs, own, base);
    base = fit_harmonics(model, runs.data, base.theta, &base, options);
    if (!serves(base)) return not_fitted(base);
    if (!counted) break;
  }
  if (!let_records_differ(unit, largest, options, runs, fitted)) return not_fitted(base);
  warn_if_unsettled(base, runs.warnings);
  return fitted;
}

Error not_fitted(const HarmonicFit& fit) {
  return {ErrorKind::not_converged,
          fit.trouble +
              "; nothing can be said of what is missing before the model itself is fitted: "
              "give start values nearer to the damper's (shakerctl estimate tries several), "
              "fix what these runs cannot determine, or look for a channel with coarse "
              "steps or a wrong scale"};
}

}  // namespace shaker::estimator::diagnosis
