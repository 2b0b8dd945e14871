#include "daemon/state_table.hpp"

#include <gtest/gtest.h>

namespace shaker::daemon {
namespace {

TEST(StateTable, HasOneRowForEachStateInItsOwnPlace) {
  ASSERT_EQ(state_table().size(), static_cast<std::size_t>(kStateCount));
  for (int i = 0; i < kStateCount; ++i) {
    EXPECT_EQ(static_cast<int>(state_table()[static_cast<std::size_t>(i)].state), i);
  }
}

TEST(StateTable, EveryStateMayFault) {
  for (const auto& r : state_table()) {
    EXPECT_EQ(allowed(r.state, State::fault), r.state != State::fault) << r.name;
  }
}

TEST(StateTable, MotionStartsOnlyFromCheckAndFaultLeadsOnlyToIdle) {
  for (const auto& r : state_table()) {
    const bool moving = r.state == State::settle || r.state == State::measure;
    EXPECT_EQ(allowed(r.state, State::ramp), r.state == State::check || moving) << r.name;
    EXPECT_EQ(allowed(State::fault, r.state), r.state == State::idle) << r.name;
  }
}

TEST(StateTable, SetpointsLeaveOnlyInRampSettleAndMeasure) {
  for (const auto& r : state_table()) {
    EXPECT_EQ(r.setpoint_may_leave,
              r.state == State::ramp || r.state == State::settle || r.state == State::measure)
        << r.name;
    // Every state with motion allows the ramp down.
    EXPECT_EQ(allowed(r.state, State::ramp_down), r.setpoint_may_leave) << r.name;
  }
}

}  // namespace
}  // namespace shaker::daemon
