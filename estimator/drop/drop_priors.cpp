#include "estimator/drop/internal/drop_priors.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/drop/internal/drop_curves.hpp"

namespace shaker::estimator {
namespace {

template <class Belongs>
std::vector<double> load_of(const DropShares& shares, const Belongs& belongs) {
  std::vector<double> load;
  for (const EffectShare& share : shares.effects) {
    if (!belongs(share.effect)) continue;
    load.resize(share.load.size(), 0.0);
    for (std::size_t i = 0; i < load.size(); ++i)
      load[i] += share.load[i];
  }
  return load;
}

std::vector<double> family_load(const DropShares& shares, std::string_view family) {
  return load_of(shares, [&](const std::string& e) { return effect_family(e) == family; });
}

std::vector<double> times(double factor, std::vector<double> values) {
  for (double& value : values)
    value *= factor;
  return values;
}

// C_d moves with the logarithm of the velocity, and the force with twice that, against it.
std::vector<double> discharge_mode(const std::vector<double>& orifice,
                                   const std::vector<double>& speed, double spread, double tested) {
  std::vector<double> mode;
  for (std::size_t i = 0; i < orifice.size(); ++i) {
    const double beyond = std::fabs(speed[i]) / tested;
    mode.push_back(beyond > 1.0 ? 2.0 * spread * std::log10(beyond) * orifice[i] : 0.0);
  }
  return mode;
}

// The derivative of F = F_0 (V_0 / V)^n over n is F ln(V_0 / V), and ln(V_0 / V) is ln(F / F_0) / n.
std::vector<double> index_mode(const std::vector<double>& gas, double spread, double index) {
  std::vector<double> mode;
  for (const double force : gas)
    mode.push_back(force > 0.0 ? spread * force * std::log(force / gas.front()) / index : 0.0);
  return mode;
}

double index_of(const Model& model) {
  for (const ModelParameter& p : model.parameters()) {
    if (p.effect == "gas_spring" && p.name.ends_with("theta4")) return p.start;
  }
  return 0.0;
}

std::vector<double> at_times(const std::vector<double>& t, const std::vector<double>& values,
                             const std::vector<double>& wanted) {
  std::vector<double> out;
  for (const double time : wanted)
    out.push_back(linear_at(t, values, time));
  return out;
}

}  // namespace

ForceAlongPath prior_forces(const DamperHypothesis& damper, const DropConditions& conditions,
                            const ExtrapolationPriors& priors, double tested_speed,
                            const std::vector<double>& t) {
  ForceAlongPath force;
  force.mean.assign(t.size(), 0.0);
  if (!priors.any()) return force;
  const DropTest test(damper.model, conditions);
  const auto theta = test.model().start();
  const auto run = test.run(theta, false);
  const auto shares = test.shares(theta);
  if (!run || !shares) return force;
  const auto add = [&](const std::vector<double>& mode) {
    force.modes.push_back(at_times(run->history.t, mode, t));
  };
  const auto orifice = family_load(*shares, "orifice"), gas = family_load(*shares, "gas");
  if (priors.discharge_spread > 0.0 && tested_speed > 0.0 && !orifice.empty())
    add(discharge_mode(orifice, run->history.speed, priors.discharge_spread, tested_speed));
  const double index = index_of(test.model());
  if (priors.index_spread > 0.0 && index > 0.0 && !gas.empty() && gas.front() > 0.0)
    add(index_mode(gas, priors.index_spread, index));
  const auto viscous =
      load_of(*shares, [](const std::string& e) { return e == "viscous_damping"; });
  if (priors.runs.force > 0.0) force.modes.emplace_back(t.size(), priors.runs.force);
  if (priors.runs.gas_pressure > 0.0 && !gas.empty()) add(times(priors.runs.gas_pressure, gas));
  if (priors.runs.damping > 0.0 && !viscous.empty()) add(times(priors.runs.damping, viscous));
  return force;
}

ForceAlongPath beyond_table(const DamperHypothesis& ended, const config::PinTable& table,
                            double fall, const DropConditions& conditions,
                            const std::vector<double>& t) {
  ForceAlongPath force;
  force.mean.assign(t.size(), 0.0);
  const DropTest test(ended.model, conditions);
  const auto theta = test.model().start();
  const auto run = test.run(theta, false);
  const auto shares = test.shares(theta);
  if (!run || !shares) return force;
  std::vector<double> mode = family_load(*shares, "orifice");
  if (mode.empty()) return force;
  const double low = table.stroke.front(), high = table.stroke.back();
  // The force goes with 1 / area^2.
  const double spread = std::min(kMostBeyond, 2.0 * std::fabs(fall));
  for (std::size_t i = 0; i < mode.size(); ++i) {
    const double u = run->history.stroke[i] + conditions.extended;
    mode[i] *= spread * -std::expm1(-std::max({0.0, low - u, u - high}) / (high - low));
  }
  force.modes.push_back(at_times(run->history.t, mode, t));
  return force;
}

}  // namespace shaker::estimator
