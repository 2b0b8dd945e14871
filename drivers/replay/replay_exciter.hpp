// The exciter of a replay: accepts every setpoint and moves nothing.
//
// It answers as a drive that follows at once, so that a recorded campaign runs through the same
// states as it did.
#pragma once

#include <memory>

#include "base/clock.hpp"
#include "drivers/exciter.hpp"

namespace shaker::drivers::replay {

std::unique_ptr<Exciter> make_replay_exciter(const Clock& clock);

}  // namespace shaker::drivers::replay
