// A measured drop that joins a campaign's estimate. The drops are those of the linear oscillator in
// closed form, and of an oscillator with dry friction by steps of Runge and Kutta of this file.
#include "estimator/drop/joined_drop.hpp"

#include <array>
#include <cmath>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "../fixtures.hpp"
#include "estimator/drop/drop_mixture.hpp"

namespace shaker::estimator {
namespace {

using namespace testing;

constexpr double kSink = 1.0, kTransducer = 1e-5, kSpacing = 1e-3;
const DropConditions kFall = {kSink, 0.0, 1.0, -1};

// u'' + c u' + k u = -pull from u = 0, u' = 1 m/s.
double stroke_at(double t, double c, double k, double pull = 0.0) {
  const double decay = 0.5 * c, damped = std::sqrt(k - decay * decay);
  const double rest = -pull / k;
  return rest + std::exp(-decay * t) * (-rest * std::cos(damped * t) +
                                        (kSink - decay * rest) / damped * std::sin(damped * t));
}

DropRecord measured_fall(double c, double k, unsigned seed, double pull = 0.0) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> noise(0.0, kTransducer);
  DropRecord record;
  for (int i = 0; i < 500; ++i) {
    record.t.push_back(kSpacing * i);
    record.stroke.push_back(stroke_at(record.t.back(), c, k, pull) + noise(random));
  }
  return record;
}

// With dry friction, of which the oscillator knows nothing.
DropRecord measured_fall_with_friction(double friction, unsigned seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> noise(0.0, kTransducer);
  const auto pull = [&](double u, double v) {
    return -2.0 * v - 100.0 * u - friction * std::tanh(v / 1e-3);
  };
  DropRecord record;
  double u = 0.0, v = kSink;
  constexpr int kFine = 20;
  constexpr double kStep = kSpacing / kFine;
  for (int i = 0; i < 500; ++i) {
    record.t.push_back(kSpacing * i);
    record.stroke.push_back(u + noise(random));
    for (int s = 0; s < kFine; ++s) {
      const double a1 = pull(u, v), v2 = v + 0.5 * kStep * a1;
      const double a2 = pull(u + 0.5 * kStep * v, v2), v3 = v + 0.5 * kStep * a2;
      const double a3 = pull(u + 0.5 * kStep * v2, v3), v4 = v + kStep * a3;
      const double a4 = pull(u + kStep * v3, v4);
      u += kStep / 6.0 * (v + 2.0 * v2 + 2.0 * v3 + v4);
      v += kStep / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4);
    }
  }
  return record;
}

DamperHypothesis oscillator_known_to(double c, double c_error, double k, double k_error) {
  DamperHypothesis h;
  h.model = linear_oscillator();
  h.model.effects[0].parameters["c"].start = c;
  h.model.effects[1].parameters["k"].start = k;
  h.numbers = {{0, "c", false}, {1, "k", false}};
  h.covariance = {c_error * c_error, 0.0, 0.0, k_error * k_error};
  h.degrees_of_freedom = 1e6;
  h.probability = 1.0;
  return h;
}

IdentifiedDamper damper_of(std::vector<DamperHypothesis> hypotheses) {
  IdentifiedDamper damper;
  damper.hypotheses = std::move(hypotheses);
  for (int i = 0; i < 40; ++i)
    damper.visited.push_back({0.02 * std::cos(0.157 * i), 0.2 * std::sin(0.157 * i), 0.0, 0.0});
  damper.unnamed_force = 0.01;
  return damper;
}

JoinedDrop joined_of(const IdentifiedDamper& damper, const DropRecord& record,
                     const DropConditions& fall = kFall) {
  auto found = join_drop(damper, fall, record);
  EXPECT_TRUE(found.ok()) << (found.ok() ? "" : found.error().what);
  return std::move(*found);
}

double start_of_c(const DamperHypothesis& h) {
  return value_of(h.model, {0, "c", false});
}

double width_of_peak_stroke(const IdentifiedDamper& damper) {
  const auto drop = predict_drop(damper, kFall);
  EXPECT_TRUE(drop.ok());
  return drop->bands[0].upper - drop->bands[0].lower;
}

