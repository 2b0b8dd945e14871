#include "estimator/signal/cycle_courses.hpp"

#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>

namespace shaker::estimator {
namespace {

TEST(CycleCourses, TakeOutTheMeansOfCyclesThatAreSoManyApart) {
  const std::vector<double> values = {3.0, -1.0, 4.0, 1.0, -5.0, 9.0, 2.0, 6.0};
  for (const int periods : {1, 2, 3, 4}) {
    std::vector<double> mean(static_cast<std::size_t>(periods), 0.0), rest = values;
    for (std::size_t i = 0; i < mean.size(); ++i) {
      double count = 0.0;
      for (std::size_t k = i; k < values.size(); k += mean.size(), ++count)
        mean[i] += values[k];
      mean[i] /= count;
    }
    const auto courses = CycleCourses::repeating(values.size(), periods);
    const CycleCourses::Split split = courses.take_out(rest);
    double squares = 0.0, about_mean = 0.0;
    for (std::size_t k = 0; k < values.size(); ++k) {
      const double off = values[k] - mean[k % mean.size()];
      EXPECT_NEAR(rest[k], off, 1e-12) << periods;
      squares += off * off;
      about_mean += std::pow(values[k] - 2.375, 2);
    }
    EXPECT_NEAR(split.rest, squares, 1e-12) << periods;
    EXPECT_NEAR(split.follows + split.rest, about_mean, 1e-12) << periods;
  }
}

// The slope of 0, 1, 3, 4, 7 is 1.7, by hand.
TEST(CycleCourses, ATrendIsTheLineOfLeastSquares) {
  std::vector<double> values = {0.0, 1.0, 3.0, 4.0, 7.0};
  const auto split = CycleCourses::trend(5).take_out(values);
  EXPECT_NEAR(split.follows, 1.7 * 1.7 * 10.0, 1e-12);
  EXPECT_NEAR(split.rest, 30.0 - 28.9, 1e-12);
}

// The probabilities of noise are uniform: of each course, and however many numbers a cycle has.
TEST(CycleCourses, NoiseFollowsByChance) {
  std::mt19937_64 source(4);
  std::normal_distribution<double> noise;
  constexpr int kDraws = 4000, kNumbers = 5;
  for (const CycleCourses& courses :
       {CycleCourses::trend(8), CycleCourses::repeating(9, 2), CycleCourses::repeating(13, 4)}) {
    int below_tenth = 0, below_hundredth = 0;
    for (int draw = 0; draw < kDraws; ++draw) {
      CycleCourses::Split split;
      for (int c = 0; c < kNumbers; ++c) {
        std::vector<double> values(courses.cycles());
        for (double& value : values)
          value = 7.0 + noise(source);
        split += courses.take_out(values);
      }
      const double chance = courses.by_chance(split, kNumbers);
      below_tenth += chance < 0.1 ? 1 : 0;
      below_hundredth += chance < 0.01 ? 1 : 0;
    }
    EXPECT_NEAR(below_tenth, 0.1 * kDraws, 4.0 * std::sqrt(0.09 * kDraws));
    EXPECT_NEAR(below_hundredth, 0.01 * kDraws, 4.0 * std::sqrt(0.0099 * kDraws));
  }
}

TEST(CycleCourses, SayNothingOfCyclesThatAreTooFew) {
  std::vector<double> values = {1.0, 2.0};
  const auto trend = CycleCourses::trend(2);
  EXPECT_EQ(trend.by_chance(trend.take_out(values), 1.0), 1.0);
  std::vector<double> alike = {1.0, 1.0, 1.0, 1.0};
  const auto pattern = CycleCourses::repeating(4, 2);
  EXPECT_EQ(pattern.by_chance(pattern.take_out(alike), 1.0), 1.0);
}

}  // namespace
}  // namespace shaker::estimator
