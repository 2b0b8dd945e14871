// Time integration of a model with its sensitivity equations (5.10): initial conditions in,
// trajectory and its derivatives over initial states and parameters out.
//
// Three ways to a trajectory:
//   adams, bdf    CVODES, variable step and order; bdf for stiff models (friction with a short
//                 presliding distance). adams hands over to bdf where it gets stuck.
//   runge_kutta4  the paper's: classical, fixed steps between the samples, all segments of all
//                 records abreast in SIMD lanes. Faster by far for long records.
// Only the state equations steer CVODES' steps, so that a trajectory is the same with and without
// sensitivities, as section 5.1 asks.
//
// Three ways to the derivatives, the last two for comparison:
//   sensitivities       (5.10), integrated with the state
//   augmented_states    (5.11), (5.12): the parameters as states that do not change (CVODES only)
//   finite_differences  central, one parameter after the other
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "estimator/time/excitation.hpp"
#include "estimator/time/state_equations.hpp"

namespace shaker::estimator {

enum class Integrator { adams, bdf, runge_kutta4 };
enum class Gradient { sensitivities, augmented_states, finite_differences };

// Ending a step at each reversal of a velocity, where |v| v is not smooth, gives runge_kutta4 its
// fourth order back. CVODES has to begin again at order one each time, which costs it more than it
// gains. automatic: runge_kutta4 does, CVODES does not.
enum class CutAtReversals { automatic, always, never };

struct TimeOptions {
  Integrator integrator = Integrator::adams;
  Gradient gradient = Gradient::sensitivities;
  // CVODES: relative tolerance, and the absolute one in units of the model (m, m/s).
  double relative_tolerance = 1e-10;
  double absolute_tolerance = 1e-12;
  // CVODES: sensitivities hold the tolerance too; by default (as section 5.1 asks) the state alone
  // chooses the steps, and they are good to about 1e-6 of their size at 1e-10.
  bool control_sensitivities = false;
  // runge_kutta4: the largest step, s; 0: the spacing of the samples.
  double step = 0.0;
  CutAtReversals cut = CutAtReversals::automatic;
};

// One piece of a record: from a given initial state to its last time.
struct Arc {
  std::span<const double> times;  // increasing; the first is where `start` holds
  const Excitation* excitation = nullptr;
  std::vector<double> start;  // states
  // Results, row by row: states(times x m); sensitivities(times x m x columns), the columns being
  // the m initial states, then the parameters asked for.
  std::vector<double> states, sensitivities;
  // The integrator's own: excitation at its nodes. Clear it when times or excitation change.
  std::vector<double> nodes;
};

struct IntegrationReport {
  bool ok = false;
  bool inadmissible = false;     // 1 - theta3 u <= 0 or the like; else the integrator gave up
  std::size_t arc = 0;           // which
  double reached = 0.0;          // s
  std::string sentence() const;  // empty when ok
};

// A workspace for one thread. After the first call on arcs of one shape only CVODES allocates.
class TimeIntegration {
 public:
  // `free`: indices of the parameters whose sensitivities are wanted. `equations` must outlive it.
  // Throws std::invalid_argument for options that contradict each other.
  static std::unique_ptr<TimeIntegration> make(const StateEquations& equations,
                                               const TimeOptions& options, std::vector<int> free);
  virtual ~TimeIntegration() = default;

  // Fills the results of all arcs. With `sensitivities` false those are left as they are.
  // Stops at the first trouble; results are then unspecified.
  virtual IntegrationReport run(std::span<Arc> arcs, std::span<const double> theta,
                                bool sensitivities) = 0;
};

}  // namespace shaker::estimator
