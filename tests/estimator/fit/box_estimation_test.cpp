// Estimates with the optimum on bounds: no neighbouring point may be better than a converged
// fit.
#include <algorithm>
#include <cmath>
#include <random>

#include <gmock/gmock.h>

#include "estimator/fit/estimation.hpp"
#include "tests/estimator/benchmark_jobs.hpp"
#include "tests/estimator/fixtures.hpp"

namespace shaker::estimator {
namespace {

struct Box {
  std::vector<double> lower, upper;
};

// The names of the parameters are in the order of the effects, and each effect has its own
// ones.
config::ModelSpec within(config::ModelSpec spec, const Box& box) {
  const Model plain(spec);
  for (std::size_t k = 0; k < box.lower.size(); ++k) {
    const ModelParameter& p = plain.parameters()[k];
    for (auto& effect : spec.effects) {
      if (effect.effect != p.effect) continue;
      auto& parameter = effect.parameters[p.name];
      parameter.lower = box.lower[k];
      parameter.upper = box.upper[k];
      parameter.start = 0.5 * (box.lower[k] + box.upper[k]);
    }
  }
  return spec;
}

std::vector<RunData> runs_of(const Model& model, const std::vector<double>& truth,
                             const std::vector<std::pair<double, double>>& excitations,
                             std::mt19937_64& random) {
  std::uniform_real_distribution<double> noise(-0.005, 0.005);
  std::vector<RunData> runs;
  for (const auto& [frequency, amplitude] : excitations) {
    PeriodicSystem system(model, {Scheme::order6, 320, true});
    system.set_excitation(frequency, amplitude);
    EXPECT_EQ(system.solve_from_rest(truth).status, SolveStatus::converged);
    RunData& run = runs.emplace_back();
    run.frequency_hz = frequency;
    run.amplitude = amplitude;
    double size = 0.0;
    for (int i = 0; i < 40; ++i)
      size = std::max(size, std::fabs(system.observed(8 * i)));
    for (int i = 0; i < 40; ++i)
      run.displacement.push_back(system.observed(8 * i) + size * noise(random));
  }
  return runs;
}

// The largest fraction of the sum of squares that a step of one parameter inside the box could
// gain.
double gain_inside(const Estimator& estimator, const Model& model) {
  const Linearised at = estimator.linearised();
  const std::vector<double>& theta = estimator.last().theta;
  const std::size_t p = theta.size();
  double largest = 0.0, sum = 0.0;
  for (const double e : at.residual)
    sum += e * e;
  for (std::size_t k = 0; k < p; ++k) {
    double slope = 0.0, curvature = 0.0;
    for (std::size_t i = 0; i < at.residual.size(); ++i) {
      const double j = at.jacobian[i * p + k];
      slope += j * at.residual[i];
      curvature += j * j;
    }
    const ModelParameter& parameter = model.parameters()[k];
    const bool outwards = (theta[k] <= parameter.lower && slope < 0.0) ||
                          (theta[k] >= parameter.upper && slope > 0.0);
    if (!outwards) largest = std::max(largest, slope * slope / curvature / sum);
  }
  return largest;
}

// Boxes beside the truth, inside it and around it, from a few to many per cent wide, with fits
// from several starts in each. Returns the number of converged fits.
int fit_in_boxes(const config::ModelSpec& spec, const std::vector<double>& truth,
                 const std::vector<std::pair<double, double>>& excitations, int boxes,
                 Method method) {
  std::mt19937_64 random(17);
  std::uniform_real_distribution<double> share;
  const Model plain(spec);
  int converged = 0;
  for (int trial = 0; trial < boxes; ++trial) {
    Box box;
    for (const double theta : truth) {
      const double centre = theta * std::exp(0.9 * (share(random) - 0.5));
      const double width = 0.02 + 0.4 * share(random) * share(random);
      const bool open = share(random) < 0.25;
      box.lower.push_back(open ? -10.0 * theta : centre * (1.0 - width));
      box.upper.push_back(open ? 10.0 * theta : centre * (1.0 + width));
    }
    const Model model(within(spec, box));
    EstimationOptions options;
    options.method = method;
    Estimator estimator(model, runs_of(plain, truth, excitations, random), options);
    for (int attempt = 0; attempt < 4; ++attempt) {
      std::vector<double> start;
      for (std::size_t k = 0; k < truth.size(); ++k) {
        const double low = std::max(box.lower[k], std::min(0.7 * truth[k], box.upper[k]));
        const double high = std::min(box.upper[k], std::max(1.4 * truth[k], box.lower[k]));
        start.push_back(low + (high - low) * share(random));
      }
      const Fit& fit = estimator.fit(start);
      if (fit.status != FitStatus::converged) continue;
      ++converged;
      EXPECT_LT(gain_inside(estimator, model), 1e-6) << "box " << trial << ", start " << attempt;
    }
  }
  return converged;
}

class EveryBoxedMethod : public ::testing::TestWithParam<Method> {};

TEST_P(EveryBoxedMethod, EndsWhereNothingInsideIsBetter) {
  EXPECT_GT(fit_in_boxes(testing::duffing(), {3.0, 60.0, 900.0}, {{1.0, 2.0}, {1.5, 3.0}}, 150,
                         GetParam()),
            570);
}

INSTANTIATE_TEST_SUITE_P(Methods, EveryBoxedMethod,
                         ::testing::Values(Method::lifted, Method::levenberg_marquardt));

// The gas column is too short for the stroke in the data, so the fit approaches the wall of the
// gas spring. This is not an optimum, and the fit must say what stops it.
TEST(BoxEstimation, ThatEndsAtTheGasWallIsNotCalledConverged) {
  Box box;
  box.lower = {6.694, 1e-9, 2.0978, 0.8388};
  box.upper = {6.694, 1e4, 2.0978, 0.8388};
  config::ModelSpec spec = within(testing::oleo(32.2), box);
  for (auto& effect : spec.effects) {
    for (auto& [name, parameter] : effect.parameters)
      parameter.fixed = name != "theta2";
  }
  const Model model(spec);
  Estimator estimator(model, {testing::job1()});
  const Fit& fit = estimator.fit({6.694, 5.25, 2.0978, 0.8388});
  EXPECT_EQ(fit.status, FitStatus::not_converged);
  EXPECT_THAT(fit.trouble, ::testing::HasSubstr("a better fit would have no periodic solution"));
  EXPECT_THAT(fit.trouble, ::testing::HasSubstr("run 1 (2 Hz): the state is inadmissible"));
  EXPECT_GT(gain_inside(estimator, model), 0.1);
}

}  // namespace
}  // namespace shaker::estimator
