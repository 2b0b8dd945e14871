#include "estimator/record.hpp"

#include <cmath>
#include <numbers>

#include <gmock/gmock.h>

#include "tests/estimator/fixtures.hpp"

namespace shaker::estimator {
namespace {

using ::testing::HasSubstr;

// The linear oscillator's closed-form response to a distorted excitation, at arbitrary
// sampling.
Record distorted(double frequency, double rate, double seconds, double start) {
  const double c = 4.0, k = 90.0;
  Record r;
  for (double t = start; t < start + seconds; t += 1.0 / rate) {
    double x = 0.0, u = 0.0;
    for (const auto& [h, amplitude, phase] :
         {std::tuple{1, 3.0, 0.7}, std::tuple{2, 0.4, -1.0}, std::tuple{3, 0.2, 2.0}}) {
      const double w = 2.0 * std::numbers::pi * frequency * h;
      const double gain = 1.0 / std::hypot(k - w * w, c * w);
      const double lag = std::atan2(c * w, k - w * w);
      x += amplitude * std::cos(w * t + phase);
      u += gain * amplitude * std::cos(w * t + phase - lag);
    }
    r.t.push_back(t);
    r.displacement.push_back(u);
    r.excitation.push_back(x + 0.05);  // an accelerometer's offset
  }
  return r;
}

TEST(RunFromRecord, FindsFrequencyPhaseAndHarmonicsOfAMeasuredExcitation) {
  const Record record = distorted(2.0004, 173.0, 6.3, 17.2);
  const auto run = run_from_record(record, 2.0, 0.0);
  ASSERT_TRUE(run.ok()) << run.error().what;
  EXPECT_NEAR(run->frequency_hz, 2.0004, 2e-5);
  EXPECT_NEAR(run->amplitude, 3.0, 1e-3);
  const Model model(testing::linear_oscillator());
  EstimationOptions options;
  options.grid = {Scheme::order6, 160, true};
  Estimator estimator(model, {*run}, options);
  const Fit& fit = estimator.fit({3.0, 80.0});
  ASSERT_EQ(fit.status, FitStatus::converged);
  EXPECT_NEAR(fit.theta[0], 4.0, 2e-3);
  EXPECT_NEAR(fit.theta[1], 90.0, 2e-2);
}

TEST(RunFromRecord, KeepsOnePeriodOnEqualStepsOnTheGrid) {
  Record record;
  for (int i = 0; i < 40; ++i) {
    record.t.push_back(i * 0.0125);
    record.displacement.push_back(0.5);
  }
  const auto run = run_from_record(record, 2.0, 10.0);
  ASSERT_TRUE(run.ok());
  EXPECT_TRUE(run->tau.empty());
  EXPECT_EQ(run->amplitude, 10.0);
}

TEST(RunFromRecord, SaysWhatIsWrongWithARecord) {
  const auto refusal = [](Record r, double f = 2.0) {
    const auto run = run_from_record(r, f, 1.0);
    return run.ok() ? std::string() : run.error().what;
  };
  Record r = distorted(2.0, 100.0, 2.0, 0.0);
  r.displacement[6] = std::nan("");
  EXPECT_THAT(refusal(r), HasSubstr("sample 7 is missing"));
  r = distorted(2.0, 100.0, 2.0, 0.0);
  r.t[10] = r.t[9];
  EXPECT_THAT(refusal(r), HasSubstr("does not come after"));
  EXPECT_THAT(refusal(distorted(2.0, 100.0, 0.3, 0.0)), HasSubstr("it must cover one"));
  EXPECT_THAT(refusal(distorted(2.0, 12.0, 2.0, 0.0)), HasSubstr("samples a period are too few"));
  r = distorted(2.0, 100.0, 2.0, 0.0);
  r.t.resize(50);
  EXPECT_THAT(refusal(r), HasSubstr("different lengths"));
  r = distorted(2.0, 100.0, 2.0, 0.0);
  r.excitation.assign(r.t.size(), 1.0);
  EXPECT_THAT(refusal(r), HasSubstr("never changes"));
}

}  // namespace
}  // namespace shaker::estimator
