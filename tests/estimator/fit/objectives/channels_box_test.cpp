// Fits of several channels with the optimum on bounds, where mass and spring are nearly
// indistinguishable. A converged fit is as likely as the result of any other start in the same
// box, or it is a local maximum: a joint likelihood may have two when the box excludes the
// truth.
#include <algorithm>
#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "estimator/fit/objectives/channels.hpp"
#include "tests/estimator/fixtures.hpp"
#include "tests/sanitized.hpp"

namespace shaker::estimator {
namespace {

constexpr Quantity kChannels[] = {Quantity::displacement, Quantity::absolute_acceleration};
const std::vector<double> kTruth = {3.0, 60.0, 0.3};  // c, k, m_a

// (6.2) with a free mass: at one frequency k and m_a cannot be distinguished.
config::ModelSpec with_free_mass() {
  auto spec = testing::linear_oscillator();
  spec.effects.push_back(testing::effect("added_mass"));
  return spec;
}

class Boxes {
 public:
  // A box beside the truth, inside it or around it, from narrow to wide; a quarter of the sides
  // is open.
  config::ModelSpec next() {
    auto spec = with_free_mass();
    for (std::size_t k = 0; k < kTruth.size(); ++k) {
      auto& p = spec.effects[k].parameters[Model(spec).parameters()[k].name];
      const double centre = kTruth[k] * std::exp(0.9 * (share_(random_) - 0.5));
      const double width = 0.02 + 0.4 * share_(random_) * share_(random_);
      const bool open = share_(random_) < 0.25;
      p.lower = open ? 0.05 * kTruth[k] : centre * (1.0 - width);
      p.upper = open ? 10.0 * kTruth[k] : centre * (1.0 + width);
      p.start = 0.5 * (*p.lower + *p.upper);
    }
    return spec;
  }
  std::vector<double> start(const Model& model) {
    std::vector<double> theta;
    for (std::size_t k = 0; k < kTruth.size(); ++k) {
      const ModelParameter& p = model.parameters()[k];
      const double low = std::clamp(0.7 * kTruth[k], p.lower, p.upper);
      const double high = std::clamp(1.4 * kTruth[k], p.lower, p.upper);
      theta.push_back(low + (high - low) * share_(random_));
    }
    return theta;
  }
  ChannelRun run(double frequency) {
    const Model model(with_free_mass());
    PeriodicSystem system(model, {Scheme::order6, 160, true});
    system.set_channels(kChannels);
    system.set_excitation(frequency, 2.0);
    EXPECT_EQ(system.solve_from_rest(kTruth).status, SolveStatus::converged);
    ChannelRun run;
    run.frequency_hz = frequency;
    run.amplitude = 2.0;
    for (int b = 0; b < 2; ++b) {
      auto& series = run.channels.emplace_back();
      for (int i = 0; i < 160; i += 4)
        series.push_back(system.observed(i, b));
      const double size = *std::max_element(series.begin(), series.end());
      for (double& y : series)
        y += 0.005 * size * normal_(random_);
    }
    return run;
  }

 private:
  std::mt19937_64 random_{17};
  std::uniform_real_distribution<double> share_;
  std::normal_distribution<double> normal_;
};

// The gain in log likelihood of a small step from `end` towards `better`. The box is convex.
double gain_towards(const ChannelFit& end, const ChannelFit& better, const Model& model,
                    const std::vector<ChannelRun>& runs, ChannelOptions options) {
  options.max_iterations = 0;  // evaluates only the likelihood
  double most = -1e300;
  for (const double share : {1e-4, 1e-3, 1e-2}) {
    std::vector<double> theta = end.fit.theta;
    for (std::size_t k = 0; k < theta.size(); ++k)
      theta[k] += share * (better.fit.theta[k] - theta[k]);
    const auto there = fit_channels(model, kChannels, runs, theta, options);
    most = std::max(most, there.log_likelihood - end.log_likelihood);
  }
  return most;
}

// Fits from four starts in each of `boxes` boxes. Returns the number of converged fits.
int fit_in_boxes(const ChannelOptions& options, int boxes) {
  constexpr int kStarts = 4;
  constexpr double kSame = 1e-3;  // of the log likelihood; 0.5 is one standard error
  Boxes made;
  int converged = 0;
  for (int box = 0; box < boxes; ++box) {
    const Model model(made.next());
    const std::vector<ChannelRun> runs = {made.run(1.0), made.run(1.1)};
    std::vector<ChannelFit> found;
    for (int start = 0; start < kStarts; ++start)
      found.push_back(fit_channels(model, kChannels, runs, made.start(model), options));
    const ChannelFit& best = *std::max_element(
        found.begin(), found.end(),
        [](const auto& a, const auto& b) { return a.log_likelihood < b.log_likelihood; });
    for (const ChannelFit& end : found) {
      if (end.fit.status != FitStatus::converged) continue;
      ++converged;
      if (end.log_likelihood >= best.log_likelihood - kSame) continue;
      EXPECT_LE(gain_towards(end, best, model, runs, options), 0.0)
          << "box " << box << " ends where it is less likely by "
          << best.log_likelihood - end.log_likelihood << " (in logarithms)";
    }
  }
  return converged;
}

TEST(ChannelsInABox, EndWhereNothingBesideIsLikelier) {
  for (const NoiseModel noise : {NoiseModel::independent, NoiseModel::joint}) {
    ChannelOptions options;
    options.noise = noise;
    options.grid.points = 80;
    EXPECT_GT(fit_in_boxes(options, repetitions(300)), repetitions(300) * 4 - 10);
  }
}

TEST(ChannelsInABox, EndWhereNothingBesideIsLikelierStagewise) {
  ChannelOptions options;
  options.stagewise = true;
  options.grid.points = 80;
  EXPECT_GT(fit_in_boxes(options, repetitions(100)), repetitions(100) * 4 - 8);
}

}  // namespace
}  // namespace shaker::estimator
