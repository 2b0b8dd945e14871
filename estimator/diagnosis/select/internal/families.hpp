// Kinds of effects. The effects of one kind do nearly the same and share the evidence.
#pragma once

#include <span>
#include <string_view>
#include <vector>

namespace shaker::estimator::diagnosis {

struct EffectKind {
  std::string_view name;  // for a reader: "dry friction"
  std::vector<std::string_view> effects;
};

std::span<const EffectKind> effect_kinds();
// Returns the kind of an effect, or null if no other effect is of its kind.
const EffectKind* kind_of(std::string_view effect);

}  // namespace shaker::estimator::diagnosis
