// The drop of one hypothesis as a function of independent standard variates: those along the
// principal axes of its covariance, and those of an unnamed force. Quadratic along each axis that
// matters, linear along the others.
//
// The drops beside the estimates are integrated as accurately as the band can show, and no more.
#pragma once

#include <memory>
#include <optional>
#include <random>
#include <vector>

#include "base/result.hpp"
#include "estimator/drop/drop.hpp"
#include "estimator/drop/unnamed_force.hpp"
#include "estimator/model/identified_damper.hpp"

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
  // the drop at the estimates fails. `weight`: of this part in the mixture. Integrates two drops for
  // each axis that matters and one for each other, which is linear then; so are all where the weight
  // is little. None without a weight.
  static Result<DropSurrogate> make(const DamperHypothesis& damper,
                                    const DropConditions& conditions, double weight = 1.0,
                                    const ForceAlongPath* force = nullptr,
                                    const std::vector<double>* t = nullptr);

  // The drop at the estimates, until shortly after the rebound.
  const DropRun& center() const { return center_; }
  // The same over the whole duration, without a force.
  Result<DropRun> whole() const;
  // Points of the drop up to its end, for a force along it.
  void path(std::vector<double>& t, std::vector<double>& stroke, std::vector<double>& speed) const;

  double linear_error(std::size_t figure) const;  // standard error of the parameters alone
  double quantile(double probability) const;      // of Student's t behind the covariance

  // `draws` from the quadratic. Where it is not enough, and this part has enough `weight` in the
  // mixture to be worth them, drops of their own instead: its share of `exact_draws`.
  DrawnFigures draw(double weight, int draws, int exact_draws, std::mt19937_64& random) const;
  void draw_history(double weight, std::mt19937_64& random, HistoryDraws& into) const;

 private:
  static constexpr double kStep = 2.0;  // standard deviations at which the drops beside are taken
  static constexpr double kLittleWeight = 0.05;     // of a part that is worth few drops
  static constexpr std::size_t kHistoryEvery = 20;  // times of a history that have a band

  struct Axis {
    std::vector<double> numbers;              // per unit variate; empty: they stay
    int mode = -1;                            // of the force; -1: of the covariance
    std::vector<double> slope, bend;          // of the figures
    std::vector<double> stroke, speed, load;  // slopes of the curves at the thinned times
    double reach = 0.0;                       // variates to which it was followed
  };
  // The first drop along an axis, and where it is.
  struct Probe {
    double variate = 0.0;
    DropRun run;
  };

  void keep_within_bounds();
  std::vector<Axis> wanted_axes() const;
  Result<DropRun> run_at(const std::vector<double>& variates) const;
  Result<DropRun> run_along(std::size_t axis, double variate) const;
  std::vector<Probe> probe_axes(const std::vector<Axis>& wanted);
  std::optional<Probe> probe(std::size_t axis) const;
  bool accurate_enough(const std::vector<Probe>& probes) const;
  bool matters(const Probe& probe, const std::vector<double>& spread) const;
  std::vector<double> spread_of(const std::vector<Probe>& probes) const;
  void follow(const std::vector<Probe>& probes);
  void fit_axis(Axis& own, double first, const DropRun& one, double second,
                const DropRun* other) const;
  double step_of(std::size_t number, const std::vector<double>& variates) const;
  bool admissible(const std::vector<double>& variates) const;
  std::vector<double> admissible_variates(std::mt19937_64& random) const;
  std::vector<double> theta_at(const std::vector<double>& variates) const;
  double gas_end(const std::vector<double>& variates) const;
  std::vector<double> figures_at(const std::vector<double>& variates) const;
  std::vector<double> variates(std::mt19937_64& random) const;
  bool quadratic_enough() const;

  DamperHypothesis damper_;
  DropConditions conditions_;
  std::shared_ptr<const DropTest> test_;
  std::vector<int> parameter_of_;  // of each number in the model; -1: a constant
  ForceAlongPath force_;
  std::vector<double> force_t_;
  DropRun center_;     // accurate
  DropRun beside_;     // the same with the effort of the drops beside it
  DropEffort effort_;  // of those
  double whole_duration_ = 0.0;
  double weight_ = 1.0;
  std::vector<Axis> axes_;
};

}  // namespace shaker::estimator
