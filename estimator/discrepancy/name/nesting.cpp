#include "estimator/discrepancy/name/nesting.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace shaker::estimator::discrepancy {
namespace {

struct Special {
  std::string_view symbol;
  double value;
};
struct Nesting {
  std::string_view richer, simpler;
  std::vector<Special> where;  // all of them
};

const std::vector<Nesting>& nestings() {
  static const std::vector<Nesting> all = {
      {"stribeck_friction", "coulomb_friction", {{"ratio", 1.0}}},
      {"bouc_wen_hysteresis", "presliding_friction", {{"gamma", 0.0}, {"n", 1.0}}},
      {"presliding_friction", "coulomb_friction", {{"z0", 5e-5}}},
      // Rigid oil that flows laminar below q_l damps by theta1 q_l v besides.
      {"oil_compressibility", "viscous_damping", {{"k_o", 1e6}}}};
  return all;
}

bool holds(std::string_view richer, std::string_view simpler) {
  for (std::string_view s = simpler_than(richer); !s.empty(); s = simpler_than(s)) {
    if (s == simpler) return true;
  }
  return false;
}

}  // namespace

std::string_view simpler_than(std::string_view effect) {
  for (const Nesting& n : nestings()) {
    if (n.richer == effect) return n.simpler;
  }
  return {};
}

bool related(std::string_view a, std::string_view b) {
  return holds(a, b) || holds(b, a);
}

bool reduces(const HarmonicFit& fit, std::string_view effect) {
  const auto found = std::find_if(nestings().begin(), nestings().end(),
                                  [&](const Nesting& n) { return n.richer == effect; });
  if (found == nestings().end()) return false;
  const auto& parameters = fit.model->parameters();
  return std::all_of(found->where.begin(), found->where.end(), [&](const Special& special) {
    for (std::size_t k = parameters.size(); k-- > 0;) {
      if (parameters[k].effect != effect || !parameters[k].name.ends_with(special.symbol)) continue;
      const double error = fit.standard_error(static_cast<int>(k));
      return std::fabs(fit.theta[k] - special.value) <= 2.0 * error + 1e-9;
    }
    return false;
  });
}

}  // namespace shaker::estimator::discrepancy
