// Pseudo-arclength continuation of periodic solutions over the frequency or the amplitude of the
// excitation: the response curve through its folds, with stability and bifurcations.
//
// With a hardening or softening spring one excitation has several solutions, and the history of the
// rig decides which of them it shows. A curve followed by arclength passes through all connected
// solutions, stable or not. It shows where they meet (folds) and from where the motion repeats
// only after two periods (period doublings).
//
// Method: the unknowns are z of (5.19) and the frequency or amplitude. The predictor goes along the
// unit tangent; the corrector solves in the plane normal to it. The step grows after easy
// corrections and shrinks after failures and sharp bends. A sign change between two points reveals
// a bifurcation, which false position along the chord then locates:
//
//   fold             the value's component of the unit tangent
//   period doubling  det(M + 1), M the monodromy matrix
//   branch point     det(M - 1)
//   torus            the largest |multiplier| - 1, when two multipliers cross the unit circle
#pragma once

#include <complex>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "estimator/solve/periodic/floquet.hpp"
#include "estimator/solve/periodic/internal/arc.hpp"

namespace shaker::estimator {

struct ContinuationOptions {
  GridOptions grid{Scheme::order6, 256, true};  // points of one excitation period
  int periods = 1;           // of the excitation in one period of a new curve's solutions
  int harmonics = 5;         // of the observed coordinate, stored with every point
  double first_step = 0.01;  // lengths: 1 is the whole range, or the motion's own size
  double least_step = 1e-6;
  double greatest_step = 0.05;
  int most_points = 5000;
};

struct BranchPoint {
  double frequency_hz = 0.0, amplitude = 0.0;
  double least = 0.0, most = 0.0;  // of the observed coordinate
  // Observed coordinate: [k] is the complex amplitude c of the k-th harmonic of the whole ring (of
  // the excitation when the ring has one period), Re(c exp(2 pi i k tau)); [0] is the mean.
  std::vector<std::complex<double>> harmonics;
  Floquet floquet;
  bool stable = false;
  double arclength = 0.0;
  double turning = 0.0;  // the value's component of the unit tangent, > 0 on the way to `to`
  ArcPoint at;           // the whole solution
};

enum class Bifurcation { fold, branch_point, period_doubling, torus };
std::string_view name(Bifurcation kind);

struct SpecialPoint {
  Bifurcation kind = Bifurcation::fold;
  BranchPoint point;
  std::size_t after = 0;  // lies between points [after] and [after + 1]
};

struct Branch {
  Along along = Along::frequency;
  double held = 0.0, from = 0.0, to = 0.0;
  int periods = 1;
  std::vector<BranchPoint> points;
  std::vector<SpecialPoint> special;
  bool complete = false;  // reached `to`
  std::string ended;      // sentence: how, where and why it ended
};

// Use it from one thread. All functions allocate. Frequencies in Hz, amplitudes in m/s^2. A failure
// is reported in Branch::ended.
class Continuation {
 public:
  // `model` must outlive it; `theta` has a value for each of its parameters.
  Continuation(const Model& model, std::vector<double> theta, ContinuationOptions options = {});

  // Both start with a solution at `from`, reached from rest. They follow the curve towards `to` and
  // through folds, until the value leaves the interval between `from` and `to` at either end.
  Branch over_frequency(double amplitude, double from, double to);
  Branch over_amplitude(double frequency_hz, double from, double to);
  // Starts at `value` from `start`, an approximate state on this grid, and goes first in the
  // direction from `from` to `to`. A curve that closes on itself is followed once.
  Branch from_state(Along along, double held, double value, double from, double to,
                    std::span<const double> start);

  // Follows the branch with twice the period that leaves `branch` at the period doubling `at`. It
  // starts in the direction of the critical multiplier and ends like the others.
  Branch doubled(const Branch& branch, const SpecialPoint& at);

  // Returns all solutions of the branch at one value, solved there, in the order of the branch.
  std::vector<BranchPoint> solutions_at(const Branch& branch, double value);

  const ContinuationOptions& options() const { return options_; }

 private:
  GridOptions ring(int periods) const;
  SolutionArc make_arc(const Branch& branch) const;
  Branch from_rest(Along along, double held, double from, double to);
  static void end_at_limit(SolutionArc& arc, const ArcPoint& before, const ArcPoint& tangent,
                           double value, ArcPoint& point, ArcPoint& direction);
  void walk(SolutionArc& arc, ArcPoint first, ArcPoint direction, Branch& branch);
  void look_between(SolutionArc& arc, const BranchPoint& a, const BranchPoint& b,
                    const ArcPoint& tangent, Branch& branch);
  std::optional<BranchPoint> between(SolutionArc& arc, const BranchPoint& a, const BranchPoint& b,
                                     const ArcPoint& tangent, double share, bool forward);
  BranchPoint describe(SolutionArc& arc, const ArcPoint& at, double turning);

  const Model* model_;
  std::vector<double> theta_;
  ContinuationOptions options_;
};

// Solves at the excitation of `system` by arclength continuation over the amplitude, through folds.
// It serves where solve_from_rest() fails. On failure the report holds the amplitude reached.
SolveReport solve_through_folds(PeriodicSystem& system, std::span<const double> theta);

}  // namespace shaker::estimator
