#include "estimator/discrepancy/cycles/channel_faults.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "estimator/discrepancy/cycles/quantum.hpp"
#include "estimator/math/numbers.hpp"

namespace shaker::estimator::discrepancy {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kWithin = 1.5;  // times as long as a cosine's crest
constexpr Eigen::Index kFewestCycles = 5;
constexpr double kLeastSlip = 0.01;  // turns in all
constexpr double kSure = 8.0;        // standard errors

constexpr std::size_t kFewestForSpikes = 32;
constexpr std::size_t kMostSpikes = 3;
constexpr std::size_t kTouched = 2;  // samples on each side that a spike puts off too
constexpr double kFarOff = 6.0;      // times the next
constexpr double kOwnShare = 1.25;   // of its neighbours: 1.5 of a spike, 1 of a jump

struct Line {
  double slope = 0.0, standard_error = 0.0;
};

Line line_through(const Eigen::VectorXd& y) {
  const auto n = static_cast<double>(y.size());
  const Eigen::VectorXd x = Eigen::VectorXd::LinSpaced(y.size(), -0.5 * (n - 1.0), 0.5 * (n - 1.0));
  Line line;
  line.slope = x.dot(y) / x.squaredNorm();
  const double left = (y.array() - y.mean() - line.slope * x.array()).matrix().squaredNorm();
  line.standard_error = std::sqrt(left / std::max(n - 2.0, 1.0) / x.squaredNorm());
  return line;
}

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
constexpr double kSureSlope = 4.0;  // standard errors

std::vector<Flat> flats_of(std::span<const double> y, double extreme, double samples_a_cycle) {
  std::vector<Flat> flats;
  for (std::size_t i = 0; i < y.size(); ++i) {
    if (y[i] != extreme) continue;
    if (flats.empty() || static_cast<double>(i - flats.back().end) > kOneCrest * samples_a_cycle)
      flats.push_back({i, i});
    flats.back().end = i + 1;
  }
  return flats;
}

// The grid of all other values: a clipped one need not stand on it.
double grid_beside(std::span<const double> y, double extreme) {
  std::vector<double> others(y.begin(), y.end());
  std::erase(others, extreme);
  return quantum_of(others);
}

// How steeply a channel comes to its flats on one side, a sample, and how it bends there: the
// parabola through the mean of what lies beside them.
struct Flank {
  double slope = 0.0, bend = 0.0, slope_error = 0.0;
};

Flank flank_of(std::span<const double> y, const std::vector<Flat>& flats, Eigen::Index samples,
               bool after) {
  const Eigen::VectorXd j = Eigen::VectorXd::LinSpaced(samples, 1.0, static_cast<double>(samples));
  Eigen::MatrixXd basis(samples, 3);
  basis << Eigen::VectorXd::Ones(samples), j, j.cwiseAbs2();
  const auto solver = basis.colPivHouseholderQr();
  const auto wide = static_cast<std::size_t>(samples);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double seen = 0.0, squares = 0.0;
  for (const Flat& f : flats) {
    if (after ? f.end + wide > y.size() : f.begin < wide) continue;
    Eigen::VectorXd drop(samples);
    for (std::size_t k = 0; k < wide; ++k)
      drop[static_cast<Eigen::Index>(k)] =
          std::fabs(y[f.begin] - y[after ? f.end + k : f.begin - 1 - k]);
    const Eigen::Vector3d own = solver.solve(drop);
    sum += own;
    squares += own[1] * own[1];
    seen += 1.0;
  }
  if (seen < 3.0) return {};
  const Eigen::Vector3d mean = sum / seen;
  const double variance = std::max(squares / seen - mean[1] * mean[1], 0.0);
  return {mean[1], mean[2], std::sqrt(variance / seen)};
}

// A crest that is cut off: the flat begins or ends with a slope, which would have gone on to a
// crest more than a step of the grid above. Where rounding makes a crest flat, what is lost is less
// than a step; where a damper sticks, it comes to rest without a slope; and from a stop that gives
// by less than a step it is back sooner.
bool cut_off(std::span<const double> y, double extreme, double range, double samples_a_cycle,
             double cycles, double step) {
  const std::vector<Flat> flats = flats_of(y, extreme, samples_a_cycle);
  const auto count = static_cast<double>(flats.size());
  if (count < 3.0 || count < kMostCycles * cycles) return false;
  double length = 0.0;
  for (const Flat& f : flats)
    length += static_cast<double>(f.end - f.begin) / count;
  if (length < kShortestFlat) return false;
  const double wide = std::clamp(length, 4.0, std::max(4.0, samples_a_cycle / 8.0));
  const double least = std::max(kLeastCut * range, kStepsCut * step);
  const auto cuts = [&](const Flank& f) {
    return f.slope > kSureSlope * f.slope_error && 0.25 * f.slope * length > least &&
           f.slope * f.slope > 4.0 * f.bend * least;
  };
  const auto samples = static_cast<Eigen::Index>(std::lround(wide));
  const bool before = cuts(flank_of(y, flats, samples, false));
  const bool after = cuts(flank_of(y, flats, samples, true));
  return step < kFineStep * range ? before || after : before && after;
}

}  // namespace

