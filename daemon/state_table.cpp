#include "daemon/state_table.hpp"

namespace shaker::daemon {
namespace {

// Columns of the last field: idle, check, ramp, settle, measure, ramp_down, fault, pause.
constexpr std::array<StateRow, kStateCount> kTable{{
    {State::idle,
     "IDLE",
     "the exciter is disabled; nothing moves unless an operator starts a campaign",
     false,
     false,
     {false, true, false, false, false, false, true, false}},
    {State::check,
     "CHECK",
     "nothing moves: the exciter is disabled, or enabled at amplitude zero while its dead-man is "
     "proved; sensors are being proved at rest",
     false,
     false,
     {true, false, true, false, false, false, true, false}},
    {State::ramp,
     "RAMP",
     "motion grows from zero along the exciter's ramp; the first one of a campaign pauses at a "
     "gentle "
     "level until the stroke has answered with the right sign",
     true,
     true,
     {false, false, false, true, false, true, true, false}},
    {State::settle,
     "SETTLE",
     "the setpoint is reached; cycles are cut and none is accepted yet",
     true,
     true,
     {false, false, true, false, true, true, true, false}},
    {State::measure,
     "MEASURE",
     "the response is periodic; each whole, steady cycle is accepted",
     true,
     true,
     {false, false, true, true, false, true, true, false}},
    {State::ramp_down,
     "RAMP_DOWN",
     "motion goes to zero along the ramp, and at once if that is refused or not confirmed in time",
     false,
     true,
     {true, false, false, false, false, false, true, true}},
    {State::fault,
     "FAULT",
     "the exciter has been told to stop at once; latched until acknowledged with the cause gone",
     false,
     false,
     {true, false, false, false, false, false, false, false}},
    {State::pause,
     "PAUSE",
     "at rest: the exciter is disabled; the campaign waits until a client in control resumes it, "
     "or "
     "anyone stops it",
     false,
     false,
     {true, true, false, false, false, false, true, false}},
}};

}  // namespace

std::span<const StateRow> state_table() {
  return kTable;
}
const StateRow& row(State state) {
  return kTable[static_cast<std::size_t>(state)];
}

}  // namespace shaker::daemon
