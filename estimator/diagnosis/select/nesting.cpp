#include "estimator/diagnosis/select/internal/nesting.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace shaker::estimator::diagnosis {
namespace {

// The value of a parameter in the special case: an end of its range, or zero.
enum class Place { lower, upper, zero };
struct Special {
  std::string_view symbol;
  Place place;
};
constexpr double kRounding = 1e-9;  // of a value

struct Nesting {
  std::string_view richer, simpler;
  std::vector<Special> where;  // all of them
};

const std::vector<Nesting>& nestings() {
  static const std::vector<Nesting> all = {
      {"stribeck_friction", "coulomb_friction", {{"ratio", Place::lower}}},
      // A static peak as narrow as the smoothing width only makes the reversal sharper.
      {"stribeck_friction", "coulomb_friction", {{"v_s", Place::lower}}},
      {"bouc_wen_hysteresis", "presliding_friction", {{"gamma", Place::zero}, {"n", Place::lower}}},
      {"presliding_friction", "coulomb_friction", {{"z0", Place::lower}}},
      // Rigid oil with laminar flow below q_l damps by theta1 q_l v in addition.
      {"oil_compressibility", "viscous_damping", {{"k_o", Place::upper}}}};
  return all;
}

bool holds(std::string_view richer, std::string_view simpler) {
  for (std::string s = simpler_than(richer); !s.empty(); s = simpler_than(s)) {
    if (s == simpler) return true;
  }
  return false;
}

}  // namespace

std::string simpler_than(std::string_view effect) {
  const config::Driven name = config::driven(effect);
  for (const Nesting& n : nestings()) {
    if (n.richer == name.effect) return config::driven_name(n.simpler, name.input);
  }
  return {};
}

bool related(std::string_view a, std::string_view b) {
  return holds(a, b) || holds(b, a);
}

bool reduces(const HarmonicFit& fit, std::string_view effect) {
  const auto& parameters = fit.model->parameters();
  const auto stands = [&](const Special& special) {
    for (std::size_t k = parameters.size(); k-- > 0;) {
      const ModelParameter& p = parameters[k];
      if (p.effect != effect || p.symbol != special.symbol) continue;
      const double value = special.place == Place::zero    ? 0.0
                           : special.place == Place::lower ? p.lower
                                                           : p.upper;
      const double error = fit.standard_error(static_cast<int>(k));
      return std::fabs(fit.theta[k] - value) <= 2.0 * error + kRounding * std::fabs(value);
    }
    return false;
  };
  return std::any_of(nestings().begin(), nestings().end(), [&](const Nesting& n) {
    return n.richer == config::driven(effect).effect &&
           std::all_of(n.where.begin(), n.where.end(), stands);
  });
}

}  // namespace shaker::estimator::diagnosis
