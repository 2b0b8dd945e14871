#include "estimator/diagnosis/cycles/internal/clipping.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include <Eigen/Dense>

#include "estimator/diagnosis/cycles/internal/quantisation_step.hpp"
#include "estimator/math/dense.hpp"
#include "estimator/math/numbers.hpp"

namespace shaker::estimator::diagnosis {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kWithin = 1.5;  // times as long as a cosine's crest

// Samples on the extreme value, one crest's: [begin, end).
struct Flat {
  std::size_t begin = 0, end = 0;
};

constexpr double kOneCrest = 0.15;   // of a cycle: flats no further apart are one, broken by noise
constexpr double kShortestFlat = 2;  // samples, on average
constexpr double kMostCycles = 0.5;  // share of them that shows it
constexpr double kStepsCut = 2.0;    // of the grid: less is a crest within one step
constexpr double kLeastCut = 0.002;  // of the range
// Of the range. Coarser steps can hide where a damper that sticks, or a valve, bends into its rest:
// both flanks must tell then. On a fine grid one is enough, as a force may jump on the other side.
constexpr double kFineStep = 1e-3;
// Further from the flat a slip that is soon over bends the other way: the nearest tell as well.
constexpr Eigen::Index kFewestBeside = 4;
constexpr double kUnsure = 2.0;     // standard errors by which a flank may be gentler
constexpr double kSureSlope = 4.0;  // standard errors
// Of a step: rounding leaves 0.29, and this much lets hardly two neighbours stay on one value.
constexpr double kNoisy = 1.0;
constexpr double kTrifle = 1e-5;     // of the range
constexpr double kBand = 6.0;        // of the noise: from a flat's highest sample to its lowest
constexpr double kQuiet = 1e-3;      // of the range: under more noise a damper may come to rest
constexpr double kShortestBand = 3;  // samples, on average
constexpr double kDome = 0.6;        // of the noise
constexpr double kBandsCut = 3.0;
constexpr double kSameForce = 0.01;  // of its range

// A channel turned so that the end which is asked for is its highest value.
struct Ended {
  std::vector<double> y;
  double highest = 0.0, next = 0.0, range = 0.0;  // next: below the highest
};

Ended ended(std::span<const double> y, bool top) {
  Ended end;
  double low = std::numeric_limits<double>::infinity();
  end.highest = -low;
  for (const double value : y) {
    end.y.push_back(top ? value : -value);
    end.highest = std::max(end.highest, end.y.back());
    low = std::min(low, end.y.back());
  }
  end.range = end.highest - low;
  end.next = low;
  for (const double value : end.y) {
    if (value < end.highest) end.next = std::max(end.next, value);
  }
  return end;
}

std::vector<Flat> flats_of(const Ended& end, double samples_a_cycle) {
  std::vector<Flat> flats;
  for (std::size_t i = 0; i < end.y.size(); ++i) {
    if (end.y[i] != end.highest) continue;
    if (flats.empty() || static_cast<double>(i - flats.back().end) > kOneCrest * samples_a_cycle)
      flats.push_back({i, i});
    flats.back().end = i + 1;
  }
  return flats;
}

double length_of(const std::vector<Flat>& flats) {
  double length = 0.0;
  for (const Flat& f : flats)
    length += static_cast<double>(f.end - f.begin) / static_cast<double>(flats.size());
  return length;
}

// The grid of all other values: a clipped one need not stand on it.
double grid_beside(const Ended& end) {
  std::vector<double> others = end.y;
  std::erase(others, end.highest);
  return quantisation_step_of(others);
}

// How steeply a channel comes to its flats on one side, a sample, and how it bends there: the
// parabola through the mean of what lies beside them. `noise`: what a flat's own one leaves.
struct Flank {
  double slope = 0.0, bend = 0.0, slope_error = 0.0, bend_error = 0.0, noise = 0.0;
};

Flank flank_of(const Ended& end, const std::vector<Flat>& flats, Eigen::Index samples, bool after) {
  const std::vector<double>& y = end.y;
  const Eigen::VectorXd j = Eigen::VectorXd::LinSpaced(samples, 1.0, static_cast<double>(samples));
  Eigen::MatrixXd basis(samples, 3);
  basis << Eigen::VectorXd::Ones(samples), j, j.cwiseAbs2();
  const PivotedQr solver(basis);
  const auto wide = static_cast<std::size_t>(samples);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero(), squares = Eigen::Vector3d::Zero();
  double seen = 0.0, left = 0.0;
  for (const Flat& f : flats) {
    if (after ? f.end + wide > y.size() : f.begin < wide) continue;
    Eigen::VectorXd drop(samples);
    for (std::size_t k = 0; k < wide; ++k)
      drop[static_cast<Eigen::Index>(k)] =
          std::fabs(y[f.begin] - y[after ? f.end + k : f.begin - 1 - k]);
    const Eigen::Vector3d own = solver.solve(drop);
    sum += own;
    squares += own.cwiseAbs2();
    left += (drop - basis * own).squaredNorm();
    seen += 1.0;
  }
  if (seen < 3.0) return {};
  const Eigen::Vector3d mean = sum / seen;
  const Eigen::Vector3d error =
      ((squares / seen - mean.cwiseAbs2()).cwiseMax(0.0) / seen).cwiseSqrt();
  return {mean[1], mean[2], error[1], error[2],
          std::sqrt(left / seen / static_cast<double>(samples - 3))};
}

// What lies on both sides of the flats of most cycles; none: there are no such flats.
struct Shoulders {
  bool any = false;
  double length = 0.0;  // of the flats, samples
  Flank before, after;
  Flank close_before, close_after;  // of as few samples as a parabola takes
};

Shoulders shoulders_of(const Ended& end, double samples_a_cycle, double cycles) {
  const std::vector<Flat> flats = flats_of(end, samples_a_cycle);
  const auto count = static_cast<double>(flats.size());
  if (count < 3.0 || count < kMostCycles * cycles) return {};
  Shoulders found;
  found.length = length_of(flats);
  if (found.length < kShortestFlat) return {};
  const double fewest = kFewestBeside;
  const double wide = std::clamp(found.length, fewest, std::max(fewest, samples_a_cycle / 8.0));
  const auto samples = static_cast<Eigen::Index>(std::lround(wide));
  found.any = true;
  found.before = flank_of(end, flats, samples, false);
  found.after = flank_of(end, flats, samples, true);
  found.close_before = flank_of(end, flats, kFewestBeside, false);
  found.close_after = flank_of(end, flats, kFewestBeside, true);
  return found;
}

// As gently as its errors allow.
Flank gentlest(Flank f) {
  f.slope = std::max(0.0, f.slope - kUnsure * f.slope_error);
  f.bend = std::max(0.0, f.bend + kUnsure * f.bend_error);
  return f;
}

// A crest that is cut off: the flat begins or ends with a slope, which would have gone on to a
// crest more than a step of the grid above. Where rounding makes a crest flat, what is lost is less
// than a step; where a damper sticks, it comes to rest without a slope; and from a stop that gives
// by less than a step it is back sooner.
bool cut_off(const Shoulders& beside, double range, double step, double steps_cut = kStepsCut) {
  if (!beside.any) return false;
  const double least = std::max(kLeastCut * range, steps_cut * step);
  const auto cuts = [&](const Flank& f) {
    return f.slope > kSureSlope * f.slope_error && 0.25 * f.slope * beside.length > least &&
           f.slope * f.slope > 4.0 * f.bend * least;
  };
  if (step < kFineStep * range) return cuts(beside.before) || cuts(beside.after);
  return cuts(beside.before) && cuts(beside.after) && cuts(gentlest(beside.close_before)) &&
         cuts(gentlest(beside.close_after));
}

// Samples in a row at the end that a crest within a step does not explain.
double longest_crest(const Ended& end, double samples_a_cycle, double quantisation_step) {
  const double flat = 2.0 * std::sqrt(2.0 * (end.highest - end.next) / (0.5 * end.range)) / kTwoPi;
  // A crest within one step of a coarse grid.
  const double within = std::acos(std::max(-1.0, 1.0 - 2.0 * quantisation_step / end.range)) / kPi;
  return std::max(4.0, std::max(3.0 * std::min(flat, 0.05), kWithin * within) * samples_a_cycle);
}

// Again and again `longest` samples in a row at the end; a run over several cycles is that many.
bool dwells(const Ended& end, double samples_a_cycle, double cycles, double longest) {
  double runs = 0.0, length = 0.0;
  for (std::size_t i = 0; i <= end.y.size(); ++i) {
    if (i < end.y.size() && end.y[i] == end.highest) {
      length += 1.0;
      continue;
    }
    if (length >= longest) runs += std::max(1.0, std::floor(length / samples_a_cycle));
    length = 0.0;
  }
  return runs >= 3.0 && runs >= 0.3 * cycles;
}

// Of a channel's differences of that order, per square root of their coefficients' squares. The
// median leaves corners out.
double noise_in_differences(const std::vector<double>& y, int order) {
  std::vector<double> left = y;
  double squares = 1.0;  // the middle binomial coefficient of twice the order
  for (int k = 1; k <= order; ++k) {
    for (std::size_t i = 1; i < left.size(); ++i)
      left[i - 1] = left[i] - left[i - 1];
    left.pop_back();
    squares *= 2.0 * (2.0 * k - 1.0) / k;
  }
  for (double& value : left)
    value = std::fabs(value);
  const auto middle = left.begin() + static_cast<std::ptrdiff_t>(left.size() / 2);
  std::nth_element(left.begin(), middle, left.end());
  return *middle / (0.6745 * std::sqrt(squares));
}

// Of the higher orders, less of the curve itself is in them; of the lower, less of its corners.
double noise_of(const Ended& end) {
  double noise = std::numeric_limits<double>::infinity();
  for (const int order : {3, 5, 7})
    noise = std::min(noise, noise_in_differences(end.y, order));
  return noise;
}

// By how much the flats' middle third lies above the rest: a crest is round, a clipped one is not.
double dome_of(const Ended& end, const std::vector<Flat>& flats) {
  double middle = 0.0, outer = 0.0, in_middle = 0.0, in_outer = 0.0;
  for (const Flat& f : flats) {
    const std::size_t third = (f.end - f.begin) / 3;
    for (std::size_t i = f.begin; i < f.end; ++i) {
      const bool inside = i >= f.begin + third && i < f.end - third;
      (inside ? middle : outer) += end.y[i];
      (inside ? in_middle : in_outer) += 1.0;
    }
  }
  return in_outer > 0.0 ? middle / in_middle - outer / in_outer : 0.0;
}

// Noise of what comes after the clipping lies on the flat: what is within its band counts as one
// value, on a grid as coarse as the band.
bool cut_off_under_noise(const Ended& end, double samples_a_cycle, double cycles) {
  const double noise = noise_of(end), band = kBand * noise;
  if (noise > kQuiet * end.range) return false;
  Ended banded = end;
  for (double& value : banded.y) {
    if (value >= end.highest - band) value = end.highest;
  }
  const std::vector<Flat> flats = flats_of(banded, samples_a_cycle);
  if (length_of(flats) < kShortestBand || dome_of(end, flats) > kDome * noise) return false;
  Shoulders beside = shoulders_of(banded, samples_a_cycle, cycles);
  beside.before = gentlest(beside.before);
  beside.after = gentlest(beside.after);
  return cut_off(beside, end.range, std::max(band, kFineStep * end.range), kBandsCut);
}

// The step that all levels are whole numbers of apart, also where no two are neighbours on it; as
// good as nothing where they are on no grid.
double common_step(const Ended& end) {
  std::vector<double> levels = end.y;
  std::sort(levels.begin(), levels.end());
  const double trifle = kTrifle * end.range;
  double step = end.range;
  for (std::size_t i = 1; i < levels.size() && step > trifle; ++i) {
    double apart = levels[i] - levels[i - 1];
    while (apart > trifle) {  // Euclid's
      const double left = std::fabs(step - apart * std::round(step / apart));
      step = apart;
      apart = left;
    }
  }
  return step;
}

// Steps that can hide a valve's or dry friction's own course.
bool on_coarse_grid(const Ended& end, double grid) {
  return (grid > 0.0 ? grid : common_step(end)) > kFineStep * end.range;
}

// Beside the flat; on it there is none. Both are said too large where the curve bends.
double noise_beside(const Ended& end, const Shoulders& beside) {
  return std::min(std::max(beside.before.noise, beside.after.noise), noise_of(end));
}

}  // namespace

