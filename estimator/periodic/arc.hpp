// One step along a curve of periodic solutions: the ring's equations (5.19) with the frequency or
// the amplitude of the excitation as one unknown more, closed by a plane across the curve. Private
// to continuation and branch switching.
//
// Both systems that a step needs have dg/dz as matrix, so that the factorised ring serves (block
// elimination). At a fold dg/dz is singular, but only there, and a Newton step that rounding spoilt
// is mended by the next.
#pragma once

#include <span>
#include <vector>

#include "estimator/periodic/periodic_system.hpp"

namespace shaker::estimator {

enum class Along { frequency, amplitude };

// A point of the curve, and a direction in the same shape.
struct ArcPoint {
  std::vector<double> z;
  double value = 0.0;  // frequency, Hz, or amplitude
};

ArcPoint difference(const ArcPoint& a, const ArcPoint& b);

struct StepLimits {
  double least = 1e-6, greatest = 0.05;
};

// cos over each of `periods` periods on `points` points.
std::vector<double> cosine_shape(int points, int periods);

class Arc {
 public:
  // `shape` is the excitation for an amplitude of 1 at the grid's points, `periods` how many of its
  // periods they span; `held` the one of frequency and amplitude that does not change, and `range`
  // > 0 the interval of the other over which a length of 1 is measured.
  Arc(const Model& model, std::vector<double> theta, GridOptions grid, std::vector<double> shape,
      int periods, Along along, double held, double range);

  PeriodicSystem& system() { return system_; }
  const std::vector<double>& theta() const { return theta_; }
  Along along() const { return along_; }
  int periods() const { return periods_; }
  double held() const { return held_; }
  double range() const { return range_; }
  double frequency(double value) const { return along_ == Along::frequency ? value : held_; }
  double amplitude(double value) const { return along_ == Along::frequency ? held_ : value; }

  // Lengths are measured with each coordinate over its own motion in `point` from here on;
  // `direction` gets unit length again.
  void set_scale(const ArcPoint& point, ArcPoint& direction);
  double dot(const ArcPoint& a, const ArcPoint& b) const;

  // Puts the ring at a point and linearises it there.
  bool linearise(const ArcPoint& point);
  // Solves at a fixed value from the state `start`.
  bool solve_at(double value, std::span<const double> start, ArcPoint& out);
  // Solves in the plane through `guess` across `direction`. Returns the iterations, 0 on failure.
  int correct(const ArcPoint& guess, const ArcPoint& direction, ArcPoint& out, int most = 8);
  // From `point` one step along its unit tangent `direction`; both become those of the next point.
  // `step` is halved until the corrector succeeds and the curve does not bend sharply, and grows
  // after an easy success. False, nothing changed, when it fell below the least.
  bool advance(ArcPoint& point, ArcPoint& direction, double& step, StepLimits limits);
  // Unit tangent at `point`, on the side of `like`; false when the ring is exactly singular.
  bool tangent(const ArcPoint& point, const ArcPoint& like, ArcPoint& out);
  // Where dg/dz is singular, its null vector, by inverse iteration from `direction`.
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
