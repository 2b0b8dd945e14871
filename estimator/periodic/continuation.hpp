// A curve of periodic solutions over the frequency or the amplitude of the excitation: the response
// curve, followed by pseudo-arclength through its folds, with what lives on it.
//
// Where a spring hardens or softens, one excitation has several solutions; which of them the rig is
// on depends on how it got there. A curve followed by arclength passes through all that hang
// together, stable or not, and says where they meet (folds) and where the motion takes two periods
// to repeat from then on (period doublings).
//
// Method: the unknowns z of (5.19) and the frequency or amplitude; predictor along the unit
// tangent, corrector in the plane across it; the step grows after easy corrections and shrinks
// after failures and sharp bends. A bifurcation between two points shows as a sign change and is
// located by false position on the arclength: a fold by the tangent's share of the value, a period
// doubling by det(M + 1) of the monodromy matrix M, a branch point by det(M - 1), a torus by the
// count of complex multipliers outside the unit circle.
#pragma once

#include <complex>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "estimator/periodic/arc.hpp"
#include "estimator/periodic/floquet.hpp"

namespace shaker::estimator {

struct ContinuationOptions {
  GridOptions grid{Scheme::order6, 256, true};  // points of one excitation period
  int periods = 1;           // of the excitation, after which a new curve's solutions repeat
  int harmonics = 5;         // of the observed coordinate, kept with every point
  double first_step = 0.01;  // lengths: 1 is the whole range, or the motion's own size
  double least_step = 1e-6;
  double greatest_step = 0.05;
  int most_points = 5000;
};

struct BranchPoint {
  double frequency_hz = 0.0, amplitude = 0.0;
  double least = 0.0, most = 0.0;  // of the observed coordinate
  // Observed coordinate: [k] is the complex amplitude of the k-th harmonic of the whole cyclic time
  // (of the excitation when it is one period long), Re(c exp(2 pi i k tau)); [0] the mean.
  std::vector<std::complex<double>> harmonics;
  Floquet floquet;
  bool stable = false;
  double arclength = 0.0;
  double turning = 0.0;  // the tangent's share of the value, > 0 on the way to `to`
  ArcPoint at;           // the whole solution
};

enum class Bifurcation { fold, branch_point, period_doubling, torus };
std::string_view name(Bifurcation kind);

struct SpecialPoint {
  Bifurcation kind = Bifurcation::fold;
  BranchPoint point;
  std::size_t after = 0;  // stands between points [after] and [after + 1]
};

struct Branch {
  Along along = Along::frequency;
  double held = 0.0, from = 0.0, to = 0.0;
  int periods = 1;
  std::vector<BranchPoint> points;
  std::vector<SpecialPoint> special;
  bool complete = false;  // got to `to`
  std::string ended;      // sentence: how, where and why it ended
};

// One thread. Allocates.
class Continuation {
 public:
  // `model` must outlive it; `theta` has all its parameters.
  Continuation(const Model& model, std::vector<double> theta, ContinuationOptions options = {});

  // Both from a solution at `from` that is reached from rest, towards `to` and through folds, until
  // the value leaves the interval between them at either end.
  Branch over_frequency(double amplitude, double from, double to);
  Branch over_amplitude(double frequency_hz, double from, double to);
  // From a solution of one's own at `value` (`start` is a state on this grid, approximate), first
  // in the direction from `from` to `to`; a curve that closes on itself is followed once.
  Branch from_state(Along along, double held, double value, double from, double to,
                    std::span<const double> start);

  // The branch with twice the period that leaves `branch` at a period doubling, along the critical
  // multiplier's direction; followed until the value leaves the interval of `branch`.
  Branch doubled(const Branch& branch, const SpecialPoint& at);

  // All solutions on the branch at one value, solved there exactly, in the order of the branch.
  std::vector<BranchPoint> solutions_at(const Branch& branch, double value);

  const ContinuationOptions& options() const { return options_; }

 private:
  GridOptions ring(int periods) const;
  Arc make_arc(const Branch& branch) const;
  Branch from_rest(Along along, double held, double from, double to);
  void walk(Arc& arc, ArcPoint first, ArcPoint direction, Branch& branch);
  void look_between(Arc& arc, const BranchPoint& a, const BranchPoint& b, const ArcPoint& tangent,
                    Branch& branch);
  std::optional<BranchPoint> between(Arc& arc, const BranchPoint& a, const BranchPoint& b,
                                     const ArcPoint& tangent, double share, bool forward);
  BranchPoint describe(Arc& arc, const ArcPoint& at, double turning);

  const Model* model_;
  std::vector<double> theta_;
  ContinuationOptions options_;
};

// A solution at the excitation of `system` when growing the excitation step by step fails: by
// arclength over the amplitude, through folds. On failure the report says how far that got.
SolveReport solve_through_folds(PeriodicSystem& system, std::span<const double> theta);

}  // namespace shaker::estimator
