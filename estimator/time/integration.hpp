// Time integration of a model with its sensitivity equations (5.10). From initial conditions it
// computes the trajectory and its derivatives over initial states and parameters.
//
// Integrators:
//   adams, bdf    CVODES, variable step and order; bdf for stiff models (friction with a short
//                 presliding distance). If adams fails, bdf integrates the arc again.
//   runge_kutta4  the method of the paper: classical, fixed steps between the samples, all segments
//                 of all records as a batch in SIMD lanes. Much faster for long records.
//   sdirk4        implicit, L-stable, of order four, with fixed steps in lanes likewise: for long
//                 records of stiff models.
// Only the state equations control CVODES' steps, so a trajectory is the same with and without
// sensitivities, as section 5.1 requires.
//
// Derivatives (the last two serve for comparison):
//   sensitivities       (5.10), integrated with the state
//   augmented_states    (5.11), (5.12): the parameters as constant states (CVODES only)
//   finite_differences  central, one parameter after the other
#pragma once

#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "estimator/time/excitation.hpp"
#include "estimator/time/state_equations.hpp"

namespace shaker::estimator {

enum class Integrator { adams, bdf, runge_kutta4, sdirk4 };
enum class Gradient { sensitivities, augmented_states, finite_differences };

// Whether a step ends at each velocity reversal, where |v| v is not smooth. runge_kutta4 keeps its
// fourth order this way. CVODES restarts at order one each time, which costs more than it gains.
// automatic: runge_kutta4 cuts its steps, CVODES does not. sdirk4 never does.
enum class CutAtReversals { automatic, always, never };

struct TimeOptions {
  Integrator integrator = Integrator::adams;
  Gradient gradient = Gradient::sensitivities;
  // CVODES: relative tolerance, and the absolute one in units of the model (m, m/s).
  double relative_tolerance = 1e-10;
  double absolute_tolerance = 1e-12;
  // CVODES: the sensitivities meet the tolerance too. By default (as section 5.1 requires) only the
  // state controls the steps; at 1e-10 the sensitivities then have an error of about 1e-6 of their
  // size.
  bool control_sensitivities = false;
  // runge_kutta4, sdirk4: the largest step, s; 0: the spacing of the samples.
  double step = 0.0;
  CutAtReversals cut = CutAtReversals::automatic;
  // CVODES, Adams: steps between two samples, after which BDF does the piece anew.
  long max_steps = 50000;
  // runge_kutta4, sdirk4: told of the states and sensitivities whose rates are about to be computed,
  // at each stage of each step; false ends the integration. Empty: it goes on.
  std::function<bool(double numbers)> afford;
};

// One piece of a record, integrated from a given initial state to its last time.
struct Arc {
  std::span<const double> times;  // s, increasing; the first is the time of `start`
  const Excitation* excitation = nullptr;
  std::vector<double> start;  // m states
  // Results, row by row: states (times x m) and sensitivities (times x m x columns). The columns
  // are the m initial states, then the free parameters.
  std::vector<double> states, sensitivities;
  // Private to the integrator: the excitation at its nodes. Clear it when times or excitation
  // change.
  std::vector<double> nodes;
};

struct IntegrationReport {
  bool ok = false;
  bool inadmissible = false;     // inadmissible state (1 - theta3 u <= 0); else integrator failure
  bool stopped = false;          // not afforded any longer; nothing else is said then
  std::size_t arc = 0;           // the arc with the failure
  double reached = 0.0;          // s
  std::string sentence() const;  // empty when ok
};

// A workspace for one thread. runge_kutta4 with integrated sensitivities does not allocate after
// the first call on arcs of one shape; the others do.
class TimeIntegration {
 public:
  // `free`: indices of the parameters whose sensitivities are computed. `equations` must outlive
  // it. Throws std::invalid_argument for invalid options or indices, and std::runtime_error if
  // CVODES cannot be set up.
  static std::unique_ptr<TimeIntegration> make(const StateEquations& equations,
                                               const TimeOptions& options, std::vector<int> free);
  virtual ~TimeIntegration() = default;

  // Fills the results of all arcs. If `sensitivities` is false, those of the arcs do not change.
  // Stops at the first failure; the results are then unspecified.
  virtual IntegrationReport run(std::span<Arc> arcs, std::span<const double> theta,
                                bool sensitivities) = 0;
};

}  // namespace shaker::estimator
