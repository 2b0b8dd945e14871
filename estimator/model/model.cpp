#include "estimator/model/model.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/model/internal/model_builder.hpp"
#include "estimator/model/run_models.hpp"

namespace shaker::estimator {

Model::Model(const config::ModelSpec& spec) {
  ModelBuilder(*this, spec).build();
  if (has_run_values(spec)) *this = model_of_first_values(spec);
}

std::vector<double> Model::start() const {
  std::vector<double> theta;
  for (const ModelParameter& p : parameters_)
    theta.push_back(p.start);
  return theta;
}

void Model::Term::gather(const double* theta, double* local) const {
  const std::size_t count = effect->parameters().size();
  for (std::size_t k = 0; k < count; ++k)
    local[k] = factor(k) * theta[parameter(k)];
  for (std::size_t k = 0; k < borrowed.size(); ++k)
    local[count + k] =
        borrowed[k] >= 0 ? factor(count + k) * theta[borrowed[k]] : effect->borrows()[k].otherwise;
}

bool Model::evaluate(const ModelPoints& at, const double* theta, const ModelForces& out) const {
  return plain_ ? evaluate_plain(at, theta, out) : evaluate_general(at, theta, out);
}

bool Model::lanes_possible() const {
  return plain_ && !needs_carrier_ && instruments_.empty() && exciter_parameters_ == 0 &&
         std::all_of(terms_.begin(), terms_.end(), [](const Term& term) {
           return term.borrowed.empty() && term.own.empty() && !term.effect->sees_excitation();
         });
}

double Model::velocity_kink(const double* theta, double u) const {
  if (!plain_) return 0.0;
  double kink = 0.0;
  for (const Term& term : terms_) {
    if (term.borrowed.empty() && term.own.empty()) {
      kink += term.effect->velocity_kink(theta + term.first_parameter, term.constants.data(), u);
    } else {
      double local[kMostParameters];
      term.gather(theta, local);
      kink += term.effect->velocity_kink(local, term.constants.data(), u);
    }
  }
  return kink;
}

// Forward difference; it is exact for a jump that is linear in its coefficients.
void Model::velocity_kink_gradient(std::span<double> theta, double* gradient) const {
  const double kink = velocity_kink(theta.data());
  for (std::size_t k = 0; k < theta.size(); ++k) {
    const double was = theta[k];
    const double step = 1e-4 * std::max(std::fabs(was), 1e-8);
    theta[k] = was + step;
    gradient[k] = (velocity_kink(theta.data()) - kink) / step;
    theta[k] = was;
  }
}

}  // namespace shaker::estimator