TEST(JoinedDrop, TheNoiseOfARecordIsThatOfItsSamplesOrOfItsRounding) {
  const auto record = measured_fall(2.0, 100.0, 7);
  EXPECT_NEAR(noise_of_record(record.t, record.stroke), kTransducer, 0.15 * kTransducer);
  auto rounded = record.stroke;
  for (double& stroke : rounded)
    stroke = 1e-3 * std::round(1e3 * stroke);
  EXPECT_GE(noise_of_record(record.t, rounded), 0.99e-3 / std::sqrt(12.0));
  EXPECT_TRUE(std::isnan(noise_of_record({0.0, 1.0}, {0.0, 1.0})));
}

// The estimate of campaign and drop together by the normal equations, with slopes by differences of
// the closed form.
TEST(JoinedDrop, IsTheEstimateOfCampaignAndDropTogether) {
  const auto record = measured_fall(2.06, 100.5, 11);
  const auto damper = damper_of({oscillator_known_to(2.0, 0.05, 100.0, 0.4)});
  const auto found = joined_of(damper, record);
  ASSERT_EQ(found.hypotheses.size(), 1u);
  EXPECT_TRUE(found.hypotheses[0].agrees) << found.hypotheses[0].trouble;
  EXPECT_TRUE(found.hypotheses[0].joined);
  EXPECT_TRUE(found.intervals_hold);
  EXPECT_NEAR(found.hypotheses[0].left, kTransducer, 0.1 * kTransducer);
  double a[] = {1.0 / (0.05 * 0.05), 0.0, 1.0 / (0.4 * 0.4)};
  double b[] = {-0.06 * a[0], -0.5 * a[2]};  // from the truth, where the slopes are taken
  const double s = found.noise;
  for (std::size_t i = 0; i < found.points; ++i) {
    const double t = record.t[i];
    const double over_c = (stroke_at(t, 2.07, 100.5) - stroke_at(t, 2.05, 100.5)) / 0.02;
    const double over_k = (stroke_at(t, 2.06, 100.6) - stroke_at(t, 2.06, 100.4)) / 0.2;
    const double left = record.stroke[i] - stroke_at(t, 2.06, 100.5);
    a[0] += over_c * over_c / (s * s);
    a[1] += over_c * over_k / (s * s);
    a[2] += over_k * over_k / (s * s);
    b[0] += over_c * left / (s * s);
    b[1] += over_k * left / (s * s);
  }
  const double det = a[0] * a[2] - a[1] * a[1];
  const auto& h = found.damper.hypotheses[0];
  EXPECT_NEAR(start_of_c(h), 2.06 + (a[2] * b[0] - a[1] * b[1]) / det,
              1e-2 * std::sqrt(a[2] / det));
  EXPECT_NEAR(value_of(h.model, {1, "k", false}), 100.5 + (a[0] * b[1] - a[1] * b[0]) / det,
              1e-2 * std::sqrt(a[0] / det));
  EXPECT_NEAR(h.covariance[0], a[2] / det, 0.02 * a[2] / det);
  EXPECT_NEAR(h.covariance[3], a[0] / det, 0.02 * a[0] / det);
  EXPECT_LT(width_of_peak_stroke(found.damper), 0.1 * width_of_peak_stroke(damper));
}

TEST(JoinedDrop, KnowsTheLiftOfTheDrop) {
  // Half of the weight of g = 9.80665 m/s^2 is carried; the model has no weight of its own.
  const auto record = measured_fall(2.02, 100.2, 5, 0.5 * 9.80665);
  DropConditions lifted = kFall;
  lifted.lift = 0.5;
  const auto damper = damper_of({oscillator_known_to(2.0, 0.05, 100.0, 0.4)});
  const auto found = joined_of(damper, record, lifted);
  EXPECT_TRUE(found.intervals_hold);
  EXPECT_NEAR(start_of_c(found.damper.hypotheses[0]), 2.02, 2e-3);
  EXPECT_FALSE(joined_of(damper, record).intervals_hold);
}

