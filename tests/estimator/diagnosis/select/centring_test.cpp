// A fitted place of rest is told as any fitted number is.
#include "estimator/diagnosis/select/internal/centring.hpp"

#include <cmath>
#include <ostream>
#include <string>

#include <gtest/gtest.h>

#include "estimator/diagnosis/diagnose.hpp"
#include "tests/estimator/diagnosis/campaigns.hpp"
#include "tests/estimator/fixtures.hpp"

namespace shaker::estimator::diagnosis {
namespace {

TEST(PlaceOfRest, TellsTheFittedPlaceOfRestOfASpring) {
  const auto d =
      diagnose(testing::recorded({{"cubic_stiffness", 6000.0}, {"cubic_stiffness_centre", 0.16}},
                                 testing::kSixRuns, 5),
               estimator::testing::oleo());
  ASSERT_TRUE(d) << d.error().what;
  ASSERT_EQ(d->effects.size(), 1U);
  EXPECT_EQ(d->effects[0].name, "cubic_stiffness");
  ASSERT_EQ(d->effects[0].parameters.size(), 2U);
  const ParameterEstimate& place = d->effects[0].parameters[1];
  EXPECT_EQ(place.name, "u0");
  EXPECT_EQ(place.unit, "m");
  EXPECT_GT(place.standard_error, 0.0);
  EXPECT_LT(place.standard_error, 1e-3);
  EXPECT_LT(std::fabs(place.value - 0.16), 4.0 * place.standard_error);
  EXPECT_LT(place.lower, place.value);
  EXPECT_GT(place.upper, place.value);
  EXPECT_EQ(d->improved.effects.back().constants.at("u0"), place.value);
}

// The force is nearly a constant and a slope along the motion about 0.15 m.
struct Spring {
  const char *name, *symbol;
  double size, place;
};

void PrintTo(const Spring& spring, std::ostream* out) {
  *out << spring.name << " at " << spring.place;
}

class Centring : public ::testing::TestWithParam<Spring> {};

TEST_P(Centring, NamesASpringThatIsNotAtRestAlongTheMotion) {
  const Spring& truth = GetParam();
  const std::string name = truth.name;
  const auto d = diagnose(testing::recorded({{name, truth.size}, {name + "_centre", truth.place}},
                                            testing::kSixRuns, 5),
                          estimator::testing::oleo());
  ASSERT_TRUE(d) << d.error().what;
  EXPECT_EQ(d->verdict, Verdict::explained);
  ASSERT_EQ(d->effects.size(), 1U);
  EXPECT_EQ(d->effects[0].name, name);
  const auto& parameters = d->effects[0].parameters;
  ASSERT_EQ(parameters.size(), truth.place == 0.0 ? 1U : 2U);  // zero is no number that was fitted
  EXPECT_EQ(parameters[0].name, truth.symbol);
  EXPECT_NEAR(parameters[0].value, truth.size, 4.0 * parameters[0].standard_error);
  if (truth.place == 0.0) return;
  EXPECT_NEAR(parameters[1].value, truth.place, 4.0 * parameters[1].standard_error);
}

INSTANTIATE_TEST_SUITE_P(Springs, Centring,
                         ::testing::Values(Spring{"linear_stiffness", "k", 20.0, 0.0},
                                           Spring{"cubic_stiffness", "k3", 400.0, 0.0},
                                           Spring{"linear_stiffness", "k", 20.0, -0.08},
                                           Spring{"linear_stiffness", "k", 20.0, 0.08}));

TEST(PlaceOfRest, KnowsTheLinesWhosePlaceIsFitted) {
  config::ModelSpec spec = estimator::testing::oleo();
  const std::size_t own = spec.effects.size();
  EXPECT_TRUE(fitted_places(spec, own).empty());
  spec.effects.push_back(estimator::testing::effect("coulomb_friction"));
  spec.effects.push_back(estimator::testing::effect("cubic_stiffness"));
  EXPECT_TRUE(fitted_places(spec, own).empty());
  spec.effects.back().constants["u0"] = 0.16;
  EXPECT_EQ(fitted_places(spec, own), std::vector<std::size_t>{own + 1});
  EXPECT_TRUE(fitted_places(spec, own + 2).empty());
}

}  // namespace
}  // namespace shaker::estimator::diagnosis
