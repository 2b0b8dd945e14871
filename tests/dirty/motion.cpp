#include "tests/dirty/motion.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace shaker::dirty {
namespace {

constexpr double kTwoPi = 2.0 * std::numbers::pi;

double number(const Effects& effects, const std::string& effect, const std::string& parameter,
              double otherwise) {
  const auto found = effects.find(effect);
  return found == effects.end() ? otherwise : found->second.at(parameter);
}

// The table, as recorded and as it really moves.
class Table {
 public:
  Table(const Run& run, const Effects& effects)
      : run_(run),
        gain_(number(effects, "exciter_gain", "G", 1.0)),
        late_(number(effects, "exciter_phase", "phi", 0.0)) {
    if (!effects.contains("exciter_distortion")) return;
    for (int h = 2; h <= 5; ++h) {
      cosine_[h] = number(effects, "exciter_distortion", "a" + std::to_string(h), 0.0);
      sine_[h] = number(effects, "exciter_distortion", "b" + std::to_string(h), 0.0);
    }
  }

  double recorded(double t) const {
    return run_.excited() ? run_.amplitude * std::cos(angle(t)) : 0.0;
  }
  double real(double t) const {
    if (!run_.excited()) return 0.0;
    const double at = angle(t) - late_;
    double shape = std::cos(at);
    for (int h = 2; h <= 5; ++h)
      if (cosine_[h] != 0.0) shape += cosine_[h] * std::cos(h * at) + sine_[h] * std::sin(h * at);
    return gain_ * run_.amplitude * shape;
  }

 private:
  double angle(double t) const {
    double cycles = run_.frequency * t;
    if (run_.drive == Drive::kSweep)
      cycles += 0.5 * (run_.to_frequency - run_.frequency) / run_.duration * t * t;
    return kTwoPi * cycles + run_.phase;
  }

  const Run& run_;
  double gain_;
  double late_;
  double cosine_[6] = {};
  double sine_[6] = {};
};

// `a` plus `h` times `b`.
State moved_by(const State& a, double h, const State& b) {
  State sum;
  for (std::size_t i = 0; i < kStates; ++i)
    sum[i] = a[i] + h * b[i];
  return sum;
}

// One step of order 4 of state' = f(t, state).
template <class Rate>
State runge_kutta(const Rate& f, double t, double h, const State& s) {
  const State k1 = f(t, s);
  const State k2 = f(t + 0.5 * h, moved_by(s, 0.5 * h, k1));
  const State k3 = f(t + 0.5 * h, moved_by(s, 0.5 * h, k2));
  const State k4 = f(t + h, moved_by(s, h, k3));
  State next;
  for (std::size_t i = 0; i < kStates; ++i)
    next[i] = s[i] + h / 6.0 * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]);
  return next;
}

// A damper that is free to move under the table.
class FreeMotion {
 public:
  FreeMotion(const Device& device, const Table& table, const RunChange& change, const State& start)
      : device_(device), table_(table), change_(change), s_(start) {}

  // From t to t + h.
  void advance(double t, double h) {
    if (!device_.has_dry_friction()) {
      s_ = step(t, h);
      return;
    }
    for (int turns = 0; h > 0.0 && turns < 20; ++turns) {
      if (direction_ == 0.0) direction_ = released(t);
      const State next = step(t, h);
      if (direction_ * next[kVelocity] >= 0.0) {
        s_ = next;
        return;
      }
      const double part = to_standstill(t, h);
      s_ = step(t, part);
      s_[kVelocity] = 0.0;
      t += part;
      h -= part;
      direction_ = 0.0;
    }
  }
  const State& state() const { return s_; }
  // Load of the damper, m/s^2.
  double load(double t) const {
    State rate;
    return device_.force(s_, change_, rate) + friction(t, s_);
  }

