#include "sim/register_map.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace shaker::sim {
namespace {

using ::testing::ElementsAre;
using Words = std::vector<std::uint16_t>;

// Words written by hand: 2.0f = 4000 0000, 3.0f = 4040 0000, 1.0f = 3F80 0000, 0.5f = 3F00
// 0000.
struct Desk {
  VirtualRig rig{RigOptions{}, Nanoseconds(0)};
  RegisterMap map{rig};
};

TEST(RegisterMap, StoresSetpointsAndShowsThem) {
  Desk desk;
  EXPECT_EQ(desk.map.write(0, Words{0x4000, 0, 0x4040, 0}), Refusal::none);
  EXPECT_EQ(desk.rig.settings().frequency_hz, 2.0);
  EXPECT_EQ(desk.rig.settings().amplitude, 3.0);
  EXPECT_THAT(desk.map.holding(), ElementsAre(0x4000, 0, 0x4040, 0, 0, 0, 0, 0, 0x3F00, 0, 0, 0));
}

TEST(RegisterMap, StartsOnTheRampOfTheSameBlock) {
  Desk desk;
  EXPECT_EQ(desk.map.write(0, Words{0x4000, 0, 0x4040, 0, 1, 0x3F80, 0}), Refusal::none);
  std::vector<RigSample> samples;
  desk.rig.advance(std::chrono::milliseconds(400), samples);
  EXPECT_NEAR(desk.rig.status().amplitude, 1.2, 1e-9);
  EXPECT_EQ(desk.map.input()[Input::status], 3);
}

TEST(RegisterMap, RefusesAllOrNothing) {
  Desk desk;
  const auto before = desk.map.holding();
  EXPECT_EQ(desk.map.write(0, Words{0x4000}), Refusal::illegal_address);
  EXPECT_EQ(desk.map.write(1, Words{0, 0x4040, 0}), Refusal::illegal_address);
  EXPECT_EQ(desk.map.write(11, Words{0, 0}), Refusal::illegal_address);
  EXPECT_EQ(desk.map.write(0, Words{}), Refusal::illegal_address);
  EXPECT_EQ(desk.map.write(0, Words{0x4000, 0, 0xC000, 0}), Refusal::illegal_value);
  EXPECT_EQ(desk.map.write(0, Words{0x7FC0, 0}), Refusal::illegal_value);
  EXPECT_EQ(desk.map.holding(), before);
}

TEST(RegisterMap, ShowsOneSampleInOneBlock) {
  Desk desk;
  RigSample sample;
  sample.displacement = 0.5;
  sample.excitation = -3.0;
  sample.device_us = 0x00010002;
  sample.counter = 0x00030004;
  sample.auxiliary[0] = 2.0;
  sample.auxiliary[7] = 3.0;
  desk.map.show(sample);
  const auto input = desk.map.input();
  EXPECT_THAT(
      std::vector(input.begin() + Input::displacement, input.begin() + Input::auxiliary + 2),
      ElementsAre(0x3F00, 0, 0xC040, 0, 1, 2, 3, 4, 0x4000, 0));
  EXPECT_THAT(std::vector(input.end() - 2, input.end()), ElementsAre(0x4040, 0));
}

TEST(RegisterMap, InjectsAndResetsFaults) {
  Desk desk;
  EXPECT_EQ(desk.map.write(Holding::inject, Words{5}), Refusal::none);
  EXPECT_EQ(desk.map.input()[Input::fault], 2);
  EXPECT_EQ(desk.map.write(Holding::enable, Words{1}), Refusal::device_failure);
  EXPECT_EQ(desk.map.write(Holding::fault_reset, Words{1}), Refusal::none);
  EXPECT_EQ(desk.map.write(Holding::enable, Words{1}), Refusal::none);
}

}  // namespace
}  // namespace shaker::sim
