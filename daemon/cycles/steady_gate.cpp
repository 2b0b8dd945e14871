#include "daemon/cycles/steady_gate.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "daemon/cycles/cycle_noise.hpp"

namespace shaker::daemon {
namespace {

constexpr double kDriftByChance = 1e-3;  // of a window without a drift
// Lower limit of the noise, as a part of the stroke: without it a noise-free sensor would never
// be steady.
constexpr double kNoiseFloor = 1e-5;

}  // namespace

void SteadyGate::restart(std::size_t points, double tolerance) {
  for (auto& entry : ring_)
    entry.cycle.assign(points, 0.0);
  points_ = points;
  tolerance_ = tolerance;
  count_ = 0;
  missing_ = 0;
}

double SteadyGate::difference(std::size_t age, std::size_t apart, double noise) const {
  const auto& a = back(age).cycle;
  const auto& b = back(age + apart).cycle;
  double squares = 0.0;
  for (std::size_t i = 0; i < points_; ++i)
    squares += (a[i] - b[i]) * (a[i] - b[i]);
  return std::sqrt(squares / static_cast<double>(points_) / 2.0) / noise;
}

double SteadyGate::recent_change(double noise) const {
  double most = 0.0;
  for (std::size_t age = 0; age < 4; ++age)
    most = std::max(most, difference(age, 1, noise));
  return most;
}

std::optional<int> SteadyGate::find_subharmonic(double noise) const {
  if (count_ < kWindow) return std::nullopt;
  // A response of three periods may have two similar cycles; the largest difference decides.
  double most = 0.0;
  for (std::size_t age = 0; age < 4; ++age)
    most = std::max(most, difference(age, 1, noise));
  if (most <= tolerance_) return std::nullopt;
  for (std::size_t p = 2; p <= 4; ++p) {
    double worst = 0.0;
    for (std::size_t age = 0; age + p < kWindow; ++age) {
      worst = std::max(worst, difference(age, p, noise));
    }
    if (worst <= std::max(tolerance_, 0.1 * most) && worst < 0.5 * most) {
      return static_cast<int>(p);
    }
  }
  return std::nullopt;
}

bool SteadyGate::creeps(double noise, double& shift) const {
  constexpr double w = static_cast<double>(kWindow);
  constexpr double sxx = w * (w * w - 1.0) / 12.0;
  estimator::CycleCourses::Split split;
  for (std::size_t c = 0; c < kCoefficients; ++c) {
    std::array<double, kWindow> course{};
    for (std::size_t age = 0; age < kWindow; ++age)
      course[age] = back(age).white[c];
    split += trend_.take_out(course);
  }
  shift = std::sqrt(split.follows / sxx / static_cast<double>(points_)) * (w - 1.0) / noise;
  return trend_.by_chance(split, static_cast<double>(kCoefficients)) < kDriftByChance &&
         shift > tolerance_ / 10.0;
}

GateVerdict SteadyGate::add(std::span<const double> cycle, double point_noise) {
  newest_ = (newest_ + 1) % kWindow;
  auto& entry = ring_[newest_];
  std::ranges::copy(cycle, entry.cycle.begin());
  const auto c = stroke_harmonics(cycle);
  const double n = static_cast<double>(points_);
  entry.white[0] = c[0].real() * std::sqrt(n);
  for (std::size_t h = 1; h < c.size(); ++h) {
    entry.white[2 * h - 1] = c[h].real() * std::sqrt(n / 2.0);
    entry.white[2 * h] = c[h].imag() * std::sqrt(n / 2.0);
  }
  count_ = std::min(count_ + 1, kWindow);

  const auto [low, high] = std::ranges::minmax_element(cycle);
  const double noise = std::max({point_noise, kNoiseFloor * (*high - *low) / 2.0, 1e-12});
  if (missing_ > 0 && count_ >= 2 &&
      (missing_ > kMissingMost || difference(0, 1, noise) > tolerance_)) {
    count_ = 1;
  }
  missing_ = 0;
  GateVerdict verdict;
  if (count_ >= 2) verdict.change = difference(0, 1, noise);
  verdict.subharmonic = find_subharmonic(noise);
  double shift = 0.0;
  if (verdict.subharmonic) {
    verdict.why = fmt::format("the response repeats only every {} periods", *verdict.subharmonic);
  } else if (verdict.change > tolerance_) {
    verdict.why = fmt::format(
        "transient: it differs from the cycle before by {:.1f} times the noise; "
        "{:.1f} is allowed",
        verdict.change, tolerance_);
  } else if (count_ < kWindow) {
    verdict.why = fmt::format("settling: {} of the {} cycles that must be seen", count_, kWindow);
  } else if (recent_change(noise) > tolerance_) {
    verdict.why = "transient: one of the last four cycles differed from its own cycle before";
  } else if (creeps(noise, shift)) {
    verdict.creep = shift;
    verdict.why = fmt::format(
        "creeping: {:.1f} times the noise over the last {} cycles; {:.1f} is "
        "allowed",
        shift, kWindow, tolerance_ / 10.0);
  } else {
    verdict.steady = true;
  }
  return verdict;
}

}  // namespace shaker::daemon
