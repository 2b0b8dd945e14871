#include "estimator/model/internal/model_builder.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <stdexcept>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "base/unit.hpp"
#include "estimator/model/effects/catalogue.hpp"
#include "estimator/model/effects/placed.hpp"
#include "estimator/model/effects/scaled.hpp"
#include "estimator/model/effects/tabulated_pin.hpp"
#include "estimator/model/formula/formula_effect.hpp"

namespace shaker::estimator {
namespace {

std::string known_effects() {
  std::vector<std::string_view> names;
  for (const Effect* effect : catalogue())
    names.push_back(effect->name());
  return fmt::format("{}", fmt::join(names, ", "));
}

// "1/m" becomes "1/ft" in a model whose length unit is the foot.
std::string relabel(std::string_view unit, const std::string& length) {
  std::string text(unit);
  if (length == "m") return text;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const bool alone =
        (i == 0 || !std::isalpha(static_cast<unsigned char>(text[i - 1]))) &&
        (i + 1 == text.size() || !std::isalpha(static_cast<unsigned char>(text[i + 1])));
    if (text[i] == 'm' && alone) {
      text.replace(i, 1, length);
      i += length.size() - 1;
    }
  }
  return text;
}

// The unit in which a model counts what has the dimension of `unit`.
std::string own_unit(const Unit& unit, const std::string& length) {
  switch (unit.dimension) {
    case Dimension::length:
      return length;
    case Dimension::speed:
      return length + "/s";
    case Dimension::acceleration:
      return length + "/s^2";
    default:
      return std::string(si_unit(unit.dimension));
  }
}

std::vector<double> one_or(const std::vector<double>& given, std::size_t size, double value) {
  return given.empty() && size == 1 ? std::vector<double>{value} : given;
}

// Adds a row and a column of zeros to a square matrix (row by row).
void grow(std::vector<double>& matrix, std::size_t size) {
  std::vector<double> grown((size + 1) * (size + 1), 0.0);
  for (std::size_t r = 0; r < size; ++r)
    std::copy_n(&matrix[r * size], size, &grown[r * (size + 1)]);
  matrix = std::move(grown);
}

}  // namespace

void ModelBuilder::reject(const std::string& why) const {
  throw std::invalid_argument(fmt::format(
      "{}: {}", spec_.origin.empty() ? "model '" + spec_.name + "'" : spec_.origin, why));
}

void ModelBuilder::build() {
  model_.name_ = spec_.name;
  model_.length_unit_ = spec_.length_unit;
  read_coordinates();
  if (spec_.effects.empty()) reject("/effects is empty: a model needs at least one effect");
  for (std::size_t i = 0; i < spec_.effects.size(); ++i)
    add_effect(spec_.effects[i], i);
  borrow();
  sort_by_lender();
  add_series_coordinate();
  add_internal_coordinates();
  finish();
}

void ModelBuilder::read_coordinates() {
  const std::size_t s = std::max<std::size_t>(1, spec_.coordinates.size());
  model_.mechanical_ = static_cast<int>(s);
  model_.coordinate_names_ = spec_.coordinates;
  if (spec_.coordinates.empty()) model_.coordinate_names_ = {"stroke"};
  model_.order_.assign(s, 2);
  model_.rest_.assign(s, 0.0);
  model_.mass_ = one_or(spec_.mass, s, 1.0);
  model_.excitation_ = one_or(spec_.excitation, s, 1.0);
  if (model_.mass_.size() != s * s)
    reject(
        fmt::format("/mass has {} numbers; {} coordinates need {}", model_.mass_.size(), s, s * s));
  if (model_.excitation_.size() != s)
    reject(fmt::format("/excitation has {} numbers; {} coordinates need one each",
                       model_.excitation_.size(), s));
  if (spec_.observed.empty()) return;
  const auto found = std::find(spec_.coordinates.begin(), spec_.coordinates.end(), spec_.observed);
  if (found == spec_.coordinates.end())
    reject(fmt::format("/observed '{}' is none of the coordinates: {}", spec_.observed,
                       fmt::join(spec_.coordinates, ", ")));
  model_.observed_ = static_cast<int>(found - spec_.coordinates.begin());
}

