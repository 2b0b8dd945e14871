#include "estimator/diagnosis/noise/internal/moved_run.hpp"

#include <array>
#include <string>
#include <vector>

#include "estimator/diagnosis/fit/internal/model_of_run.hpp"
#include "estimator/diagnosis/fit/internal/smoothing.hpp"
#include "estimator/diagnosis/score/internal/scoring.hpp"

namespace shaker::estimator::diagnosis {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

int parameter_of(const Model& model, const std::string& effect, const std::string& symbol) {
  for (int k = 0; k < model.parameter_count(); ++k) {
    const ModelParameter& p = model.parameters()[static_cast<std::size_t>(k)];
    if (p.effect == effect && p.symbol == symbol) return k;
  }
  return -1;
}

std::optional<MovedRun> moved_run(const HarmonicFit& fit, const RunDatum& datum, std::size_t r,
                                  const RunConstantValues& constants) {
  config::EffectSpec force;
  force.effect = "constant_force";
  force.formula = "k0";
  force.parameters["k0"].start = 0.0;
  // In a model of several coordinates the force would have to say where it acts.
  const bool pushes = fit.spec.coordinates.size() <= 1;
  const config::ModelSpec spec = pushes ? with_line(fit.spec, force) : fit.spec;
  RunDatum run = datum;
  run.to_limit.reset();                               // it is of the model without the force
  run.budget = std::make_shared<EvaluationBudget>();  // a fixed amount of work
  const int points = fit.predictions[r].points();
  const auto model = fit.rounded ? rounded_model(spec, run, points) : model_of_run(spec, run);
  const std::vector<double> same = carried_over(*model, fit);
  const std::array<int, kRunConstants> places = {-1, parameter_of(*model, "constant_force", "k0"),
                                                 parameter_of(*model, "gas_spring", "theta2"),
                                                 parameter_of(*model, "viscous_damping", "c")};
  std::vector<double> moved = same;
  for (std::size_t k = 1; k < places.size(); ++k) {
    if (places[k] < 0) continue;
    double& value = moved[static_cast<std::size_t>(places[k])];
    const double by = constants[static_cast<Index>(k)];
    value = k == 1 ? by : value * (1.0 + by);
  }
  Prediction prediction(*model, run, points);
  prediction.start_from(fit.predictions[r]);
  if (!prediction.at(same, HowFar::patient)) return std::nullopt;
  const VectorXd before = prediction.value();
  if (!prediction.at(moved, HowFar::patient)) return std::nullopt;
  MovedRun out;
  out.influence = MatrixXd::Zero(before.size(), kRunConstants);
  if (datum.quantity == Quantity::displacement) out.influence(0, 0) = 1.0;
  for (std::size_t k = 1; k < places.size(); ++k) {
    if (places[k] < 0) continue;
    const double unit = k == 1 ? 1.0 : same[static_cast<std::size_t>(places[k])];
    out.influence.col(static_cast<Index>(k)) = unit * prediction.jacobian().col(places[k]);
  }
  VectorXd along = constants;
  along[0] = 0.0;  // a zero is a straight line
  out.bend = prediction.value() - before - out.influence * along;
  return out;
}

}  // namespace shaker::estimator::diagnosis
