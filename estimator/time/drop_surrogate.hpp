// The drop of one hypothesis as a function of independent standard variates: those along the
// principal axes of its covariance, and those of an unnamed force. Quadratic along each axis.
#pragma once

#include <memory>
#include <random>
#include <vector>

#include "base/result.hpp"
#include "estimator/time/drop.hpp"
#include "estimator/time/identified_damper.hpp"
#include "estimator/time/unnamed_force.hpp"

namespace shaker::estimator {

struct DrawnFigures {
  std::vector<std::vector<double>> figures;  // one a draw, in the order of kDropFigures
  double lost_share = 0.0;                   // of the draws that give no drop
};

// Draws of the curves at some times, weighted.
struct HistoryDraws {
  std::vector<double> t;
  std::vector<std::vector<double>> stroke, speed, load;  // a list of draws for each time
  std::vector<double> weight;                            // of each draw
  // Adds the quantiles `tail` and 1 - tail of a curve at each time.
  void ends(const std::vector<std::vector<double>>& curve, double tail, std::vector<double>& lower,
            std::vector<double>& upper) const;
};

class DropSurrogate {
 public:
  // `force`: an unnamed force beside the parameters, at the times `t`; null: none. An Error where
  // the drop at the estimates fails. `weight`: of this part in the mixture. Integrates two drops an
  // axis, or one where the weight is little, and that axis is linear then; none without a weight.
  static Result<DropSurrogate> make(const DamperHypothesis& damper,
                                    const DropConditions& conditions, double weight = 1.0,
                                    const ForceAlongPath* force = nullptr,
                                    const std::vector<double>* t = nullptr);

  // The drop at the estimates: over the whole duration, and until shortly after the rebound.
  const DropRun& whole() const { return whole_; }
  const DropRun& center() const { return center_; }
  // Points of the drop up to its end, for a force along it.
  void path(std::vector<double>& t, std::vector<double>& stroke, std::vector<double>& speed) const;

  double linear_error(std::size_t figure) const;  // standard error of the parameters alone
  double quantile(double probability) const;      // of Student's t behind the covariance

  // `draws` from the quadratic. Where it is not enough, and this part has enough `weight` in the
  // mixture to be worth them, drops of their own instead: its share of `exact_draws`.
  DrawnFigures draw(double weight, int draws, int exact_draws, std::mt19937_64& random) const;
  void draw_history(double weight, std::mt19937_64& random, HistoryDraws& into) const;

 private:
  struct Axis {
    std::vector<double> numbers;              // per unit variate; empty: they stay
    int mode = -1;                            // of the force; -1: of the covariance
    std::vector<double> slope, bend;          // of the figures
    std::vector<double> stroke, speed, load;  // slopes of the curves at the thinned times
    double reach = 0.0;                       // variates to which it was followed
    bool one_sided = false;                   // no drop is beyond the estimate on one side
  };

  void keep_within_bounds();
  Result<DropRun> run_at(const std::vector<double>& variates) const;
  void add_axis(Axis axis);
  void fit_axis(Axis& own, double first, const DropRun& one, double second,
                const DropRun* other) const;
  bool add_linear_axis(Axis& own, std::vector<double> at) const;
  double step_of(std::size_t number, const std::vector<double>& variates) const;
  bool admissible(const std::vector<double>& variates) const;
  std::vector<double> admissible_variates(std::mt19937_64& random) const;
  std::vector<double> figures_at(const std::vector<double>& variates) const;
  std::vector<double> variates(std::mt19937_64& random) const;
  bool quadratic_enough() const;

  DamperHypothesis damper_;
  DropConditions conditions_;
  std::shared_ptr<const DropTest> test_;
  std::vector<int> parameter_of_;  // of each number in the model; -1: a constant
  ForceAlongPath force_;
  std::vector<double> force_t_;
  DropRun whole_, center_;
  double weight_ = 1.0;
  std::vector<Axis> axes_;
};

}  // namespace shaker::estimator
