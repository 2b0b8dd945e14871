#include "report/estimate_document.hpp"

#include <gtest/gtest.h>

namespace shaker::report {
namespace {

TEST(EstimateDocument, LosesNothingOfTheEstimate) {
  estimator::Estimate estimate;
  estimate.model = "oleo";
  estimate.parameters = {
      {"theta1", "orifice_damping", "1/m", 16.7, 0.1, 16.5, 16.9, true, true, false},
      {"theta2", "gas_spring", "m/s^2", 1.5, 0.2, 1.1, 1.9, false, false, true}};
  estimate.parameters[1].bias = 0.02;
  estimate.covariance_order = {"theta2"};
  estimate.covariance = {0.04};
  estimate.noise_standard_deviation = 2e-5;
  estimate.sum_of_squares = 3e-8;
  estimate.condition = 12.5;
  estimate.observations = 128;
  estimate.degrees_of_freedom = 127;
  estimate.cycles = 4;
  estimate.runs = 2;
  estimate.iterations = 5;
  estimate.converged = true;
  estimate.usable = false;
  estimate.intervals_hold = false;
  estimate.warnings = {"a", "b"};
  const protocol::EstimateDocument document = to_document(estimate);
  EXPECT_EQ(document.model, "oleo");
  ASSERT_EQ(document.parameters.size(), 2u);
  const protocol::ParameterEntry& first = document.parameters[0];
  EXPECT_EQ(first.name, "theta1");
  EXPECT_EQ(first.effect, "orifice_damping");
  EXPECT_EQ(first.unit, "1/m");
  EXPECT_EQ(first.value, 16.7);
  EXPECT_EQ(first.standard_error, 0.1);
  EXPECT_EQ(first.lower, 16.5);
  EXPECT_EQ(first.upper, 16.9);
  EXPECT_TRUE(first.fixed);
  EXPECT_TRUE(first.at_bound);
  EXPECT_FALSE(first.determined);
  EXPECT_FALSE(first.bias) << "the value is the optimum";
  EXPECT_EQ(document.parameters[1].bias, 0.02);
  EXPECT_FALSE(document.parameters[1].fixed);
  EXPECT_TRUE(document.parameters[1].determined);
  EXPECT_EQ(document.covariance_order, estimate.covariance_order);
  EXPECT_EQ(document.covariance, estimate.covariance);
  EXPECT_EQ(document.noise_standard_deviation, 2e-5);
  EXPECT_EQ(document.sum_of_squares, 3e-8);
  EXPECT_EQ(document.condition, 12.5);
  EXPECT_EQ(document.observations, 128);
  EXPECT_EQ(document.degrees_of_freedom, 127);
  EXPECT_EQ(document.cycles_used, 4);
  EXPECT_EQ(document.runs_used, 2);
  EXPECT_EQ(document.iterations, 5);
  EXPECT_TRUE(document.converged);
  EXPECT_FALSE(document.usable);
  EXPECT_FALSE(document.intervals_hold);
  EXPECT_EQ(document.warnings, estimate.warnings);
  EXPECT_FALSE(document.campaign || document.run || document.cycle || document.latency_s);
}

}  // namespace
}  // namespace shaker::report
