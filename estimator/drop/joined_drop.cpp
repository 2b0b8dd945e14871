#include "estimator/drop/joined_drop.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <utility>

#include <Eigen/Dense>
#include <fmt/format.h>

#include "estimator/drop/drop_mixture.hpp"
#include "estimator/fit/records/transient.hpp"
#include "estimator/math/dense.hpp"
#include "estimator/math/statistics.hpp"

namespace shaker::estimator {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

constexpr double kFalseAlarm = 0.01;       // of a hypothesis that is true, by all three tests
constexpr std::size_t kMostJoined = 1000;  // samples; of a longer record every second, third, ...
constexpr std::size_t kFewestJoined = 20;
constexpr std::size_t kSlowParts = 12;  // means of that many pieces are the slow part
// Samples for one degree of freedom of a noise that comes from the record: the median has 0.37 of
// the efficiency of a mean square, and neighbours share what they tell.
constexpr double kSamplesPerFreedom = 6.0;
constexpr double kStatedFreedom = 1e6;
constexpr double kBestTransducer = 1e-5;  // noise over the largest stroke
constexpr double kLeastRootVariance = 1e-10;
// Half of the weight stays with what the band held before.
constexpr double kUnnamedWhereItDisagrees = 0.5;

// The smallest step between neighbours: that of the rounding, if there is one.
double rounding_step(const std::vector<double>& values) {
  double step = std::numeric_limits<double>::infinity();
  for (std::size_t i = 1; i < values.size(); ++i) {
    const double next = std::fabs(values[i] - values[i - 1]);
    if (next > 0.0) step = std::min(step, next);
  }
  return std::isfinite(step) ? step : 0.0;
}

// The fit of one hypothesis to the drop, with its campaign as prior.
struct FittedToDrop {
  HypothesisInDrop said;
  std::optional<double> evidence;       // logarithm, but for what all hypotheses share
  std::vector<std::size_t> parameters;  // of the hypothesis' numbers: those that were free
  std::vector<double> values, covariance;
};

class DropFit {
 public:
  DropFit(const DamperHypothesis& damper, const DropConditions& conditions,
          const DropRecord& record, double noise)
      : damper_(damper), record_(record), noise_(noise), test_(damper.model, conditions) {
    extended_ = conditions.extended;
  }

  FittedToDrop run() {
    choose_parameters();
    const Model model(spec_);
    order_as(model);
    if (means_.empty()) {
      out_.said.trouble = "it has no uncertain parameter";
      return std::move(out_);
    }
    TransientOptions options;
    options.prior = TransientPrior{means_, prior_, noise_};
    options.segment = record_.t.size() + 1;
    options.time.max_steps = kStepsBeforeBdf;
    TransientEstimator estimator(model, {as_record()}, options);
    const TransientFit& fit = estimator.fit(model.start());
    if (fit.status != FitStatus::converged) {
      out_.said.trouble = fit.trouble.empty() ? "it is not determined" : fit.trouble;
      return std::move(out_);
    }
    judge(fit, estimator.residuals(0));
    if (!out_.said.agrees) return std::move(out_);
    if (constants_ > 0) {
      out_.said.trouble = "its fitted constants do not follow a drop";
      return std::move(out_);
    }
    out_.said.joined = true;
    for (std::size_t k = 0; k < fit.theta.size(); ++k) {
      if (!model.parameters()[k].fixed) out_.values.push_back(fit.theta[k]);
    }
    out_.covariance = fit.covariance;
    return std::move(out_);
  }

 private:
  static constexpr long kStepsBeforeBdf = 300;

  // Uncertain parameters are free, everything else is held. The lift is a constant excitation of the
  // mass alone.
  void choose_parameters() {
    spec_ = damper_.model;
    const std::size_t equations = spec_.coordinates.size();
    spec_.excitation.assign(std::max<std::size_t>(1, equations), 0.0);
    spec_.excitation[0] = 1.0;
    const Model model(spec_);
    for (const ModelNumber& place : numbers_of(model))
      spec_.effects[place.line].parameters[place.symbol].fixed = true;
    const std::size_t size = damper_.numbers.size();
    for (std::size_t k = 0; k < size; ++k) {
      const ModelNumber& number = damper_.numbers[k];
      const double variance =
          damper_.covariance.size() == size * size ? damper_.covariance[k * size + k] : 0.0;
      if (number.constant && variance > 0.0) ++constants_;
      if (!number.constant && variance > 0.0)
        spec_.effects[number.line].parameters[number.symbol].fixed = false;
    }
  }

  // The prior in the order of the free parameters.
  void order_as(const Model& model) {
    const auto places = numbers_of(model);
    const std::size_t size = damper_.numbers.size();
    for (std::size_t k = 0; k < places.size(); ++k) {
      if (model.parameters()[k].fixed) continue;
      const auto at = std::find_if(damper_.numbers.begin(), damper_.numbers.end(),
                                   [&](const ModelNumber& number) {
                                     return !number.constant && number.line == places[k].line &&
                                            number.symbol == places[k].symbol;
                                   });
      out_.parameters.push_back(static_cast<std::size_t>(at - damper_.numbers.begin()));
      means_.push_back(model.parameters()[k].start);
    }
    for (const std::size_t i : out_.parameters) {
      for (const std::size_t k : out_.parameters)
        prior_.push_back(damper_.covariance[i * size + k]);
    }
  }

