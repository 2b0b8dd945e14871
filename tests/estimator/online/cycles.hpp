// Measured cycles for the tests of this folder: the solution of a model on a fine Fourier grid,
// which is another scheme than the estimator's, with white noise. The parameters may change
// from cycle to cycle.
#pragma once

#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "estimator/online/measured_cycle.hpp"
#include "estimator/solve/periodic/periodic_system.hpp"
#include "tests/estimator/fixtures.hpp"

namespace shaker::estimator::online::testing {

class Damper {
 public:
  Damper(const config::ModelSpec& spec, double noise, unsigned seed)
      : model_(spec), noise_(noise), random_(seed) {}

  MeasuredCycle cycle(int run, long index, const std::vector<double>& theta) {
    MeasuredCycle c;
    c.run = run;
    c.index = index;
    c.frequency_hz = run == 0 ? 2.0 : 1.0;
    c.amplitude = 3.048;
    PeriodicSystem system(model_, {Scheme::fourier, 160, false});
    system.set_excitation(c.frequency_hz, c.amplitude);
    EXPECT_EQ(system.solve_from_rest(theta).status, SolveStatus::converged);
    std::normal_distribution<double> normal(0.0, noise_);
    for (int i = 0; i < 40; ++i)
      c.displacement.push_back(system.value(4 * i, model_.observed()) + normal(random_));
    return c;
  }

 private:
  Model model_;
  double noise_;
  std::mt19937_64 random_;
};

inline config::ModelSpec oleo_started(const std::vector<double>& start) {
  auto spec = estimator::testing::oleo();
  spec.effects[0].parameters["theta1"].start = start[0];
  spec.effects[1].parameters["theta2"].start = start[1];
  spec.effects[1].parameters["theta3"].start = start[2];
  spec.effects[1].parameters["theta4"].start = start[3];
  return spec;
}

}  // namespace shaker::estimator::online::testing
