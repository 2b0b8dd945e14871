#include "sim/integrator.hpp"

#include <algorithm>
#include <cmath>

#include <boost/math/tools/toms748_solve.hpp>
#include <boost/numeric/odeint/algebra/array_algebra.hpp>
#include <boost/numeric/odeint/stepper/controlled_runge_kutta.hpp>
#include <boost/numeric/odeint/stepper/runge_kutta_dopri5.hpp>

namespace shaker::sim {
namespace {

namespace odeint = boost::numeric::odeint;
using Dopri5 = odeint::runge_kutta_dopri5<State>;
using ErrorChecker =
    odeint::default_error_checker<double, odeint::array_algebra, odeint::default_operations>;
using StepAdjuster = odeint::default_step_adjuster<double, double>;
using Controlled = odeint::controlled_runge_kutta<Dopri5, ErrorChecker, StepAdjuster>;

constexpr double kTolerance = 1e-12;
constexpr double kLongestStep = 0.01;
constexpr double kShortestStep = 1e-12;

struct System {
  const Plant* plant;
  const TableMotion* table;
  double direction;
  void operator()(const State& state, State& rate, double t) const {
    rate = plant->rate(state, direction, table->acceleration(t));
  }
};

bool finite(const State& state) {
  return std::ranges::all_of(state, [](double x) { return std::isfinite(x); });
}

// One step of fixed length.
State stepped(const System& system, const State& from, const State& rate, double t, double h) {
  State to{}, rate_there{};
  Dopri5 single;
  single.do_step(system, from, rate, t, to, rate_there, h);
  return to;
}

}  // namespace

struct Integrator::Impl {
  Impl(const Plant& p, const State& start, double at) : plant(p), state(start), t(at) {}

  // The table's acceleration minus the smooth forces, for a damper that does not move.
  double net(const State& s, double at, const TableMotion& table) const {
    return table.acceleration(at) - plant.balance(s, 0.0).force;
  }
  double hold(const State& s) const { return plant.balance(s, 0.0).friction; }

  void step(double until, const TableMotion& table);
  void choose_direction(const TableMotion& table);
  double locate(double h, const System& system) const;
  void cross(double h, double at, const System& system);
  void leave_at_once(double h, const System& system);
  void give_up(double until);

  const Plant& plant;
  State state;
  double t;
  double direction = 0.0;
  double h_next = 1e-3;
  bool rate_known = false;
  State rate{};
  bool bottomed = false;
  Controlled stepper{ErrorChecker(kTolerance, kTolerance), StepAdjuster(0.0)};
};

// At v = 0: decides in which direction the damper moves, or that friction holds it.
void Integrator::Impl::choose_direction(const TableMotion& table) {
  state[1] = 0.0;
  const double force = net(state, t, table);
  direction = std::abs(force) <= hold(state) ? 0.0 : std::copysign(1.0, force);
  rate_known = false;
}

// The part of the step h after which the present mode ends: the velocity vanishes, or the stuck
// damper breaks away.
double Integrator::Impl::locate(double h, const System& system) const {
  const auto event = [&](double part) {
    const State s = part > 0.0 ? stepped(system, state, rate, t, part) : state;
    if (direction != 0.0) return direction * s[1];
    return hold(s) - std::abs(net(s, t + part, *system.table));
  };
  const double low = event(0.0), high = event(h);
  if (!(low > 0.0)) return 0.0;
  if (!(high < 0.0)) return h;
  boost::uintmax_t iterations = 60;
  const auto bracket = boost::math::tools::toms748_solve(
      event, 0.0, h, low, high, boost::math::tools::eps_tolerance<double>(48), iterations);
  return bracket.second;
}

// Integrates to the end of the mode, `at` after the start of the step h, and starts the next
// mode.
void Integrator::Impl::cross(double h, double at, const System& system) {
  if (at <= 0.0) {
    leave_at_once(h, system);
    return;
  }
  const bool was_stuck = direction == 0.0;
  state = stepped(system, state, rate, t, at);
  t += at;
  choose_direction(*system.table);
  if (was_stuck && direction == 0.0) {  // breaks away within rounding
    direction = std::copysign(1.0, net(state, t, *system.table));
  }
}

// The mode ends where it began. A damper that can move in neither direction from v = 0 is held
// for the whole step.
void Integrator::Impl::leave_at_once(double h, const System& system) {
  rate_known = false;
  if (direction == 0.0) {
    direction = std::copysign(1.0, net(state, t + h, *system.table));
    return;
  }
  direction = -direction;
  const System back{&plant, system.table, direction};
  State back_rate{};
  back(state, back_rate, t);
  const State other = stepped(back, state, back_rate, t, h);
  if (direction * other[1] < 0.0) {
    state[1] = 0.0;
  } else {
    state = other;
  }
  t += h;
}

void Integrator::Impl::give_up(double until) {
  bottomed = true;
  state = plant.at_rest();
  direction = 0.0;
  rate_known = false;
  h_next = 1e-4;
  t = until;
}

void Integrator::Impl::step(double until, const TableMotion& table) {
  const System system{&plant, &table, direction};
  if (!rate_known) system(state, rate, t);
  rate_known = true;
  const double whole = std::min({h_next, until - t, kLongestStep});
  double h = whole, reached = t;
  State trial{}, trial_rate{};
  while (stepper.try_step(system, state, rate, reached, trial, trial_rate, h) == odeint::fail) {
    if (h < kShortestStep) break;
  }
  const double taken = reached - t;
  if (taken <= 0.0 || !finite(trial)) {
    give_up(until);
    return;
  }
  h_next = whole < h_next ? std::max(h_next, h) : h;
  const bool ends = direction != 0.0 ? direction * trial[1] < 0.0
                                     : std::abs(net(trial, reached, table)) > hold(trial);
  if (ends) {
    cross(taken, locate(taken, system), system);
    return;
  }
  state = trial;
  rate = trial_rate;
  t = reached;
}

Integrator::Integrator(const Plant& plant, const State& start, double t)
    : impl_(std::make_unique<Impl>(plant, start, t)) {
  if (start[1] != 0.0) impl_->direction = std::copysign(1.0, start[1]);
}
Integrator::~Integrator() = default;

void Integrator::advance(double until, const TableMotion& table) {
  auto& it = *impl_;
  while (until - it.t > kShortestStep) {
    it.step(until, table);
    const auto wall = it.plant.wall();
    if (wall && it.state[0] > *wall) {
      it.bottomed = true;
      it.state[0] = *wall;
      it.state[1] = 0.0;
      it.choose_direction(table);
    }
  }
  it.t = std::max(it.t, until);
}

void Integrator::table_changed() {
  impl_->rate_known = false;
}
const State& Integrator::state() const {
  return impl_->state;
}
double Integrator::time() const {
  return impl_->t;
}
double Integrator::acceleration(const TableMotion& table) const {
  const auto& it = *impl_;
  return it.plant.rate(it.state, it.direction, table.acceleration(it.t))[1];
}
bool Integrator::stuck() const {
  return impl_->direction == 0.0;
}
bool Integrator::take_bottomed() {
  return std::exchange(impl_->bottomed, false);
}

}  // namespace shaker::sim
