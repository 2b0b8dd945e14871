#include "estimator/fit/internal/batch_estimation.hpp"

#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>

#include <gtest/gtest.h>

#include "tests/estimator/benchmark_jobs.hpp"
#include "tests/estimator/counting_allocator.hpp"
#include "tests/estimator/fixtures.hpp"

namespace shaker::estimator {
namespace {

using testing::job1;
using testing::kJobStart;

EstimationOptions on_points(int points) {
  EstimationOptions options;
  options.grid = {Scheme::order6, points, true};
  return options;
}

// The record of job J1, with new noise for each record.
std::vector<double> records(std::size_t count, unsigned seed = 1) {
  const RunData run = job1();
  std::mt19937 generator(seed);
  std::uniform_real_distribution<double> noise(-3e-4, 3e-4);
  std::vector<double> all;
  for (std::size_t i = 0; i < count; ++i) {
    for (const double y : run.displacement)
      all.push_back(y + noise(generator));
  }
  return all;
}

TEST(BatchEstimator, FindsWhatTheEstimatorFindsRecordByRecord) {
  const Model model(testing::oleo(32.2));
  RunData run = job1();
  const auto data = records(11);
  BatchEstimator batch(model, run, on_points(80));
  const BatchFit& fit = batch.fit(data, kJobStart);
  ASSERT_EQ(fit.records, 11U);
  Estimator single(model, {run}, on_points(80));
  for (std::size_t i = 0; i < fit.records; ++i) {
    std::copy_n(data.begin() + static_cast<std::ptrdiff_t>(40 * i), 40, run.displacement.begin());
    single.update_run(0, run);
    const Fit& one = single.fit(kJobStart);
    EXPECT_EQ(fit.status[i], FitStatus::converged);
    for (std::size_t k = 0; k < 4; ++k) {
      EXPECT_NEAR(fit.theta_of(i)[k] / one.theta[k], 1.0, 1e-9);
      EXPECT_NEAR(fit.standard_error[4 * i + k] / one.standard_error[k], 1.0, 1e-6);
    }
    EXPECT_NEAR(fit.sum_of_squares[i] / one.sum_of_squares, 1.0, 1e-9);
  }
}

TEST(BatchEstimator, FindsTheSameForAForceOfTheExcitation) {
  config::ModelSpec spec = testing::oleo(32.2);
  config::EffectSpec lost;
  lost.effect = "lost_excitation";
  lost.formula = "part * x";
  lost.parameters["part"].start = 0.1;
  lost.parameters["part"].fixed = true;
  spec.effects.push_back(lost);
  const Model model(spec);
  RunData run = job1();
  const auto data = records(3);
  std::vector<double> start = kJobStart;
  start.push_back(0.1);
  BatchEstimator batch(model, run, on_points(80));
  const BatchFit& fit = batch.fit(data, start);
  Estimator single(model, {run}, on_points(80));
  for (std::size_t i = 0; i < fit.records; ++i) {
    std::copy_n(data.begin() + static_cast<std::ptrdiff_t>(40 * i), 40, run.displacement.begin());
    single.update_run(0, run);
    const Fit& one = single.fit(start);
    ASSERT_EQ(one.status, FitStatus::converged) << one.trouble;
    for (std::size_t k = 0; k < 4; ++k)
      EXPECT_NEAR(fit.theta_of(i)[k] / one.theta[k], 1.0, 1e-8) << k;
  }
}

TEST(BatchEstimator, GivesTheSameBitsOnAnyNumberOfThreadsAndBesideAnyNeighbours) {
  const Model model(testing::oleo(32.2));
  const auto data = records(45);
  BatchEstimator alone(model, job1(), on_points(80), 1);
  const BatchFit expected = alone.fit(data, kJobStart);
  for (const int threads : {2, 3}) {
    BatchEstimator batch(model, job1(), on_points(80), threads);
    EXPECT_EQ(batch.fit(data, kJobStart).theta, expected.theta);
    EXPECT_EQ(batch.fit(data, kJobStart).standard_error, expected.standard_error);
  }
}

// The sum of squares of this record overflows for every parameter value.
std::vector<double> hopeless() {
  std::vector<double> record;
  for (int j = 0; j < 40; ++j)
    record.push_back(j % 3 == 0 ? -1e200 : 1e200);
  return record;
}

// A record that no oleo can produce: the best response is zero.
std::vector<double> sawtooth() {
  std::vector<double> record;
  for (int j = 0; j < 40; ++j)
    record.push_back(j % 2 == 0 ? 10.0 : -10.0);
  return record;
}

void replace(std::vector<double>& all, std::size_t record, const std::vector<double>& by) {
  std::copy(by.begin(), by.end(), all.begin() + static_cast<std::ptrdiff_t>(40 * record));
}

// Compares bits, because standard errors may be NaN.
void expect_same(const BatchFit& a, std::size_t i, const BatchFit& b, std::size_t j) {
  const auto bits = [](const double& x) { return std::bit_cast<std::uint64_t>(x); };
  EXPECT_EQ(a.status[i], b.status[j]);
  EXPECT_EQ(a.iterations[i], b.iterations[j]);
  EXPECT_EQ(bits(a.sum_of_squares[i]), bits(b.sum_of_squares[j]));
  EXPECT_EQ(bits(a.noise[i]), bits(b.noise[j]));
  for (std::size_t k = 0; k < 4; ++k) {
    EXPECT_EQ(bits(a.theta_of(i)[k]), bits(b.theta_of(j)[k]));
    EXPECT_EQ(bits(a.standard_error[4 * i + k]), bits(b.standard_error[4 * j + k]));
  }
}

TEST(BatchEstimator, GivesUpTheSameWayInAnyLaneAndDisturbsNoNeighbour) {
  const Model model(testing::oleo(32.2));
  const auto data = records(20);
  BatchEstimator one(model, job1(), on_points(80), 1);
  const BatchFit undisturbed = one.fit(data, kJobStart);
  const BatchFit given_up = one.fit(hopeless(), kJobStart);
  EXPECT_EQ(given_up.status[0], FitStatus::not_converged);
  EXPECT_EQ(given_up.sum_of_squares[0], std::numeric_limits<double>::infinity());
  const BatchFit worst = one.fit(sawtooth(), kJobStart);
  EXPECT_GT(worst.sum_of_squares[0], 3000.0);  // of 4000, in the data's unit squared
  // In three batches of eight lanes: among good records, beside another bad one, and in an
  // incomplete batch.
  auto mixed = data;
  for (const std::size_t record : {0UL, 5UL, 14UL, 19UL})
    replace(mixed, record, hopeless());
  for (const std::size_t record : {6UL, 12UL})
    replace(mixed, record, sawtooth());
  for (const int threads : {1, 2, 3}) {
    BatchEstimator batch(model, job1(), on_points(80), threads);
    const BatchFit& fit = batch.fit(mixed, kJobStart);
    for (std::size_t i = 0; i < 20; ++i) {
      SCOPED_TRACE(i);
      if (i == 0 || i == 5 || i == 14 || i == 19)
        expect_same(fit, i, given_up, 0);
      else if (i == 6 || i == 12)
        expect_same(fit, i, worst, 0);
      else
        expect_same(fit, i, undisturbed, i);
    }
  }
}

TEST(BatchEstimator, DoesNotAllocateOnceItHasRun) {
  const Model model(testing::oleo(32.2));
  const auto data = records(20);
  BatchEstimator batch(model, job1());
  batch.fit(data, kJobStart);
  const long before = testing::allocation_count();
  batch.fit(data, kJobStart);
  EXPECT_EQ(testing::allocation_count(), before);
}

TEST(BatchEstimator, RefusesWhatItCannotUse) {
  const Model model(testing::oleo(32.2));
  BatchEstimator batch(model, job1());
  auto data = records(3);
  data[50] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(batch.fit(data, kJobStart), std::invalid_argument);
  data.resize(70);
  EXPECT_THROW(batch.fit(data, kJobStart), std::invalid_argument);
  RunData uneven = job1();
  uneven.tau.assign(40, 0.0);
  EXPECT_THROW(BatchEstimator(model, uneven), std::invalid_argument);
}

// Twelve runs in two batches, against a separate system for each run.
TEST(Estimator, TakesRunsAbreastWithoutChangingTheEstimate) {
  std::vector<RunData> runs = testing::job2();
  const Model model(testing::oleo(32.2));
  EstimationOptions options = on_points(128);
  options.tolerance = 1e-11;
  Estimator batch(model, runs, options);
  for (RunData& run : runs)
    run.sample_weight.assign(run.displacement.size(), 1.0);  // batches do not accept weights
  Estimator single(model, runs, options);
  const Fit& one = single.fit(kJobStart);
  const Fit& all = batch.fit(kJobStart);
  EXPECT_EQ(all.status, FitStatus::converged);
  for (std::size_t k = 0; k < 4; ++k) {
    EXPECT_NEAR(all.theta[k] / one.theta[k], 1.0, 1e-9);
    EXPECT_NEAR(all.standard_error[k] / one.standard_error[k], 1.0, 1e-7);
  }
  EXPECT_NEAR(all.sum_of_squares / one.sum_of_squares, 1.0, 1e-9);
  EXPECT_EQ(batch.predicted(11).size(), 64U);
  EXPECT_NEAR(batch.predicted(11)[5], single.predicted(11)[5], 1e-10);
}

}  // namespace
}  // namespace shaker::estimator
