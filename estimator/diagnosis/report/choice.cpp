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

// True if `simple` has the same effects but for a special case of one. `allowed`: the fit must allow
// the special case; otherwise it must stand there.
bool only_richer(const Hypothesis& h, const Hypothesis& simple, bool allowed) {
  return std::any_of(h.effects.begin(), h.effects.end(), [&](const std::string& effect) {
    const auto special = simpler_than(effect);
    return std::any_of(special.begin(), special.end(), [&](const std::string& simpler) {
      return with_instead(h.effects, effect, simpler) == simple.effects &&
             (allowed ? reduces(*h.fit, effect, simpler)
                      : is_special_case(*h.fit, effect, simpler));
    });
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
// gains there beside the simpler effect is the corner's. Where something unknown is left, an effect at
// the end of its range that is a simpler one only imitates it.
void Choice::name_simpler() {
  const bool corners = on_samples(data_);
  if (chosen_ == nullptr || (found_.explained && !corners)) return;
  const Hypothesis& best = *chosen_;
  const double before = found_.base.fit->chi_squared;
  const double least = before - kNearlyAll * (before - best.fit->chi_squared);
  for (const Hypothesis& h : found_.hypotheses) {
    if (counts(h) && h.fit->chi_squared < least && only_richer(best, h, corners)) chosen_ = &h;
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
