#include "estimator/paper/optimisers/methods.hpp"

namespace shaker::estimator::optimisers {
namespace {

constexpr Method kMethods[] = {
    {"newton", "(4.5)", "own", "exact second derivatives", newton},
    {"newton_differences", "(4.5)", "own", "J; Hessian from differences of the gradient",
     newton_differences},
    {"bfgs", "ch. 4", "Ceres", "gradient", bfgs},
    {"conjugate_gradients", "ch. 4", "Ceres", "gradient", conjugate_gradients},
    {"polytope", "ch. 4", "NLopt", "none", polytope},
    {"gauss_newton", "(4.7)", "own", "J", gauss_newton},
    {"gauss_newton_search", "(4.7)", "own", "J", gauss_newton_search},
    {"gauss_newton_relaxed", "(4.7)", "own", "J", gauss_newton_relaxed},
    {"levenberg_marquardt", "(4.8)", "own", "J", levenberg_marquardt},
    {"trust_region", "(4.9)", "own", "J", trust_region},
    {"modified_gauss_newton", "(4.10)-(4.18)", "own", "J; Q along some directions",
     modified_gauss_newton},
    {"variable_projection", "-", "own", "J", variable_projection},
    {"automatic", "(4.8), (4.10)-(4.18)", "own", "J", automatic},
};

}  // namespace

std::span<const Method> methods() {
  return kMethods;
}

const Method* find_method(std::string_view name) {
  for (const Method& method : kMethods) {
    if (method.name == name) return &method;
  }
  return nullptr;
}

}  // namespace shaker::estimator::optimisers
