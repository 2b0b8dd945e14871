// The recorded excitation may differ from the motion of the table; the motion itself must not
// change.
#include <map>
#include <numbers>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "sim/virtual_rig.hpp"

namespace shaker::sim {
namespace {

constexpr double kFrequency = 2.0;  // Hz; at 1000 samples per second 125 are a quarter period

std::vector<RigSample> recorded(const std::map<std::string, double>& parameters) {
  RigOptions options;
  options.noise_m = options.noise_m_s2 = options.quantum_m = options.quantum_m_s2 = 0.0;
  options.heartbeat_timeout_s = 0.0;
  options.parameters = parameters;
  constexpr Nanoseconds kStart = std::chrono::seconds(5);
  VirtualRig rig(options, kStart);
  EXPECT_TRUE(rig.set_ramp(0.0) && rig.set_frequency(kFrequency) && rig.set_amplitude(1.0));
  EXPECT_TRUE(rig.set_enable(true));
  std::vector<RigSample> samples;
  rig.advance(kStart + std::chrono::seconds(10), samples);
  return samples;
}

TEST(RecordedExcitation, TurnsByAPhaseItsFundamentalOnly) {
  const double quarter = std::numbers::pi / 2.0;
  const auto plain = recorded({});
  const auto turned = recorded({{"excitation_sensor_phase", quarter}});
  const auto distorted = recorded({{"excitation_h3", 0.2}});
  const auto both = recorded({{"excitation_h3", 0.2}, {"excitation_sensor_phase", quarter}});
  for (const std::size_t k : {9000U, 9100U, 9333U}) {
    EXPECT_NEAR(turned[k].excitation, plain[k - 125].excitation, 1e-12);
    EXPECT_EQ(turned[k].displacement, plain[k].displacement);
    EXPECT_NEAR(both[k].excitation - turned[k].excitation,
                distorted[k].excitation - plain[k].excitation, 1e-12);
    EXPECT_EQ(both[k].displacement, distorted[k].displacement);
  }
}

}  // namespace
}  // namespace shaker::sim
