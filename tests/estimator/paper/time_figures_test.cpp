#include "estimator/paper/time_figures.hpp"

#include <cmath>
#include <fstream>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace shaker::estimator::paper {
namespace {

using Table = std::vector<std::vector<double>>;

nlohmann::json reference(int figure) {
  std::ifstream file(SHAKER_TEST_DATA "/verbeek1991.json");
  return nlohmann::json::parse(file).at("fig" + std::to_string(figure));
}

double largest(const Table& a, const Table& b) {
  double worst = 0.0;
  for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i) {
    for (std::size_t k = 0; k < a[i].size(); ++k)
      worst = std::max(worst, std::fabs(a[i][k] - b[i][k]));
  }
  return worst;
}

class TimeFigures : public ::testing::TestWithParam<int> {};

TEST_P(TimeFigures, AreReproducedToTheDigitsThatCanBeReached) {
  const auto wanted = reference(GetParam());
  const FigureRun run = reproduce_time(GetParam());
  ASSERT_EQ(run.printed, wanted["printed"].get<Table>());
  ASSERT_EQ(run.iterates.size(), run.printed.size());
  const double tolerance = wanted.value("agree_tol", wanted.value("agree_tol_c1", 0.0));
  EXPECT_LE(largest(run.iterates, run.printed), tolerance);
  EXPECT_DOUBLE_EQ(run.max_deviation, largest(run.iterates, run.printed));
  EXPECT_LE(run.max_deviation, run.agreement);
  EXPECT_TRUE(run.reproducible);
  // The iterates of the independent code agree far better than the print.
  const auto independent =
      (GetParam() == 9 ? wanted["iterates_c1"] : wanted["iterates"]).get<Table>();
  EXPECT_LT(largest(run.iterates, independent), 1e-6);
}

INSTANTIATE_TEST_SUITE_P(TimeIntegration, TimeFigures, ::testing::Values(6, 7, 9, 10));

TEST(TimeFigures, FiveCannotBeReproducedAndSaysSo) {
  const FigureRun run = reproduce_time(5);
  EXPECT_EQ(run.printed, reference(5)["printed"].get<Table>());
  ASSERT_GE(run.iterates.size(), 1U);
  EXPECT_LT(largest({run.iterates[0]}, {run.printed[0]}), 0.05);  // by construction
  EXPECT_FALSE(run.reproducible);
  EXPECT_NE(run.remark.find("cannot be reproduced"), std::string::npos);
}

TEST(TimeFigures, NineNeedsFiveIterationsWithoutTheSlip) {
  const Table right = figure_nine_without_the_slip();
  const std::vector<double> exact = {0.4, 0.0, 5.08, 5.0, 1.62, 1.0};
  ASSERT_GE(right.size(), 5U);
  EXPECT_GT(largest({right[3]}, {exact}), 5e-5);
  EXPECT_LT(largest({right[4]}, {exact}), 5e-5);
  const Table independent = reference(9)["iterates_c2_correct"];
  EXPECT_LT(largest({right.begin(), right.begin() + 5}, independent), 1e-6);
}

TEST(TimeFigures, OtherNumbersAreRefusedWithTheChoice) {
  EXPECT_THROW(reproduce_time(8), std::invalid_argument);
  EXPECT_THROW(reproduce_time(11), std::invalid_argument);
}

}  // namespace
}  // namespace shaker::estimator::paper
