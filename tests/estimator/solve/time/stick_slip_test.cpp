// Friction that jumps: against the closed form of each half swing, and differences of it.
#include <cmath>
#include <numbers>
#include <stdexcept>

#include <gtest/gtest.h>

#include "estimator/solve/time/integrators.hpp"
#include "tests/estimator/fixtures.hpp"

namespace shaker::estimator {
namespace {

constexpr double kStill = 1e-8;  // m/s

// u'' = -(c u' + k u + f sign(u')).
struct Oscillator {
  double u = 0.03, v = 0.01, c = 0.6, k = 100.0, f = 0.15;
};

config::ModelSpec model_of(const Oscillator& o) {
  config::ModelSpec spec = testing::linear_oscillator();
  spec.effects[0].parameters["c"].start = o.c;
  spec.effects[1].parameters["k"].start = o.k;
  config::EffectSpec friction;
  friction.effect = "coulomb_friction";
  friction.parameters["f_c"].start = o.f;
  friction.constants["e"] = 0.05 * kStill;
  spec.effects.push_back(friction);
  return spec;
}

// Half swing by half swing, each about its own place of rest, until the spring is weaker than the
// friction.
double closed_form(Oscillator o, double t) {
  const double g = 0.5 * o.c, w = std::sqrt(o.k - g * g);
  for (double now = 0.0;;) {
    double way = o.v > 0.0 ? 1.0 : -1.0;
    if (o.v == 0.0) {
      if (std::fabs(o.k * o.u) <= o.f) return o.u;
      way = o.u > 0.0 ? -1.0 : 1.0;
    }
    const double rest = -way * o.f / o.k, a = o.u - rest, b = (o.v + g * a) / w;
    // u' is proportional to p cos + q sin.
    const double p = b * w - g * a, q = -a * w - g * b;
    double angle = std::atan(-p / q);
    if (angle < 1e-9) angle += std::numbers::pi;
    const double end = angle / w, past = std::min(t - now, end);
    o.u = rest + std::exp(-g * past) * (a * std::cos(w * past) + b * std::sin(w * past));
    if (now + end >= t) return o.u;
    o.v = 0.0;
    now += end;
  }
}

struct Course {
  std::vector<double> times;
  Arc arc;
  IntegrationReport report;
};

Course integrated(const Oscillator& o, double step, double duration, const Excitation& excitation,
                  TimeOptions options = {}) {
  const Model model(model_of(o));
  const StateEquations equations(model);
  options.still = kStill;
  Course out;
  for (int i = 0; i <= std::lround(duration / step); ++i)
    out.times.push_back(i * step);
  out.arc.times = out.times;
  out.arc.excitation = &excitation;
  out.arc.start = {o.u, o.v};
  const auto integration = make_stick_slip(equations, options, {0, 1, 2});
  const auto theta = model.start();
  out.report = integration->run({&out.arc, 1}, theta, true);
  return out;
}

// Ends at rest, off its centre, after 15 half swings.
TEST(StickSlip, FollowsEachHalfSwingToRest) {
  const Oscillator o;
  for (const double step : {0.02, 0.01, 0.005}) {
    SCOPED_TRACE(step);
    const Course course = integrated(o, step, 5.0, {});
    ASSERT_TRUE(course.report.ok);
    const double within = 1e-6 * std::pow(step / 0.01, 3);
    for (std::size_t i = 0; i < course.times.size(); ++i)
      ASSERT_NEAR(course.arc.states[2 * i], closed_form(o, course.times[i]), within) << i;
    EXPECT_EQ(course.arc.states[2 * course.times.size() - 1], 0.0);  // it does not creep
    EXPECT_GT(std::fabs(course.arc.states[2 * course.times.size() - 2]), 1e-4);
  }
}

TEST(StickSlip, DerivativesGoThroughReversalsAndRest) {
  const Oscillator o;
  constexpr double kStep = 0.005;
  const Course course = integrated(o, kStep, 5.0, {});
  double Oscillator::*const numbers[] = {&Oscillator::u, &Oscillator::v, &Oscillator::c,
                                         &Oscillator::k, &Oscillator::f};
  const double by[] = {1e-6, 1e-5, 1e-5, 1e-3, 1e-6};
  for (std::size_t i = 0; i < course.times.size(); i += 7) {
    for (std::size_t c = 0; c < 5; ++c) {
      Oscillator more = o, less = o;
      more.*numbers[c] += by[c];
      less.*numbers[c] -= by[c];
      const double t = course.times[i];
      const double slope = (closed_form(more, t) - closed_form(less, t)) / (2.0 * by[c]);
      const double size = c == 0 ? 1.0 : c == 1 ? 0.1 : c == 4 ? 0.1 : c == 2 ? 0.01 : 1e-3;
      ASSERT_NEAR(course.arc.sensitivities[i * 10 + c], slope, 2e-3 * size) << c << " at " << t;
    }
  }
}

// A force that grows beyond the friction moves the mass from there on; the mass stays where it is
// before.
TEST(StickSlip, ComesLooseWhereTheForceExceedsTheFriction) {
  Oscillator o;
  o.u = o.v = 0.0;
  const std::vector<double> t = {0.0, 1.0}, x = {0.0, 0.3};  // 0.3 m/s^3
  const Excitation ramp = Excitation::sampled(t, x);
  const Course course = integrated(o, 0.02, 0.8, ramp);
  ASSERT_TRUE(course.report.ok);
  const double g = 0.5 * o.c, w = std::sqrt(o.k - g * g), rate = 0.3;
  for (std::size_t i = 0; i < course.times.size(); ++i) {
    const double past = course.times[i] - o.f / rate;
    double moved = 0.0;  // u'' + c u' + k u = rate past, from rest
    if (past > 0.0) {
      const double a = rate * o.c / (o.k * o.k), b = (g * a - rate / o.k) / w;
      moved = rate * past / o.k - a +
              std::exp(-g * past) * (a * std::cos(w * past) + b * std::sin(w * past));
    }
    ASSERT_NEAR(std::fabs(course.arc.states[2 * i]), moved, 1e-7) << course.times[i];
  }
}

TEST(StickSlip, EndsWhereItIsNotAfforded) {
  TimeOptions options;
  int asked = 0;
  options.afford = [&](double) { return ++asked < 50; };
  const Course course = integrated({}, 0.01, 5.0, {}, options);
  EXPECT_FALSE(course.report.ok);
  EXPECT_TRUE(course.report.stopped);
  EXPECT_FALSE(course.report.inadmissible);
}

TEST(StickSlip, RefusesWhatHasNoWayOrNoRest) {
  const Model model(model_of({}));
  const StateEquations equations(model);
  EXPECT_THROW(make_stick_slip(equations, {}, {}), std::invalid_argument);
}

}  // namespace
}  // namespace shaker::estimator
