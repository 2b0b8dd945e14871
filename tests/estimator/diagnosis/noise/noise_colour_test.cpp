#include "estimator/diagnosis/noise/internal/noise_colour.hpp"

#include <cmath>
#include <numbers>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "estimator/diagnosis/diagnose.hpp"
#include "estimator/diagnosis/noise/internal/transient.hpp"
#include "tests/estimator/diagnosis/free_decay.hpp"
#include "tests/estimator/diagnosis/records.hpp"
#include "tests/estimator/fixtures.hpp"
#include "tests/sanitized.hpp"

namespace shaker::estimator::diagnosis {
namespace {

using testing::sweep;
using testing::Truth;

constexpr double kDeviation = 5e-5;  // of the sensor's noise, m

config::ModelSpec oscillator() {
  auto model = estimator::testing::model_of({estimator::testing::effect("linear_stiffness"),
                                             estimator::testing::effect("viscous_damping")});
  model.effects[0].parameters["k"].start = 80.0;
  return model;
}

// Noise that falls above 1.6 Hz (at 500 Hz sampling), where the response is.
void add_coloured(std::vector<double>& values, double deviation, std::uint64_t seed) {
  constexpr double kKept = 0.98;
  std::mt19937_64 source(seed);
  std::normal_distribution<double> normal;
  double noise = normal(source);
  for (double& value : values) {
    noise = kKept * noise + std::sqrt(1.0 - kKept * kKept) * normal(source);
    value += deviation * noise;
  }
}

Recording coloured(Recording record, std::uint64_t seed) {
  add_coloured(record.displacement, kDeviation, seed);
  return record;
}

// The cost of a diagnosis with such noise grows with the square of a record's length: s.
constexpr double kLong = 12.0, kShort = kSanitized ? 4.0 : 8.0;

Campaign sweeps(const Truth& truth, std::uint64_t seed, double length = kLong) {
  Campaign campaign;
  campaign.runs = {coloured(sweep("linear", truth, 0.5, 4.0, 3.0, length, seed), seed + 100),
                   coloured(sweep("linear", truth, 3.0, 1.0, 2.0, length, seed + 1), seed + 101),
                   coloured(sweep("linear", truth, 0.8, 3.0, 2.5, length, seed + 2), seed + 102)};
  for (std::size_t i = 0; i < campaign.runs.size(); ++i)
    campaign.runs[i].name = "r" + std::to_string(i + 1);
  campaign.runs.back().role = Role::held_out;
  return campaign;
}

struct Fit {
  TransientRuns runs;
  HarmonicFit fit;
};

Fit fit_of(const Truth& truth, std::uint64_t seed) {
  auto runs = transient_runs(sweeps(truth, seed).runs, oscillator());
  HarmonicFit fit = fit_transient(oscillator(), *runs, {});
  return {std::move(*runs), std::move(fit)};
}

TEST(NoiseColour, IsTheSpectrumOfWhatAFitLeaves) {
  const Fit of = fit_of({}, 1);
  const auto data = with_spectrum_left(of.fit, of.runs.data, of.runs.data, ColourOf::response);
  ASSERT_EQ(data.size(), of.runs.data.size());
  for (const RunDatum& datum : data) {
    // First-order coloured noise with a corner at w0: the power of a cosine is 2 (2 w0
    // deviation^2 / (w^2 + w0^2)) / length. Compared in bands of some hundred cosines.
    const double w0 = -std::log(0.98) * 500.0, length = datum.sampled->length();
    double found = 0.0, expected = 0.0;
    for (Eigen::Index k = 0; k < datum.error.size(); ++k) {
      const double w = std::numbers::pi * static_cast<double>(k) / length;
      found += datum.error[k] * datum.error[k];
      expected += 4.0 * w0 * kDeviation * kDeviation / (w * w + w0 * w0) / length;
    }
    EXPECT_NEAR(found / expected, 1.0, 0.35);
  }
}

// A zero of the record's own stands in its mean alone, and makes no noise of low frequency.
TEST(NoiseColour, HoldsNoZeroOfTheRecord) {
  const Fit of = fit_of({}, 1);
  std::vector<RunDatum> moved = of.runs.data;
  for (RunDatum& datum : moved) {
    datum.own_zero = 100.0 * kDeviation;
    datum.response[0] += datum.own_zero;
  }
  const auto data = with_spectrum_left(of.fit, of.runs.data, of.runs.data, ColourOf::response);
  const auto same = with_spectrum_left(of.fit, moved, moved, ColourOf::response);
  for (std::size_t r = 0; r < data.size(); ++r)
    EXPECT_LE(same[r].error[1], data[r].error[1]);
  EXPECT_NEAR(spectrum_gain({of.fit, of.runs.data}, {of.fit, moved}), 0.0, 10.0);
}

TEST(NoiseColour, LiesAlongNoSmoothForceUnlessOneIsMissing) {
  int unlikely = 0;
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    const Fit of = fit_of({}, 10 * seed);
    const auto data = with_spectrum_left(of.fit, of.runs.data, of.runs.data, ColourOf::response);
    const auto chance = chance_along_motion(of.fit, data, {});
    ASSERT_TRUE(chance);
    unlikely += *chance < 0.02 ? 1 : 0;
  }
  EXPECT_LE(unlikely, 1);
  const Fit of = fit_of({{"cubic_stiffness", 800.0}}, 7);
  const auto data = with_spectrum_left(of.fit, of.runs.data, of.runs.data, ColourOf::response);
  EXPECT_LT(chance_along_motion(of.fit, data, {}).value_or(1.0), 1e-9);
}

// The noise falls by about the number of additional parameters when these do not improve the
// model.
TEST(NoiseColour, IsLessBesideAFitThatHoldsWhatWasMissing) {
  auto richer = oscillator();
  richer.effects.push_back(estimator::testing::effect("cubic_stiffness"));
  for (const double hidden : {0.0, 800.0}) {
    const Fit of = fit_of({{"cubic_stiffness", hidden}}, 3);
    std::vector<double> start = of.fit.theta;
    start.push_back(0.0);
    const HarmonicFit more = fit_harmonics(richer, of.runs.data, start, &of.fit, {});
    ASSERT_TRUE(more.trouble.empty()) << more.trouble;
    const double gain = spectrum_gain({more, of.runs.data}, {of.fit, of.runs.data});
    if (hidden > 0.0)
      EXPECT_GT(gain, 200.0);
    else
      EXPECT_LT(std::fabs(gain), 10.0);
  }
}

// Noise of the measured excitation: the model follows it, but the mass does not.
TEST(NoiseColour, OfTheExcitationGoesThroughTheModel) {
  TransientRuns runs;
  {
    std::vector<Recording> records = {sweep("linear", {}, 0.5, 4.0, 3.0, 12.0, 1),
                                      sweep("linear", {}, 3.0, 1.0, 2.0, 12.0, 2)};
    for (std::size_t i = 0; i < records.size(); ++i) {
      records[i].name = "r" + std::to_string(i + 1);
      add_coloured(records[i].excitation, 0.02, 50 + i);
    }
    auto read = transient_runs(records, oscillator());
    ASSERT_TRUE(read) << read.error().what;
    runs = std::move(*read);
  }
  const HarmonicFit fit = fit_transient(oscillator(), runs, {});
  const auto data = with_spectrum_left(fit, runs.data, runs.data, ColourOf::excitation);
  for (std::size_t r = 0; r < data.size(); ++r) {
    ASSERT_TRUE(data[r].whitening);
    const Eigen::VectorXd left = data[r].response - fit.predictions[r].value();
    const auto count = static_cast<double>(left.size());
    EXPECT_GT(whitened(runs.data[r], left).squaredNorm() / count, 5.0);
    const double white = whitened(data[r], left).squaredNorm() / count;
    EXPECT_NEAR(white, 1.0, 0.25);
  }
  const HarmonicFit again = fit_harmonics(oscillator(), data, fit.theta, &fit, {});
  EXPECT_GT(chance_along_motion(again, data, {}).value_or(0.0), 1e-3);
}

// Three free decays with friction from about this stroke, in coloured noise: the fit of the
// oscillator without friction.
Fit decays(double friction, double from, std::uint64_t seed) {
  std::vector<Recording> records;
  for (std::uint64_t i = 0; i < 3; ++i) {
    const auto force = [&](double u, double v) {
      return 80.0 * u + 0.8 * v + friction * std::tanh(v / 5e-3);
    };
    const double start = from * (1.0 + 0.3 * static_cast<double>(i));
    records.push_back(
        coloured(testing::decay_of(force, {.start = start, .seed = seed + i}), seed + 100 + i));
    records.back().name = "r" + std::to_string(i + 1);
  }
  auto runs = transient_runs(records, oscillator());
  HarmonicFit fit = fit_transient(oscillator(), *runs, {});
  return {std::move(*runs), std::move(fit)};
}

TEST(NoiseColour, IsASmallPartOfTheResponse) {
  const Fit noise = decays(0.0, 0.03, 10), friction = decays(0.8, 0.1, 10);
  ASSERT_TRUE(noise.fit.trouble.empty()) << noise.fit.trouble;
  ASSERT_TRUE(friction.fit.trouble.empty()) << friction.fit.trouble;
  EXPECT_TRUE(may_be_noise(noise.fit, noise.runs.data));
  EXPECT_FALSE(may_be_noise(friction.fit, friction.runs.data));
}

TEST(NoiseColour, RaisesNoAlarm) {
  const auto nothing = diagnose(sweeps({}, 3, kShort), oscillator());
  ASSERT_TRUE(nothing) << nothing.error().what;
  EXPECT_EQ(nothing->verdict, Verdict::adequate) << nothing->probability_before;
  EXPECT_TRUE(nothing->effects.empty());
  EXPECT_THAT(nothing->warnings, ::testing::Contains(::testing::HasSubstr("low frequency")));
}

TEST(NoiseColour, HidesNoEffect) {
  DiagnoseOptions options;
  options.most_effects = 1;  // sets of several take most of the time
  const auto stiff =
      diagnose(sweeps({{"cubic_stiffness", 800.0}}, 5, kShort), oscillator(), options);
  ASSERT_TRUE(stiff) << stiff.error().what;
  EXPECT_EQ(stiff->verdict, Verdict::explained);
  ASSERT_EQ(stiff->effects.size(), 1U);
  EXPECT_EQ(stiff->effects[0].name, "cubic_stiffness");
  EXPECT_NEAR(stiff->effects[0].parameters.at(0).value, 800.0, 30.0);
}

}  // namespace
}  // namespace shaker::estimator::diagnosis
