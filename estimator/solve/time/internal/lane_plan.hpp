// A batch of arcs, one in each SIMD lane: their times, excitation and data at each node.
#pragma once

#include <span>
#include <vector>

#include "estimator/math/aligned.hpp"
#include "estimator/solve/time/integration.hpp"

namespace shaker::estimator {

inline constexpr int kLanesAbreast = 32;  // their numbers fit the first cache

class LanePlan {
 public:
  // Arcs `first` to `first + lanes - 1`; steps between samples are at most `step` s, if that is not
  // 0. The arcs' spans and excitations must outlive it.
  void lay(std::span<const Arc> arcs, std::size_t first, int lanes, double step);
  // Whether it was laid for these arcs.
  bool is_of(std::span<const Arc> arcs, std::size_t first, int lanes) const;

  std::size_t first() const { return first_; }
  int lanes() const { return lanes_; }
  std::size_t intervals() const { return parts_.size(); }  // between samples, of the longest arc
  int parts(std::size_t interval) const { return parts_[interval]; }  // steps in an interval
  bool uniform() const { return uniform_; }  // an interval has as many steps as any other

  // A value for each lane; an arc that has ended stays at its last one.
  const double* times(std::size_t sample) const { return row(t_, sample); }
  const double* measured(std::size_t sample) const { return row(y_, sample); }
  // Two half steps for each step.
  const double* excitation(std::size_t half_step) const { return row(x_, half_step); }
  std::size_t first_half_step(std::size_t interval) const { return half_steps_[interval]; }

  // On 64-byte boundaries, to the next multiple of 8: the last sample of each lane, and which of
  // its samples count (`from` <= sample < `to`).
  const double* last() const { return last_.data(); }
  const double* from() const { return from_.data(); }
  const double* to() const { return to_.data(); }

 private:
  struct Source {
    const double* times;
    const Excitation* excitation;
    const double* measured;
    std::size_t size;
  };
  static Source source_of(const Arc& arc);
  const double* row(const std::vector<double>& values, std::size_t at) const {
    return &values[at * static_cast<std::size_t>(lanes_)];
  }
  void lay_lane(const Arc& arc, std::size_t lane);

  std::size_t first_ = 0;
  int lanes_ = 0;
  bool uniform_ = true;
  std::vector<int> parts_;
  std::vector<std::size_t> half_steps_;
  std::vector<double> t_, x_, y_;
  AlignedVector last_, from_, to_;
  std::vector<Source> sources_;
};

// Lays plans for all arcs, kLanesAbreast each; those that were laid for the same arcs stay.
void lay_plans(std::span<Arc> arcs, double step, std::vector<LanePlan>& plans);

}  // namespace shaker::estimator
