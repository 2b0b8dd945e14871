// Bouc-Wen hysteresis, z' = a v - b |v| |z|^(n-1) z - c v |z|^n, either as a force k z beside a
// damper or as the restoring force of the bouc_wen plant. Source: Y. K. Wen, J. Eng. Mech. Div.
// ASCE 102 (1976) 249-263.
#include <cmath>

#include "sim/parts/parts.hpp"

namespace shaker::sim {
namespace {

struct Hysteresis final : PlantPart {
  double k, a, b, c, n;
  double damping = 0.0, stiffness = 0.0;  // used by the bouc_wen plant only
  std::size_t slot;

  Hysteresis(double k_, double a_, double b_, double c_, double n_, Memory& memory)
      : k(k_), a(a_), b(b_), c(c_), n(n_), slot(static_cast<std::size_t>(memory.claim(0.0))) {}

  void add(const Motion& m, Balance& sum) const override {
    sum.force += damping * m.v + stiffness * m.u + k * m.state[slot];
  }
  void remember(const Motion& m, State& rate) const override {
    const double z = m.state[slot];
    const double power = std::pow(std::abs(z), n - 1.0);
    rate[slot] = a * m.v - b * m.speed() * power * z - c * m.v * power * std::abs(z);
  }
};

constexpr Parameter kBeside[] = {{"bouc_wen_stiffness", "1/s^2", 0.0, 0.0, 1e6, "k in k z (a = 1)"},
                                 {"bouc_wen_b", "1/m^n", 100.0, 0.0, 1e9, "b"},
                                 {"bouc_wen_c", "1/m^n", 50.0, -1e9, 1e9, "c"},
                                 {"bouc_wen_n", "1", 1.0, 1.0, 5.0, "n, sharpness of the knee"}};

constexpr Parameter kOwn[] = {
    {"damping", "1/s", 2.0, 0.0, 1e4, "viscous damping"},
    {"stiffness", "1/s^2", 400.0, 1e-6, 1e9, "small-amplitude stiffness k"},
    {"alpha", "1", 0.1, 0.0, 1.0, "share of the stiffness that does not yield"},
    {"a", "1", 1.0, 1e-6, 1e3, "a in z' = a v - ..."},
    {"beta", "1/m^n", 100.0, 0.0, 1e9, "b in z' = ... - b |v| |z|^(n-1) z"},
    {"gamma", "1/m^n", 50.0, -1e9, 1e9, "c in z' = ... - c v |z|^n"},
    {"n", "1", 1.0, 1.0, 5.0, "sharpness of the knee"}};

std::unique_ptr<PlantPart> make_beside(const Values& v, Memory& memory) {
  const double k = v.at("bouc_wen_stiffness");
  if (k == 0.0) return nullptr;
  return std::make_unique<Hysteresis>(k, 1.0, v.at("bouc_wen_b"), v.at("bouc_wen_c"),
                                      v.at("bouc_wen_n"), memory);
}

std::unique_ptr<PlantPart> make_own(const Values& v, Memory& memory) {
  const double k = v.at("stiffness"), alpha = v.at("alpha");
  auto part = std::make_unique<Hysteresis>((1.0 - alpha) * k, v.at("a"), v.at("beta"),
                                           v.at("gamma"), v.at("n"), memory);
  part->damping = v.at("damping");
  part->stiffness = alpha * k;
  return part;
}

}  // namespace

const PartEntry kBoucWenHysteresis = {"bouc_wen_hysteresis", kBeside, make_beside};
const PartEntry kBoucWenOscillator = {"bouc_wen_oscillator", kOwn, make_own};

}  // namespace shaker::sim
