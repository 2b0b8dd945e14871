#include "estimator/diagnosis/select/internal/probe_starts.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/estimator/fixtures.hpp"

namespace shaker::estimator::diagnosis {
namespace {

using ::testing::DoubleNear;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

std::vector<double> starts(const std::vector<config::EffectSpec>& lines,
                           const std::string& symbol) {
  std::vector<double> values;
  for (const config::EffectSpec& line : lines)
    values.push_back(line.parameters.at(symbol).start.value());
  return values;
}

Probe probe_of(const std::string& effect, std::vector<std::string> coefficients) {
  Probe probe;
  probe.line.effect = effect;
  probe.coefficients = std::move(coefficients);
  return probe;
}

// The time constant of 1 s has the bounds 0.02 s and 30 s.
TEST(ProbeStarts, OfWhatHasNoCoefficientLieFarApart) {
  const auto lines = placed_apart(probe_of("gas_heat_transfer", {}));
  EXPECT_THAT(starts(lines, "tau"), ElementsAre(DoubleNear(0.125, 1e-12), DoubleNear(8.0, 1e-12)));
}

TEST(ProbeStarts, AreNotPlacedApartWhereACoefficientCanBeNothing) {
  EXPECT_THAT(placed_apart(probe_of("coulomb_friction", {"f_c"})), IsEmpty());
  EXPECT_THAT(placed_apart(probe_of("no such effect", {})), IsEmpty());
}

TEST(ProbeStarts, SwitchAnEffectOn) {
  const auto lines = starts_of(probe_of("coulomb_friction", {"f_c"}));
  ASSERT_EQ(lines.size(), 2U);
  const auto switched = starts(lines, "f_c");
  EXPECT_GT(switched[0], 0.0);
  EXPECT_GT(switched[1], switched[0]);
}

TEST(ProbeStarts, AreTheProbesOwnWhereNothingSwitchesItOn) {
  const auto lines = starts_of(probe_of("gas_heat_transfer", {}));
  ASSERT_EQ(lines.size(), 1U);
  EXPECT_THAT(lines[0].parameters, IsEmpty());
}

// A fit that ended at the lower bound of tau came by the lower of the two starts.
TEST(ProbeStarts, AreNotTakenAgainWhereAFitCameBy) {
  const Probe probe = probe_of("gas_heat_transfer", {});
  config::ModelSpec spec = estimator::testing::oleo();
  spec.effects.push_back(probe.line);
  HarmonicFit fit;
  fit.spec = spec;
  fit.model = std::make_shared<const Model>(spec);
  fit.theta = fit.model->start();
  const auto lines = placed_apart(probe);
  const auto passed = [&](double tau) {
    fit.theta.back() = tau;
    return std::vector{went_past(fit, lines[0]), went_past(fit, lines[1])};
  };
  ASSERT_EQ(fit.model->parameters().back().symbol, "tau");
  EXPECT_THAT(passed(fit.model->parameters().back().lower), ElementsAre(true, false));
  EXPECT_THAT(passed(fit.model->parameters().back().upper), ElementsAre(false, true));
  EXPECT_THAT(passed(0.1), ElementsAre(false, false));  // it settled: that is another valley
}

}  // namespace
}  // namespace shaker::estimator::diagnosis
