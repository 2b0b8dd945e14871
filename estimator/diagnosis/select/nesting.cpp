#include "estimator/diagnosis/select/internal/nesting.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "estimator/diagnosis/score/internal/scoring.hpp"

namespace shaker::estimator::diagnosis {
namespace {

// The value of a parameter in the special case: an end of its range, zero or one.
enum class Place { lower, upper, zero, one };
struct Special {
  std::string_view symbol;
  Place place;
};
constexpr double kRounding = 1e-9;  // of a value

struct Nesting {
  std::string_view richer, simpler;
  std::vector<Special> where;  // all of them
  // A parameter that the two call differently; all others that they share have one name. Empty in
  // the richer one: it has none for that.
  std::string_view in_richer = {}, in_simpler = {};
};

const std::vector<Nesting>& nestings() {
  static const std::vector<Nesting> all = {
      {"stribeck_friction", "coulomb_friction", {{"ratio", Place::lower}}},
      // A static peak as narrow as the smoothing width only makes the reversal sharper.
      {"stribeck_friction", "coulomb_friction", {{"v_s", Place::lower}}},
      {"bouc_wen_hysteresis",
       "presliding_friction",
       {{"gamma", Place::zero}, {"n", Place::lower}},
       "f_h",
       "f_c"},
      {"presliding_friction", "coulomb_friction", {{"z0", Place::lower}}},
      {"pinched_friction", "coulomb_friction", {{"u_p", Place::lower}}},
      // A pinch where the motion never comes.
      {"pinched_friction", "coulomb_friction", {{"u_c", Place::lower}}},
      {"pinched_friction", "coulomb_friction", {{"u_c", Place::upper}}},
      {"power_damping", "viscous_damping", {{"alpha", Place::one}}, "c_p", "c"},
      {"power_damping", "coulomb_friction", {{"alpha", Place::lower}}, "", "f_c"},
      // Rigid oil with laminar flow below q_l damps by theta1 q_l v in addition.
      {"oil_compressibility", "viscous_damping", {{"k_o", Place::upper}}, "", "c"}};
  return all;
}

double value_of(const Special& special, const ModelParameter& p) {
  if (special.place == Place::zero) return 0.0;
  if (special.place == Place::one) return 1.0;
  return special.place == Place::lower ? p.lower : p.upper;
}

// The last parameter of that effect and symbol; null: none.
const double* value_of(const HarmonicFit& fit, std::string_view effect, std::string_view symbol) {
  const auto& parameters = fit.model->parameters();
  for (std::size_t k = parameters.size(); k-- > 0;) {
    if (parameters[k].effect == effect && parameters[k].symbol == symbol) return &fit.theta[k];
  }
  return nullptr;
}

bool holds(std::string_view richer, std::string_view simpler) {
  const auto special = simpler_than(richer);
  return std::any_of(special.begin(), special.end(),
                     [&](const std::string& s) { return s == simpler || holds(s, simpler); });
}

// True if what makes the effect richer stands within so many standard errors of the special case.
bool stands_within(double errors, const HarmonicFit& fit, std::string_view effect,
                   std::string_view simpler) {
  const auto stands = [&](const Special& special) {
    const auto& parameters = fit.model->parameters();
    for (std::size_t k = parameters.size(); k-- > 0;) {
      const ModelParameter& p = parameters[k];
      if (p.effect != effect || p.symbol != special.symbol) continue;
      const double value = value_of(special, p);
      const double near = errors > 0.0 ? errors * fit.standard_error(static_cast<int>(k)) : 0.0;
      return std::fabs(fit.theta[k] - value) <= near + kRounding * std::fabs(value);
    }
    return false;
  };
  return std::any_of(nestings().begin(), nestings().end(), [&](const Nesting& n) {
    return n.richer == config::driven(effect).effect &&
           n.simpler == config::driven(simpler).effect &&
           std::all_of(n.where.begin(), n.where.end(), stands);
  });
}

}  // namespace

std::vector<std::string> simpler_than(std::string_view effect) {
  const config::Driven name = config::driven(effect);
  std::vector<std::string> all;
  for (const Nesting& n : nestings()) {
    std::string simpler = config::driven_name(n.simpler, name.input);
    if (n.richer == name.effect && std::find(all.begin(), all.end(), simpler) == all.end())
      all.push_back(std::move(simpler));
  }
  return all;
}

std::vector<std::string> with_instead(std::vector<std::string> effects, const std::string& effect,
                                      const std::string& other) {
  std::replace(effects.begin(), effects.end(), effect, other);
  std::sort(effects.begin(), effects.end());
  return effects;
}

bool holds_all_of(std::string_view richer, std::string_view simpler) {
  const std::string_view from = config::driven(richer).effect, to = config::driven(simpler).effect;
  return std::any_of(nestings().begin(), nestings().end(), [&](const Nesting& n) {
    return n.richer == from && n.simpler == to && n.in_richer.empty() == n.in_simpler.empty();
  });
}

bool related(std::string_view a, std::string_view b) {
  return holds(a, b) || holds(b, a);
}

bool reduces(const HarmonicFit& fit, std::string_view effect, std::string_view simpler) {
  return stands_within(2.0, fit, effect, simpler);
}

bool is_special_case(const HarmonicFit& fit, std::string_view effect, std::string_view simpler) {
  return stands_within(0.0, fit, effect, simpler);
}

bool reduces(const HarmonicFit& fit, std::string_view effect) {
  const auto special = simpler_than(effect);
  return std::any_of(special.begin(), special.end(),
                     [&](const std::string& simpler) { return reduces(fit, effect, simpler); });
}

std::vector<double> carried_across(const Model& model, std::string_view effect,
                                   const HarmonicFit& fit, std::string_view other) {
  std::vector<double> theta = carried_over(model, fit);
  const std::string_view to = config::driven(effect).effect, from = config::driven(other).effect;
  for (const Nesting& n : nestings()) {
    const bool enriched = n.richer == to && n.simpler == from;
    if (!enriched && !(n.richer == from && n.simpler == to)) continue;
    const auto& mine = enriched ? n.in_richer : n.in_simpler;
    const auto& theirs = enriched ? n.in_simpler : n.in_richer;
    for (std::size_t k = 0; k < theta.size(); ++k) {
      const ModelParameter& p = model.parameters()[k];
      if (p.effect != effect) continue;
      const double* known = value_of(fit, other, p.symbol == mine ? theirs : p.symbol);
      if (known != nullptr) theta[k] = std::clamp(*known, p.lower, p.upper);
      for (const Special& special : n.where) {
        if (enriched && p.symbol == special.symbol) theta[k] = value_of(special, p);
      }
    }
    break;
  }
  return theta;
}

}  // namespace shaker::estimator::diagnosis
