// The exciter of a replay: accepts every setpoint and moves nothing.
//
// It answers as a drive without delay, so that a recorded campaign passes through the same
// states.
#pragma once

#include <memory>

#include "base/clock.hpp"
#include "drivers/exciter.hpp"

namespace shaker::drivers::replay {

std::unique_ptr<Exciter> make_replay_exciter(const Clock& clock);

}  // namespace shaker::drivers::replay