  TransientRecord as_record() const {
    TransientRecord record;
    record.name = "the measured drop";
    record.t = record_.t;
    record.displacement = record_.stroke;
    for (double& stroke : record.displacement)
      stroke += extended_;
    record.excitation = Excitation::constant(-test_.lift());
    for (const double state : test_.touch_down()) {
      InitialState known;
      known.value = state;
      known.known = true;
      record.initial.push_back(known);
    }
    record.start = 0.0;
    return record;
  }

  void judge(const TransientFit& fit, const std::vector<double>& left) {
    const auto n = static_cast<double>(left.size());
    const auto q = static_cast<double>(out_.parameters.size());
    const double squares = std::inner_product(left.begin(), left.end(), left.begin(), 0.0);
    const double freedom = record_.noise > 0.0 ? kStatedFreedom : n / kSamplesPerFreedom;
    const double variance = noise_ * noise_;
    double chance = fisher_f_above(squares / variance / (n - q), n - q, freedom);
    double slow = 0.0;
    for (std::size_t part = 0; part < kSlowParts; ++part) {
      const std::size_t from = part * left.size() / kSlowParts,
                        to = (part + 1) * left.size() / kSlowParts;
      double sum = 0.0;
      for (std::size_t i = from; i < to; ++i)
        sum += left[i];
      slow += sum * sum / static_cast<double>(to - from);
    }
    const auto parts = static_cast<double>(kSlowParts);
    chance = std::min(chance, fisher_f_above(slow / variance / parts, parts, freedom));
    chance = std::min(
        chance, fisher_f_above(fit.prior_sum / q, q,
                               std::clamp(damper_.degrees_of_freedom, 2.0, kMostCampaignFreedom)));
    out_.said.left = std::sqrt(squares / n);
    out_.said.moved = std::sqrt(fit.prior_sum / q);
    out_.said.agrees = chance > kFalseAlarm / 3.0;
    out_.evidence = -0.5 * (squares / variance + fit.prior_sum) - 0.5 * narrowing(fit);
  }

  // The logarithm of how much smaller the drop makes the volume of the parameters, squared.
  double narrowing(const TransientFit& fit) const {
    const auto q = static_cast<Index>(out_.parameters.size());
    const MatrixXd before = Eigen::Map<const MatrixXd>(prior_.data(), q, q);
    const MatrixXd after = Eigen::Map<const MatrixXd>(fit.covariance.data(), q, q);
    const Eigen::VectorXd inverse = before.diagonal().cwiseSqrt().cwiseInverse();
    const auto logarithm = [&](const MatrixXd& v) {
      const Eigen::VectorXd values =
          spectrum_of(inverse.asDiagonal() * v * inverse.asDiagonal()).values;
      return values.cwiseMax(kLeastRootVariance).array().log().sum();
    };
    return logarithm(before) - logarithm(after);
  }

  const DamperHypothesis& damper_;
  const DropRecord& record_;
  double noise_, extended_ = 0.0;
  DropTest test_;
  config::ModelSpec spec_;
  std::vector<double> means_, prior_;
  int constants_ = 0;
  FittedToDrop out_;
};

// The part of the record up to the end of the rebound, and not more samples than count.
DropRecord used_part(const DropRecord& record, double end) {
  const auto size = static_cast<std::size_t>(
      std::upper_bound(record.t.begin(), record.t.end(), end) - record.t.begin());
  const std::size_t every = size / kMostJoined + 1;
  DropRecord used;
  used.noise = record.noise;
  for (std::size_t i = 0; i < size; i += every) {
    used.t.push_back(record.t[i]);
    used.stroke.push_back(record.stroke[i]);
  }
  return used;
}

// Puts the numbers of a fit into the hypothesis from which `stripped` came by taking the instruments
// off; their own numbers leave its covariance.
void put_joined(const FittedToDrop& fit, const DamperHypothesis& stripped, DamperHypothesis& into) {
  std::vector<ModelNumber> own;  // of the stripped numbers, in the lines of the whole model
  for (const ModelNumber& number : into.numbers) {
    if (own.size() == stripped.numbers.size()) break;
    const ModelNumber& next = stripped.numbers[own.size()];
    if (number.symbol == next.symbol && number.constant == next.constant &&
        into.model.effects.at(number.line).effect == stripped.model.effects.at(next.line).effect)
      own.push_back(number);
  }
  into.numbers.clear();
  for (std::size_t i = 0; i < fit.parameters.size(); ++i) {
    into.numbers.push_back(own.at(fit.parameters[i]));
    set_value(into.model, into.numbers.back(), fit.values[i]);
  }
  into.covariance = fit.covariance;
}

// The probabilities after the drop. A hypothesis without a fit keeps its own.
void weigh_again(const std::vector<FittedToDrop>& fits, std::vector<DamperHypothesis>& hypotheses) {
  double best = -std::numeric_limits<double>::infinity(), weighed = 0.0, sum = 0.0;
  for (std::size_t h = 0; h < fits.size(); ++h) {
    if (!fits[h].evidence) continue;
    best = std::max(best, *fits[h].evidence);
    weighed += hypotheses[h].probability;
  }
  std::vector<double> share(fits.size(), 0.0);
  for (std::size_t h = 0; h < fits.size(); ++h) {
    if (fits[h].evidence) share[h] = hypotheses[h].probability * std::exp(*fits[h].evidence - best);
    sum += share[h];
  }
  for (std::size_t h = 0; h < fits.size(); ++h) {
    if (fits[h].evidence && sum > 0.0) hypotheses[h].probability = weighed * share[h] / sum;
  }
}

}  // namespace