void ModelBuilder::add_effect(const config::EffectSpec& spec, std::size_t index) {
  const auto place = fmt::format("/effects/{}", index);
  const Effect* effect = spec.table             ? table_effect(spec, place)
                         : spec.formula.empty() ? find_effect(spec)
                                                : own_effect(spec, place);
  if (effect == nullptr)
    reject(fmt::format("{}: there is no effect '{}'; there are {}", place, spec.effect,
                       known_effects()));
  if (effect == &tabulated_pin())
    reject(fmt::format("{}: {} wants a \"table\" with the strokes of its {} to {} knots", place,
                       spec.effect, config::kFewestKnots, config::kMostKnots));
  if (spec.parameters.contains(kPlace) && has_place(*effect))
    effect = model_.own_effects_.emplace_back(make_placed(*effect)).get();
  if (spec.in_series && !effect->in_series())
    reject(fmt::format("{}/in_series: {} is no part in series; leave it out", place, spec.effect));
  Model::Term term;
  term.effect = effect;
  term.first_parameter = model_.parameter_count();
  place_in_coordinates(spec, place, term);
  add_constants(spec, place, term);
  add_parameters(spec, index, place, *effect);
  (effect->instrument() != nullptr ? model_.instruments_ : model_.terms_)
      .push_back(std::move(term));
}

const Effect* ModelBuilder::own_effect(const config::EffectSpec& spec, const std::string& place) {
  if (find_effect(spec.effect) != nullptr)
    reject(fmt::format("{}: the catalogue has an effect '{}'; give the formula another name", place,
                       spec.effect));
  try {
    return model_.own_effects_.emplace_back(make_formula_effect(spec)).get();
  } catch (const std::invalid_argument& error) {
    reject(fmt::format("{}/{}", place, error.what()));
  }
}

const Effect* ModelBuilder::table_effect(const config::EffectSpec& spec, const std::string& place) {
  if (spec.effect != tabulated_pin().name())
    reject(fmt::format("{}/table: it stands in the effect {} only", place, tabulated_pin().name()));
  return model_.own_effects_.emplace_back(make_tabulated_pin(*spec.table)).get();
}

// Sets which coordinates an effect sees and in which equations it acts. An instrument sees
// none. An effect of the exciter acts where the excitation does.
void ModelBuilder::place_in_coordinates(const config::EffectSpec& spec, const std::string& place,
                                        Model::Term& term) {
  const auto s = static_cast<std::size_t>(model_.mechanical_);
  if (term.effect->group() == Group::exciter || term.effect->instrument() != nullptr) {
    if (!spec.sees.empty() || !spec.acts.empty())
      reject(fmt::format("{}: {} belongs to the {}; it takes no 'sees' and 'acts'", place,
                         spec.effect,
                         term.effect->group() == Group::exciter ? "exciter" : "instrument"));
    term.sees.assign(s, 0.0);
    term.acts = model_.excitation_;
    return;
  }
  term.sees = one_or(spec.sees, s, 1.0);
  term.acts = one_or(spec.acts, s, 1.0);
  if (term.sees.size() != s || term.acts.size() != s)
    reject(fmt::format("{}: 'sees' and 'acts' need one number for each of the {} coordinates",
                       place, s));
}

void ModelBuilder::add_constants(const config::EffectSpec& spec, const std::string& place,
                                 Model::Term& term) {
  const auto constants = term.effect->constants();
  for (const ConstantInfo& stated : constants) {
    const ConstantInfo info = scaled(stated, spec.scale);
    const auto given = spec.constants.find(std::string(info.symbol));
    double value = given != spec.constants.end() ? given->second : info.value;
    if (info.symbol == "g" && given == spec.constants.end()) value = spec_.gravity;
    if (info.width && !(value > 0.0))
      reject(fmt::format("{}/constants/{}: {} is not allowed; it must be above 0", place,
                         info.symbol, value));
    term.constants.push_back(value);
  }
  for (const auto& given : spec.constants) {
    const std::string& symbol = given.first;
    if (std::none_of(constants.begin(), constants.end(),
                     [&](const ConstantInfo& c) { return c.symbol == symbol; }))
      reject(fmt::format("{}/constants: {} has no constant '{}'", place, spec.effect, symbol));
  }
}

