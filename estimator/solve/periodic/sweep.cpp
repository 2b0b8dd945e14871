#include "estimator/solve/periodic/internal/sweep.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "estimator/solve/periodic/continuation.hpp"
#include "estimator/solve/periodic/newton_rate.hpp"

namespace shaker::estimator {
namespace {

constexpr int kMaxSweepSteps = 12;
// A prediction belongs to another branch if its error is kWorse times that of the last prediction
// and exceeds kWrong times the stroke.
constexpr double kWorse = 10.0;
constexpr double kWrong = 1e-3;

GridOptions coarser(GridOptions grid) {
  if (grid.scheme != Scheme::fourier && grid.points >= 80) grid.points /= 2;
  return grid;
}

bool has(unsigned lanes, std::size_t lane) {
  return (lanes >> lane & 1U) != 0;
}

void check(std::span<const double> frequencies) {
  for (std::size_t i = 0; i < frequencies.size(); ++i) {
    const bool ordered =
        i < 2 || (frequencies[i] > frequencies[i - 1]) == (frequencies[1] > frequencies[0]);
    const bool apart = i == 0 || frequencies[i] != frequencies[i - 1];
    if (!(frequencies[i] > 0.0) || !std::isfinite(frequencies[i]) || !ordered || !apart)
      throw std::invalid_argument("a sweep's frequencies must be positive, and rise or fall");
  }
}

// Predicts the states of the lanes in `moving`: weighted sums of their histories.
SHAKER_SIMD_CLONES void combine(int n, const Lanes* const (&history)[4], const Lanes* weights,
                                const LaneMask& moving, Lanes* z) {
  for (int i = 0; i < n; ++i) {
    const Lanes sum = weights[0] * history[0][i] + weights[1] * history[1][i] +
                      weights[2] * history[2][i] + weights[3] * history[3][i];
    z[i] = chosen(moving, sum, z[i]);
  }
}

SHAKER_SIMD_CLONES void push(int n, Lanes* const (&history)[4], const LaneMask& moving,
                             const Lanes* z) {
  for (int i = 0; i < n; ++i) {
    for (int h = 3; h >= 1; --h)
      history[h][i] = chosen(moving, history[h - 1][i], history[h][i]);
    history[0][i] = chosen(moving, z[i], history[0][i]);
  }
}

// Solves from rest, by arclength through folds if the continuation in amplitude fails.
SolveReport solve_anew(PeriodicSystem& system, std::span<const double> theta) {
  const SolveReport report = system.solve_from_rest(theta);
  return report.status == SolveStatus::no_convergence ? solve_through_folds(system, theta) : report;
}

}  // namespace

FrequencySweep::FrequencySweep(const Model& model, SweepOptions options)
    : options_(options),
      size_(static_cast<std::size_t>(options.grid.points * model.coordinates())),
      single_(model, options.grid),
      coarse_(model, coarser(options.grid)) {
  if (PeriodicLanes::possible(model, options.grid)) {
    lanes_ = std::make_unique<PeriodicLanes>(model, options.grid, false);
    delta_.resize(static_cast<std::size_t>(kLanes * model.parameter_count()));
    newton_step_.resize(kLanes);
    weights_.resize(kHistory * kLanes);
  }
  for (AlignedVector& past : history_)
    past.resize(size_ * (lanes_ ? kLanes : 1));
}

FrequencySweep::~FrequencySweep() = default;

std::size_t FrequencySweep::run(std::span<const double> theta, double amplitude,
                                std::span<const double> frequencies) {
  check(frequencies);
  amplitude_ = amplitude;
  steps_ = 0;
  theta_.assign(theta.begin(), theta.end());
  states_.resize(frequencies.size() * size_);
  status_.assign(frequencies.size(), SolveStatus::no_convergence);
  stretches_ = {};
  if (lanes_)
    walk_batch(frequencies);
  else
    walk_alone(frequencies);
  return static_cast<std::size_t>(
      std::count(status_.begin(), status_.end(), SolveStatus::converged));
}

// Sets the Lagrange weights of the solutions in the history for `frequency`.
void FrequencySweep::weigh_history(Stretch& stretch, double frequency) {
  stretch.weight.fill(0.0);
  for (std::size_t h = 0; h < stretch.known; ++h) {
    double over = 1.0;
    double under = 1.0;
    for (std::size_t m = 0; m < stretch.known; ++m) {
      if (m == h) continue;
      over *= frequency - stretch.frequency[m];
      under *= stretch.frequency[h] - stretch.frequency[m];
    }
    stretch.weight[h] = over / under;
  }
}

void FrequencySweep::remember(Stretch& stretch, double frequency) {
  std::copy_backward(stretch.frequency.begin(), stretch.frequency.end() - 1,
                     stretch.frequency.end());
  stretch.frequency[0] = frequency;
  stretch.known = std::min(stretch.known + 1, kHistory);
}

// --- a batch of eight stretches

void FrequencySweep::walk_batch(std::span<const double> frequencies) {
  const std::size_t count = frequencies.size();
  const std::size_t length = (count + kLanes - 1) / kLanes;
  single_.set_excitation(1.0, amplitude_);
  for (std::size_t l = 0; l < kLanes; ++l) {
    lanes_->set_excitation(static_cast<int>(l), single_);
    for (std::size_t k = 0; k < theta_.size(); ++k)
      lanes_->theta()[kLanes * k + l] = theta_[k];
    stretches_[l].next = std::min(l * length, count);
    stretches_[l].end = std::min((l + 1) * length, count);
  }
  lanes_->begin();
  walk(kAllLanes, frequencies);
  std::size_t owner = 0;  // the lane whose branch reaches the joint
  for (std::size_t l = 1; l < kLanes && l * length < count; ++l) {
    if (same_branch(owner, l * length, frequencies[l * length])) {
      owner = l;
      continue;
    }
    stretches_[owner].next = l * length;
    stretches_[owner].end = stretches_[l].end;
    walk(1U << owner, frequencies);
  }
}

// Moves each lane of `lanes` from frequency to frequency until all are at the end of their stretch.
void FrequencySweep::walk(unsigned lanes, std::span<const double> frequencies) {
  for (;;) {
    unsigned going = 0;
    for (std::size_t l = 0; l < kLanes; ++l) {
      if (has(lanes, l) && stretches_[l].next < stretches_[l].end) going |= 1U << l;
    }
    if (going == 0) return;
    step_lanes(going, frequencies);
  }
}

void FrequencySweep::step_lanes(unsigned lanes, std::span<const double> frequencies) {
  unsigned predicted = 0;
  for (std::size_t l = 0; l < kLanes; ++l) {
    if (!has(lanes, l)) continue;
    Stretch& stretch = stretches_[l];
    const double frequency = frequencies[stretch.next];
    lanes_->set_frequency(static_cast<int>(l), frequency);
    if (stretch.known == 0) {
      begin_lane(l, frequency);
      continue;
    }
    predicted |= 1U << l;
    weigh_history(stretch, frequency);
    for (std::size_t h = 0; h < kHistory; ++h)
      weights_[kLanes * h + l] = stretch.weight[h];
  }
  if (predicted != 0) {
    combine(points(),
            {as_lanes(history_[0].data()), as_lanes(history_[1].data()),
             as_lanes(history_[2].data()), as_lanes(history_[3].data())},
            as_lanes(weights_.data()), mask_of(predicted), as_lanes(lanes_->state()));
  }
  unsigned found = correct(lanes);
  for (std::size_t l = 0; l < kLanes; ++l) {
    if (!has(lanes, l)) continue;
    Stretch& stretch = stretches_[l];
    const double frequency = frequencies[stretch.next];
    if (!has(found, l)) {
      stretch.known = 0;
      if (rescue(l, frequency, status_[stretch.next])) found |= 1U << l;
    } else {
      status_[stretch.next] = SolveStatus::converged;
    }
    double* out = &states_[stretch.next * size_];
    for (std::size_t i = 0; i < size_; ++i)
      out[i] = lanes_->state()[kLanes * i + l];
    if (has(found, l)) remember(stretch, frequency);
    ++stretch.next;
  }
  push(points(),
       {as_lanes(history_[0].data()), as_lanes(history_[1].data()), as_lanes(history_[2].data()),
        as_lanes(history_[3].data())},
       mask_of(found), as_lanes(lanes_->state()));
}

// Solves from rest on the coarse grid and interpolates. Newton's method on the full grid follows.
void FrequencySweep::begin_lane(std::size_t lane, double frequency) {
  coarse_.set_excitation(frequency, amplitude_);
  coarse_.solve_from_rest(theta_);
  single_.interpolate_from(coarse_);
  for (std::size_t i = 0; i < size_; ++i)
    lanes_->state()[kLanes * i + lane] = single_.state()[i];
}

// Solves a frequency from rest, with damping and continuation, after the prediction failed.
bool FrequencySweep::rescue(std::size_t lane, double frequency, SolveStatus& status) {
  single_.set_excitation(frequency, amplitude_);
  status = solve_anew(single_, theta_).status;
  for (std::size_t i = 0; i < size_; ++i)
    lanes_->state()[kLanes * i + lane] = single_.state()[i];
  return status == SolveStatus::converged;
}

// Iterates Newton's method in `lanes`. Returns a mask of the lanes that converged.
unsigned FrequencySweep::correct(unsigned lanes) {
  std::array<double, kLanes> last;
  last.fill(std::numeric_limits<double>::infinity());
  unsigned moving = lanes;
  unsigned found = 0;
  for (int step = 0; step < kMaxSweepSteps && moving != 0; ++step, ++steps_) {
    moving &= lanes_->linearise(moving);
    moving &= lanes_->solve_step(moving);
    lanes_->advance(delta_.data(), newton_step_.data(), moving);
    for (std::size_t l = 0; l < kLanes; ++l) {
      if (!has(moving, l)) continue;
      const double size = newton_step_[l];
      if (step == 0) stretches_[l].error = size;
      if (!std::isfinite(size) || (step > 2 && size > 0.9 * last[l])) {
        moving &= ~(1U << l);
      } else if (left_after(size, last[l]) <= options_.tolerance) {
        found |= 1U << l;
        moving &= ~(1U << l);
      }
      last[l] = size;
    }
  }
  return found;
}

// Tests if the prediction of `lane` at a joint is on the branch where the next stretch started.
bool FrequencySweep::same_branch(std::size_t lane, std::size_t joint, double frequency) {
  Stretch& stretch = stretches_[lane];
  if (stretch.known == 0 || status_[joint] != SolveStatus::converged) return stretch.known == 0;
  weigh_history(stretch, frequency);
  double error = 0.0;
  double size = 0.0;
  for (std::size_t i = 0; i < size_; ++i) {
    double sum = 0.0;
    for (std::size_t h = 0; h < kHistory; ++h)
      sum += stretch.weight[h] * history_[h][kLanes * i + lane];
    const double value = states_[joint * size_ + i];
    error = std::max(error, std::fabs(sum - value));
    size = std::max(size, std::fabs(value));
  }
  return error <= std::max(kWorse * stretch.error, kWrong) * size;
}

// --- a single system: several coordinates, effects with memory, Fourier

void FrequencySweep::walk_alone(std::span<const double> frequencies) {
  Stretch& stretch = stretches_[0];
  const auto z = single_.state();
  for (std::size_t f = 0; f < frequencies.size(); ++f) {
    single_.set_excitation(frequencies[f], amplitude_);
    weigh_history(stretch, frequencies[f]);
    for (std::size_t i = 0; stretch.known > 0 && i < size_; ++i) {
      z[i] = 0.0;
      for (std::size_t h = 0; h < kHistory; ++h)
        z[i] += stretch.weight[h] * history_[h][i];
    }
    SolveReport report;
    report.status = SolveStatus::no_convergence;
    if (stretch.known > 0) report = single_.solve(theta_, kMaxSweepSteps);
    if (report.status != SolveStatus::converged) {
      stretch.known = 0;
      report = solve_anew(single_, theta_);
    }
    steps_ += report.iterations;
    status_[f] = report.status;
    std::copy(z.begin(), z.end(), &states_[f * size_]);
    if (report.status != SolveStatus::converged) continue;
    std::rotate(history_.begin(), history_.end() - 1, history_.end());
    std::copy(z.begin(), z.end(), history_[0].begin());
    remember(stretch, frequencies[f]);
  }
}

}  // namespace shaker::estimator