double noise_of_record(const std::vector<double>& t, const std::vector<double>& values) {
  if (t.size() < 5) return std::numeric_limits<double>::quiet_NaN();
  std::vector<double> apart;
  for (std::size_t i = 2; i + 2 < t.size(); ++i) {
    const std::size_t beside[] = {i - 2, i - 1, i + 1, i + 2};
    double off = values[i], squares = 1.0;
    for (const std::size_t a : beside) {
      double weight = 1.0;
      for (const std::size_t b : beside)
        weight *= a == b ? 1.0 : (t[i] - t[b]) / (t[a] - t[b]);
      off -= weight * values[a];
      squares += weight * weight;
    }
    apart.push_back(std::fabs(off) / std::sqrt(squares));
  }
  const auto middle = apart.begin() + static_cast<std::ptrdiff_t>(apart.size() / 2);
  std::nth_element(apart.begin(), middle, apart.end());
  const double largest =
      std::fabs(*std::max_element(values.begin(), values.end(),
                                  [](double a, double b) { return std::fabs(a) < std::fabs(b); }));
  constexpr double kMedianOfNormal = 0.6745;
  return std::max({*middle / kMedianOfNormal, rounding_step(values) / std::sqrt(12.0),
                   kBestTransducer * largest});
}

Result<JoinedDrop> join_drop(const IdentifiedDamper& damper, const DropConditions& conditions,
                             const DropRecord& record) {
  JoinedDrop out;
  out.damper = damper;
  std::vector<FittedToDrop> fits;
  DropRecord used;
  for (DamperHypothesis& hypothesis : out.damper.hypotheses) {
    const DamperHypothesis stripped = without_instruments(hypothesis);
    fits.emplace_back();
    const DropTest test(stripped.model, conditions);
    const auto run = test.run(test.model().start(), false);
    if (!run) {
      fits.back().said.trouble = run.error().what;
      continue;
    }
    if (used.t.empty()) {
      used = used_part(record, end_of_rebound(run->history));
      if (used.t.size() < kFewestJoined)
        return Error{ErrorKind::invalid,
                     fmt::format("{} samples up to the end of the rebound; it takes {} to join",
                                 used.t.size(), kFewestJoined)};
      out.noise = record.noise > 0.0 ? record.noise : noise_of_record(record.t, record.stroke);
    }
    fits.back() = DropFit(stripped, conditions, used, out.noise).run();
    // A transducer on a joint that gives may have been zeroed under the weight.
    const auto zeroed = zeroed_under_weight(hypothesis, conditions);
    if (zeroed && !fits.back().said.agrees) {
      auto other = DropFit(stripped, *zeroed, used, out.noise).run();
      if (other.said.agrees) fits.back() = std::move(other);
    }
    if (fits.back().said.joined) put_joined(fits.back(), stripped, hypothesis);
  }
  out.points = used.t.size();
  const bool any =
      std::any_of(fits.begin(), fits.end(), [](const auto& f) { return f.said.agrees; });
  if (any) weigh_again(fits, out.damper.hypotheses);
  std::vector<std::size_t> order(fits.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return out.damper.hypotheses[a].probability > out.damper.hypotheses[b].probability;
  });
  if (!any) std::sort(order.begin(), order.end());
  const auto unordered = std::move(out.damper.hypotheses);
  out.damper.hypotheses.clear();
  for (const std::size_t h : order) {
    out.damper.hypotheses.push_back(unordered[h]);
    out.hypotheses.push_back(std::move(fits[h].said));
  }
  out.intervals_hold = !out.hypotheses.empty() && out.hypotheses.front().agrees;
  if (!out.intervals_hold && damper.visited.size() >= 3 && damper.unnamed_force > 0.0)
    out.damper.unnamed_probability = std::max(damper.unnamed_probability, kUnnamedWhereItDisagrees);
  return out;
}

}  // namespace shaker::estimator
