#include "estimator/diagnosis/report/internal/choice.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "estimator/diagnosis/select/internal/nesting.hpp"
#include "estimator/diagnosis/select/internal/weights.hpp"

namespace shaker::estimator::diagnosis {

using Eigen::VectorXd;

namespace {

constexpr std::size_t kMostEffects = 3;
constexpr double kNearlyAll = 0.99;  // of chi-squared that the richer one closes

// The same effects, but for one in the place of a simpler one that it holds.
bool richer(const Hypothesis& h, const Hypothesis& simple) {
  std::vector<std::string> less;
  for (const std::string& effect : h.effects) {
    const bool shared =
        std::find(simple.effects.begin(), simple.effects.end(), effect) != simple.effects.end();
    less.push_back(shared ? effect : simpler_than(effect));
  }
  std::sort(less.begin(), less.end());
  return h.effects != simple.effects && less == simple.effects;
}

// What the one holds in the place of the other's effects does no more than they do.
bool only_richer(const Hypothesis& h, const Hypothesis& simple) {
  return std::all_of(h.effects.begin(), h.effects.end(), [&](const std::string& effect) {
    return std::find(simple.effects.begin(), simple.effects.end(), effect) !=
               simple.effects.end() ||
           reduces(*h.fit, effect);
  });
}

}  // namespace

VectorXd residual_of(const HarmonicFit& fit, const std::vector<RunDatum>& data, std::size_t run) {
  return data[run].response - fit.predictions[run].value();
}

Choice::Choice(const Selection& found, const std::vector<RunDatum>& data)
    : found_(found), data_(data) {
  if (found_.adequate || found_.best >= found_.hypotheses.size()) return;
  const Hypothesis* best = &found_.hypotheses[found_.best];
  if (!counts(*best)) return;
  chosen_ = found_.explained ? best : heaviest(kMostEffects);
  name_simpler();
}

const Hypothesis* Choice::heaviest(std::size_t most) const {
  return Weights(found_, data_).heaviest(most, [&](const Hypothesis& h) {
    return std::none_of(h.effects.begin(), h.effects.end(),
                        [&](const std::string& effect) { return dropped_.contains(effect); });
  });
}

// A record has no corners that are sharper than its samples: what a static peak as narrow as that
// gains there beside the simpler effect is the corner's.
void Choice::name_simpler() {
  if (chosen_ == nullptr || !on_samples(data_)) return;
  const Hypothesis& best = *chosen_;
  const double before = found_.base.fit->chi_squared;
  const double least = before - kNearlyAll * (before - best.fit->chi_squared);
  for (const Hypothesis& h : found_.hypotheses) {
    if (counts(h) && h.fit->chi_squared < least && richer(best, h) && only_richer(best, h))
      chosen_ = &h;
  }
}

bool Choice::drop_unlikely(const std::function<double(const std::string&)>& probability,
                           double least) {
  if (chosen_ == nullptr) return false;
  const Hypothesis& unsure = *chosen_;
  const std::size_t known = dropped_.size();
  for (const std::string& effect : unsure.effects) {
    if (probability(effect) < least) dropped_.insert(effect);
  }
  if (dropped_.size() == known) return false;
  chosen_ = heaviest(unsure.effects.size());
  return true;
}

double Choice::left_of(const Hypothesis& one, const Hypothesis& other) const {
  double mine = 0.0, theirs = 0.0;
  for (std::size_t r = 0; r < data_.size(); ++r) {
    if (data_[r].role != Role::fit) continue;
    const auto left = [&](const Hypothesis& h) {
      return root_mean_square(without_own_zero(data_[r], residual_of(*h.fit, data_of(h), r)));
    };
    mine += std::pow(left(one), 2);
    theirs += std::pow(left(other), 2);
  }
  return std::min(one.fit->chi_squared / other.fit->chi_squared, mine / theirs);
}

const std::vector<RunDatum>& Choice::data_of(const Hypothesis& h) const {
  return h.data ? *h.data : data_;
}

}  // namespace shaker::estimator::diagnosis
