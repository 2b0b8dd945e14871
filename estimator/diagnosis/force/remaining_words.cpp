#include "estimator/diagnosis/force/internal/remaining_words.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <fmt/format.h>

namespace shaker::estimator::diagnosis {
namespace {

constexpr double kOfPeak = 0.5;      // of its height: what belongs to a hill
constexpr double kAlmostAll = 0.85;  // of what was measured
constexpr double kSecond = 0.4;      // of the largest hill's height: worth a word
constexpr double kNextTo = 1.6;      // steps of the grid

struct Range {
  double low = 1e300, high = -1e300;
  void take(double value) {
    low = std::min(low, value);
    high = std::max(high, value);
  }
  double width() const { return high - low; }
};

struct Hill {
  std::size_t peak = 0;
  Range stroke, velocity;
};

double surely(const ForceCell& cell) {
  return std::fabs(cell.force) - 2.0 * cell.standard_error;
}

// Cells about the peak that are joined to it, significant, of its sign and of half its height.
Hill hill_about(const RemainingForce& force, std::size_t peak) {
  Hill hill{peak, {}, {}};
  const double top = force.cells[peak].force;
  std::vector<char> in(force.cells.size(), 0);
  std::vector<std::size_t> open = {peak};
  in[peak] = 1;
  while (!open.empty()) {
    const ForceCell& cell = force.cells[open.back()];
    open.pop_back();
    hill.stroke.take(cell.stroke);
    hill.velocity.take(cell.velocity);
    for (std::size_t c = 0; c < force.cells.size(); ++c) {
      const ForceCell& other = force.cells[c];
      if (in[c] != 0 || !other.significant() || other.force / top < kOfPeak ||
          std::fabs(other.stroke - cell.stroke) > kNextTo * force.stroke_step ||
          std::fabs(other.velocity - cell.velocity) > kNextTo * force.velocity_step)
        continue;
      in[c] = 1;
      open.push_back(c);
    }
  }
  return hill;
}

std::string number(double value) {
  return fmt::format("{:.3g}", value);
}

std::string said(const RemainingForce& force, const Hill& hill, const Range& stroke,
                 const Range& speed, const std::string& unit) {
  const double shown = unit == "m" ? 1e3 : 1.0;
  const std::string length = unit == "m" ? "mm" : unit;
  const ForceCell& peak = force.cells[hill.peak];
  std::string text =
      fmt::format("up to {} +- {} {}/s^2 {}", number(peak.force), number(peak.standard_error), unit,
                  hill.velocity.low >= 0.0    ? "on compression"
                  : hill.velocity.high <= 0.0 ? "on extension"
                                              : "about velocity reversal");
  if (hill.velocity.width() < kAlmostAll * speed.width()) {
    // Extension is said by the word.
    const bool back = hill.velocity.high <= 0.0;
    const double from = back ? -hill.velocity.high : hill.velocity.low;
    const double to = back ? -hill.velocity.low : hill.velocity.high;
    text += to - from > force.velocity_step
                ? fmt::format(" between {} and {} {}/s", number(shown * from), number(shown * to),
                              length)
                : fmt::format(" at {} {}/s", number(shown * from), length);
  }
  if (hill.stroke.width() < kAlmostAll * stroke.width())
    text += hill.stroke.width() > force.stroke_step
                ? fmt::format(", stroke {} to {} {}", number(shown * hill.stroke.low),
                              number(shown * hill.stroke.high), length)
                : fmt::format(", stroke {} {}", number(shown * hill.stroke.low), length);
  return text;
}

}  // namespace

std::string in_words(const RemainingForce& force, const std::string& length_unit) {
  Range stroke, speed;
  std::size_t highest[2] = {force.cells.size(), force.cells.size()};
  for (std::size_t c = 0; c < force.cells.size(); ++c) {
    const ForceCell& cell = force.cells[c];
    stroke.take(cell.stroke);
    speed.take(cell.velocity);
    if (!cell.significant()) continue;
    std::size_t& best = highest[cell.force < 0.0 ? 1 : 0];
    if (best == force.cells.size() || surely(cell) > surely(force.cells[best])) best = c;
  }
  std::vector<std::size_t> peaks;
  for (const std::size_t c : highest) {
    if (c < force.cells.size()) peaks.push_back(c);
  }
  if (peaks.empty())
    return "no force of stroke and velocity alone stands out: what is left depends on something "
           "else (the frequency, the history of the motion, time)";
  std::sort(peaks.begin(), peaks.end(), [&](std::size_t a, std::size_t b) {
    return surely(force.cells[a]) > surely(force.cells[b]);
  });
  std::string text =
      "remaining force, " + said(force, hill_about(force, peaks[0]), stroke, speed, length_unit);
  if (peaks.size() > 1 && surely(force.cells[peaks[1]]) > kSecond * surely(force.cells[peaks[0]]))
    text += "; " + said(force, hill_about(force, peaks[1]), stroke, speed, length_unit);
  return text +
         fmt::format("; a force of stroke and velocity accounts for {:.0f} % of what is left",
                     100.0 * force.share);
}

}  // namespace shaker::estimator::diagnosis
