// The methods of chapter 4, one file each, and their table.
//
// Each takes a problem and a start (problem.parameters() values) and returns its result and its
// cost (summary.hpp). A new method is one file, one declaration here and one row in methods.cpp:
// tests and `shakerctl compare` use the table. All respect the box and refuse inadmissible steps.
// They throw std::invalid_argument for contradictory bounds only.
#pragma once

#include <span>
#include <string_view>

#include "estimator/paper/optimisers/internal/problem.hpp"
#include "estimator/paper/optimisers/internal/summary.hpp"

namespace shaker::estimator::optimisers {

using Minimise = Summary (*)(LeastSquaresProblem& problem, const Eigen::VectorXd& start,
                             const Options& options);

struct Method {
  std::string_view name;
  std::string_view equation;  // in the paper
  std::string_view source;    // library, or "own"
  std::string_view needs;     // required derivatives
  Minimise minimise;
};

std::span<const Method> methods();
const Method* find_method(std::string_view name);  // nullptr when there is none

// Own code.
Summary newton(LeastSquaresProblem&, const Eigen::VectorXd& start, const Options&);
Summary newton_differences(LeastSquaresProblem&, const Eigen::VectorXd& start, const Options&);
Summary gauss_newton(LeastSquaresProblem&, const Eigen::VectorXd& start, const Options&);
Summary gauss_newton_search(LeastSquaresProblem&, const Eigen::VectorXd& start, const Options&);
Summary gauss_newton_relaxed(LeastSquaresProblem&, const Eigen::VectorXd& start, const Options&);
Summary levenberg_marquardt(LeastSquaresProblem&, const Eigen::VectorXd& start, const Options&);
Summary modified_gauss_newton(LeastSquaresProblem&, const Eigen::VectorXd& start, const Options&);
Summary trust_region(LeastSquaresProblem&, const Eigen::VectorXd& start, const Options&);
Summary variable_projection(LeastSquaresProblem&, const Eigen::VectorXd& start, const Options&);
// Ceres.
Summary bfgs(LeastSquaresProblem&, const Eigen::VectorXd& start, const Options&);
Summary conjugate_gradients(LeastSquaresProblem&, const Eigen::VectorXd& start, const Options&);
// NLopt.
Summary polytope(LeastSquaresProblem&, const Eigen::VectorXd& start, const Options&);
// Levenberg-Marquardt, followed by other methods where it fails; see automatic.cpp.
Summary automatic(LeastSquaresProblem&, const Eigen::VectorXd& start, const Options&);

}  // namespace shaker::estimator::optimisers
