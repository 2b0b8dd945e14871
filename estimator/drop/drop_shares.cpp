// The forces of single effects along a drop.
#include <algorithm>
#include <cmath>
#include <optional>

#include "estimator/drop/drop.hpp"
#include "estimator/drop/falling_damper.hpp"
#include "estimator/drop/internal/drop_curves.hpp"
#include "estimator/model/effects/catalogue.hpp"
#include "estimator/model/model_arrays.hpp"

namespace shaker::estimator {
namespace {

// The balances of forces of a model at the points of a path.
class BalancesAlongPath {
 public:
  BalancesAlongPath(std::size_t points, const std::vector<double>& states,
                    const StateEquations& equations, const std::vector<double>& theta)
      : points_(points), equations_(equations), theta_(theta) {
    const std::size_t stride = (points + 7) / 8 * 8, m = states.size() / points;
    numbers_.assign(stride * (2 * m + 1), 0.0);
    for (std::size_t j = 0; j < m; ++j) {
      s_.push_back(numbers_.data() + j * stride);
      rate_.push_back(numbers_.data() + (m + j) * stride);
      for (std::size_t i = 0; i < points; ++i)
        s_[j][i] = states[i * m + j];
    }
    StateEquations::Workspace work;
    known_ = equations.rates(static_cast<int>(points_), s_.data(), numbers_.data() + 2 * m * stride,
                             theta.data(), work, rate_.data(), nullptr, nullptr);
  }

  // Left sides of the equations of `model`, which has the same coordinates: one array each. Nothing
  // where a point is inadmissible.
  std::optional<std::vector<std::vector<double>>> of(const Model& model) const {
    const int n = static_cast<int>(points_);
    ModelArrays at;
    at.shape(model, n);
    for (int c = 0; c < model.coordinates(); ++c) {
      const auto own = static_cast<std::size_t>(c);
      const int v = equations_.velocity_of(c);
      std::copy_n(s_[own], n, at.u[own]);
      std::copy_n(speed(c), n, at.v[own]);
      if (v >= 0) std::copy_n(rate_[static_cast<std::size_t>(v)], n, at.a[own]);
    }
    if (!known_ || !at.evaluate(model, n, theta_.data())) return std::nullopt;
    std::vector<std::vector<double>> left;
    for (const double* g : at.g)
      left.emplace_back(g, g + n);
    return left;
  }
  const double* speed(int coordinate) const {
    const int v = equations_.velocity_of(coordinate);
    return v >= 0 ? s_[static_cast<std::size_t>(v)] : rate_[static_cast<std::size_t>(coordinate)];
  }

 private:
  std::size_t points_;
  const StateEquations& equations_;
  const std::vector<double>& theta_;
  AlignedVector numbers_;
  std::vector<double*> s_, rate_;
  bool known_ = false;
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

// What the balances of a model differ by from those without a line: its force.
std::vector<double> force_in(const std::vector<double>& with, const std::vector<double>& without,
                             double factor) {
  std::vector<double> force(with.size());
  for (std::size_t i = 0; i < force.size(); ++i)
    force[i] = factor * (with[i] - without[i]);
  return force;
}

void add(std::vector<double>& sum, const std::vector<double>& more) {
  sum.resize(more.size(), 0.0);
  for (std::size_t i = 0; i < more.size(); ++i)
    sum[i] += more[i];
}

// The lines' loads, and their energies in place of shares. Behind a part in series the damper has a
// stroke and a balance of its own.
std::vector<EffectShare> loads_of_lines(const config::ModelSpec& spec, const Model& model,
                                        const BalancesAlongPath& path, const DropHistory& h,
                                        std::size_t end) {
  const int own = model.coordinate_in_series();
  const auto joint = std::ranges::find_if(spec.effects, is_in_series);
  const double acts =
      joint == spec.effects.end() || joint->acts.empty() ? 1.0 : joint->acts.front();
  std::vector<double> own_speed, transmitted;
  if (own >= 0) own_speed.assign(path.speed(own), path.speed(own) + h.t.size());
  const auto with = path.of(model);
  const auto kinds = line_kinds(spec);
  std::vector<EffectShare> shares;
  for (std::size_t line = 0; with && line < kinds.size(); ++line) {
    const config::EffectSpec& effect = spec.effects[line];
    if (kinds[line] != LineKind::load || !sees_stroke(effect, model.observed()) ||
        is_in_series(effect))
      continue;
    const auto without = path.of(Model(without_force_of(spec, line)));
    if (!without) continue;
    std::vector<double> load = force_in((*with)[0], (*without)[0], 1.0);
    double energy = work_between(h.t, load, h.speed, 0, end);
    if (own >= 0) {
      const auto at = static_cast<std::size_t>(own);
      const std::vector<double> behind = force_in((*with)[at], (*without)[at], acts);
      energy += work_between(h.t, behind, own_speed, 0, end);
      add(load, behind);
      add(transmitted, behind);
    }
    shares.push_back({effect.effect, std::move(load), 0.0, energy});
  }
  if (transmitted.empty()) return shares;
  std::vector<double> yielding = h.speed;
  for (std::size_t i = 0; i < yielding.size(); ++i)
    yielding[i] -= own_speed[i];
  const double energy = work_between(h.t, transmitted, yielding, 0, end);
  shares.push_back({joint->effect, std::move(transmitted), 0.0, energy});
  return shares;
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
  const BalancesAlongPath path(h.t.size(), motion->states, equations_, theta);
  DropShares out;
  out.effects = loads_of_lines(spec_, model_, path, h, end);
  double strut = 0.0;
  for (EffectShare& share : out.effects) {
    share.of_peak_load = share.load[largest] / h.load[largest];
    strut += share.of_energy;
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
