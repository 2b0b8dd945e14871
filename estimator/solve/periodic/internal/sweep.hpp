// Periodic solutions for one excitation amplitude at many frequencies, for a response map or a
// frequency response. Each solution starts from its neighbours.
//
// The list is cut into eight equal stretches that run as a batch in SIMD lanes. A lane finds its
// first solution from rest and continues from frequency to frequency: the polynomial through its
// last four solutions predicts the next one, and one or two Newton steps correct it. Where two
// stretches meet, the prediction of the first is compared with the start of the second. If they are
// on different branches, the first lane computes the second stretch again. The result is therefore
// that of one pass through the list, with an eighth of the steps.
//
// A sweep does not pass folds: at the end of a branch it starts again from rest. continuation.hpp
// follows branches around their folds.
#pragma once

#include <array>
#include <memory>
#include <span>
#include <vector>

#include "estimator/solve/periodic/periodic_lanes.hpp"
#include "estimator/solve/periodic/periodic_system.hpp"

namespace shaker::estimator {

struct SweepOptions {
  // With 160 points the stroke of the oleo is accurate to 5e-8 ft from 0.5 to 8 Hz.
  GridOptions grid{Scheme::order6, 160, true};
  double tolerance = 1e-8;  // of the Newton iteration, relative to the largest stroke
};

// Mutable workspace of one thread. After a run over as many frequencies, only starts from rest
// allocate.
class FrequencySweep {
 public:
  // `model` must outlive it. Throws std::invalid_argument for too few points.
  explicit FrequencySweep(const Model& model, SweepOptions options = {});
  ~FrequencySweep();

  // Solves for the excitation amplitude * cos(2 pi tau) (m/s^2) at each of `frequencies` (Hz).
  // Throws std::invalid_argument unless they are positive and strictly rising or falling. Returns
  // how many solutions were found; status() gives the reason for the others.
  std::size_t run(std::span<const double> theta, double amplitude,
                  std::span<const double> frequencies);

  int points() const { return options_.grid.points; }
  // The state of the last run at a frequency's index: points * coordinates, as in PeriodicSystem.
  std::span<const double> solution(std::size_t frequency) const {
    return {&states_[frequency * size_], size_};
  }
  SolveStatus status(std::size_t frequency) const { return status_[frequency]; }
  // Linearisations of the last run: of eight lanes at once, or of the single system.
  int steps() const { return steps_; }

 private:
  static constexpr std::size_t kHistory = 4;  // solutions that the predictor uses
  struct Stretch {
    std::size_t next = 0, end = 0;
    std::size_t known = 0;  // solutions in the history
    std::array<double, kHistory> frequency{}, weight{};
    double error = 0.0;  // of the last prediction, relative to the stroke
  };
  void walk_batch(std::span<const double> frequencies);
  void walk(unsigned lanes, std::span<const double> frequencies);
  void step_lanes(unsigned lanes, std::span<const double> frequencies);
  void walk_alone(std::span<const double> frequencies);
  void begin_lane(std::size_t lane, double frequency);
  unsigned correct(unsigned lanes);
  bool rescue(std::size_t lane, double frequency, SolveStatus& status);
  bool same_branch(std::size_t lane, std::size_t joint, double frequency);
  static void weigh_history(Stretch& stretch, double frequency);
  static void remember(Stretch& stretch, double frequency);

  SweepOptions options_;
  std::size_t size_;  // of a solution
  double amplitude_ = 0.0;
  std::vector<double> theta_;
  PeriodicSystem single_, coarse_;
  std::unique_ptr<PeriodicLanes> lanes_;  // null: single_ solves all frequencies
  std::array<Stretch, kLanes> stretches_;
  std::array<AlignedVector, kHistory> history_;  // newest first; value i of lane l at [8 i + l]
  AlignedVector delta_, newton_step_, weights_;
  std::vector<double> states_;
  std::vector<SolveStatus> status_;
  int steps_ = 0;
};

}  // namespace shaker::estimator
