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
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "estimator/solve/time/excitation.hpp"
#include "estimator/solve/time/state_equations.hpp"

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
  // make_stick_slip(): velocity below which a mass is at rest; its friction has turned round well
  // below it.
  double still = 0.0;
  // CVODES, Adams: steps between two samples, and evaluations of the rates in an arc, after which BDF
  // integrates the arc anew.
  long max_steps = 50000, max_evaluations = std::numeric_limits<long>::max();
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
  // For sums(): what the observed coordinate is compared with, at the nodes from `first_measured` on.
  std::span<const double> measured;
  std::size_t first_measured = 0;
  // Set it when what the spans or the excitation refer to has changed; the integrator resets it.
  bool changed = true;
};

// Of arcs that are only compared, not kept: the state at the end of each arc, its derivatives (states
// x columns, row by row), and the products of all its rows. A row has the derivatives of the observed
// coordinate and then the measured value less that coordinate. Products are symmetric, in full.
struct ArcSums {
  std::size_t states = 0, columns = 0;
  std::vector<double> numbers;  // arc by arc

  std::size_t size() const { return states * (1 + columns) + (columns + 1) * (columns + 1); }
  double* end(std::size_t arc) { return &numbers[arc * size()]; }
  const double* end(std::size_t arc) const { return &numbers[arc * size()]; }
  double* derivatives(std::size_t arc) { return end(arc) + states; }
  const double* derivatives(std::size_t arc) const { return end(arc) + states; }
  double* products(std::size_t arc) { return end(arc) + states * (1 + columns); }
  const double* products(std::size_t arc) const { return end(arc) + states * (1 + columns); }
};

// How sums() goes. What is left of an arc after its last whole step is left out.
struct SumOptions {
  std::size_t stride = 1;  // samples in a step, and from one that is compared to the next
  bool between = false;    // compares the samples between too, by cubics, where it can
  bool cut = true;         // as TimeOptions::cut says; else steps are not cut at reversals
};

struct IntegrationReport {
  bool ok = false;
  bool inadmissible = false;     // inadmissible state (1 - theta3 u <= 0); else integrator failure
  bool stiff = false;            // CVODES: Adams failed, so that BDF integrated an arc
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
  explicit TimeIntegration(const StateEquations& equations) : equations_(equations) {}
  virtual ~TimeIntegration() = default;

  // Fills the results of all arcs. If `sensitivities` is false, those of the arcs do not change.
  // Stops at the first failure; the results are then unspecified.
  virtual IntegrationReport run(std::span<Arc> arcs, std::span<const double> theta,
                                bool sensitivities) = 0;

  // The same with sensitivities, without any results in the arcs: sums them up.
  virtual IntegrationReport sums(std::span<Arc> arcs, std::span<const double> theta,
                                 const SumOptions& options, ArcSums& out);
  // Whether sums() can take strides above 1.
  virtual bool strides() const { return false; }

 protected:
  const StateEquations& equations_;
};

}  // namespace shaker::estimator
