// The forces of single effects along a drop.
#include <algorithm>
#include <cmath>
#include <optional>

#include "estimator/drop/drop.hpp"
#include "estimator/drop/falling_damper.hpp"
#include "estimator/drop/internal/drop_curves.hpp"
#include "estimator/model/model_arrays.hpp"

namespace shaker::estimator {
namespace {

// The accelerations of the coordinates at the points of a path, each times its mass in the first
// equation.
class InertiaAlongPath {
 public:
  InertiaAlongPath(std::size_t points, const std::vector<double>& states) : points_(points) {
    const std::size_t stride = (points + 7) / 8 * 8, m = states.size() / points;
    numbers_.assign(stride * (2 * m + 1), 0.0);
    for (std::size_t j = 0; j < m; ++j) {
      s_.push_back(numbers_.data() + j * stride);
      rate_.push_back(numbers_.data() + (m + j) * stride);
      for (std::size_t i = 0; i < points; ++i)
        s_[j][i] = states[i * m + j];
    }
    x_ = numbers_.data() + 2 * m * stride;
  }

  // Nothing where a point is inadmissible.
  std::optional<std::vector<double>> of(const std::vector<double>& mass,
                                        const StateEquations& equations,
                                        const std::vector<double>& theta) {
    StateEquations::Workspace work;
    if (!equations.rates(static_cast<int>(points_), s_.data(), x_, theta.data(), work, rate_.data(),
                         nullptr, nullptr))
      return std::nullopt;
    std::vector<double> inertia(points_, 0.0);
    for (std::size_t e = 0; e < mass.size(); ++e) {
      const int v = equations.velocity_of(static_cast<int>(e));
      for (std::size_t i = 0; v >= 0 && i < points_; ++i)
        inertia[i] += mass[e] * rate_[static_cast<std::size_t>(v)][i];
    }
    return inertia;
  }

 private:
  std::size_t points_;
  AlignedVector numbers_;
  std::vector<double*> s_, rate_;
  double* x_ = nullptr;
};

// A line with its force, but not in the balance of forces.
config::ModelSpec without_force_of(config::ModelSpec spec, std::size_t line) {
  const std::size_t size = std::max<std::size_t>(1, spec.coordinates.size());
  config::EffectSpec& effect = spec.effects[line];
  if (effect.sees.empty()) effect.sees.assign(size, 1.0);
  effect.acts.assign(size, 0.0);
  return spec;
}

// Whether a line sees the stroke; a tyre's spring sees another coordinate.
bool sees_stroke(const config::EffectSpec& line, int observed) {
  const auto at = static_cast<std::size_t>(observed);
  return line.sees.empty() || (at < line.sees.size() && line.sees[at] != 0.0);
}

struct Family {
  std::string_view name;
  std::vector<std::string_view> effects;
};
const std::vector<Family>& families() {
  static const std::vector<Family> all = {
      {"gas", {"gas_spring", "real_gas", "gas_heat_transfer", "dissolved_gas", "second_chamber"}},
      {"orifice",
       {"orifice_damping", "laminar_orifice", "metering_pin", "tabulated_pin", "rebound_damping",
        "relief_valve", "cavitation"}},
      {"friction",
       {"coulomb_friction", "pressure_friction", "stribeck_friction", "pinched_friction",
        "presliding_friction", "bouc_wen_hysteresis"}}};
  return all;
}

}  // namespace

std::string_view effect_family(std::string_view effect) {
  for (const Family& family : families()) {
    if (std::find(family.effects.begin(), family.effects.end(), effect) != family.effects.end())
      return family.name;
  }
  return "other";
}

double DropTest::energy_in(const DropHistory& h, std::size_t end,
                           const std::vector<double>& theta) const {
  const double speed = conditions_.sink_speed;
  if (!has_tyre()) return 0.5 * mass_[0] * speed * speed + (weight_ - lift_) * h.stroke[end];
  const double tyre = h.travel[end] - h.stroke[end];
  return 0.5 * (mass_[0] + unsprung_mass(theta)) * speed * speed +
         (weight_ - lift_) * h.travel[end] + unsprung_weight(theta) * tyre;
}

Result<DropShares> DropTest::shares(const std::vector<double>& theta) const {
  DropRun run;
  const auto motion = integrate(run, theta, false, {}, {});
  if (!motion) return motion.error();
  loads(run, theta, motion->states, {}, {});
  const DropHistory& h = run.history;
  const CurvePlace peak = deepest_turn(h.t, h.stroke, h.speed);
  if (peak.before >= h.t.size()) return read_off(run, theta).error();
  const std::size_t end = peak.before + 1;
  const auto largest =
      static_cast<std::size_t>(std::max_element(h.load.begin(), h.load.end()) - h.load.begin());
  InertiaAlongPath path(h.t.size(), motion->states);
  const auto with = path.of(mass_, equations_, theta);
  DropShares out;
  double strut = 0.0;
  const auto kinds = line_kinds(spec_);
  for (std::size_t line = 0; with && line < kinds.size(); ++line) {
    if (kinds[line] != LineKind::load || !sees_stroke(spec_.effects[line], model_.observed()))
      continue;
    const Model model(without_force_of(spec_, line));
    const StateEquations equations(model, forces_of(model, lift_));
    const auto without = path.of(mass_, equations, theta);
    if (!without) continue;
    EffectShare share;
    share.effect = spec_.effects[line].effect;
    for (std::size_t i = 0; i < h.t.size(); ++i)
      share.load.push_back((*without)[i] - (*with)[i]);
    share.of_peak_load = share.load[largest] / h.load[largest];
    share.of_energy = work_between(h.t, share.load, h.speed, 0, end);
    strut += share.of_energy;
    out.effects.push_back(std::move(share));
  }
  for (EffectShare& share : out.effects)
    share.of_energy /= strut;
  const double in = energy_in(h, end, theta);
  double left = in - strut - 0.5 * mass_[0] * h.speed[end] * h.speed[end];
  if (has_tyre()) {
    std::vector<double> tyre_speed;
    for (std::size_t i = 0; i < h.t.size(); ++i)
      tyre_speed.push_back(h.travel_speed[i] - h.speed[i]);
    left = in - strut - work_between(h.t, h.ground_load, tyre_speed, 0, end) -
           0.5 * mass_[0] * h.travel_speed[end] * h.travel_speed[end] -
           0.5 * unsprung_mass(theta) * tyre_speed[end] * tyre_speed[end];
  }
  out.energy_residual = left / in;
  return out;
}

}  // namespace shaker::estimator