bool clipped(std::span<const double> y, double samples_a_cycle, double cycles, bool top,
             double quantum) {
  const double sign = top ? 1.0 : -1.0;
  double extreme = -std::numeric_limits<double>::infinity();
  double low = std::numeric_limits<double>::infinity();
  for (const double value : y) {
    extreme = std::max(extreme, sign * value);
    low = std::min(low, sign * value);
  }
  // It never moves.
  if (!(extreme > low)) return true;
  double next = low;
  for (const double value : y) {
    if (sign * value < extreme) next = std::max(next, sign * value);
  }
  const double grid = quantum > 0.0 ? quantum : grid_beside(y, sign * extreme);
  const double step = grid > 0.0 ? grid : extreme - next;
  if (cut_off(y, sign * extreme, extreme - low, samples_a_cycle, cycles, step)) return true;
  const double flat = 2.0 * std::sqrt(2.0 * (extreme - next) / (0.5 * (extreme - low))) / kTwoPi;
  // A crest within one step of a coarse grid.
  const double within = std::acos(std::max(-1.0, 1.0 - 2.0 * quantum / (extreme - low))) / kPi;
  const double longest =
      std::max(4.0, std::max(3.0 * std::min(flat, 0.05), kWithin * within) * samples_a_cycle);
  double runs = 0.0, length = 0.0;  // at the end; a run over several cycles is that many
  for (std::size_t i = 0; i <= y.size(); ++i) {
    if (i < y.size() && sign * y[i] == extreme) {
      length += 1.0;
      continue;
    }
    if (length >= longest) runs += std::max(1.0, std::floor(length / samples_a_cycle));
    length = 0.0;
  }
  return runs >= 3.0 && runs >= 0.3 * cycles;
}

double clock_slip(const Eigen::MatrixXd& response) {
  const Eigen::Index kept = response.rows() - response.rows() / 3;  // the transient is in the first
  if (kept < kFewestCycles || response.cols() < 3) return 0.0;
  Eigen::VectorXd phase(kept), size(kept);
  for (Eigen::Index k = 0; k < kept; ++k) {
    const auto row = response.row(response.rows() - kept + k);
    phase[k] = std::atan2(row[2], row[1]) / kTwoPi;
    if (k > 0) phase[k] -= std::round(phase[k] - phase[k - 1]);
    size[k] = std::log(std::max(std::hypot(row[1], row[2]), 1e-300)) / kTwoPi;
  }
  const Line whole = line_through(phase);
  const double early = line_through(phase.head(kept / 2 + 1)).slope;
  const double late = line_through(phase.tail(kept / 2 + 1)).slope;
  const double slip = std::fabs(whole.slope);
  const bool even = std::fabs(early - late) < 0.3 * slip;
  const bool same_size = std::fabs(line_through(size).slope) < 0.2 * slip;
  const bool sure = slip > kSure * whole.standard_error;
  return even && same_size && sure && slip * static_cast<double>(kept) > kLeastSlip ? whole.slope
                                                                                    : 0.0;
}

std::vector<std::size_t> lone_spikes(std::span<const double> y) {
  if (y.size() < kFewestForSpikes) return {};
  std::vector<double> off(y.size(), 0.0);
  for (std::size_t i = 2; i + 2 < y.size(); ++i)
    off[i] = std::fabs(y[i] - (4.0 * (y[i - 1] + y[i + 1]) - (y[i - 2] + y[i + 2])) / 6.0);
  std::vector<std::size_t> farthest;  // one more than may be spikes
  for (std::size_t k = 0; k <= kMostSpikes; ++k) {
    std::size_t at = 0;
    for (std::size_t i = 0; i < y.size(); ++i) {
      const bool own = std::any_of(farthest.begin(), farthest.end(), [&](std::size_t f) {
        return (f > i ? f - i : i - f) <= kTouched;
      });
      if (!own && off[i] > off[at]) at = i;
    }
    farthest.push_back(at);
  }
  for (std::size_t k = kMostSpikes; k > 0; --k) {
    if (!(off[farthest[k - 1]] > kFarOff * off[farthest[k]])) continue;
    farthest.resize(k);
    std::erase_if(farthest, [&](std::size_t i) {
      const double others = std::max(off[i - 1], off[i + 1]);
      return off[i] < kOwnShare * others || off[i] < std::fabs(y[i + 1] - y[i - 1]);
    });
    return farthest;
  }
  return {};
}

}  // namespace shaker::estimator::discrepancy