void ModelBuilder::add_parameters(const config::EffectSpec& spec, std::size_t index,
                                  const std::string& place, const Effect& effect) {
  const auto known = effect.parameters();
  for (const auto& given : spec.parameters) {
    const std::string& symbol = given.first;
    if (std::any_of(known.begin(), known.end(),
                    [&](const ParameterInfo& p) { return p.symbol == symbol; }))
      continue;
    std::vector<std::string_view> names;
    for (const ParameterInfo& p : known)
      names.push_back(p.symbol);
    reject(fmt::format("{}/parameters: {} has no parameter '{}'; it has {}", place, spec.effect,
                       symbol, names.empty() ? "none" : fmt::format("{}", fmt::join(names, ", "))));
  }
  const std::string_view input = config::driven(spec.effect).input;
  bool driven = input.empty();
  for (const ParameterInfo& stated : known) {
    const auto given = spec.parameters.find(std::string(stated.symbol));
    const config::ParameterSpec empty;
    const config::ParameterSpec& said = given != spec.parameters.end() ? given->second : empty;
    const ParameterInfo info = with_start_inside(scaled(effect, stated, spec.scale), said);
    if (!said.unit.empty() && spec.formula.empty())
      reject(fmt::format("{}/parameters/{}/unit: {} has its unit, {}", place, info.symbol,
                         info.symbol, info.unit));
    check_formula_unit(said.unit, fmt::format("{}/parameters/{}/unit", place, info.symbol));
    ModelParameter p;
    p.line = index;
    p.symbol = std::string(info.symbol);
    const bool goes = !input.empty() && info.absent == 0.0;
    p.name = goes ? fmt::format("{}[{}]", p.symbol, input) : p.symbol;
    if (std::any_of(model_.parameters_.begin(), model_.parameters_.end(),
                    [&](const ModelParameter& other) { return other.name == p.name; }))
      p.name = fmt::format("{}[{}].{}", spec.effect, index, info.symbol);
    p.effect = spec.effect;
    p.unit = relabel(info.unit, model_.length_unit_);
    p.lower = said.lower.value_or(info.lower);
    p.upper = said.upper.value_or(info.upper);
    p.start = said.start.value_or(std::clamp(info.start, p.lower, p.upper));
    p.fixed = said.fixed;
    p.variation = said.variation;
    if (goes) p.variation = {"", std::string(input), spec.reference};
    driven = driven || goes;
    if (said.prior_mean && said.prior_standard_deviation) {
      p.prior_mean = said.prior_mean;
      p.prior_standard_deviation = said.prior_standard_deviation;
    } else if (info.spread > 0.0) {
      p.prior_mean = info.start;
      p.prior_standard_deviation = info.spread;
    }
    if (!(p.lower <= p.upper))
      reject(fmt::format("{}/parameters/{}: lower bound {} is above the upper bound {}", place,
                         info.symbol, p.lower, p.upper));
    if (!(p.start >= p.lower && p.start <= p.upper))
      reject(fmt::format("{}/parameters/{}/start: {} is outside its bounds [{}, {}]", place,
                         info.symbol, p.start, p.lower, p.upper));
    model_.parameters_.push_back(std::move(p));
  }
  if (!driven) reject(fmt::format("{}/input: {} has no coefficient", place, effect.name()));
}

// A formula's unit is a label: its numbers are not converted, so another unit is refused.
void ModelBuilder::check_formula_unit(const std::string& label, const std::string& place) const {
  const auto unit = unit_called(label);
  if (!unit) return;
  const std::string own = own_unit(*unit, model_.length_unit_);
  const auto there = conversion(label, own);
  if (!there || (std::fabs(there->scale - 1.0) < 1e-12 && there->offset == 0.0)) return;
  reject(
      fmt::format("{}: \"{}\" is a unit in which this model does not count, and the numbers of a "
                  "formula are not converted: give start, bounds and prior in {}",
                  place, label, own));
}

// The first effect of that name that sees the same motion lends, else the first of that name.
void ModelBuilder::borrow() {
  const auto lend = [&](Model::Term& term) {
    for (const Borrowed& want : term.effect->borrows()) {
      const Model::Term* lender = nullptr;
      for (const Model::Term& other : model_.terms_) {
        if (&other == &term || other.effect->name() != want.effect) continue;
        if (lender == nullptr || (lender->sees != term.sees && other.sees == term.sees))
          lender = &other;
      }
      if (lender == nullptr && std::isnan(want.otherwise))
        reject(fmt::format(
            "{} is stated in terms of {}'s {}, and this model has no {}; add that "
            "effect or leave {} out",
            term.effect->name(), want.effect, want.symbol, want.effect, term.effect->name()));
      int index = -1;
      if (lender != nullptr) {
        const auto known = lender->effect->parameters();
        const auto found = std::find_if(known.begin(), known.end(), [&](const ParameterInfo& p) {
          return p.symbol == want.symbol;
        });
        if (found == known.end())
          reject(fmt::format("{} is stated in terms of {}'s {}, which there is not",
                             term.effect->name(), want.effect, want.symbol));
        index = lender->first_parameter + static_cast<int>(found - known.begin());
        if (want.displaced) model_.parameters_[static_cast<std::size_t>(index)].fixed = true;
      }
      term.borrowed.push_back(index);
    }
  };
  for (Model::Term& term : model_.terms_)
    lend(term);
  for (Model::Term& term : model_.instruments_)
    lend(term);
}

