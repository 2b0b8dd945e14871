// Polytope (Nelder and Mead 1965) of NLopt, which keeps the box (Box 1965). An inadmissible vertex
// has the value infinity. The method restarts at its end until this gives no further decrease,
// because a polytope can collapse short of the minimum.
#include <algorithm>
#include <cmath>
#include <limits>
#include <nlopt.hpp>

#include "estimator/paper/optimisers/internal/scaled.hpp"
#include "estimator/paper/optimisers/methods.hpp"

namespace shaker::estimator::optimisers {
namespace {

constexpr int kRounds = 8;
constexpr double kFirstEdge = 0.1;  // of a parameter

double objective(const std::vector<double>& x, std::vector<double>&, void* data) {
  auto& scaled = *static_cast<Scaled*>(data);
  if (!scaled.at(x.data(), false)) return std::numeric_limits<double>::infinity();
  return scaled.here().phi / scaled.phi_unit();
}

}  // namespace

Summary polytope(LeastSquaresProblem& problem, const Eigen::VectorXd& start,
                 const Options& options) {
  constexpr const char* kName = "polytope";
  Evaluator evaluator(problem, options);
  Point point;
  point.theta = start;
  if (!evaluator.at(point, false)) return evaluator.finish(kName, Status::inadmissible, point);
  Scaled scaled(evaluator, point);
  const auto size = static_cast<unsigned>(problem.parameters());
  const auto plain = [](const Eigen::VectorXd& v) {
    return std::vector<double>(v.data(), v.data() + v.size());
  };
  nlopt::opt solver(nlopt::LN_NELDERMEAD, size);
  solver.set_min_objective(objective, &scaled);
  solver.set_lower_bounds(plain(scaled.to(problem.lower())));
  solver.set_upper_bounds(plain(scaled.to(problem.upper())));
  solver.set_xtol_rel(0.1 * options.step_tolerance);
  for (int round = 0; round < kRounds && !evaluator.exhausted(); ++round) {
    const double before = scaled.best().phi;
    std::vector<double> x = plain(scaled.to(scaled.best().theta));
    std::vector<double> edge;
    for (const double value : x)
      edge.push_back(kFirstEdge * std::max(std::fabs(value), 1e-3));
    solver.set_initial_step(edge);
    solver.set_maxeval(std::max(1, options.max_evaluations - evaluator.summary().evaluations));
    double value = 0.0;
    try {
      solver.optimize(x, value);
    } catch (const nlopt::roundoff_limited&) {  // limit of double precision; the best point is kept
    }
    ++evaluator.summary().iterations;
    if (round > 0 && before - scaled.best().phi <= 1e-12 * before) break;
  }
  return judge(kName, scaled, false);
}

}  // namespace shaker::estimator::optimisers
