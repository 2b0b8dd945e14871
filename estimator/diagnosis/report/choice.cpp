#include "estimator/diagnosis/report/choice.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "estimator/diagnosis/select/nesting.hpp"

namespace shaker::estimator::diagnosis {

using Eigen::VectorXd;

namespace {

constexpr double kFirstEffect = 0.75;  // of the gap's square, by the first effect
constexpr double kHalved = 0.5;        // of chi-squared, by one more effect
constexpr double kOfGap = 0.6;         // of the gap's square, by one more where that is weighed
constexpr double kRicher = 0.1;  // of the gap's square, by what holds the simple one and does more
constexpr double kNearlyAll = 0.99;          // of chi-squared that the richer one closes
constexpr double kNearlyAsMuch = 2.0 / 3.0;  // of the gap's square that the best closes

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

bool counts(const Hypothesis& h) {
  return h.disqualified.empty() && std::isfinite(h.fit->chi_squared);
}

Choice::Choice(const Selection& found, const std::vector<RunDatum>& data)
    : found_(found), data_(data) {
  for (const Hypothesis* next = after(found_.base); next != nullptr; next = after(*next))
    path_.push_back(next);
  if (found_.adequate || found_.best >= found_.hypotheses.size()) return;
  const Hypothesis* best = &found_.hypotheses[found_.best];
  if (!counts(*best)) return;
  if (found_.explained)
    chosen_ = best;
  else if (!path_.empty())
    chosen_ = path_.back();
  drop_idle();
  name_simpler();
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

// An effect that the others do better without has not earned its place.
void Choice::drop_idle() {
  const auto better_without = [&](const Hypothesis& h) {
    return chosen_ != nullptr && counts(h) && h.effects.size() + 1 == chosen_->effects.size() &&
           h.log_evidence >= chosen_->log_evidence &&
           std::includes(chosen_->effects.begin(), chosen_->effects.end(), h.effects.begin(),
                         h.effects.end());
  };
  for (auto next = found_.hypotheses.begin(); next != found_.hypotheses.end();) {
    next = std::find_if(found_.hypotheses.begin(), found_.hypotheses.end(), better_without);
    if (next != found_.hypotheses.end()) chosen_ = &*next;
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
  chosen_ = nullptr;
  std::pair<bool, double> most(false, least);
  for (const Hypothesis& h : found_.hypotheses) {
    if (!counts(h) || h.effects.size() > unsure.effects.size()) continue;
    std::pair<bool, double> now(std::includes(unsure.effects.begin(), unsure.effects.end(),
                                              h.effects.begin(), h.effects.end()),
                                1.0);
    for (const std::string& effect : h.effects)
      now.second = dropped_.contains(effect) ? 0.0 : std::min(now.second, probability(effect));
    if (now.second < least || now < most) continue;
    chosen_ = &h;
    most = now;
  }
  return true;
}

// The next larger hypothesis that closes enough of what `smallest` leaves: an effect more, or a
// richer one in the place of the simple one that it holds, where that closes nearly all. Of those
// that close nearly as much, the one with the fewest parameters: friction before hysteresis that
// can do what friction does.
const Hypothesis* Choice::after(const Hypothesis& smallest) const {
  const double next_effect = found_.by_gap ? kOfGap : kHalved;
  const double limit = &smallest == &found_.base ? kFirstEffect : next_effect;
  const auto larger = [&](const Hypothesis& h) {
    if (!counts(h)) return false;
    if (richer(h, smallest)) return left_of(h, smallest) < kRicher;
    return h.effects.size() == smallest.effects.size() + 1 &&
           std::includes(h.effects.begin(), h.effects.end(), smallest.effects.begin(),
                         smallest.effects.end());
  };
  double least = limit;
  for (const Hypothesis& h : found_.hypotheses) {
    if (larger(h)) least = std::min(least, left_of(h, smallest));
  }
  const Hypothesis* next = nullptr;
  for (const Hypothesis& h : found_.hypotheses) {
    if (!larger(h)) continue;
    const double left = left_of(h, smallest);
    if (left >= limit || 1.0 - left < kNearlyAsMuch * (1.0 - least)) continue;
    const auto price = [](const Hypothesis& of) { return of.fit->free.size(); };
    if (next == nullptr || price(h) < price(*next) ||
        (price(h) == price(*next) && h.fit->chi_squared < next->fit->chi_squared))
      next = &h;
  }
  return next;
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
