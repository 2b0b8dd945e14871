#include "estimator/diagnosis/report/internal/hypotheses.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "estimator/diagnosis/cycles/harmonics.hpp"
#include "estimator/diagnosis/fit/internal/smoothing.hpp"
#include "estimator/diagnosis/force/internal/remaining_force.hpp"
#include "estimator/diagnosis/noise/internal/above_noise.hpp"
#include "estimator/diagnosis/records/internal/transient_run.hpp"
#include "estimator/diagnosis/report/internal/estimates.hpp"
#include "estimator/diagnosis/select/internal/centring.hpp"
#include "estimator/model/effects/scaled.hpp"
#include "estimator/model/mean_of_runs.hpp"

namespace shaker::estimator::diagnosis {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

constexpr double kLeastShare = 2e-3;         // of probability, that is worth a hypothesis
constexpr std::size_t kMostHypotheses = 8;   // that are kept
constexpr double kMostImitated = 0.95;       // of an effect, by the parameters
constexpr double kLeastUnnamed = 0.02;       // of probability: no campaign rules it out
constexpr int kVisitedCells = 24;            // of the stroke and of the velocity
constexpr double kLeastUnnamedForce = 1e-9;  // of the force

// The free parameters as numbers of the damper.
MeanOfRuns free_numbers(const HarmonicFit& fit) {
  const auto places = numbers_of(*fit.model);
  std::vector<ModelNumber> free;
  std::vector<double> values;
  for (const int i : fit.free) {
    free.push_back(places[static_cast<std::size_t>(i)]);
    values.push_back(fit.theta[static_cast<std::size_t>(i)]);
  }
  return mean_of_runs(free, values);
}

// Free parameters, then the constants that were fitted beside them, which bend the parameters.
void put_covariance(const HarmonicFit& fit, const std::vector<FittedConstant>& constants,
                    double scale, DamperHypothesis& out) {
  const MeanOfRuns free = free_numbers(fit);
  const auto q = static_cast<Index>(free.numbers.size());
  const Index size = q + static_cast<Index>(constants.size());
  MatrixXd v = MatrixXd::Zero(size, size);
  v.topLeftCorner(q, q) = free.weight * fit.covariance * free.weight.transpose();
  out.numbers = free.numbers;
  for (std::size_t c = 0; c < constants.size(); ++c) {
    const FittedConstant& constant = constants[c];
    out.numbers.push_back({constant.line, constant.symbol, true});
    Eigen::VectorXd along = Eigen::VectorXd::Zero(size);
    if (constant.bends.size() == fit.covariance.rows())
      along.head(q) = free.weight * constant.bends;
    along[q + static_cast<Index>(c)] = 1.0;
    along *= constant.standard_error;
    v += along * along.transpose();
  }
  v *= scale;
  v.diagonal().head(q) += free.scatter;
  for (Index i = 0; i < size; ++i) {
    for (Index k = 0; k < size; ++k)
      out.covariance.push_back(v(i, k));
  }
}

// The share of an effect of the catalogue that the parameters imitate, at the median.
double imitated_share(const Diagnosis& said) {
  std::vector<double> shares;
  for (const Ranked& ranked : said.ranking)
    shares.push_back(ranked.hidden);
  if (shares.empty()) return 0.0;
  std::sort(shares.begin(), shares.end());
  return std::clamp(shares[shares.size() / 2], 0.0, kMostImitated);
}

// Where more than noise is left, the covariance is larger by as much, and by what the parameters
// have taken of the unnamed effect: it bends them as effects of the catalogue would.
double excess_of(const HarmonicFit& fit, const Diagnosis& said) {
  if (said.verdict != Verdict::unexplained) return 1.0;
  const double freedom = fit.observations - static_cast<double>(fit.free.size());
  return std::max(1.0, fit.chi_squared / std::max(1.0, freedom)) / (1.0 - imitated_share(said));
}

double freedom_of(const std::vector<RunDatum>& data) {
  double freedom = 0.0, count = 0.0;
  for (const RunDatum& datum : data) {
    freedom += datum.freedom.sum();
    count += static_cast<double>(datum.freedom.size());
  }
  return std::max(2.0, count > 0.0 ? freedom / count : 0.0);
}

std::optional<DamperHypothesis> described_hypothesis(const Hypothesis& h, const Selection& found,
                                                     const std::vector<RunDatum>& data,
                                                     const Diagnosis& said) {
  const HarmonicFit& fit = *h.fit;
  if (!fit.covariance.allFinite() || !std::isfinite(fit.chi_squared)) return std::nullopt;
  DamperHypothesis out;
  out.effects = h.effects;
  out.model = at_estimates(fit);
  const auto& own = h.data ? *h.data : data;
  if (fit.at_once ||
      std::any_of(own.begin(), own.end(), [](const RunDatum& d) { return d.to_limit != nullptr; }))
    out.model = stated_sharp(out.model);
  out.model = with_mean_values(with_narrow_smoothing(out.model));
  state_scaled(out.model);
  std::vector<FittedConstant> constants = places_of(h, data, found.base.fit->spec.effects.size());
  if (fit.constant) constants.push_back(*fit.constant);
  put_covariance(fit, constants, excess_of(fit, said), out);
  out.degrees_of_freedom = freedom_of(data);
  return out;
}

// Cells of a grid over the measured motion of all runs; `remaining` has its own.
std::vector<VisitedCell> visited_by(const std::vector<RunCurves>& curves) {
  double low = 1e300, high = -1e300, speed = 0.0;
  for (const RunCurves& run : curves) {
    for (std::size_t i = 0; i < run.stroke.size(); ++i) {
      low = std::min(low, run.stroke[i]);
      high = std::max(high, run.stroke[i]);
      speed = std::max(speed, std::fabs(run.velocity[i]));
    }
  }
  if (!(high > low) || !(speed > 0.0)) return {};
  std::map<std::pair<int, int>, std::pair<VisitedCell, double>> cells;
  for (const RunCurves& run : curves) {
    for (std::size_t i = 0; i < run.stroke.size(); ++i) {
      const std::pair at(static_cast<int>(kVisitedCells * (run.stroke[i] - low) / (high - low)),
                         static_cast<int>(kVisitedCells * (run.velocity[i] / speed + 1.0) / 2.0));
      auto& [cell, count] = cells[at];
      cell.stroke += run.stroke[i];
      cell.velocity += run.velocity[i];
      count += 1.0;
    }
  }
  std::vector<VisitedCell> out;
  for (const auto& [at, of] : cells)
    out.push_back({of.first.stroke / of.second, of.first.velocity / of.second});
  return out;
}

// What is compared, if that is a force, else the acceleration of the measured motion.
double force_in(const RunDatum& datum) {
  if (datum.kind == Kind::imposed_motion || datum.by_force) return motion_in(datum);
  if (datum.sampled) return std::sqrt(datum.sampled->a.array().square().mean());
  const Eigen::VectorXd rate = derivative(datum.response, datum.frequency_hz);
  return root_mean_square(derivative(rate, datum.frequency_hz));
}

// Root mean square over the runs.
double force_in(const std::vector<RunDatum>& data) {
  double sum = 0.0;
  for (const RunDatum& datum : data)
    sum += std::pow(force_in(datum), 2);
  return std::sqrt(sum / std::max(1.0, static_cast<double>(data.size())));
}

// The force that noise could hide, or that is left: the gap's share of the motion is taken as that
// of the force.
double unnamed_force(const std::vector<RunDatum>& data, const Diagnosis& said) {
  double motion = 0.0, count = 0.0;
  for (const RunDatum& datum : data) {
    if (datum.role != Role::fit) continue;
    motion += std::pow(motion_of(datum.response), 2);
    count += 1.0;
  }
  motion = std::sqrt(motion / std::max(1.0, count));
  const double left = std::max(said.gap.after, said.gap.noise_floor);
  const double share = motion > 0.0 ? left / motion : 0.0;
  return std::max(share, kLeastUnnamedForce) * force_in(data);
}

std::vector<VisitedCell> cells_of(const RemainingForce& remaining) {
  std::vector<VisitedCell> cells;
  for (const ForceCell& cell : remaining.cells)
    cells.push_back({cell.stroke, cell.velocity, cell.beside, cell.beside_error});
  return cells;
}

// What a hypothesis leaves where the campaign was; `of_chosen`: what the answer leaves, if that is
// known. Empty where the force cannot be told.
std::vector<VisitedCell> left_by(const Hypothesis& h, const Selection& found,
                                 const std::vector<RunDatum>& data, bool chosen,
                                 const std::optional<RemainingForce>& of_chosen,
                                 SeenPriors& known) {
  if (chosen) return of_chosen ? cells_of(*of_chosen) : std::vector<VisitedCell>();
  const auto own = remaining_force(*h.fit, h.data ? *h.data : data, found.by_gap, known);
  return own ? cells_of(*own) : std::vector<VisitedCell>();
}

}  // namespace

