#include "estimator/diagnosis/fit/internal/jumping_friction.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "estimator/diagnosis/fit/internal/smoothing.hpp"
#include "estimator/model/effects/catalogue.hpp"
#include "estimator/model/effects/turning.hpp"

namespace shaker::estimator::diagnosis {
namespace {

// The lines with friction that jumps.
std::vector<Turning> jumps_of(const config::ModelSpec& spec) {
  std::vector<Turning> all = turnings_of(spec);
  std::erase_if(all, [&](const Turning& turning) {
    const Effect* effect = find_effect(spec.effects[turning.line].effect);
    return turning.stated || effect == nullptr || !jumps(*effect);
  });
  return all;
}

}  // namespace

bool can_jump(const config::ModelSpec& spec, const std::vector<RunDatum>& data) {
  const auto remembers = [](const config::EffectSpec& line) {
    const Effect* effect = find_effect(line.effect);
    return effect != nullptr && !effect->internals().empty();  // stiff
  };
  if (jumps_of(spec).empty() || std::ranges::any_of(spec.effects, remembers)) return false;
  const Model model(spec);
  int velocities = 0;
  for (int c = 0; c < model.coordinates(); ++c)
    velocities += model.order(c) > 1 ? 1 : 0;
  return velocities == 1 && std::all_of(data.begin(), data.end(), [](const RunDatum& datum) {
           return datum.sampled && !datum.by_force;
         });
}

std::shared_ptr<const HarmonicFit> fit_of_jumps(const HarmonicFit& near,
                                                const std::vector<RunDatum>& data,
                                                FitOptions options) {
  options.at_once = true;
  auto fit = std::make_shared<const HarmonicFit>(
      fit_harmonics(near.spec, data, near.theta, &near, options));
  return fit->converged && fit->predicts_all ? fit : nullptr;
}

}  // namespace shaker::estimator::diagnosis
