// Fits that move theta and the periodic solutions together, for a model of two coordinates and for
// one with memory, against the optimum by independent code.
#include <cmath>

#include <gtest/gtest.h>

#include "config/model.hpp"
#include "estimator/fit/estimation.hpp"
#include "tests/estimator/counting_allocator.hpp"
#include "tests/estimator/fixtures.hpp"

namespace shaker::estimator {
namespace {

using Numbers = std::vector<double>;

struct LiftedJob {
  const char* name;
  config::ModelSpec (*spec)();
  Numbers truth, frequencies;
  int points;
  double error;  // of theta on that grid
};

void PrintTo(const LiftedJob& job, std::ostream* out) {
  *out << job.name;
}

config::ModelSpec with_presliding() {
  config::ModelSpec spec = testing::oleo();
  spec.effects.push_back(testing::effect("presliding_friction"));
  return spec;
}

class Lifted : public ::testing::TestWithParam<LiftedJob> {
 protected:
  Lifted() {
    for (const double frequency : GetParam().frequencies) {
      RunData run;
      run.frequency_hz = frequency;
      run.amplitude = 3.0;
      runs_.push_back(run);
    }
    for (const auto& row : testing::read_csv(std::string(GetParam().name) + ".csv"))
      runs_[static_cast<std::size_t>(row[0])].displacement.push_back(row[1]);
    for (const auto& row : testing::read_csv(std::string(GetParam().name) + "_reference.csv"))
      optimum_.push_back(row[0]);
    options_.grid.points = GetParam().points;
    options_.tolerance = 1e-8;
  }

  double error_of(const Fit& fit) const {
    double error = 0.0;
    for (std::size_t k = 0; k < optimum_.size(); ++k)
      error = std::max(error, std::fabs(fit.theta[k] / optimum_[k] - 1.0));
    return error;
  }

  std::vector<RunData> runs_;
  Numbers optimum_;
  EstimationOptions options_;
  Model model_{GetParam().spec()};
};

TEST_P(Lifted, NeedsNoFallbackFromTheCornersOfTwentyPercent) {
  Estimator estimator(model_, runs_, options_);
  for (unsigned corner = 0; corner < 1U << optimum_.size(); ++corner) {
    Numbers start = GetParam().truth;
    for (std::size_t k = 0; k < start.size(); ++k)
      start[k] *= (corner >> k & 1U) != 0 ? 1.2 : 0.8;
    const Fit& fit = estimator.fit(start);
    ASSERT_EQ(fit.status, FitStatus::converged) << corner << ": " << fit.trouble;
    EXPECT_FALSE(fit.nested) << corner;
    EXPECT_LT(error_of(fit), GetParam().error) << corner;
  }
}

TEST_P(Lifted, EndsWhereTheNestedMethodEnds) {
  Numbers start = GetParam().truth;
  for (double& value : start)
    value *= 1.05;
  Estimator lifted(model_, runs_, options_);
  const Fit& moved = lifted.fit(start);
  options_.method = Method::levenberg_marquardt;
  Estimator nested(model_, runs_, options_);
  const Fit& solved = nested.fit(start);
  EXPECT_FALSE(moved.nested);
  EXPECT_TRUE(solved.nested);
  for (std::size_t k = 0; k < start.size(); ++k) {
    EXPECT_NEAR(moved.theta[k] / solved.theta[k], 1.0, 1e-6) << k;
    EXPECT_NEAR(moved.standard_error[k] / solved.standard_error[k], 1.0, 1e-4) << k;
  }
}

TEST_P(Lifted, DoesNotAllocateAfterTheFirstFit) {
  Numbers start = GetParam().truth;
  for (double& value : start)
    value *= 1.05;
  Estimator estimator(model_, runs_, options_);
  estimator.fit(start);
  const long before = testing::allocation_count();
  for (std::size_t r = 0; r < runs_.size(); ++r)
    estimator.update_run(r, runs_[r]);
  const Fit& fit = estimator.fit(start);
  EXPECT_EQ(testing::allocation_count(), before);
  EXPECT_EQ(fit.status, FitStatus::converged);
}

INSTANTIATE_TEST_SUITE_P(
    Jobs, Lifted,
    ::testing::Values(
        LiftedJob{"oleo_j6",
                  [] { return testing::oleo_on_tyre(0.15); },
                  {16.7, 1.5, 5.3, 1.0, 2000.0, 4.0},
                  {2.0, 4.0},
                  160,
                  1e-6},
        LiftedJob{"oleo_j7", with_presliding, {13.3, 1.8, 4.3, 1.2, 0.5, 0.001}, {2.0}, 640, 4e-5}),
    [](const auto& one) { return std::string(one.param.name); });

}  // namespace
}  // namespace shaker::estimator