IdentifiedDamper identified_damper(const Selection& found, const std::vector<RunDatum>& data,
                                   const Choice& choice, const ModelProbabilities& probabilities,
                                   const Diagnosis& said, SeenPriors& known) {
  IdentifiedDamper damper;
  damper.verdict = name(said.verdict);
  const bool explained = said.verdict != Verdict::unexplained;
  std::vector<std::pair<double, const Hypothesis*>> all = {{probabilities.of_base(), &found.base}};
  for (std::size_t k = 0; k < found.hypotheses.size(); ++k) {
    const double imitates = explained ? 0.0 : probabilities.imitates(k);
    all.front().first += imitates * probabilities.of(k);
    all.emplace_back((1.0 - imitates) * probabilities.of(k), &found.hypotheses[k]);
  }
  const Hypothesis* first = choice.chosen() != nullptr ? choice.chosen() : &found.base;
  std::stable_sort(all.begin(), all.end(), [&](const auto& a, const auto& b) {
    if ((a.second == first) != (b.second == first)) return a.second == first;
    return a.first > b.first;
  });
  double sum = 0.0;
  for (const auto& [share, hypothesis] : all) {
    const bool chosen = hypothesis == first;
    if (damper.hypotheses.size() == kMostHypotheses || (share < kLeastShare && !chosen)) break;
    auto one = described_hypothesis(*hypothesis, found, data, said);
    if (!one) continue;
    one->probability = std::max(share, kLeastShare);
    if (!explained) one->left = left_by(*hypothesis, found, data, chosen, said.remaining, known);
    sum += one->probability;
    damper.hypotheses.push_back(std::move(*one));
  }
  for (DamperHypothesis& one : damper.hypotheses)
    one.probability /= sum;
  damper.visited = visited_by(said.curves);
  if (said.remaining) damper.visited = cells_of(*said.remaining);
  damper.unnamed_probability =
      explained ? std::max(kLeastUnnamed, probabilities.of_unknown()) : 1.0;
  damper.unnamed_force = unnamed_force(data, said);
  return damper;
}

}  // namespace shaker::estimator::diagnosis
