// The two methods of a fit. Private to the sources of the estimator.
#pragma once

#include <limits>
#include <string>
#include <vector>

#include "estimator/fit/internal/gauss_newton_equations.hpp"
#include "estimator/fit/internal/periodic_solutions.hpp"

namespace shaker::estimator {

// How far the lifted method has come with its steps.
class LiftedProgress {
 public:
  enum class Next { another_step, finer_grid, done, failed };
  // A new grid; what the steps on the one before showed is kept.
  void begin_grid() { without_progress_ = 0; }
  // After the iteration-th step on a grid. `step`: the largest relative change of theta and the
  // states; `state_step`: of the states alone; `approach`: on the coarse grid; `whole`: it was not
  // shortened.
  Next after_step(double step, double state_step, int iteration, bool approach, bool whole,
                  double tolerance);

 private:
  double last_step_ = std::numeric_limits<double>::infinity();
  int without_progress_ = 0;  // steps that did not shrink
};

// What both methods move: theta in `fit`, and the periodic solutions.
struct Search {
  FitData& data;
  PeriodicSolutions& solutions;
  GaussNewtonEquations& equations;
  Fit& fit;

  // Sums the normal equations from the present linearisation of the single systems.
  void accumulate() const;
  void move_theta() const;  // along the step
};

// Lifted Gauss-Newton: one iteration moves theta and the periodic solutions together.
class LiftedSearch : Search {
 public:
  explicit LiftedSearch(const Search& search);
  // Moves fit.theta to the optimum. Returns false if the iteration does not contract.
  bool run(bool warm);

  // The questions of the loop: math/damped_minimum.hpp.
  bool compute_step(double lambda);
  bool converged_before_step() const { return false; }
  bool step_is_successful();
  bool converged_after_success() const { return now_.next != LiftedProgress::Next::another_step; }
  bool converged_after_failure() const { return false; }

 private:
  struct Halving;
  bool approach_from_data();
  bool start_along_data(double share);
  // The steps on one level. `first`: the start may be far.
  bool steps(bool approach, bool first);
  void shorten_last_step(bool approach, double share);
  std::vector<double> start_, theta_before_;
  LiftedProgress progress_;
  struct Steps {
    bool approach = false, first = false;  // as for steps()
    int iteration = 0;
    bool admissible = true;  // the solutions could be linearised
    LiftedProgress::Next next = LiftedProgress::Next::another_step;
  } now_;  // on one grid
};

// The nested methods: for every theta the periodic solutions converge first.
class NestedSearch : Search {
 public:
  explicit NestedSearch(const Search& search);
  // Moves fit.theta to the optimum, and sets the status of the fit. `damped`: Levenberg-Marquardt,
  // otherwise Gauss-Newton.
  void run(const std::vector<double>& start, bool warm, bool damped);

  // The questions of the loop: math/damped_minimum.hpp.
  bool compute_step(double lambda);
  bool converged_before_step() const { return false; }
  bool step_is_successful();
  bool converged_after_success();
  bool converged_after_failure();

 private:
  bool solve_after_step(bool damped);
  void step_back();
  bool nothing_to_gain();
  std::string why_not_converged() const;
  std::vector<double> theta_before_;
  std::vector<std::vector<double>> states_before_;
  SolveReport last_;          // of the last run that was solved
  std::size_t last_run_ = 0;  // which one that is
  std::vector<double> start_;
  bool damped_ = true;
  struct Trial {
    double before = 0.0;  // objective before the step
    double size = 0.0;    // of the step, relative
    bool pure = false;    // neither damped nor shortened
  } trial_;
  double previous_ = 0.0;  // size of the step before, if it was pure
  int at_bottom_ = 0;      // very short steps in turn
};

}  // namespace shaker::estimator