TEST(JoinedDrop, ADropThatDisagreesNarrowsNothing) {
  const auto damper = damper_of({oscillator_known_to(2.0, 0.05, 100.0, 0.4)});
  const double before = width_of_peak_stroke(damper);
  // What the model lacks, and a damper that is another one.
  for (const auto& record : {measured_fall_with_friction(0.05, 3), measured_fall(2.6, 100.0, 3)}) {
    const auto found = joined_of(damper, record);
    EXPECT_FALSE(found.hypotheses[0].agrees);
    EXPECT_FALSE(found.hypotheses[0].joined);
    EXPECT_FALSE(found.intervals_hold);
    EXPECT_EQ(start_of_c(found.damper.hypotheses[0]), 2.0);
    EXPECT_EQ(found.damper.hypotheses[0].covariance, damper.hypotheses[0].covariance);
    EXPECT_EQ(found.damper.unnamed_probability, 0.5);
    EXPECT_GE(width_of_peak_stroke(found.damper), before);
  }
  const auto far = joined_of(damper, measured_fall(2.6, 100.0, 3));
  EXPECT_NEAR(far.hypotheses[0].moved, 12.0 / std::sqrt(2.0), 0.2);
}

TEST(JoinedDrop, KnowsThatATransducerMayHaveBeenZeroedUnderTheWeight) {
  auto h = oscillator_known_to(2.0, 0.05, 100.0, 0.4);
  h.model.effects.push_back(effect("series_compliance"));
  h.model.effects[2].parameters["k_n"].start = 1000.0;
  // Touch-down at u = -g / k_n: what is counted from there is pulled by k u.
  const double zero = -9.80665 / 1000.0;
  const auto found = joined_of(damper_of({h}), measured_fall(2.03, 100.3, 13, 100.3 * zero));
  EXPECT_TRUE(found.hypotheses[0].joined) << found.hypotheses[0].trouble;
  EXPECT_NEAR(start_of_c(found.damper.hypotheses[0]), 2.03, 2e-3);
  EXPECT_EQ(found.damper.hypotheses[0].model.effects.size(), 3u);
}

TEST(JoinedDrop, TellsRivalsApart) {
  auto first = oscillator_known_to(2.0, 0.02, 100.0, 0.2);
  auto second = oscillator_known_to(2.0, 0.02, 103.0, 0.2);
  first.probability = 0.9;
  second.probability = 0.1;
  second.effects = {"the stiffer one"};
  const auto found = joined_of(damper_of({first, second}), measured_fall(2.01, 103.1, 9));
  EXPECT_THAT(found.damper.hypotheses[0].effects, ::testing::ElementsAre("the stiffer one"));
  EXPECT_GT(found.damper.hypotheses[0].probability, 0.999);
  EXPECT_NEAR(found.damper.hypotheses[0].probability + found.damper.hypotheses[1].probability, 1.0,
              1e-12);
  EXPECT_TRUE(found.intervals_hold);
  EXPECT_FALSE(found.hypotheses[1].agrees);
}

TEST(JoinedDrop, RefusesARecordThatIsTooShort) {
  auto record = measured_fall(2.0, 100.0, 1);
  record.t.resize(15);
  record.stroke.resize(15);
  const auto found =
      join_drop(damper_of({oscillator_known_to(2.0, 0.05, 100.0, 0.4)}), kFall, record);
  ASSERT_FALSE(found.ok());
  EXPECT_THAT(found.error().what, ::testing::HasSubstr("takes 20"));
}

// Dampers drawn from what the campaign says of them: the intervals of campaign and drop hold as
// often as stated, and few drops are said to disagree.
TEST(JoinedDrop, ItsIntervalsHoldAsOftenAsStated) {
  constexpr unsigned kDampers = 100;
  std::mt19937_64 random(21);
  std::normal_distribution<double> normal;
  const auto damper = damper_of({oscillator_known_to(2.0, 0.05, 100.0, 0.4)});
  int agree = 0, held = 0;
  for (unsigned d = 0; d < kDampers; ++d) {
    const double c = 2.0 + 0.05 * normal(random), k = 100.0 + 0.4 * normal(random);
    const auto found = joined_of(damper, measured_fall(c, k, 1000 + d));
    if (!found.intervals_hold) continue;
    ++agree;
    const auto& h = found.damper.hypotheses[0];
    held += std::fabs(start_of_c(h) - c) < 1.96 * std::sqrt(h.covariance[0]) ? 1 : 0;
  }
  EXPECT_GE(agree, 95);
  EXPECT_GE(held, agree - 12);
  EXPECT_LT(held, agree + 1);
}

}  // namespace
}  // namespace shaker::estimator
