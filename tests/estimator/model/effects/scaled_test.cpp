// The catalogue's defaults for another unit or size of motion: a force of the same shape, as much larger.
#include "estimator/model/effects/scaled.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "estimator/model/effects/catalogue.hpp"

namespace shaker::estimator {
namespace {

using config::MotionScale;

constexpr int kPoints = 8;
constexpr std::size_t kMost = 32;  // arrays of derivatives

struct alignas(64) Lane {
  std::array<double, kPoints> at{};
};

// What the effect's own defaults do along a motion of this scale.
std::vector<double> force_of(const Effect& effect, const MotionScale& scale) {
  std::vector<double> theta, constants;
  for (const ParameterInfo& p : effect.parameters()) {
    // Not its start where that may be its absence.
    const ParameterInfo own = scaled(effect, p, scale);
    theta.push_back(own.start + 0.01 * std::min(own.upper - own.start, 100.0 * own.start));
  }
  for (const Borrowed& b : effect.borrows()) {
    const Effect& lender = *find_effect(b.effect);
    for (const ParameterInfo& p : lender.parameters())
      if (p.symbol == b.symbol) theta.push_back(scaled(lender, p, scale).start);
  }
  for (const ConstantInfo& c : effect.constants())
    constants.push_back(scaled(c, scale).value);
  Lane u, v, a;
  for (std::size_t i = 0; i < kPoints; ++i) {
    u.at[i] = scale.length * (0.004 + 0.005 * static_cast<double>(i));
    v.at[i] = scale.speed * (0.3 - 0.09 * static_cast<double>(i));
    a.at[i] = scale.force * (2.0 - 0.7 * static_cast<double>(i));
  }
  Points points;
  points.n = kPoints;
  points.u = u.at.data();
  points.v = v.at.data();
  points.a = a.at.data();
  std::vector<Lane> arrays(kMost);
  std::vector<double*> by_theta;
  for (std::size_t k = 4; k < kMost; ++k)
    by_theta.push_back(arrays[k].at.data());
  Forces forces;
  forces.f = arrays[0].at.data();
  forces.f_u = arrays[1].at.data();
  forces.f_v = arrays[2].at.data();
  forces.f_a = arrays[3].at.data();
  forces.f_theta = by_theta.data();
  EXPECT_TRUE(effect.evaluate(points, theta.data(), constants.data(), forces)) << effect.name();
  return {arrays[0].at.begin(), arrays[0].at.end()};
}

TEST(Scaled, EveryForceKeepsItsShape) {
  int compared = 0;
  for (const Effect* effect : catalogue()) {
    // With states of its own it has no force of the motion alone. Weight does not follow a motion,
    // and a model states the strokes of a table.
    if (effect->group() != Group::damper || effect->instrument() != nullptr ||
        effect->sees_excitation() || !effect->internals().empty() || effect->moves_base() ||
        effect->in_series() || effect->name() == "gravity" || effect->name() == "tabulated_pin")
      continue;
    const auto one = force_of(*effect, {});
    for (const MotionScale& scale : {MotionScale{1000.0, 1000.0, 1000.0},
                                     MotionScale{1.0, 1.0, 0.01}, MotionScale{0.2, 3.0, 7.0}}) {
      const auto other = force_of(*effect, scale);
      for (std::size_t i = 0; i < one.size(); ++i)
        EXPECT_NEAR(other[i], scale.force * one[i], 1e-9 * scale.force * (1.0 + std::abs(one[i])))
            << effect->name() << " at " << i;
    }
    ++compared;
  }
  EXPECT_GE(compared, 12);
}

TEST(Scaled, LeavesAloneWhatHasNoScale) {
  const MotionScale scale{57.3, 57.3, 57.3};
  for (const Effect* effect : catalogue()) {
    for (const ParameterInfo& p : effect->parameters()) {
      const bool stays =
          p.unit == "-" || p.unit == "rad" || (p.unit == "s" && effect->group() != Group::damper);
      if (!stays) continue;
      EXPECT_EQ(scaled(*effect, p, scale).upper, p.upper) << effect->name();
    }
    for (const ConstantInfo& c : effect->constants()) {
      if (c.width) continue;
      EXPECT_EQ(scaled(c, scale).value, c.value) << effect->name();
    }
  }
}

// The share of the orifice that a pin closes, and the bend of a sensor, are those at the largest stroke:
// in their ranges for a long stroke as for a short one.
TEST(Scaled, AShapeIsMeantUpToTheLargestStroke) {
  for (const Effect* effect : {&metering_pin(), &sensor_nonlinearity()}) {
    const ConstantInfo& span = effect->constants()[0];
    MotionScale scale{3.0, 2.0, 1.0};
    scale.reach = 0.21;
    EXPECT_EQ(scaled(span, scale).value, 0.21) << effect->name();
    scale.reach = 0.0;
    EXPECT_EQ(scaled(span, scale).value, 3.0 * span.value) << effect->name();
  }
}

TEST(Scaled, AWrittenLineNeedsNoScale) {
  config::EffectSpec line;
  line.effect = "stribeck_friction";
  line.parameters["f_c"].start = 40.0;
  line.scale = {1e3, 1e3, 1e3};
  config::ModelSpec model;
  model.effects = {line};
  state_scaled(model);
  line = model.effects[0];
  EXPECT_EQ(line.scale, MotionScale{});
  EXPECT_EQ(line.parameters["f_c"].start, 40.0);
  EXPECT_DOUBLE_EQ(*line.parameters["f_c"].upper, 20e3);
  EXPECT_DOUBLE_EQ(*line.parameters["v_s"].start, 20.0);
  EXPECT_DOUBLE_EQ(line.constants["e"], 2.0);
}

TEST(Scaled, AStartAtABoundIsWrittenWithinIt) {
  config::EffectSpec line;
  line.effect = "stribeck_friction";
  line.scale = {1.0, 0.7735, 1.0};
  line.parameters["v_s"].start = std::nextafter(2e-3 * 0.7735, 0.0);
  line.parameters["ratio"].start = std::nextafter(2.0, 3.0);
  config::ModelSpec model;
  model.effects = {line};
  state_scaled(model);
  for (const char* symbol : {"v_s", "ratio"}) {
    const auto& written = model.effects[0].parameters.at(symbol);
    EXPECT_GE(*written.start, *written.lower) << symbol;
    EXPECT_LE(*written.start, *written.upper) << symbol;
  }
}

// 0.1 m for the zero of a sensor, a motion that is a thousand times as large in its unit.
TEST(Scaled, WidensARangeThatIsNotStatedAndNoOther) {
  config::ModelSpec model;
  model.effects.resize(2);
  model.effects[0].effect = "sensor_offset";
  model.effects[1].effect = "sensor_offset";
  model.effects[1].parameters["b"].upper = 2.0;
  const auto wide = with_room(model, {1000.0, 1000.0, 1000.0});
  EXPECT_DOUBLE_EQ(wide.effects[0].parameters.at("b").lower.value(), -100.0);
  EXPECT_DOUBLE_EQ(wide.effects[0].parameters.at("b").upper.value(), 100.0);
  EXPECT_DOUBLE_EQ(wide.effects[1].parameters.at("b").upper.value(), 2.0);
  const auto small = with_room(model, {0.01, 0.01, 0.01});
  EXPECT_TRUE(small.effects[0].parameters.empty());
}

// 1 MN s/m beside a reference mass of 1 kg. A sign, a stated bound and a number without a unit stay.
TEST(Scaled, MovesABoundThatIsNotStatedAwayFromAStatedStart) {
  const auto bounds = [](const char* effect, const char* symbol, double start, auto&&... upper) {
    config::ParameterSpec stated;
    stated.start = start;
    ((stated.upper = upper), ...);
    const Effect* known = find_effect(effect);
    for (const ParameterInfo& info : known->parameters()) {
      if (info.symbol != symbol) continue;
      const ParameterInfo own = with_start_inside(info, stated);
      return std::pair(own.lower, own.upper);
    }
    return std::pair(0.0, 0.0);
  };
  EXPECT_EQ(bounds("viscous_damping", "c", 3e6), std::pair(0.0, 3e7));
  EXPECT_EQ(bounds("viscous_damping", "c", 3.0), std::pair(0.0, 1e6));
  EXPECT_EQ(bounds("viscous_damping", "c", -3.0), std::pair(0.0, 1e6));
  EXPECT_EQ(bounds("viscous_damping", "c", 3e6, 5e5), std::pair(0.0, 1e6));
  EXPECT_EQ(bounds("bouc_wen_hysteresis", "z0", 1e-6), std::pair(1e-7, 0.1));
  EXPECT_EQ(bounds("bouc_wen_hysteresis", "n", 7.0), std::pair(1.0, 2.0));
  EXPECT_EQ(bounds("one_sided_damping", "c_1", -2e6), std::pair(-2e7, 1e6));
}

}  // namespace
}  // namespace shaker::estimator