// Sorts lenders before borrowers, because a borrower adds to columns that its lender sets.
void ModelBuilder::sort_by_lender() {
  std::vector<Model::Term> sorted;
  std::vector<char> ready(static_cast<std::size_t>(model_.parameter_count()), 0);
  auto& waiting = model_.terms_;
  while (!waiting.empty()) {
    const auto next = std::find_if(waiting.begin(), waiting.end(), [&](const Model::Term& term) {
      return std::all_of(term.borrowed.begin(), term.borrowed.end(),
                         [&](int k) { return k < 0 || ready[static_cast<std::size_t>(k)] != 0; });
    });
    if (next == waiting.end())
      reject(fmt::format("{} borrows from an effect that borrows from it",
                         waiting.front().effect->name()));
    for (std::size_t k = 0; k < next->effect->parameters().size(); ++k)
      ready[static_cast<std::size_t>(next->first_parameter) + k] = 1;
    sorted.push_back(std::move(*next));
    waiting.erase(next);
  }
  waiting = std::move(sorted);
}

// An effect in series (free play) separates the damper from the mass. Effects that carry load,
// saw the same motion and acted at the same place now see the damper's own stroke. This is a
// new coordinate, whose equation is the balance of loads on the massless joint.
void ModelBuilder::add_series_coordinate() {
  const auto is_series = [](const Model::Term& t) { return t.effect->in_series(); };
  const auto series = std::find_if(model_.terms_.begin(), model_.terms_.end(), is_series);
  if (series == model_.terms_.end()) return;
  if (std::count_if(model_.terms_.begin(), model_.terms_.end(), is_series) > 1)
    reject(fmt::format("{} occurs twice; a load path has one", series->effect->name()));
  const std::size_t s = model_.order_.size();
  grow(model_.mass_, s);
  model_.excitation_.push_back(0.0);
  model_.order_.push_back(1);
  model_.rest_.push_back(0.0);
  model_.coordinate_names_.push_back(std::string(series->effect->name()) + ".damper");
  model_.coordinate_in_series_ = static_cast<int>(s);
  const auto sees = series->sees, acts = series->acts;
  for (Model::Term& term : model_.terms_) {
    const bool carried =
        &term != &*series && term.effect->carries_load() && term.sees == sees && term.acts == acts;
    if (carried) {
      term.sees.assign(s, 0.0);
      term.acts.assign(s, 0.0);
    }
    term.sees.push_back(carried ? 1.0 : 0.0);
    term.acts.push_back(carried ? 1.0 : 0.0);
  }
  series->sees.back() = series->acts.back() = -1.0;
}

void ModelBuilder::add_internal_coordinates() {
  for (Model::Term& term : model_.terms_) {
    term.first_internal = model_.coordinates();
    for (const InternalInfo& info : term.effect->internals()) {
      grow(model_.mass_, model_.order_.size());
      model_.excitation_.push_back(0.0);
      model_.order_.push_back(info.order);
      model_.rest_.push_back(info.start);
      model_.coordinate_names_.push_back(fmt::format("{}.{}", term.effect->name(), info.symbol));
    }
  }
  for (Model::Term& term : model_.terms_) {
    term.sees.resize(model_.order_.size(), 0.0);
    term.acts.resize(model_.order_.size(), 0.0);
  }
}

void ModelBuilder::finish() {
  model_.plain_ = model_.coordinates() == 1;
  for (Model::Term& term : model_.terms_) {
    const Effect& effect = *term.effect;
    const bool exciter = effect.group() == Group::exciter;
    const int count = static_cast<int>(effect.parameters().size() + effect.borrows().size());
    if (count > kMostParameters || effect.internals().size() > kMostInternals)
      reject(fmt::format("{} has too many parameters or internal coordinates; at most {} and {}",
                         effect.name(), kMostParameters, kMostInternals));
    model_.most_parameters_ = std::max(model_.most_parameters_, count);
    model_.most_internals_ =
        std::max(model_.most_internals_, static_cast<int>(effect.internals().size()));
    if (exciter) {
      term.first_exciter_column = model_.exciter_parameters_;
      model_.exciter_parameters_ += count;
    }
    model_.needs_carrier_ = model_.needs_carrier_ || effect.needs_carrier();
    if (term.acts[0] != 1.0 || (!exciter && term.sees[0] != 1.0)) model_.plain_ = false;
  }
  for (const Model::Term& term : model_.terms_)
    model_.kinked_ = model_.kinked_ || (model_.plain_ && term.effect->has_velocity_kink());
  const int k = model_.most_internals_, p = model_.most_parameters_;
  model_.scratch_arrays_ = 9 + 7 * k + (1 + k) * p + model_.exciter_parameters_;
}

}  // namespace shaker::estimator
