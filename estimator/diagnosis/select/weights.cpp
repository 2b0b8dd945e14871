#include "estimator/diagnosis/select/internal/weights.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

namespace shaker::estimator::diagnosis {
namespace {

constexpr double kIndependent = 4.0;      // numbers in a run's model error: its parts hang together
constexpr double kShareOfRecord = 0.125;  // of a record's

std::size_t size_of_catalogue(const Selection& found) {
  std::set<const Candidate*> all;
  for (const Score& score : found.base_scoring.scores)
    all.insert(score.candidate);
  return all.size();
}

// Independent numbers in the model errors of all runs.
double numbers_in(const std::vector<RunDatum>& data) {
  double sum = 0.0;
  for (const RunDatum& datum : data) {
    if (datum.role != Role::fit) continue;
    sum +=
        datum.sampled ? kShareOfRecord * static_cast<double>(datum.response.size()) : kIndependent;
  }
  return sum;
}

// Chi-squared of what the best leaves, over that of noise.
double excess(const Selection& found) {
  const auto of = [](const Hypothesis& h) {
    const double freedom = h.fit->observations - static_cast<double>(h.fit->free.size());
    return h.fit->chi_squared / std::max(1.0, freedom);
  };
  double least = of(found.base);
  for (const Hypothesis& h : found.hypotheses) {
    if (counts(h)) least = std::min(least, of(h));
  }
  return std::max(1.0, least);
}

}  // namespace

bool counts(const Hypothesis& h) {
  return h.disqualified.empty() && std::isfinite(h.fit->chi_squared);
}

Weights::Weights(const Selection& found, const std::vector<RunDatum>& data)
    : found_(found),
      catalogue_(size_of_catalogue(found)),
      only_noise_(!found.by_gap && (found.explained || found.adequate)) {
  // Errors that are what a first search left are one with the model's.
  const double by_noise = found.by_gap ? 0.0 : found.base.fit->observations / excess(found);
  numbers_ = std::max({by_noise, numbers_in(data), kIndependent});
}

double Weights::log_of(const Hypothesis& h) const {
  if (only_noise_) return h.log_evidence + log_before(h.effects.size());
  const double parameters = h.added * std::log(numbers_);
  return -0.5 *
             (numbers_ * std::log(h.fit->chi_squared / found_.base.fit->chi_squared) + parameters) +
         log_before(h.effects.size());
}

double Weights::log_of_effects() const {
  double largest = -std::numeric_limits<double>::infinity(), sum = 0.0;
  for (const Hypothesis& h : found_.hypotheses) {
    if (counts(h)) largest = std::max(largest, log_of(h));
  }
  for (const Hypothesis& h : found_.hypotheses) {
    if (counts(h)) sum += std::exp(log_of(h) - largest);
  }
  return sum > 0.0 ? largest + std::log(sum) : largest;
}

double Weights::log_of_runs_that_differ(double log_evidence) const {
  return log_evidence + std::log(static_cast<double>(std::max<std::size_t>(catalogue_, 1)));
}

// Log of what a set of so many effects has beforehand, over what one effect has: few campaigns lack
// two, and of the pairs there are many more.
double Weights::log_before(std::size_t effects) const {
  constexpr double kOneMore = 0.1;  // that one more is missing
  double sum = 0.0;
  for (std::size_t k = 1; k < effects; ++k) {
    const double others = catalogue_ > k ? static_cast<double>(catalogue_ - k) : 1.0;
    sum += std::log(kOneMore * static_cast<double>(k + 1) / others);
  }
  return sum;
}

}  // namespace shaker::estimator::diagnosis
