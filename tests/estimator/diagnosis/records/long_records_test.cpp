// Records that are too long to be integrated whole, and records in another unit.
#include <algorithm>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "estimator/diagnosis/diagnose.hpp"
#include "tests/estimator/diagnosis/records.hpp"

namespace shaker::estimator::diagnosis {
namespace {

using testing::campaign_of;
using testing::drifting_oscillator;
using testing::oscillator_sweeps;
using testing::sweep;

// Its first minutes, far below the resonance, say nothing of the spring.
TEST(Records, NamesTheStiffeningSpringWhereALongSweepResonates) {
  const auto d = diagnose(
      campaign_of({sweep("linear", {{"cubic_stiffness", 800.0}}, 0.2, 1.6, 3.0, 400.0, 7)}),
      drifting_oscillator());
  ASSERT_TRUE(d) << d.error().what;
  EXPECT_EQ(d->verdict, Verdict::explained);
  ASSERT_EQ(d->effects.size(), 1U);
  EXPECT_EQ(d->effects[0].name, "cubic_stiffness");
  EXPECT_NEAR(d->effects[0].parameters.at(0).value, 800.0, 16.0);
}

// The catalogue's range for the zero, 0.1 m, is none for a stroke in millimetres.
TEST(Records, FitsASensorsZeroInTheModelsOwnUnit) {
  Campaign campaign = oscillator_sweeps({}, 3);
  for (Recording& run : campaign.runs) {
    for (double& u : run.displacement)
      u = 1000.0 * u + 5.0;
    for (double& x : run.excitation)
      x *= 1000.0;
  }
  auto model = drifting_oscillator();
  model.length_unit = "mm";
  model.effects.push_back(estimator::testing::effect("sensor_offset"));
  const auto d = diagnose(campaign, model);
  ASSERT_TRUE(d) << d.error().what;
  EXPECT_EQ(d->verdict, Verdict::adequate);
  EXPECT_NEAR(d->parameters_after.back().value, 5.0, 0.02);
}

// What a recorder loses in the midst of a record.
TEST(Records, NamesTheSameWhereSamplesAreMissing) {
  Campaign campaign =
      campaign_of({sweep("linear", {{"cubic_stiffness", 800.0}}, 0.5, 4.0, 3.0, 12.0, 7)});
  for (Recording& run : campaign.runs) {
    const auto lose = [&](double from, double to) {
      for (auto* column : {&run.displacement, &run.excitation, &run.t}) {
        const auto first = std::ranges::lower_bound(run.t, from) - run.t.begin();
        const auto last = std::ranges::lower_bound(run.t, to) - run.t.begin();
        column->erase(column->begin() + first, column->begin() + last);
      }
    };
    lose(8.0, 8.3);
    lose(3.1, 3.2);
    lose(2.8, 2.9);  // what is left between is too short
  }
  const auto d = diagnose(campaign, drifting_oscillator());
  ASSERT_TRUE(d) << d.error().what;
  EXPECT_EQ(d->verdict, Verdict::explained);
  ASSERT_EQ(d->effects.size(), 1U);
  EXPECT_EQ(d->effects[0].name, "cubic_stiffness");
  EXPECT_NEAR(d->effects[0].parameters.at(0).value, 800.0, 16.0);
  EXPECT_THAT(d->warnings, ::testing::Contains(::testing::HasSubstr(
                               "2.798 and 2.9 s; 3.098 and 3.2 s; 7.998 and 8.3 s: 3 of its 4")));
}

}  // namespace
}  // namespace shaker::estimator::diagnosis
