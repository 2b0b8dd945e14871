// Which estimates are told to have come to an end of their range?
#include "estimator/diagnosis/report/internal/estimates.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace shaker::estimator::diagnosis {
namespace {

TEST(Estimates, AnEndOfARangeIsToldWhereItIsNotZero) {
  Diagnosis said;
  said.parameters_after.resize(4);
  for (ParameterEstimate& p : said.parameters_after)
    p.at_bound = true;
  said.parameters_after[0].name = "c";  // absent
  said.parameters_after[1].name = "b";
  said.parameters_after[1].effect = "sensor_offset";
  said.parameters_after[1].unit = "mV";
  said.parameters_after[1].value = -0.1;
  said.parameters_after[2].value = 3.0;
  said.parameters_after[2].fixed = true;
  said.parameters_after[3].value = 4.0;
  said.parameters_after[3].at_bound = false;
  warn_of_bounds(said);
  ASSERT_EQ(said.warnings.size(), 1U);
  EXPECT_THAT(said.warnings[0],
              ::testing::StartsWith("b of sensor_offset ended at -0.1 mV, the end of its range"));
}

}  // namespace
}  // namespace shaker::estimator::diagnosis
