// Every entry of the catalogue is scored, named, or stands under `not_tried` with a reason.
#include <algorithm>
#include <cmath>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "estimator/diagnosis/diagnose.hpp"
#include "estimator/model/effects/catalogue.hpp"
#include "tests/estimator/diagnosis/campaigns.hpp"
#include "tests/estimator/diagnosis/free_decay.hpp"
#include "tests/estimator/fixtures.hpp"

namespace shaker::estimator::diagnosis {
namespace {

using ::testing::HasSubstr;

template <typename List>
std::ptrdiff_t times(const List& list, std::string_view name) {
  return std::count_if(list.begin(), list.end(), [&](const auto& one) { return one.name == name; });
}

void expect_whole_catalogue(const Diagnosis& d) {
  for (const Effect* effect : catalogue()) {
    const auto ranked = times(d.ranking, effect->name());
    const auto left_out = times(d.not_tried, effect->name());
    EXPECT_LE(ranked + left_out, 1) << effect->name();
    EXPECT_GE(ranked + left_out + times(d.effects, effect->name()), 1) << effect->name();
  }
  for (const NotTried& n : d.not_tried) {
    EXPECT_FALSE(n.reason.empty()) << n.name;
  }
}

Diagnosis of_response(const std::map<std::string, double>& truth) {
  const auto d =
      diagnose(testing::recorded(truth, testing::kSixRuns, 5), estimator::testing::oleo());
  EXPECT_TRUE(d) << d.error().what;
  return d ? *d : Diagnosis{};
}

Diagnosis of_decay(double friction, double length, double duration = 10.0,
                   const DiagnoseOptions& options = {}) {
  Campaign campaign;
  campaign.runs.push_back(testing::decay_of(
      [&](double u, double v) {
        return 40.0 * u + 0.2 * v + friction * length * std::tanh(v / (1e-4 * length));
      },
      {.start = 0.1 * length, .duration = duration, .noise = 2e-5 * length}));
  auto model = estimator::testing::linear_oscillator();
  model.effects[0].parameters["c"].start = 0.2;
  model.effects[1].parameters["k"].start = 42.0;
  if (length != 1.0) model.length_unit = "counts";
  const auto d = diagnose(campaign, model, options);
  EXPECT_TRUE(d) << d.error().what;
  return d ? *d : Diagnosis{};
}

TEST(NotTried, HoldsWhatTheRankingOfAResponseDoesNot) {
  const Diagnosis quiet = of_response({});
  expect_whole_catalogue(quiet);
  EXPECT_EQ(quiet.verdict, Verdict::adequate);
  const Diagnosis rubbing = of_response({{"coulomb_friction", 0.2}});
  expect_whole_catalogue(rubbing);
  EXPECT_EQ(rubbing.verdict, Verdict::explained);
}

TEST(NotTried, HoldsWhatTheRankingOfADecayDoesNot) {
  const Diagnosis quiet = of_decay(0.0, 1.0);
  expect_whole_catalogue(quiet);
  EXPECT_EQ(quiet.verdict, Verdict::adequate);
  expect_whole_catalogue(of_decay(0.05, 1.0));
  // A spring in series is stiff, and a damper without inertia behind a play stiffer still.
  EXPECT_EQ(times(quiet.ranking, "tyre"), 1);
  EXPECT_EQ(times(quiet.ranking, "free_play"), 1);
}

// Ranges follow the motion. tests/cli/test_scale.py looks at probabilities too.
TEST(NotTried, AnswersTheSameInAnyUnit) {
  const Diagnosis metres = of_decay(0.05, 1.0, 5.0), counts = of_decay(0.05, 1e3, 5.0);
  expect_whole_catalogue(counts);
  EXPECT_EQ(counts.verdict, metres.verdict);
  ASSERT_FALSE(metres.effects.empty());
  ASSERT_FALSE(counts.effects.empty());
  EXPECT_EQ(counts.effects[0].name, metres.effects[0].name);
  EXPECT_EQ(metres.effects[0].name, "coulomb_friction");
}

// What could not be computed is not ranked as if it had been.
TEST(NotTried, NamesWhatCouldNotBeComputed) {
  const Diagnosis d = of_decay(1.0, 1.0, 5.0);
  expect_whole_catalogue(d);
  const auto found = std::find_if(d.not_tried.begin(), d.not_tried.end(), [](const NotTried& n) {
    return n.name == "sensor_quantisation";
  });
  ASSERT_NE(found, d.not_tried.end());
  EXPECT_TRUE(found->failed);
  EXPECT_THAT(found->reason, HasSubstr("no motion through the record for run decay"));
}

// A fit that creeps, or whose equations are stiff, neither goes on for ever nor speaks for or against
// its effect.
TEST(NotTried, NamesWhatTookTooMuchWork) {
  DiagnoseOptions brief;
  brief.evaluation_budget *= 0.02;
  const Diagnosis d = of_decay(0.05, 1.0, 5.0, brief);
  expect_whole_catalogue(d);
  const auto found = std::find_if(d.not_tried.begin(), d.not_tried.end(),
                                  [](const NotTried& n) { return n.name == "free_play"; });
  ASSERT_NE(found, d.not_tried.end());
  EXPECT_TRUE(found->failed);
  EXPECT_THAT(found->reason, HasSubstr("took all the work that one may take"));
  EXPECT_EQ(times(d.ranking, "free_play"), 0);
  ASSERT_FALSE(d.effects.empty());
  EXPECT_EQ(d.effects[0].name, "coulomb_friction");
}

}  // namespace
}  // namespace shaker::estimator::diagnosis
