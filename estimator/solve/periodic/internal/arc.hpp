// One step along a curve of periodic solutions. The equations are those of the ring (5.19); the
// frequency or the amplitude of the excitation is one more unknown, and a plane normal to the
// curve is the last equation. Private to continuation and branch switching.
//
// Both systems of a step have the matrix dg/dz, so one factorisation serves (block elimination).
// dg/dz is singular only exactly at a fold; a Newton step with large rounding errors there is
// corrected by the next one.
#pragma once

#include <span>
#include <vector>

#include "estimator/solve/periodic/periodic_system.hpp"

namespace shaker::estimator {

enum class Along { frequency, amplitude };

// A point of the curve, or a direction: state of the ring and value.
struct ArcPoint {
  std::vector<double> z;
  double value = 0.0;  // frequency, Hz, or amplitude
};

ArcPoint difference(const ArcPoint& a, const ArcPoint& b);

struct StepLimits {
  double least = 1e-6, greatest = 0.05;
};

// cos over `periods` whole periods on `points` equal steps.
std::vector<double> cosine_shape(int points, int periods);

class SolutionArc {
 public:
  // `shape`: the excitation with amplitude 1 at the grid's points; `periods`: the periods of the
  // excitation in it. `held`: the constant one of frequency (Hz) and amplitude (m/s^2). `range`
  // > 0: the interval of the other one that has length 1.
  SolutionArc(const Model& model, std::vector<double> theta, GridOptions grid,
              std::vector<double> shape, int periods, Along along, double held, double range);

  PeriodicSystem& system() { return system_; }
  const std::vector<double>& theta() const { return theta_; }
  Along along() const { return along_; }
  int periods() const { return periods_; }
  double held() const { return held_; }
  double range() const { return range_; }
  double frequency(double value) const { return along_ == Along::frequency ? value : held_; }
  double amplitude(double value) const { return along_ == Along::frequency ? held_ : value; }

  // Scales lengths from here on by the rms motion of each coordinate in `point`, and normalises
  // `direction`.
  void set_scale(const ArcPoint& point, ArcPoint& direction);
  double dot(const ArcPoint& a, const ArcPoint& b) const;

  // Sets state and excitation of the ring to a point and linearises there.
  bool linearise(const ArcPoint& point);
  // Solves at a fixed value from the state `start`.
  bool solve_at(double value, std::span<const double> start, ArcPoint& out);
  // Solves in the plane through `guess` normal to `direction`. Returns the number of iterations, or
  // 0 on failure.
  int correct(const ArcPoint& guess, const ArcPoint& direction, ArcPoint& out, int most = 8);
  // Makes one step from `point` along its unit tangent `direction`; both become those of the next
  // point. `step` is halved until the corrector succeeds and the curve does not bend sharply; it
  // grows after an easy success. Returns false when `step` falls below the least; `point` and
  // `direction` are then unchanged.
  bool advance(ArcPoint& point, ArcPoint& direction, double& step, StepLimits limits);
  // Computes the unit tangent at `point`, on the side of `like`; false when the ring cannot be
  // linearised or is exactly singular.
  bool tangent(const ArcPoint& point, const ArcPoint& like, ArcPoint& out);
  // Computes the null vector of dg/dz where it is singular, by inverse iteration from `direction`.
  bool critical_direction(const ArcPoint& point, ArcPoint& direction);

 private:
  void excite(double value);
  void normalise(ArcPoint& direction) const;
  bool factorise(const ArcPoint& point);

  PeriodicSystem system_;
  std::vector<double> theta_, shape_, points_, rows_, weight_;
  int periods_;
  Along along_;
  double held_, range_;
};

}  // namespace shaker::estimator
