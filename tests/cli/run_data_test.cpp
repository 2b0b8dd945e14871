#include "cli/run_data.hpp"

#include <cmath>
#include <numbers>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace shaker::cli {
namespace {

constexpr double kTwoPi = 2.0 * std::numbers::pi;

CsvTable sampled(int count, double step, double frequency, double start = 0.0) {
  CsvTable table;
  for (int i = 0; i < count; ++i) {
    const double t = start + i * step;
    table.columns["t"].push_back(t);
    table.columns["y"].push_back(0.5 + 0.1 * std::cos(kTwoPi * frequency * t));
  }
  return table;
}

TEST(RunData, FoldsWholePeriodsIntoTheirMean) {
  CsvTable table = sampled(60, 0.025, 2.0);  // three periods of twenty points
  table.columns["y"][20] += 0.003;
  table.columns["y"][40] -= 0.003;
  const auto run = run_from_table(table, "f.csv", {2.0, 3.0});
  ASSERT_TRUE(run) << run.error().what;
  EXPECT_EQ(run->cycles, 3.0);
  EXPECT_TRUE(run->tau.empty());
  ASSERT_EQ(run->displacement.size(), 20u);
  EXPECT_NEAR(run->displacement[0], 0.6, 1e-12);
  EXPECT_NEAR(run->scatter, 2 * 0.003 * 0.003, 1e-12);
  EXPECT_EQ(run->amplitude, 3.0);
  EXPECT_TRUE(run->excitation.empty());
}

TEST(RunData, KeepsTheCyclicTimeOfSamplesThatFitNoGrid) {
  const auto run = run_from_table(sampled(50, 0.0301, 2.0, 0.2), "f.csv", {2.0, 3.0});
  ASSERT_TRUE(run) << run.error().what;
  ASSERT_EQ(run->tau.size(), 50u);
  EXPECT_NEAR(run->tau[0], 0.4, 1e-12);
  EXPECT_NEAR(run->tau[20], std::fmod(2.0 * (0.2 + 20 * 0.0301), 1.0), 1e-12);
  for (const double tau : run->tau)
    EXPECT_TRUE(tau >= 0.0 && tau < 1.0);
}

TEST(RunData, MakesTheMeasuredExcitationPeriodicWithoutItsMean) {
  CsvTable table = sampled(333, 0.0071, 1.5, 0.1);
  table.columns["displacement"] = table.columns["y"];
  for (const double t : table.columns["t"]) {
    table.columns["excitation"].push_back(9.81 + 3.0 * std::cos(kTwoPi * 1.5 * t - 0.4) +
                                          0.2 * std::sin(3.0 * kTwoPi * 1.5 * t));
  }
  const auto run = run_from_table(table, "f.csv", {1.5, {}});
  ASSERT_TRUE(run) << run.error().what;
  const auto n = run->excitation.size();
  ASSERT_GE(n, 32u);
  for (std::size_t i = 0; i < n; ++i) {
    const double tau = static_cast<double>(i) / static_cast<double>(n);
    EXPECT_NEAR(run->excitation[i],
                3.0 * std::cos(kTwoPi * tau - 0.4) + 0.2 * std::sin(3.0 * kTwoPi * tau), 1e-9);
  }
}

TEST(RunData, TellsHowWellTheNoisyExcitationIsKnown) {
  std::mt19937 random(3);
  std::normal_distribution<double> noise(0.0, 0.02);
  double squares = 0.0, told = 0.0;
  for (int k = 0; k < 200; ++k) {
    CsvTable table = sampled(400, 0.0071, 1.5);
    table.columns["displacement"] = table.columns["y"];
    for (const double t : table.columns["t"])
      table.columns["excitation"].push_back(3.0 * std::cos(kTwoPi * 1.5 * t) + noise(random));
    const auto run = run_from_table(table, "f.csv", {1.5, {}});
    ASSERT_TRUE(run) << run.error().what;
    const auto n = static_cast<double>(run->excitation.size());
    double amplitude = 0.0;
    for (std::size_t i = 0; i < run->excitation.size(); ++i)
      amplitude += 2.0 / n * run->excitation[i] * std::cos(kTwoPi * static_cast<double>(i) / n);
    squares += (amplitude - 3.0) * (amplitude - 3.0) / 200.0;
    told += run->excitation_error / 200.0;
  }
  EXPECT_NEAR(std::sqrt(squares) / told, 1.0, 0.2);
}

TEST(RunData, RefusesWhatCannotBeEstimatedFrom) {
  const auto refusal = [](const CsvTable& table, const Dwell& dwell) {
    const auto run = run_from_table(table, "f.csv", dwell);
    return run ? std::string("accepted") : run.error().what;
  };
  CsvTable backwards = sampled(40, 0.0125, 2.0);
  backwards.columns["t"][7] = backwards.columns["t"][6];
  EXPECT_THAT(refusal(sampled(7, 0.07, 2.0), {2.0, 3.0}),
              testing::HasSubstr("7 points; at least 8"));
  EXPECT_THAT(
      refusal(backwards, {2.0, 3.0}),
      testing::HasSubstr("time does not increase: t = 0.075 is followed by 0.075 (point 8)"));
  EXPECT_THAT(refusal(sampled(40, 0.0125, 2.0), {0.0, 3.0}), testing::HasSubstr("--frequency"));
  EXPECT_THAT(refusal(sampled(40, 0.0125, 2.0), {2.0, {}}), testing::HasSubstr("--amplitude"));
  EXPECT_THAT(refusal(sampled(40, 0.005, 2.0), {2.0, 3.0}), testing::HasSubstr("0.40 of a period"));
  EXPECT_THAT(refusal(sampled(40, 0.2, 2.0), {2.0, 3.0}),
              testing::HasSubstr("2.5 points a period"));
}

}  // namespace
}  // namespace shaker::cli
