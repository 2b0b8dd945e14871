#include "estimator/diagnosis/noise/internal/weighing.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "config/model.hpp"
#include "sim/campaign_recorder.hpp"

namespace shaker::estimator::diagnosis {
namespace {

// The last run drives the oleo hard and fast: a disturbance changes its sign from cycle to
// cycle and decays slowly.
std::vector<SteadyRun> runs_of(double settle_cycles, double cycles) {
  sim::CampaignRecording plan;
  plan.rig.noise_m = 5e-6;
  plan.rig.noise_m_s2 = 1e-3;
  plan.rig.seed = 5;
  plan.settle_cycles = settle_cycles;
  plan.cycles = cycles;
  plan.runs = {{"r1", 2.0, 3.0, false}, {"r2", 3.0, 6.0, false}, {"r3", 6.0, 12.0, false}};
  std::vector<SteadyRun> runs;
  for (std::size_t i = 0; i < plan.runs.size(); ++i) {
    sim::Record record = sim::record_run(plan, i);
    Recording r;
    r.name = plan.runs[i].name;
    r.frequency_hz = plan.runs[i].frequency_hz;
    r.amplitude = plan.runs[i].amplitude;
    r.t = std::move(record.t);
    r.excitation = std::move(record.excitation);
    r.displacement = std::move(record.displacement);
    runs.push_back(steady_cycles(r).value());
  }
  return runs;
}

config::ModelSpec oleo() {
  return config::load_model(SHAKER_SOURCE_DIR "/config/examples/model-oleo.json").value();
}

struct Distance {
  double before, after, error_before, error_after;  // lengths, m
};

// The distance of the last run's mean cycle from that of a record without a transient.
Distance distance(const std::vector<SteadyRun>& young, const Eigen::VectorXd& settled) {
  const Weighed raw = weigh(young);
  FitOptions options;
  options.from_rest = true;
  HarmonicFit fit = fit_harmonics(oleo(), raw.data, {}, nullptr, options);
  const Weighed clean = weigh(young, fit);
  const RunDatum &before = raw.data.back(), &after = clean.data.back();
  const auto size = std::min(before.response.size(), after.response.size());
  const auto of = [&](const RunDatum& datum) {
    return (datum.response.head(size) - settled.head(size)).norm();
  };
  return {of(before), of(after), before.error.head(size).norm(), after.error.head(size).norm()};
}

TEST(Weigh, FindsTheSteadyCycleWhileATransientIsLeft) {
  const Distance d = distance(runs_of(4.0, 14.0), runs_of(80.0, 60.0).back().mean());
  EXPECT_GT(d.error_before, 5e-5);  // otherwise there is no transient to remove
  // It includes what the square of so large a transient may have left.
  EXPECT_LT(d.error_after, 0.2 * d.error_before);
  EXPECT_LT(d.after, 3.0 * d.error_after);
}

TEST(Weigh, ChangesLittleWhereNoTransientIsLeft) {
  const Distance d = distance(runs_of(60.0, 14.0), runs_of(80.0, 60.0).back().mean());
  EXPECT_LT(std::fabs(d.after - d.before), 2.0 * d.error_before);
  EXPECT_LT(d.after, 3.0 * d.error_after);
}

}  // namespace
}  // namespace shaker::estimator::diagnosis
