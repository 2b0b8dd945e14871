#include "cli/drop_picture.hpp"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace shaker::cli {
namespace {

// A blow of 0.2 s, and then the weight for the rest of `seconds`.
estimator::DropRun blow(double seconds) {
  estimator::DropRun run;
  for (int i = 0; i <= 1000; ++i) {
    const double t = seconds * i / 1000.0;
    run.history.t.push_back(t);
    run.history.load.push_back(t < 0.2 ? 100.0 * std::sin(M_PI * t / 0.2) : 9.8);
  }
  run.figures = {0.1, 0.15};
  return run;
}

TEST(DropPicture, EndsSoonAfterTheLoadStaysAtItsLastValue) {
  EXPECT_NEAR(eventful_time(blow(1.5).history), 0.4, 0.01);
  EXPECT_DOUBLE_EQ(eventful_time(blow(0.1).history), 0.1);  // never more than there is
  EXPECT_EQ(eventful_time({}), 0.0);
  const std::string drawn = drop_picture(blow(1.5), nullptr, {3.0, std::nullopt, "m"});
  EXPECT_THAT(drawn, ::testing::HasSubstr(">0.4</text>"));
  EXPECT_THAT(drawn, ::testing::Not(::testing::HasSubstr(">1.5</text>")));
}

TEST(DropPicture, IsInNewtonsWithAMass) {
  EXPECT_THAT(drop_picture(blow(1.5), nullptr, {3.0, 100.0, "m"}), ::testing::HasSubstr("load, N"));
  EXPECT_THAT(drop_picture(blow(1.5), nullptr, {3.0, std::nullopt, "ft"}),
              ::testing::HasSubstr("load per mass, ft/s^2"));
}

}  // namespace
}  // namespace shaker::cli
