#include "estimator/drop/drop.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <fmt/format.h>

#include "estimator/drop/internal/drop_curves.hpp"
#include "estimator/solve/time/integration.hpp"

namespace shaker::estimator {
namespace {

constexpr double kAbsolute = 1e-3;  // tolerance in the model's units, over the relative one
// Of a stiff model, between two times of 3000 and in all: BDF is quicker then.
constexpr long kMaxAdamsSteps = 30, kMaxAdamsEvaluations = 3000;

double row_of(const std::vector<double>& given, std::size_t at, double otherwise) {
  return at < given.size() ? given[at] : otherwise;
}

// Weight in an equation over the reference mass, from the model's gravity effects.
double weight_in(const config::ModelSpec& spec, std::size_t equation) {
  double weight = 0.0;
  for (const config::EffectSpec& effect : spec.effects) {
    if (effect.effect != "gravity") continue;
    double g = spec.gravity;
    for (const auto& constant : effect.constants)
      g = constant.second;
    weight += row_of(effect.acts, equation, equation == 0 ? 1.0 : 0.0) * g;
  }
  return weight;
}

double lift_of(const config::ModelSpec& spec, const Model& model, double share) {
  const std::size_t equations = std::max<std::size_t>(1, spec.coordinates.size());
  double mass = 0.0;  // of all equations, over the reference mass
  for (std::size_t e = 0; e < equations; ++e)
    mass += row_of(spec.excitation, e, 1.0);
  const std::vector<double> theta = model.start();
  for (const Model::Term& term : model.terms()) {
    if (term.effect->moves_base()) mass += theta[static_cast<std::size_t>(term.first_parameter)];
  }
  return share * mass * spec.gravity;
}

// In a drop the excitation is a force beside those of the damper: it acts where the damper acts,
// also on what is below it.
config::ModelSpec pushed_like_the_damper(config::ModelSpec spec) {
  for (config::EffectSpec& effect : spec.effects) {
    if (effect.effect == "tyre") effect.constants["shaken"] = 0.0;
  }
  if (spec.coordinates.size() < 2) return spec;
  for (const config::EffectSpec& effect : spec.effects) {
    if (effect.effect == "gravity" || effect.acts.size() != spec.coordinates.size() ||
        effect.acts[0] == 0.0 || row_of(effect.sees, 0, 0.0) == 0.0)
      continue;
    spec.excitation.clear();
    for (const double acts : effect.acts)
      spec.excitation.push_back(acts / effect.acts[0]);
    break;
  }
  return spec;
}

}  // namespace

// The equation of the effect `tyre` is the balance of both masses.
std::vector<double> DropTest::forces_of(const Model& model, double lift) {
  std::vector<double> force(static_cast<std::size_t>(model.coordinates()), 0.0);
  force[0] = -lift;
  for (const Model::Term& term : model.terms()) {
    if (term.effect->moves_base()) force[static_cast<std::size_t>(term.first_internal)] = -lift;
  }
  return force;
}

DropTest::DropTest(const config::ModelSpec& spec, DropConditions conditions)
    : spec_(pushed_like_the_damper(spec)),
      model_(spec_),
      conditions_(conditions),
      weight_(weight_in(spec, 0)),
      lift_(lift_of(spec, model_, conditions.lift)),
      unsprung_weight_(weight_in(spec, 1)),
      equations_(model_, forces_of(model_, lift_)) {
  const auto c = static_cast<std::size_t>(model_.coordinates());
  for (std::size_t e = 0; e < c; ++e)
    mass_.push_back(model_.mass(0, static_cast<int>(e)));
  if (!(conditions_.sink_speed > 0.0) || !std::isfinite(conditions_.sink_speed))
    throw std::invalid_argument(fmt::format("the sink speed is {} {}/s; it must be above 0",
                                            conditions_.sink_speed, model_.length_unit()));
  if (!(conditions_.lift >= 0.0 && conditions_.lift <= 1.0))
    throw std::invalid_argument(
        fmt::format("the lift is {} of the weight; it must be from 0 to 1", conditions_.lift));
  if (!(conditions_.stroke_limit > 0.0))
    throw std::invalid_argument(fmt::format("the greatest stroke is {} {}; it must be above 0",
                                            conditions_.stroke_limit, model_.length_unit()));
  if (!(conditions_.duration > 0.0) || !std::isfinite(conditions_.duration))
    throw std::invalid_argument(
        fmt::format("the duration is {} s; it must be above 0", conditions_.duration));
  if (equations_.velocity_of(model_.observed()) < 0)
    throw std::invalid_argument("the model's observed coordinate has no mass, so it has no stroke");
  // The effect `tyre` has its coordinate among the internal ones.
  for (const Model::Term& term : model_.terms()) {
    if (!term.effect->moves_base()) continue;
    if (conditions_.contact < 0) conditions_.contact = term.first_internal;
    unsprung_ = term.first_parameter;
    mass_[static_cast<std::size_t>(term.first_internal)] = 1.0;
  }
  if (conditions_.contact < 0) conditions_.contact = model_.mechanical() - 1;
  if (conditions_.contact >= model_.coordinates() ||
      equations_.velocity_of(conditions_.contact) < 0)
    throw std::invalid_argument(
        fmt::format("coordinate {} cannot meet the ground: the model has {}, counted from 0, and "
                    "it needs a mass",
                    conditions_.contact, model_.coordinates()));
  tyre_ = find_tyre();
}

int DropTest::find_tyre() const {
  if (unsprung_ >= 0) return conditions_.contact >= model_.mechanical() ? conditions_.contact : -1;
  return model_.mechanical() == 2 && model_.observed() == 0 && conditions_.contact == 1 &&
                 model_.mass(0, 0) == model_.mass(0, 1) && model_.mass(1, 0) == 0.0 &&
                 model_.mass(1, 1) > 0.0
             ? 1
             : -1;
}

double DropTest::unsprung_mass(const std::vector<double>& theta) const {
  return unsprung_ < 0 ? model_.mass(1, 1) : theta[static_cast<std::size_t>(unsprung_)];
}

double DropTest::unsprung_weight(const std::vector<double>& theta) const {
  return unsprung_ < 0 ? unsprung_weight_ : unsprung_mass(theta) * weight_;
}

std::vector<double> DropTest::touch_down() const {
  std::vector<double> states(static_cast<std::size_t>(equations_.states()), 0.0);
  for (int e = model_.mechanical(); e < model_.coordinates(); ++e)
    states[static_cast<std::size_t>(e)] = model_.rest(e);
  states[static_cast<std::size_t>(model_.observed())] = conditions_.extended;
  states[static_cast<std::size_t>(equations_.velocity_of(conditions_.contact))] =
      conditions_.sink_speed;
  return states;
}

Result<DropTest::Motion> DropTest::integrate(DropRun& out, const std::vector<double>& theta,
                                             bool derivatives, const Excitation& push,
                                             const DropEffort& effort) const {
  const auto m = static_cast<std::size_t>(equations_.states());
  TimeOptions options;
  options.integrator = effort.stiff ? Integrator::bdf : Integrator::adams;
  options.relative_tolerance = effort.tolerance;
  options.absolute_tolerance = kAbsolute * effort.tolerance;
  options.max_steps = kMaxAdamsSteps * DropEffort().steps / effort.steps;
  options.max_evaluations = kMaxAdamsEvaluations;
  std::vector<int> all;
  for (int k = 0; k < model_.parameter_count(); ++k)
    all.push_back(k);
  DropHistory& h = out.history;
  for (int i = 0; i <= effort.steps; ++i)
    h.t.push_back(conditions_.duration * drop_time_share(static_cast<double>(i) / effort.steps));
  Arc arc;
  arc.times = h.t;
  arc.excitation = &push;
  arc.start = touch_down();
  const auto integration = TimeIntegration::make(equations_, options, all);
  const auto report = integration->run({&arc, 1}, theta, derivatives);
  if (!report.ok) return Error{ErrorKind::not_converged, "the drop: " + report.sentence()};
  const auto state = [&](std::size_t i, int index) {
    return arc.states[i * m + static_cast<std::size_t>(index)];
  };
  out.stiff = effort.stiff || report.stiff;
  const int u = model_.observed(), v = equations_.velocity_of(u);
  for (std::size_t i = 0; i < h.t.size(); ++i) {
    h.stroke.push_back(state(i, u) - conditions_.extended);
    h.speed.push_back(state(i, v));
    out.fastest = std::max(out.fastest, std::fabs(h.speed.back()));
    if (!has_tyre()) continue;
    h.travel.push_back(h.stroke.back() + state(i, tyre_));
    h.travel_speed.push_back(h.speed.back() + state(i, equations_.velocity_of(tyre_)));
  }
  return Motion{std::move(arc.states), std::move(arc.sensitivities)};
}

Result<DropRun> DropTest::run(const std::vector<double>& theta, bool derivatives,
                              const Excitation& push, const DropEffort& effort) const {
  DropRun out;
  const auto motion = integrate(out, theta, derivatives, push, effort);
  if (!motion) return motion.error();
  loads(out, theta, motion->states, motion->sensitivities, push);
  if (auto good = read_off(out, theta); !good) return good.error();
  return out;
}

// Computes the load at all times in one batch: weight - lift - inertia of the first equation.
void DropTest::loads(DropRun& out, const std::vector<double>& theta,
                     const std::vector<double>& states, const std::vector<double>& sensitivities,
                     const Excitation& push) const {
  const auto m = static_cast<std::size_t>(equations_.states());
  const auto p = static_cast<std::size_t>(model_.parameter_count());
  const std::size_t n = out.history.t.size(), stride = (n + 7) / 8 * 8;
  const bool derivatives = !sensitivities.empty();
  AlignedVector numbers(stride * (2 * m + (derivatives ? m * m + m * p : 0) + 1), 0.0);
  std::vector<double*> s, rate, h_s, h_theta;
  double* at = numbers.data();
  const auto take = [&](std::vector<double*>& arrays, std::size_t count) {
    for (std::size_t i = 0; i < count; ++i, at += stride)
      arrays.push_back(at);
  };
  take(s, m);
  take(rate, m);
  if (derivatives) {
    take(h_s, m * m);
    take(h_theta, m * p);
  }
  double* x = at;
  for (std::size_t i = 0; i < n; ++i) {
    x[i] = push.value(out.history.t[i]);
    for (std::size_t j = 0; j < m; ++j)
      s[j][i] = states[i * m + j];
  }
  StateEquations::Workspace work;
  equations_.rates(static_cast<int>(n), s.data(), x, theta.data(), work, rate.data(),
                   derivatives ? h_s.data() : nullptr, derivatives ? h_theta.data() : nullptr);
  if (derivatives) {
    out.stroke_derivatives.assign(n * p, 0.0);
    out.load_derivatives.assign(n * p, 0.0);
  }
  const std::size_t columns = m + p;
  for (std::size_t i = 0; i < n; ++i) {
    double load = weight_ - lift_;
    for (int e = 0; e < model_.coordinates(); ++e) {
      const int v = equations_.velocity_of(e);
      const double mass = mass_[static_cast<std::size_t>(e)];
      if (v < 0 || mass == 0.0) continue;
      const auto row = static_cast<std::size_t>(v);
      load -= mass * rate[row][i];
      for (std::size_t k = 0; derivatives && k < p; ++k) {
        double slope = h_theta[row * p + k][i];
        for (std::size_t j = 0; j < m; ++j)
          slope += h_s[row * m + j][i] * sensitivities[(i * m + j) * columns + m + k];
        out.load_derivatives[i * p + k] -= mass * slope;
      }
    }
    out.history.load.push_back(load);
    if (has_tyre()) {
      const auto tyre = static_cast<std::size_t>(equations_.velocity_of(tyre_));
      out.history.ground_load.push_back(load + unsprung_weight(theta) -
                                        unsprung_mass(theta) * rate[tyre][i]);
    }
    for (std::size_t k = 0; derivatives && k < p; ++k)
      out.stroke_derivatives[i * p + k] =
          sensitivities[(i * m + static_cast<std::size_t>(model_.observed())) * columns + m + k];
  }
}

}  // namespace shaker::estimator
