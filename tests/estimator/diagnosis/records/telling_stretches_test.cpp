// Records whose course is known: where is which part of them used?
#include "estimator/diagnosis/records/internal/telling_stretches.hpp"

#include <cmath>

#include <gtest/gtest.h>

namespace shaker::estimator::diagnosis {
namespace {

using Eigen::Index;

constexpr Index kSamples = 30000;
constexpr double kShare = 0.12;

// An oscillation of 40 samples a period whose size follows `size` over the share of the record.
template <class Size>
Eigen::VectorXd oscillation(Size size) {
  Eigen::VectorXd y(kSamples);
  for (Index i = 0; i < kSamples; ++i)
    y[i] = 0.3 + size(static_cast<double>(i) / kSamples) * std::sin(0.157 * static_cast<double>(i));
  return y;
}

double middle(const Stretch& s) {
  return (static_cast<double>(s.begin) + 0.5 * static_cast<double>(s.length)) / kSamples;
}

void expect_apart(const std::vector<Stretch>& stretches) {
  Index end = 0, all = 0;
  for (const Stretch& s : stretches) {
    EXPECT_GE(s.begin, end);
    end = s.begin + s.length;
    all += s.length;
  }
  EXPECT_LE(end, kSamples);
  EXPECT_LE(static_cast<double>(all), kShare * kSamples);
}

TEST(TellingStretches, SeeASweepInItsResonanceAndBesideIt) {
  const auto stretches = telling_stretches(
      oscillation([](double t) { return 0.1 + std::exp(-std::pow((t - 0.7) / 0.05, 2)); }), kShare);
  ASSERT_EQ(stretches.size(), 3U);
  expect_apart(stretches);
  int inside = 0, beside = 0;
  for (const Stretch& s : stretches) {
    inside += std::fabs(middle(s) - 0.7) < 0.05 ? 1 : 0;
    beside += std::fabs(middle(s) - 0.7) > 0.1 ? 1 : 0;
  }
  EXPECT_GE(inside, 1);
  EXPECT_GE(beside, 1);
}

TEST(TellingStretches, SeeTheHeadAndTheTailOfADecay) {
  const auto stretches =
      telling_stretches(oscillation([](double t) { return std::exp(-3.0 * t); }), kShare);
  ASSERT_EQ(stretches.size(), 3U);
  expect_apart(stretches);
  EXPECT_EQ(stretches.front().begin, 0);
  EXPECT_GT(middle(stretches[1]), 0.25);
  EXPECT_GT(middle(stretches[2]), 0.75);
}

TEST(TellingStretches, LeaveOutWhereNothingMoves) {
  const auto stretches =
      telling_stretches(oscillation([](double t) { return t < 0.5 ? 1e-4 : 1.0 + t; }), kShare);
  ASSERT_FALSE(stretches.empty());
  expect_apart(stretches);
  for (const Stretch& s : stretches)
    EXPECT_GT(s.begin + s.length, kSamples / 2);
}

TEST(TellingStretches, HaveOneLengthInARecordThatStaysTheSame) {
  const auto stretches = telling_stretches(oscillation([](double) { return 1.0; }), kShare);
  ASSERT_EQ(stretches.size(), 3U);
  expect_apart(stretches);
  EXPECT_EQ(stretches[0].length, stretches[2].length);
  EXPECT_GT(static_cast<double>(stretches[0].length), 0.9 * kShare / 3.0 * kSamples);
}

}  // namespace
}  // namespace shaker::estimator::diagnosis
