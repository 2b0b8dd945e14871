#include "estimator/diagnosis/cycles/internal/quantisation_step.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "estimator/diagnosis/cycles/harmonics.hpp"
#include "estimator/math/aligned.hpp"
#include "estimator/math/lanes.hpp"

namespace shaker::estimator::diagnosis {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr double kRounding = 1e-12;  // of the largest value
constexpr double kFinest = 1e-7;     // of the range: finer steps are nobody's trouble
constexpr double kOffGrid = 0.05;    // of a step
constexpr std::size_t kFewestSteps = 3, kManySteps = 12;
constexpr double kFew = 1e-3;  // of a step, where few values must show the grid

constexpr int kRegisters = 2, kPlaces = kRegisters * kLanes;  // of the grid under the motion
constexpr double kMostSamples = 40000.0;
constexpr double kOfSteps = 0.5;  // of a step: an amplitude that is the curve's own
constexpr Index kNeighbours = 2;
constexpr double kSharp = 0.03, kBlurred = 0.75;  // noise over the step

double smallest_step(const std::vector<double>& sorted, double trifle) {
  double step = sorted.back() - sorted.front();
  for (std::size_t i = 1; i < sorted.size(); ++i) {
    const double apart = sorted[i] - sorted[i - 1];
    if (apart > trifle) step = std::min(step, apart);
  }
  return step;
}

// What is expected of a sample's rounding, in steps, at a place in steps: the saw tooth, its
// harmonics damped by the noise.
double rounded_off(double place, double noise) {
  const double c = std::cos(2.0 * std::numbers::pi * place),
               s = std::sin(2.0 * std::numbers::pi * place);
  double ck = 1.0, sk = 0.0, sum = 0.0;
  for (int k = 1; k * noise < 0.7; ++k) {
    const double next = ck * c - sk * s;
    sk = sk * c + ck * s;
    ck = next;
    const double kept = std::exp(-2.0 * std::pow(std::numbers::pi * k * noise, 2));
    sum += (k % 2 == 0 ? kept : -kept) * sk / (std::numbers::pi * k);
  }
  return sum;
}

// The same without noise, at all places of the grid under the motion.
SHAKER_INLINE void rounded_off_sharply(double place, Lanes (&off)[kRegisters]) {
  constexpr double kRound = 6755399441055744.0;  // 1.5 * 2^52: adding it rounds to an integer
  for (int g = 0; g < kRegisters; ++g) {
    for (int l = 0; l < kLanes; ++l)
      off[g][l] = place + static_cast<double>(g * kLanes + l) / kPlaces;
    off[g] = ((off[g] + kRound) - kRound) - off[g];
  }
}

// The harmonics of samples' rounding, a row of `errors` each, at all those places.
SHAKER_SIMD_CLONES void add_rounding(const double* curve, int size, double noise,
                                     double samples_a_cycle, int points, Lanes* errors) {
  std::vector<double> basis(static_cast<std::size_t>(size), 1.0);
  for (int i = 0; i < points; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / samples_a_cycle;
    const double c = std::cos(angle), s = std::sin(angle);
    double ch = 1.0, sh = 0.0, place = curve[0];
    for (int h = 1; h + 1 < size; h += 2) {
      const double next = ch * c - sh * s;
      sh = sh * c + ch * s;
      ch = next;
      basis[static_cast<std::size_t>(h)] = ch;
      basis[static_cast<std::size_t>(h) + 1] = sh;
      place += curve[h] * ch + curve[h + 1] * sh;
    }
    Lanes off[kRegisters];
    if (noise < kSharp) {
      rounded_off_sharply(place, off);
    } else {
      for (int p = 0; p < kPlaces; ++p)
        off[p / kLanes][p % kLanes] = rounded_off(place + static_cast<double>(p) / kPlaces, noise);
    }
    for (int k = 0; k < size; ++k) {
      for (int g = 0; g < kRegisters; ++g)
        errors[k * kRegisters + g] += basis[static_cast<std::size_t>(k)] * off[g];
    }
  }
}

// The curve that was rounded, as far as the rounded one tells: its harmonics that are no smaller
// than the steps make them.
VectorXd without_steps(VectorXd curve, double quantisation_step) {
  for (Index c = 3; c + 1 < curve.size(); c += 2) {
    if (std::hypot(curve[c], curve[c + 1]) > kOfSteps * quantisation_step) continue;
    curve[c] = curve[c + 1] = 0.0;
  }
  return curve;
}

// Which harmonics are large hangs on details of the curve that are not known: neighbours share.
VectorXd spread_out(const VectorXd& variance) {
  VectorXd even = variance;
  const Index harmonics = (variance.size() - 1) / 2;
  for (Index h = 1; h <= harmonics; ++h) {
    const Index from = std::max<Index>(1, h - kNeighbours);
    const Index to = std::min(harmonics, h + kNeighbours);
    even[2 * h - 1] = even[2 * h] = variance.segment(2 * from - 1, 2 * (to - from + 1)).mean();
  }
  return even;
}

}  // namespace

double quantisation_step_of(const std::vector<double>& values) {
  if (values.size() < kFewestSteps) return 0.0;
  std::vector<double> sorted = values;
  std::sort(sorted.begin(), sorted.end());
  const double range = sorted.back() - sorted.front();
  const double trifle = kRounding * std::max(std::fabs(sorted.front()), std::fabs(sorted.back()));
  const double step = smallest_step(sorted, trifle);
  if (!(step > kFinest * range)) return 0.0;
  // Counted up from neighbour to neighbour, so that a step that is slightly wrong does not matter.
  std::vector<double> number(sorted.size(), 0.0);
  std::size_t levels = 1;
  for (std::size_t i = 1; i < sorted.size(); ++i) {
    number[i] = number[i - 1] + std::round((sorted[i] - sorted[i - 1]) / step);
    levels += number[i] > number[i - 1] ? 1 : 0;
  }
  if (levels < kFewestSteps) return 0.0;
  const double quantisation_step = range / number.back();
  const double allowed = (levels < kManySteps ? kFew : kOffGrid) * quantisation_step + trifle;
  for (std::size_t i = 0; i < sorted.size(); ++i) {
    if (std::fabs(sorted[i] - sorted.front() - quantisation_step * number[i]) > allowed) return 0.0;
  }
  return quantisation_step;
}

VectorXd rounding_variance(const VectorXd& curve, double quantisation_step, double noise,
                           const Sampling& sampling) {
  const Index size = curve.size();
  if (!(quantisation_step > 0.0) || noise > kBlurred * quantisation_step)
    return VectorXd::Zero(size);
  const VectorXd smooth = without_steps(curve, quantisation_step) / quantisation_step;
  const double cycles = std::clamp(std::floor(kMostSamples / sampling.samples_a_cycle), 1.0,
                                   static_cast<double>(sampling.cycles));
  const int points = static_cast<int>(cycles * sampling.samples_a_cycle);
  AlignedVector errors(static_cast<std::size_t>(size * kPlaces), 0.0);
  add_rounding(smooth.data(), static_cast<int>(size), noise / quantisation_step,
               sampling.samples_a_cycle, points, as_lanes(errors.data()));
  const double scale = 2.0 * quantisation_step / points;
  VectorXd variance =
      scale * scale *
      Eigen::Map<const Eigen::MatrixXd>(errors.data(), kPlaces, size).cwiseAbs2().colwise().mean();
  variance[0] *= 0.25;
  return spread_out(variance);
}

}  // namespace shaker::estimator::diagnosis
