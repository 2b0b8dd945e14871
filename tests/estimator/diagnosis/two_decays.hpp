// A linear oscillator is fitted to free decays of a force, by default to one from each side.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "estimator/diagnosis/diagnose.hpp"
#include "tests/estimator/diagnosis/free_decay.hpp"
#include "tests/estimator/fixtures.hpp"

namespace shaker::estimator::diagnosis::testing {

inline Result<Diagnosis> diagnosis_of_decays(const std::function<double(double, double)>& force,
                                             const std::vector<double>& starts = {0.1, -0.08}) {
  Campaign campaign;
  campaign.name = "decays";
  std::uint64_t seed = 1;
  for (const double start : starts) {
    campaign.runs.push_back(decay_of(force, {start, 8.0, 100.0, 2e-5, seed++}));
    campaign.runs.back().name = "r" + std::to_string(seed);
  }
  return diagnose(campaign, estimator::testing::linear_oscillator());
}

// The same with friction that jumps.
inline Campaign sticking_decays(const std::function<double(double, double)>& force,
                                double friction) {
  Campaign campaign;
  campaign.name = "decays";
  std::uint64_t seed = 1;
  for (const double start : {0.08, -0.05}) {
    campaign.runs.push_back(sticking_decay_of(force, friction, {start, 9.0, 50.0, 5e-5, seed++}));
    campaign.runs.back().name = "r" + std::to_string(seed);
  }
  return campaign;
}

inline Result<Diagnosis> diagnosis_of_sticking_decays(
    const std::function<double(double, double)>& force, double friction) {
  return diagnose(sticking_decays(force, friction), estimator::testing::linear_oscillator());
}

}  // namespace shaker::estimator::diagnosis::testing
