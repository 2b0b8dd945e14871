#include "estimator/diagnosis/cycles/internal/phase_fit.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Dense>

#include "estimator/math/numbers.hpp"

namespace shaker::estimator::diagnosis {
namespace {

constexpr double kSteadyShare = 0.02;      // of the amplitude: more is a ramp
constexpr double kFarOffDeviations = 6.0;  // standard deviations of a block's phase
constexpr double kNoTurn = 1e-9;           // of a turn: what rounding leaves
constexpr std::size_t kFewestBlocks = 5;

struct Block {
  double middle = 0.0, amplitude = 0.0, turns = 0.0;
};

// Mean, fundamental and second harmonic of the samples [begin, end) at frequency f.
Block fit_block(const std::vector<double>& t, const std::vector<double>& x, std::size_t begin,
                std::size_t end, double f) {
  Eigen::Matrix<double, 5, 5> normal = Eigen::Matrix<double, 5, 5>::Zero();
  Eigen::Matrix<double, 5, 1> right = Eigen::Matrix<double, 5, 1>::Zero(), row;
  const double middle = 0.5 * (t[begin] + t[end - 1]);
  for (std::size_t i = begin; i < end; ++i) {
    const double angle = kTwoPi * f * (t[i] - middle);
    row << 1.0, std::cos(angle), std::sin(angle), std::cos(2.0 * angle), std::sin(2.0 * angle);
    normal += row * row.transpose();
    right += x[i] * row;
  }
  const Eigen::Matrix<double, 5, 1> c = normal.ldlt().solve(right);
  // Crest at angle phi after the middle, so `middle` stands -phi turns from a crest.
  return {middle, std::hypot(c[1], c[2]), -std::atan2(c[2], c[1]) / kTwoPi};
}

std::vector<Block> blocks_of(const std::vector<double>& t, const std::vector<double>& x, double f) {
  std::vector<Block> blocks;
  const double period = 1.0 / f;
  const double step = (t.back() - t.front()) / static_cast<double>(t.size() - 1);
  const auto at = [&](double when) {
    return static_cast<std::size_t>(std::lower_bound(t.begin(), t.end(), when - 1e-9 * period) -
                                    t.begin());
  };
  for (int k = 0; t.front() + (k + 1) * period <= t.back() + 1.01 * step; ++k) {
    const std::size_t begin = at(t.front() + k * period);
    const std::size_t end = at(t.front() + (k + 1) * period);
    if (end - begin >= 8) blocks.push_back(fit_block(t, x, begin, end, f));
  }
  return blocks;
}

// First and one past the last block of the longest stretch of one amplitude.
std::pair<std::size_t, std::size_t> longest_steady(const std::vector<Block>& blocks) {
  std::vector<double> sizes;
  for (const Block& b : blocks)
    sizes.push_back(b.amplitude);
  std::sort(sizes.begin(), sizes.end());
  const double reference = sizes[(sizes.size() * 3) / 5];
  std::vector<double> off;
  for (const double s : sizes)
    off.push_back(std::fabs(s - reference));
  std::nth_element(off.begin(), off.begin() + static_cast<std::ptrdiff_t>(off.size() / 2),
                   off.end());
  const double spread = std::min(6.0 * 1.48 * off[off.size() / 2], 0.3 * reference);
  const double band = std::max(kSteadyShare * reference, spread);
  std::size_t best = 0, best_length = 0, first = 0;
  for (std::size_t i = 0; i <= blocks.size(); ++i) {
    if (i < blocks.size() && std::fabs(blocks[i].amplitude - reference) <= band) continue;
    if (i - first > best_length) {
      best = first;
      best_length = i - first;
    }
    first = i + 1;
  }
  return {best, best + best_length};
}

// Turns of the blocks [first, last), counted on from block to block, over time: a straight line.
struct BlockLine {
  double origin = 0.0, at_origin = 0.0, slope = 0.0;
  double operator()(double t) const { return at_origin + slope * (t - origin); }
};

BlockLine line_through(const std::vector<Block>& blocks, std::size_t first, std::size_t last) {
  const auto count = static_cast<double>(last - first);
  BlockLine line;
  line.origin = blocks[first].middle;
  double st = 0.0, sp = 0.0, stt = 0.0, stp = 0.0;
  for (std::size_t i = first; i < last; ++i) {
    const double at = blocks[i].middle - line.origin;
    st += at;
    sp += blocks[i].turns;
    stt += at * at;
    stp += at * blocks[i].turns;
  }
  line.slope = (count * stp - st * sp) / (count * stt - st * st);
  line.at_origin = (sp - line.slope * st) / count;
  return line;
}

// The end of a ramp may be within the band of the amplitude, and its phase is yet off by so much
// that it turns the whole line: an end block that lies far off the line through the others is left
// out, one at a time.
void leave_out_ramps(const std::vector<Block>& blocks, std::size_t& first, std::size_t& last) {
  const std::size_t fewest = std::max(kFewestBlocks, (last - first) / 2);
  while (last - first > fewest) {
    const BlockLine line = line_through(blocks, first + 1, last - 1);
    std::vector<double> off;
    for (std::size_t i = first + 1; i + 1 < last; ++i)
      off.push_back(std::fabs(blocks[i].turns - line(blocks[i].middle)));
    std::nth_element(off.begin(), off.begin() + static_cast<std::ptrdiff_t>(off.size() / 2),
                     off.end());
    const double limit = kFarOffDeviations * 1.48 * off[off.size() / 2] + kNoTurn;
    const double front = std::fabs(blocks[first].turns - line(blocks[first].middle));
    const double back = std::fabs(blocks[last - 1].turns - line(blocks[last - 1].middle));
    if (std::max(front, back) <= limit) return;
    if (front > back)
      ++first;
    else
      --last;
  }
}

}  // namespace

PhaseFit fit_phase(const std::vector<double>& t, const std::vector<double>& driver,
                   double nominal_hz) {
  PhaseFit fit;
  fit.frequency_hz = nominal_hz;
  for (int pass = 0; pass < 3; ++pass) {
    auto blocks = blocks_of(t, driver, fit.frequency_hz);
    if (blocks.size() < 2) return fit;
    auto [first, last] = longest_steady(blocks);
    if (last < first + 2) return fit;
    for (std::size_t i = first + 1; i < last; ++i) {
      const double expected =
          blocks[i - 1].turns + fit.frequency_hz * (blocks[i].middle - blocks[i - 1].middle);
      blocks[i].turns += std::round(expected - blocks[i].turns);
    }
    leave_out_ramps(blocks, first, last);
    const BlockLine line = line_through(blocks, first, last);
    fit.frequency_hz = line.slope;
    fit.offset = line(0.0);
    fit.amplitude = 0.0;
    for (std::size_t i = first; i < last; ++i)
      fit.amplitude += blocks[i].amplitude / static_cast<double>(last - first);
    const double half = 0.5 / fit.frequency_hz;
    fit.from = blocks[first].middle - half;
    fit.to = blocks[last - 1].middle + half;
    if (!(std::fabs(fit.frequency_hz / nominal_hz - 1.0) < 0.1) || !(fit.amplitude > 0.0))
      return fit;
  }
  fit.ok = true;
  return fit;
}

}  // namespace shaker::estimator::diagnosis
