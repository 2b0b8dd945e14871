#include "cli/repetition.hpp"

#include <cmath>
#include <numbers>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/estimator/signal/repeating_motion.hpp"
#include "tests/sanitized.hpp"

namespace shaker::cli {
namespace {

using estimator::testing::kPoints;
using estimator::testing::motion;

TEST(Repetition, NoNoiseIsTakenForASubharmonic) {
  for (unsigned seed = 0; seed < 500; ++seed) {
    const int count = 4 + static_cast<int>(seed % 40);
    const auto doubt = doubt_of_repetition(motion(count, 1, 0.0, 0.01, seed), "f");
    EXPECT_EQ(doubt.sentence, "") << seed;
  }
  EXPECT_EQ(doubt_of_repetition(motion(20, 1, 0.0, 0.0, 1), "f").sentence, "");
}

// The offset changes from cycle to cycle. A cycle then has one independent value, and few
// cycles may alternate by chance.
TEST(Repetition, AWanderIsSeldomTakenForASubharmonic) {
  int doubted = 0;
  constexpr int kRecords = kSanitized ? 1000 : 4000;
  for (unsigned seed = 0; seed < kRecords; ++seed) {
    Cycles cycles = motion(4 + static_cast<int>(seed % 12), 1, 0.0, 1e-3, seed);
    std::mt19937 random(seed + 77);
    std::normal_distribution<double> offset(0.0, 0.03);
    for (std::size_t c = 0; c < cycles.count(); ++c) {
      const double moved = offset(random);
      for (std::size_t i = 0; i < kPoints; ++i)
        cycles.y[c * kPoints + i] += moved;
    }
    doubted += doubt_of_repetition(cycles, "f").sentence.empty() ? 0 : 1;
  }
  EXPECT_LE(doubted, 3 * kRecords / 1000);  // one in a thousand for each of 2, 3 and 4 periods
}

TEST(Repetition, SubharmonicsAreNamedWithTheirPeriodAndTheirSize) {
  for (unsigned seed = 0; seed < 50; ++seed) {
    // The means of odd and even cycles differ by twice the subharmonic; its rms difference is
    // 0.1 sqrt 2.
    const auto two = doubt_of_repetition(motion(200, 2, 0.1, 0.01, seed), "f");
    EXPECT_THAT(two.sentence, testing::HasSubstr("odd and even ones differ by 10 times the noise"));
    EXPECT_TRUE(two.spoils);
    EXPECT_THAT(doubt_of_repetition(motion(24, 3, 0.1, 0.01, seed), "f", "r01").sentence,
                testing::HasSubstr("say --periods r01=3"));
    EXPECT_THAT(doubt_of_repetition(motion(24, 4, 0.1, 0.01, seed), "f").sentence,
                testing::HasSubstr("no more than 3 periods can be fitted"));
    EXPECT_TRUE(check_repetition(motion(24, 2, 0.1, 0.01, seed), 2, "f"));
    EXPECT_TRUE(check_repetition(motion(24, 3, 0.1, 0.01, seed), 3, "f"));
    // A subharmonic below the noise of a cycle is found too.
    EXPECT_TRUE(check_repetition(motion(40, 2, 0.008, 0.01, seed), 2, "f")) << seed;
  }
  EXPECT_FALSE(doubt_of_repetition(motion(24, 2, 0.01, 0.001, 1), "f").spoils);
}

}  // namespace
}  // namespace shaker::cli
