#include "estimator/solve/time/integration.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <fmt/format.h>

#include "estimator/solve/time/integrators.hpp"

namespace shaker::estimator {
namespace {

// Relative step of a central difference. Its error is step^2 from the curvature plus the error of
// the trajectory divided by the step; 1e-4 of a parameter balances them at 1e-10.
constexpr double kDifference = 1e-4;
constexpr double kDifferenceOfZero = 1e-5;

class Differences final : public TimeIntegration {
 public:
  Differences(const StateEquations& equations, std::unique_ptr<TimeIntegration> inner,
              std::vector<int> free)
      : TimeIntegration(equations),
        m_(static_cast<std::size_t>(equations.states())),
        inner_(std::move(inner)),
        free_(std::move(free)) {}

  IntegrationReport run(std::span<Arc> arcs, std::span<const double> theta,
                        bool sensitivities) override {
    if (sensitivities) {
      if (auto report = columns(arcs, theta); !report.ok) return report;
    }
    return inner_->run(arcs, theta, false);
  }

 private:
  static double step_of(double value) {
    return value != 0.0 ? kDifference * std::fabs(value) : kDifferenceOfZero;
  }

  IntegrationReport columns(std::span<Arc> arcs, std::span<const double> theta) {
    const std::size_t k = m_ + free_.size();
    for (Arc& arc : arcs)
      arc.sensitivities.assign(arc.times.size() * m_ * k, 0.0);
    std::vector<double> moved(theta.begin(), theta.end());
    for (std::size_t column = 0; column < k; ++column) {
      for (const double side : {1.0, -1.0}) {
        IntegrationReport report;
        if (column < m_) {
          std::vector<double> saved;
          for (Arc& arc : arcs) {
            saved.push_back(arc.start[column]);
            arc.start[column] += side * step_of(saved.back());
          }
          report = inner_->run(arcs, theta, false);
          for (std::size_t j = 0; j < arcs.size(); ++j) {
            arcs[j].start[column] = saved[j];
            if (report.ok) add(arcs[j], column, k, side * 0.5 / step_of(saved[j]));
          }
        } else {
          const auto at = static_cast<std::size_t>(free_[column - m_]);
          const double step = step_of(theta[at]);
          moved[at] = theta[at] + side * step;
          report = inner_->run(arcs, moved, false);
          moved[at] = theta[at];
          for (Arc& arc : arcs) {
            if (report.ok) add(arc, column, k, side * 0.5 / step);
          }
        }
        if (!report.ok) return report;
      }
    }
    IntegrationReport good;
    good.ok = true;
    return good;
  }

  void add(Arc& arc, std::size_t column, std::size_t k, double weight) const {
    for (std::size_t i = 0; i < arc.states.size(); ++i)
      arc.sensitivities[i * k + column] += weight * arc.states[i];
  }

  std::size_t m_;
  std::unique_ptr<TimeIntegration> inner_;
  std::vector<int> free_;
};

}  // namespace

std::string IntegrationReport::sentence() const {
  if (ok) return {};
  if (stopped) return fmt::format("the integration was stopped at t = {:.6g} s", reached);
  if (inadmissible)
    return fmt::format(
        "the motion leaves what the model admits (for a gas spring: the stroke reaches 1/theta3) "
        "at t = {:.6g} s",
        reached);
  return fmt::format(
      "the integration gave up at t = {:.6g} s: the model is too stiff there, or grows without "
      "bounds; try the integrator bdf",
      reached);
}

std::unique_ptr<TimeIntegration> make_differences(const StateEquations& equations,
                                                  std::unique_ptr<TimeIntegration> inner,
                                                  std::vector<int> free) {
  return std::make_unique<Differences>(equations, std::move(inner), std::move(free));
}

std::unique_ptr<TimeIntegration> TimeIntegration::make(const StateEquations& equations,
                                                       const TimeOptions& options,
                                                       std::vector<int> free) {
  if (!(options.relative_tolerance > 0.0) || !(options.absolute_tolerance > 0.0))
    throw std::invalid_argument("the tolerances of the integration must be above 0");
  if (!(options.step >= 0.0))
    throw std::invalid_argument(
        fmt::format("the step of the integration is {} s; it must be 0 or above", options.step));
  for (const int k : free) {
    if (k < 0 || k >= equations.parameters())
      throw std::invalid_argument(
          fmt::format("there is no parameter {}; the model has {}", k, equations.parameters()));
  }
  if (options.gradient == Gradient::finite_differences) {
    TimeOptions plain = options;
    plain.gradient = Gradient::sensitivities;
    return make_differences(equations, make(equations, plain, free), free);
  }
  if (options.integrator == Integrator::adams || options.integrator == Integrator::bdf)
    return make_cvodes(equations, options, std::move(free));
  if (options.gradient == Gradient::augmented_states)
    throw std::invalid_argument(
        "the augmented states (5.11) are there for CVODES only; choose adams or bdf");
  if (options.integrator == Integrator::sdirk4)
    return make_implicit_runge_kutta(equations, options, std::move(free));
  return make_runge_kutta(equations, options, std::move(free));
}

}  // namespace shaker::estimator
