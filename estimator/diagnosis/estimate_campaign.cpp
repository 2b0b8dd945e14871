#include "estimator/diagnosis/estimate_campaign.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Dense>
#include <fmt/format.h>

#include "estimator/diagnosis/diagnose.hpp"
#include "estimator/math/dense.hpp"
#include "estimator/math/statistics.hpp"

namespace shaker::estimator::diagnosis {
namespace {

constexpr double kUpperTail = 0.975;  // of the 95 % intervals

bool same(const ModelNumber& a, const ModelNumber& b) {
  return a.line == b.line && a.symbol == b.symbol && a.constant == b.constant;
}

// Of the parameters' correlation: how nearly the data leave a direction open.
double condition_of(const Eigen::MatrixXd& covariance) {
  if (covariance.rows() == 0) return 1.0;
  const Eigen::VectorXd error = covariance.diagonal().cwiseSqrt();
  const Eigen::VectorXd spread = spectrum_of(error.cwiseInverse().asDiagonal() * covariance *
                                             error.cwiseInverse().asDiagonal())
                                     .values;
  const double least = spread.minCoeff();
  return least > 0.0 ? std::sqrt(spread.maxCoeff() / least)
                     : std::numeric_limits<double>::infinity();
}

// Puts errors, intervals and covariance of the base model's hypothesis.
void put_covariance(const DamperHypothesis& base, Estimate& estimate) {
  const Model model(base.model);
  const std::vector<ModelNumber> places = numbers_of(model);
  std::vector<Eigen::Index> kept;
  const double quantile = student_t_quantile(kUpperTail, base.degrees_of_freedom);
  const auto size = static_cast<Eigen::Index>(base.numbers.size());
  const Eigen::Map<const Eigen::MatrixXd> whole(base.covariance.data(), size, size);
  for (ParameterEstimate& parameter : estimate.parameters) {
    const auto named = std::ranges::find(model.parameters(), parameter.name, &ModelParameter::name);
    if (named == model.parameters().end()) continue;  // a value of one run, which keeps its error
    const auto& place = places[static_cast<std::size_t>(named - model.parameters().begin())];
    const auto at = std::find_if(base.numbers.begin(), base.numbers.end(),
                                 [&](const ModelNumber& n) { return same(n, place); });
    if (at == base.numbers.end()) continue;
    const auto row = at - base.numbers.begin();
    parameter.standard_error = std::sqrt(whole(row, row));
    const double reach = quantile * parameter.standard_error;
    parameter.lower = parameter.value - reach;
    parameter.upper = parameter.value + reach;
    kept.push_back(row);
    estimate.covariance_order.push_back(parameter.name);
  }
  const Eigen::MatrixXd covariance = whole(kept, kept);
  estimate.covariance.assign(covariance.data(), covariance.data() + covariance.size());
  estimate.condition = condition_of(covariance);
}

}  // namespace

Result<Estimate> estimate_campaign(const Campaign& campaign, const config::ModelSpec& model) {
  DiagnoseOptions options;
  options.most_effects = 0;
  const auto said = diagnose(campaign, model, options);
  if (!said) return said.error();
  Estimate estimate;
  estimate.model = model.name;
  estimate.parameters = said->parameters_before;
  if (!said->damper.hypotheses.empty()) put_covariance(said->damper.hypotheses.front(), estimate);
  estimate.sum_of_squares = said->chi_squared_before;
  estimate.observations = said->observations;
  estimate.degrees_of_freedom =
      said->observations - static_cast<long>(estimate.covariance_order.size());
  for (const RunGap& run : said->runs) {
    if (run.role != Role::fit) continue;
    ++estimate.runs;
    estimate.cycles += run.cycles;
  }
  estimate.noise_standard_deviation = said->gap.noise;
  estimate.gap.size = said->gap.before;
  estimate.gap.noise_floor = said->gap.noise_floor;
  estimate.converged = true;
  estimate.intervals_hold = said->verdict == Verdict::adequate;
  estimate.usable = std::all_of(
      estimate.parameters.begin(), estimate.parameters.end(), [](const ParameterEstimate& p) {
        return p.fixed || (std::isfinite(p.standard_error) && !p.at_bound);
      });
  if (!estimate.intervals_hold)
    estimate.warnings.push_back(
        fmt::format("the model misses the data by {:.3g} {} (root mean square), and noise explains "
                    "{:.3g}: the intervals do not hold; `shakerctl diagnose` looks for what is "
                    "missing",
                    said->gap.before, said->gap.unit, said->gap.noise_floor));
  estimate.warnings.insert(estimate.warnings.end(), said->warnings.begin(), said->warnings.end());
  return estimate;
}

}  // namespace shaker::estimator::diagnosis
