// Records that are not periodic, from the simulator's plants and integrator, which share no
// code with the estimator.
#pragma once

#include <cmath>
#include <map>
#include <random>
#include <string>
#include <vector>

#include "estimator/diagnosis/campaign.hpp"
#include "sim/integrator.hpp"
#include "sim/plant.hpp"
#include "sim/table_motion.hpp"
#include "tests/estimator/fixtures.hpp"

namespace shaker::estimator::diagnosis::testing {

using Truth = std::map<std::string, double>;

inline Recording record_of(const sim::Plant& plant, const sim::State& start,
                           const sim::TableMotion& table, double duration, double rate,
                           double noise, std::uint64_t seed, bool driven) {
  sim::Integrator integrator(plant, start, 0.0);
  std::mt19937_64 source(seed);
  std::normal_distribution<double> normal;
  Recording r;
  r.kind = Kind::transient;
  r.role_given = true;
  for (int i = 0; i < static_cast<int>(duration * rate); ++i) {
    const double t = i / rate;
    integrator.advance(t, table);
    r.t.push_back(t);
    r.displacement.push_back(std::round((integrator.state()[0] + noise * normal(source)) / 1e-6) *
                             1e-6);
    if (driven) r.excitation.push_back(table.acceleration(t));
  }
  return r;
}

// A mass that falls onto its gear: the stroke starts at zero with the sink speed.
inline Recording drop(const Truth& truth, double sink_speed, std::uint64_t seed,
                      double noise = 2e-5) {
  const sim::Plant plant("oleo", truth);
  sim::State start = plant.at_rest();
  start[0] = 0.0;
  start[1] = sink_speed;
  return record_of(plant, start, sim::TableMotion(), 1.2, 1000.0, noise, seed, false);
}

// A sweep of the table's frequency, from rest.
inline Recording sweep(const std::string& name, const Truth& truth, double from_hz, double to_hz,
                       double amplitude, double duration, std::uint64_t seed, double noise = 2e-5) {
  const sim::Plant plant(name, truth);
  sim::TableMotion table;
  table.go_to(0.0, from_hz, 1e-6, 0.0);
  table.go_to(0.0, to_hz, amplitude, duration);
  return record_of(plant, plant.at_rest(), table, duration, 500.0, noise, seed, true);
}

inline config::ModelSpec drifting_oscillator() {
  auto model = estimator::testing::model_of({estimator::testing::effect("linear_stiffness"),
                                             estimator::testing::effect("viscous_damping")});
  model.effects[0].parameters["k"].start = 80.0;
  return model;
}

inline Campaign campaign_of(std::vector<Recording> runs, std::size_t held_out = 0) {
  Campaign campaign;
  for (std::size_t i = 0; i < runs.size(); ++i) {
    runs[i].name = "r" + std::to_string(i + 1);
    runs[i].role = i + held_out < runs.size() ? Role::fit : Role::held_out;
  }
  campaign.runs = std::move(runs);
  return campaign;
}

inline Campaign oscillator_sweeps(const Truth& truth, std::uint64_t seed) {
  return campaign_of({sweep("linear", truth, 0.5, 4.0, 3.0, 12.0, seed),
                      sweep("linear", truth, 3.0, 1.0, 2.0, 12.0, seed + 1),
                      sweep("linear", truth, 0.8, 3.0, 2.5, 12.0, seed + 2)},
                     1);
}

}  // namespace shaker::estimator::diagnosis::testing