 private:
  // The dry force that acts: of its direction, or what holds.
  double friction(double t, const State& s) const {
    if (!device_.has_dry_friction()) return 0.0;
    const DryFriction dry = device_.dry(s, change_);
    if (direction_ != 0.0) return direction_ * dry.slipping;
    State rate;
    const double needed =
        device_.acceleration(s, table_.real(t), 0.0, change_, rate) / device_.mobility();
    return std::clamp(needed, -dry.holding, dry.holding);
  }
  // The direction in which a damper at standstill starts, or 0.
  double released(double t) const {
    State rate;
    const double needed =
        device_.acceleration(s_, table_.real(t), 0.0, change_, rate) / device_.mobility();
    const double holding = device_.dry(s_, change_).holding;
    return std::abs(needed) <= holding ? 0.0 : std::copysign(1.0, needed);
  }
  State step(double t, double h) const {
    const auto rate_of = [&](double at, const State& s) {
      State rate;
      device_.acceleration(s, table_.real(at), friction(at, s), change_, rate);
      if (device_.has_dry_friction() && direction_ == 0.0) rate[kStroke] = rate[kVelocity] = 0.0;
      return rate;
    };
    return runge_kutta(rate_of, t, h, s_);
  }
  // How much of the step passes before the velocity is 0.
  double to_standstill(double t, double h) const {
    double low = 0.0, high = h;
    for (int i = 0; i < 40; ++i) {
      const double middle = 0.5 * (low + high);
      (direction_ * step(t, middle)[kVelocity] >= 0.0 ? low : high) = middle;
    }
    return 0.5 * (low + high);
  }

  const Device& device_;
  const Table& table_;
  const RunChange& change_;
  State s_;
  double direction_ = 0.0;
};

int steps_between(const Effects& effects, double step) {
  const bool stiff = effects.contains("oil_compressibility") || effects.contains("free_play");
  return static_cast<int>(std::ceil(step / (stiff ? 5e-5 : 4e-4)));
}

Channels free_run(const Device& device, const Effects& effects, const Run& run) {
  const Table table(run, effects);
  State start = device.at_rest(run.excited() ? device.rest() : run.start_stroke);
  start[kVelocity] = run.start_velocity;
  if (run.drive == Drive::kDrop) start[kTyre] = 0.0;
  FreeMotion motion(device, table, run.change, start);
  const int steps = steps_between(effects, run.step);
  const double h = run.step / steps;
  const double delay = number(effects, "sensor_delay", "d", 0.0);
  double t = -run.settle - delay;
  const auto settling = static_cast<long>(run.settle / h);
  for (long i = 0; i < settling; ++i)
    motion.advance(-delay - static_cast<double>(settling - i) * h, h);
  Channels channels;
  const auto count = static_cast<long>(run.duration / run.step);
  for (long k = 0; k < count; ++k) {
    const double shown_at = static_cast<double>(k) * run.step;
    t = shown_at - delay;
    channels.time.push_back(shown_at);
    if (run.excited()) channels.input.push_back(table.recorded(shown_at));
    channels.response.push_back(device.shown(motion.state(), motion.load(t), shown_at, run.change));
    for (int i = 0; i < steps; ++i)
      motion.advance(t + i * h, h);
  }
  return channels;
}

Channels imposed_run(const Device& device, const Effects& effects, const Run& run) {
  const double omega = kTwoPi * run.frequency;
  const auto driven = [&](double t, State s) {
    s[kStroke] = run.start_stroke + run.amplitude * std::sin(omega * t + run.phase);
    s[kVelocity] = run.amplitude * omega * std::cos(omega * t + run.phase);
    return s;
  };
  const auto rate_of = [&](double t, const State& s) {
    State rate;
    device.force(driven(t, s), run.change, rate);
    return rate;
  };
  State s = device.at_rest(run.start_stroke);
  const int steps = steps_between(effects, run.step);
  const double h = run.step / steps;
  const auto settling = static_cast<long>(run.settle / run.step);
  const auto count = static_cast<long>(run.duration / run.step);
  Channels channels;
  for (long k = -settling; k < count; ++k) {
    const double t = static_cast<double>(k) * run.step;
    if (k >= 0) {
      const State now = driven(t, s);
      State rate;
      const double a = -omega * omega * (now[kStroke] - run.start_stroke);
      channels.time.push_back(t);
      channels.input.push_back(now[kStroke]);
      channels.response.push_back(
          device.force(now, run.change, rate) + device.added_mass() * a + run.change.zero +
          std::copysign(device.dry(now, run.change).slipping, now[kVelocity]));
    }
    for (int i = 0; i < steps; ++i)
      s = runge_kutta(rate_of, t + i * h, h, s);
  }
  return channels;
}

}  // namespace

Channels moved(const Device& device, const Effects& effects, const Run& run) {
  return run.drive == Drive::kImposed ? imposed_run(device, effects, run)
                                      : free_run(device, effects, run);
}

}  // namespace shaker::dirty