bool clipped(std::span<const double> y, double samples_a_cycle, double cycles, bool top,
             Course course, double quantisation_step) {
  const Ended end = ended(y, top);
  if (!(end.range > 0.0)) return true;  // it never moves
  const double longest = longest_crest(end, samples_a_cycle, quantisation_step);
  if (dwells(end, samples_a_cycle, cycles, std::max(longest, samples_a_cycle))) return true;
  const double grid = quantisation_step > 0.0 ? quantisation_step : grid_beside(end);
  const double step = grid > 0.0 ? grid : end.highest - end.next;
  const Shoulders beside = shoulders_of(end, samples_a_cycle, cycles);
  const bool cut = cut_off(beside, end.range, step);
  const bool long_flat = dwells(end, samples_a_cycle, cycles, longest);
  const bool noise = noise_beside(end, beside) > kNoisy * step;
  if (course == Course::kinked) return (cut || long_flat) && (noise || !on_coarse_grid(end, grid));
  if (cut || (long_flat && noise)) return true;
  return course == Course::inert && cut_off_under_noise(end, samples_a_cycle, cycles);
}

bool held_at_end(std::span<const double> motion, std::span<const double> force,
                 double samples_a_cycle, bool top) {
  const std::vector<Flat> flats = flats_of(ended(motion, top), samples_a_cycle);
  const double shortest = 3.0;
  if (flats.empty() || length_of(flats) < shortest) return false;
  const auto mean = [&](std::size_t from, std::size_t count) {
    double sum = 0.0;
    for (std::size_t i = from; i < from + count; ++i)
      sum += force[i];
    return sum / static_cast<double>(count);
  };
  double coming = 0.0, going = 0.0;  // changes in the flat's first and second half
  for (const Flat& f : flats) {
    const std::size_t length = f.end - f.begin, part = std::max<std::size_t>(1, length / 6);
    const double middle = mean(f.begin + (length - part) / 2, part);
    coming += (middle - mean(f.begin, part)) / static_cast<double>(flats.size());
    going += (mean(f.end - part, part) - middle) / static_cast<double>(flats.size());
  }
  const auto [low, high] = std::minmax_element(force.begin(), force.end());
  // What relaxes changes less and less.
  return std::fabs(going) < std::max(kSameForce * (*high - *low), 0.5 * std::fabs(coming));
}

}  // namespace shaker::estimator::diagnosis
