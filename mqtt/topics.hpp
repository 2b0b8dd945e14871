// Names of topics: PREFIX/RIG/KIND. Pure.
#pragma once

#include <array>
#include <string>
#include <string_view>

#include "base/result.hpp"

namespace shaker::mqtt {

// In the order in which they are handed over where several wait.
enum class Kind { bridge, alarm, state, estimate, health };
inline constexpr std::array kKindNames = {"bridge", "alarm", "state", "estimate", "health"};
inline constexpr std::array kDocumentKinds = {Kind::alarm, Kind::state, Kind::estimate,
                                              Kind::health};

constexpr std::size_t index_of(Kind kind) {
  return static_cast<std::size_t>(kind);
}

// One level of a topic from the name of a rig: what a level may not hold, or what shells and
// dashboards trip over, becomes "_" (space, '/', '+', '#', '$', control characters, ...).
// Letters, digits, '.', '_', '-' and all beyond ASCII stay. "rig" for an empty name.
std::string topic_level(std::string_view name);

// A prefix has one or more levels of the characters that topic_level leaves as they are.
// Returns an Error that names what is wrong.
Result<void> check_prefix(std::string_view prefix);

}  // namespace shaker::mqtt
