#include <algorithm>
#include <cmath>
#include <limits>

#include "tests/dirty/campaign.hpp"
#include "tests/dirty/draw_effect.hpp"
#include "tests/dirty/random.hpp"

namespace shaker::dirty {
namespace {

constexpr const char* kKinds[] = {"periodic", "imposed", "sweep", "decay", "drop"};
constexpr int kMaxDraws = 40;  // of one effect, until it is neither too small nor too large

// The base damper and the values from which its model starts.
void draw_base(Campaign& c, Random& random) {
  const bool oleo = c.kind == "drop" || (c.kind != "decay" && random.uniform(0.0, 1.0) < 0.6);
  if (oleo) {
    c.base = {{"theta1", random.uniform(10.0, 25.0)},
              {"theta2", random.uniform(1.2, 2.0)},
              {"theta3", random.uniform(4.5, 6.0)},
              {"theta4", random.uniform(1.0, 1.35)}};
    c.weight = c.kind != "imposed";
  } else {
    const bool rings = c.kind == "decay";
    c.base = {{"c", rings ? random.uniform(0.3, 1.0) : random.uniform(1.0, 4.0)},
              {"k", random.uniform(60.0, 160.0)}};
  }
  for (const auto& [parameter, value] : c.base)
    c.starts[parameter] = value * random.log_uniform(0.75, 1.33);
  if (oleo) c.starts["theta4"] = 1.2;
}

Run drawn_run(const Campaign& c, int number, Random& random) {
  const bool oleo = c.base.contains("theta1");
  Run run;
  run.phase = random.uniform(0.0, 6.28);
  run.step = 1.0 / 100.0;
  if (c.kind == "periodic" || c.kind == "imposed") {
    // The runs differ by about the same factor, from slow to fast.
    run.frequency = 0.8 * std::pow(5.0, (number + random.uniform(0.0, 1.0)) / 6.0);
    run.step = 1.0 / (100.0 * run.frequency * random.uniform(0.9, 1.1));
    run.duration = random.uniform(10.0, 15.0) / run.frequency;
    run.settle = 3.0;
    run.amplitude = random.uniform(1.5, 5.0);
  }
  if (c.kind == "imposed") {
    run.drive = Drive::kImposed;
    run.amplitude = random.uniform(0.01, 0.04);
    run.start_stroke = oleo ? random.uniform(0.06, 0.12) : 0.0;
  } else if (c.kind == "sweep") {
    run.drive = Drive::kSweep;
    run.frequency = random.uniform(0.4, 0.8);
    run.to_frequency = random.uniform(4.0, 6.0);
    run.amplitude = random.uniform(1.5, 5.0);
    run.duration = 16.0;
  } else if (c.kind == "decay") {
    run.drive = Drive::kDecay;
    run.start_stroke = random.sign() * random.uniform(0.01, 0.05);
    run.duration = 12.0;
  } else if (c.kind == "drop") {
    run.drive = Drive::kDrop;
    run.start_velocity = random.uniform(0.8, 2.5);
    run.duration = 2.5;
    run.step = 1.0 / 500.0;
  }
  return run;
}

void draw_runs(Campaign& c, Random& random) {
  const int count = c.kind == "periodic" || c.kind == "imposed" ? 6 : 3;
  for (int i = 0; i < count; ++i) {
    c.runs.push_back(drawn_run(c, i, random));
    c.stated_frequency.push_back(c.runs.back().frequency * random.uniform(0.99, 1.01));
  }
}

// Stroke, speed and forces of the base damper in the campaign, from its channels.
Scales scales_of(const Campaign& c) {
  const bool imposed = c.kind == "imposed";
  Scales s;
  s.low = std::numeric_limits<double>::infinity();
  s.high = -s.low;
  const Device device(c.base, {}, c.weight);
  double least = s.low, most = s.high;
  State rate;
  for (const Run& run : c.runs) {
    const Channels channels = moved(device, {}, run);
    const std::vector<double>& stroke = imposed ? channels.input : channels.response;
    for (std::size_t k = 1; k < stroke.size(); ++k) {
      State at = device.at_rest(stroke[k]);
      at[kVelocity] = (stroke[k] - stroke[k - 1]) / run.step;
      const double load = device.force(at, {}, rate);
      at[kVelocity] = 0.0;
      s.damping = std::max(s.damping, std::abs(load - device.force(at, {}, rate)));
      s.low = std::min(s.low, stroke[k]);
      s.high = std::max(s.high, stroke[k]);
      s.speed = std::max(s.speed, std::abs(stroke[k] - stroke[k - 1]) / run.step);
      least = std::min(least, load);
      most = std::max(most, load);
    }
  }
  s.load = 0.5 * (most - least);
  return s;
}

void draw_noise(Campaign& c, const Scales& s, Random& random) {
  const bool imposed = c.kind == "imposed";
  c.noise.response = (imposed ? s.load : 0.5 * s.range()) * random.log_uniform(5e-4, 5e-3);
  c.noise.input = (imposed ? 0.02 : 3.0) * random.log_uniform(5e-4, 5e-3);
  c.noise.coloured = random.uniform(0.2, 0.8);
  c.noise.time = random.log_uniform(0.005, 0.05);
  if (!imposed) return;
  c.true_mass = random.log_uniform(5.0, 300.0);
  c.stated_mass = 100.0;
}

// Zero, preload or temperature of each run. Where nothing is hidden, the runs may also be alike.
void draw_changes(Campaign& c, const Scales& s, Random& random) {
  constexpr const char* kChanges[] = {"zero", "preload", "temperature", "none"};
  const int which = random.below(c.holds == "nothing" ? 4 : 3);
  c.changes = kChanges[which];
  const double size = random.log_uniform(1e-3, 1e-2);
  for (Run& run : c.runs) {
    const double draw = size * random.normal();
    if (which == 0) run.change.zero = draw * (c.kind == "imposed" ? s.load : 0.5 * s.range());
    if (which == 1) run.change.preload = draw * s.load;
    if (which == 2) run.change.temperature = draw;
  }
}

// Two of a pair that one sensor, one orifice or one mass cannot tell apart or hold at once.
bool exclude(const std::string& a, const Effects& effects) {
  static const std::vector<std::vector<std::string>> groups = {
      {"added_mass", "tyre", "sensor_gain", "exciter_gain"},
      {"sensor_delay", "exciter_phase", "sensor_lag", "gas_heat_transfer"},
      {"coulomb_friction", "pressure_friction", "stribeck_friction", "presliding_friction"},
      {"gas_heat_transfer", "dissolved_gas", "real_gas", "second_chamber"},
      {"oil_compressibility", "laminar_orifice", "metering_pin"},
      {"oil_compressibility", "rebound_damping", "cavitation"},
      {"oil_compressibility", "relief_valve"}};
  for (const auto& group : groups) {
    if (std::ranges::find(group, a) == group.end()) continue;
    for (const auto& name : group)
      if (effects.contains(name)) return true;
  }
  return effects.contains(a);
}

// One to three effects, each visible on its own: above the noise, and below half of the motion.
void draw_effects(Campaign& c, const Scales& s, const Projection& projection, Random& random) {
  const double draw = random.uniform(0.0, 1.0);
  const std::size_t count = draw < 0.4 ? 1 : (draw < 0.75 ? 2 : 3);
  const auto names = candidates(c.kind, c.base.contains("theta1"));
  const std::vector<double> base = responses(c, {}, false);
  for (int i = 0; i < kMaxDraws && c.effects.size() < count; ++i) {
    const std::string& name = names[static_cast<std::size_t>(random.below(int(names.size())))];
    const Effects one = {{name, drawn_effect(name, s, random)}};
    if (exclude(name, c.effects)) continue;
    const double seen = projection.visible(responses(c, one, false), base);
    if (seen > 1.5 * c.noise.response && seen < 0.5 * spread(base))
      c.effects.insert(one.begin(), one.end());
  }
}

// An effect of no catalogue that is of this visible size alone, and of about the same beside the
// effects of the catalogue.
void draw_unknown(Campaign& c, const Scales& s, const Projection& projection, double size,
                  Random& random) {
  const std::vector<double> base = responses(c, {}, false);
  const std::vector<double> without = responses(c, c.effects, false);
  for (int draws = 0; draws < kMaxDraws; ++draws) {
    c.unknown = drawn_unknown(s, random);
    double alone = 0.0;
    for (int i = 0; i < 6 && std::abs(std::log(alone / size)) > 0.05; ++i) {
      alone = projection.visible(responses(c, c.unknown, false), base);
      c.unknown.begin()->second["size"] *= std::clamp(size / alone, 0.05, 20.0);
    }
    const double beside = projection.visible(responses(c, all_hidden(c), false), without);
    if (std::abs(std::log(alone / size)) < 0.3 && beside > 0.4 * size && beside < 2.5 * size)
      return;
  }
}

}  // namespace

Campaign drawn(std::uint64_t seed, long index) {
  Campaign c;
  c.seed = seed;
  c.index = index;
  c.kind = kKinds[index % 5];
  const long slot = index / 5 % 10;
  c.holds = slot == 0 ? "nothing" : (slot == 1 ? "unknown" : "effects");
  Random random(seed * 1000003ULL + static_cast<std::uint64_t>(index));
  random = Random(random.bits());
  draw_base(c, random);
  draw_runs(c, random);
  const Scales scales = scales_of(c);
  draw_noise(c, scales, random);
  const Projection projection(c);
  if (c.holds == "effects") draw_effects(c, scales, projection, random);
  if (c.holds == "effects" && c.effects.empty()) c.holds = "unknown";
  if (c.holds != "nothing") {
    double size = c.noise.response * random.log_uniform(1.0, 10.0);
    if (c.holds == "effects") {
      measure(c, projection);
      size = 0.0;
      for (const auto& [name, seen] : c.visible)
        size = std::max(size, seen);
      size *= random.log_uniform(0.05, 0.5);
    }
    draw_unknown(c, scales, projection, size, random);
  }
  draw_changes(c, scales, random);
  measure(c, projection);
  return c;
}

}  // namespace shaker::dirty
