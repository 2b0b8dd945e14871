#include "estimator/model/effects/turning.hpp"

#include <algorithm>

#include "estimator/model/effects/catalogue.hpp"
#include "estimator/model/effects/scaled.hpp"

namespace shaker::estimator {
namespace {

constexpr const char* kTurns = "e";

}  // namespace

// By its formula: a power of the velocity has a width too, and does not jump.
bool jumps(const Effect& effect) {
  return effect.formula().ends_with("tanh(v / e)");
}

std::vector<Turning> turnings_of(const config::ModelSpec& spec) {
  std::vector<Turning> all;
  for (std::size_t i = 0; i < spec.effects.size(); ++i) {
    const Effect* effect = find_effect(spec.effects[i].effect);
    if (effect == nullptr || effect->group() != Group::damper || !effect->internals().empty())
      continue;
    for (const ConstantInfo& usual : effect->constants()) {
      const ConstantInfo info = scaled(usual, spec.effects[i].scale);
      if (!info.width || info.symbol != kTurns) continue;
      const auto given = spec.effects[i].constants.find(kTurns);
      const bool stated = given != spec.effects[i].constants.end();
      all.push_back({i, std::string(info.symbol), std::string(info.unit),
                     stated ? given->second : info.value, info.value, stated});
    }
  }
  return all;
}

bool states_smoothing_width(const config::ModelSpec& spec) {
  const std::vector<Turning> turnings = turnings_of(spec);
  return std::any_of(turnings.begin(), turnings.end(),
                     [](const Turning& turning) { return turning.stated; });
}

}  // namespace shaker::estimator
