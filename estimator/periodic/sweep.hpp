// Periodic solutions of one excitation at many frequencies, each begun from its neighbours: what a
// response map or a frequency response over a whole band asks for.
//
// The list is cut into eight equal stretches that run side by side in SIMD lanes. A lane finds its
// first solution from rest and goes on from frequency to frequency: the polynomial through its last
// four solutions predicts the next, one or two Newton steps correct it. Where two stretches meet,
// what the first predicts is held against where the second began; if they are not on the same
// branch of solutions, the first goes on in place of the second. So the result is that of one walk
// through the list, at an eighth of its steps.
//
// It does not pass folds: where the walk comes to the end of its branch it starts again from rest.
// continuation.hpp follows branches around their folds.
#pragma once

#include <array>
#include <memory>
#include <span>
#include <vector>

#include "estimator/periodic/periodic_lanes.hpp"
#include "estimator/periodic/periodic_system.hpp"

namespace shaker::estimator {

struct SweepOptions {
  // 160 points hold the stroke of the oleo to 5e-8 of a foot from 0.5 to 8 Hz.
  GridOptions grid{Scheme::order6, 160, true};
  double tolerance = 1e-8;  // of the Newton iteration, against the largest stroke
};

// Mutable workspace of one thread. After the first run over as many frequencies only the starts
// from rest allocate.
class FrequencySweep {
 public:
  // `model` must outlive it. Throws std::invalid_argument for too few points.
  explicit FrequencySweep(const Model& model, SweepOptions options = {});
  ~FrequencySweep();

  // Excitation amplitude * cos(2 pi tau) at each of `frequencies` (Hz, positive, rising or falling;
  // throws std::invalid_argument otherwise). How many solutions were found; the rest have a status
  // that says why not.
  std::size_t run(std::span<const double> theta, double amplitude,
                  std::span<const double> frequencies);

  int points() const { return options_.grid.points; }
  // State at points * coordinates, as in PeriodicSystem; of the last run.
  std::span<const double> solution(std::size_t frequency) const {
    return {&states_[frequency * size_], size_};
  }
  SolveStatus status(std::size_t frequency) const { return status_[frequency]; }
  // Linearisations in all: of eight lanes at once, or of the single system.
  int steps() const { return steps_; }

 private:
  static constexpr std::size_t kHistory = 4;  // solutions that the predictor uses
  struct Stretch {
    std::size_t next = 0, end = 0;
    std::size_t known = 0;  // solutions in the history
    std::array<double, kHistory> frequency{}, weight{};
    double error = 0.0;  // of the last prediction, against the stroke
  };
  void walk_abreast(std::span<const double> frequencies);
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
  std::unique_ptr<PeriodicLanes> lanes_;  // null: one system walks alone
  std::array<Stretch, kLanes> stretches_;
  std::array<AlignedVector, kHistory> history_;  // newest first; of lane l at [8 i + l]
  AlignedVector delta_, newton_step_, weights_;
  std::vector<double> states_;
  std::vector<SolveStatus> status_;
  int steps_ = 0;
};

}  // namespace shaker::estimator
