// Compares every parameter and every standard deviation with NIST's certified values.
#include <algorithm>
#include <cmath>
#include <set>

#include <gtest/gtest.h>

#include "estimator/paper/optimisers/methods.hpp"
#include "tests/estimator/paper/optimisers/nist_models.hpp"

namespace shaker::estimator::optimisers {
namespace {

using namespace testing;

// The number of digits that agree; NIST certifies 11.
double digits(double value, double certified) {
  const double off = std::fabs(value - certified) / std::fabs(certified);
  return std::clamp(off > 0.0 ? -std::log10(off) : 11.0, 0.0, 11.0);
}

struct Score {
  double parameters = 11.0, deviations = 11.0;  // the worst of each
  double mean_parameters = 0.0, mean_deviations = 0.0;
  Summary found;
};

Score score(const NistSet& set, int start) {
  const auto problem = nist_problem(set);
  const auto& from = set.start[start];
  Score out;
  Options options;
  options.max_iterations = 2000;
  out.found = automatic(
      *problem, Eigen::Map<const Eigen::VectorXd>(from.data(), problem->parameters()), options);
  // The standard deviations are (3.27) and (3.28) at the result, in 34 digits after polishing.
  const auto& theta = out.found.theta;
  const Polished polished =
      polish(*problem->extended(), {theta.data(), theta.data() + theta.size()});
  const double variance = polished.sum_of_squares / set.degrees_of_freedom;
  const std::size_t p = set.certified.size();
  for (std::size_t k = 0; k < p; ++k) {
    const double a = digits(theta[static_cast<Eigen::Index>(k)], set.certified[k]);
    const double b =
        polished.inverse_gram.empty()
            ? 0.0
            : digits(std::sqrt(variance * polished.inverse_gram[k * p + k]), set.deviation[k]);
    out.parameters = std::min(out.parameters, a);
    out.deviations = std::min(out.deviations, b);
    out.mean_parameters += a / static_cast<double>(p);
    out.mean_deviations += b / static_cast<double>(p);
  }
  return out;
}

void print(const NistSet& set, int start, const Score& s) {
  std::printf("| %s | %d | %.1f | %.1f | %d | %d |\n", set.name.c_str(), start + 1, s.parameters,
              s.deviations, s.found.iterations, s.found.evaluations);
}

// Four sets of graded difficulty, which must agree to more digits.
TEST(Nist, FourSetsAreRightFromBothStarts) {
  int count = 0;
  for (const NistSet& set : nist_sets()) {
    if (!std::set<std::string>{"Misra1a", "Lanczos3", "MGH09", "Eckerle4"}.contains(set.name))
      continue;
    for (const int start : {0, 1}) {
      const Score s = score(set, start);
      EXPECT_GE(s.parameters, 8.0) << set.name << " from start " << start + 1;
      EXPECT_GE(s.deviations, 8.0) << set.name << " from start " << start + 1;
      EXPECT_NEAR(s.found.sum_of_squares / set.residual_sum, 1.0, 1e-10) << set.name;
      ++count;
    }
  }
  EXPECT_EQ(count, 8);
}

TEST(Nist, AllSetsAreRightFromBothStarts) {
  double parameters = 0.0, deviations = 0.0;
  int count = 0;
  for (const NistSet& set : nist_sets()) {
    ASSERT_NE(nist_problem(set), nullptr) << set.name;
    for (const int start : {0, 1}) {
      const Score s = score(set, start);
      print(set, start, s);
      EXPECT_GE(s.parameters, 6.0) << set.name << " from start " << start + 1;
      EXPECT_GE(s.deviations, 6.0) << set.name << " from start " << start + 1;
      parameters += s.mean_parameters;
      deviations += s.mean_deviations;
      ++count;
    }
  }
  EXPECT_EQ(count, 2 * 27);
  std::printf("mean digits: parameters %.2f, standard deviations %.2f\n", parameters / count,
              deviations / count);
  EXPECT_GE(parameters / count, 9.4);
  EXPECT_GE(deviations / count, 8.0);
}

}  // namespace
}  // namespace shaker::estimator::optimisers
