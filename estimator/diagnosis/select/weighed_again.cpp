#include "estimator/diagnosis/select/internal/weighed_again.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "estimator/diagnosis/fit/internal/smoothing.hpp"
#include "estimator/diagnosis/noise/internal/extra_channels.hpp"
#include "estimator/diagnosis/noise/internal/run_constants.hpp"
#include "estimator/diagnosis/noise/internal/weighing.hpp"

namespace shaker::estimator::diagnosis {
namespace {

constexpr double kBetterGuide = 0.1;  // of chi-squared, that the best leaves at most
constexpr double kHopeless = 100.0;   // of chi-squared a datum: other errors alone do not mend that

const Hypothesis* admissible_best(const Selection& found) {
  if (found.best >= found.hypotheses.size()) return nullptr;
  const Hypothesis& best = found.hypotheses[found.best];
  return best.disqualified.empty() && std::isfinite(best.fit->chi_squared) ? &best : nullptr;
}

// Chi-squared of what it leaves; of forces along a motion without the means, which zeros of the runs'
// own may make.
double left_but_for_zeros(const Hypothesis& h, const std::vector<RunDatum>& data) {
  if (data.front().kind != Kind::imposed_motion || on_samples(data)) return h.fit->chi_squared;
  const std::vector<RunDatum>& fitted = h.data ? *h.data : data;
  double sum = 0.0;
  for (std::size_t r = 0; r < fitted.size(); ++r) {
    if (fitted[r].role != Role::fit) continue;
    Eigen::VectorXd left = coloured(fitted[r], whitened_residual(*h.fit, fitted, r));
    left[0] = 0.0;
    sum += whitened(fitted[r], left).squaredNorm();
  }
  return sum;
}

// A copy of the hypothesis with a workspace of its own.
HarmonicFit copied(const Hypothesis& h, const std::vector<RunDatum>& data, FitOptions options) {
  const HarmonicFit& near = rounded(h);
  options.max_iterations = 0;
  options.points = near.predictions.front().points();
  options.sharp = has_smoothing(near.spec);
  options.at_once = near.at_once;
  return fit_harmonics(near.spec, data, h.fit->theta, &near, options);
}

}  // namespace

const Hypothesis* guide_of(const Selection& searched, const std::vector<RunDatum>& data) {
  if (searched.adequate || searched.explained) return nullptr;
  const Hypothesis* best = admissible_best(searched);
  if (best == nullptr) return nullptr;
  const bool hopeless = left_but_for_zeros(*best, data) > kHopeless * best->fit->observations;
  const bool better = best->fit->chi_squared < kBetterGuide * searched.base.fit->chi_squared;
  return better && !hopeless ? best : nullptr;
}

std::optional<WeighedAgain> explained_by_own_errors(
    const Hypothesis& guide, const HarmonicFit& base, const std::vector<SteadyRun>& runs,
    const std::vector<RunDatum>& data, const std::vector<Candidate>& catalogue,
    const SelectionOptions& options, const std::function<void(double)>& progress, bool& cut_short) {
  if (on_samples(data)) return std::nullopt;
  HarmonicFit fit = copied(guide, data, options.fit);
  std::vector<RunDatum> own = weigh(runs, fit).data;
  for (RunDatum& datum : own)
    datum.budget = data.front().budget;
  // Reads only the further channels that the base model uses, because the new fit of the base model
  // starts from its fit to `data`.
  auto more = same_channels(runs, fit, own, data);
  std::move(more.begin(), more.end(), std::back_inserter(own));
  // Beside what is missing, the base model may not have shown that the runs' zeros differ.
  std::string differ;
  if (const HarmonicFit there = copied(guide, own, options.fit); there.predicts_all)
    differ = let_zeros_differ(there, base.spec.length_unit + "/s^2", own);
  if (data.front().own_zero > 0.0) differ.clear();  // it has been told
  HarmonicFit again = fit_harmonics(base.spec, own, base.theta, &base, options.fit);
  if (!again.trouble.empty()) return std::nullopt;
  SelectionOptions with_guide = options;
  with_guide.known = &guide;
  Selection found = select_effects(std::move(again), own, catalogue, with_guide, progress);
  cut_short = cut_short || found.cut_short;
  // Without all its competitors a name would look more certain than it is.
  if (!found.explained || found.cut_short) return std::nullopt;
  return WeighedAgain{std::move(found), std::move(own), std::move(differ)};
}

}  // namespace shaker::estimator::diagnosis
