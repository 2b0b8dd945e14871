// Reads the figures of a drop from its curves.
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string_view>

#include <fmt/format.h>

#include "estimator/drop/drop.hpp"
#include "estimator/drop/internal/drop_curves.hpp"

namespace shaker::estimator {
namespace {

constexpr double kNoFigure = std::numeric_limits<double>::quiet_NaN();

// The figures of a gear with a tyre, in the order of kDropFigures; without one, the descent is the
// stroke.
std::vector<double> gear_figures(const DropHistory& h, double stroke) {
  if (h.travel.empty()) return {stroke, kNoFigure, kNoFigure, kNoFigure};
  const CurvePlace lowest = deepest_turn(h.t, h.travel, h.travel_speed);
  if (lowest.before >= h.t.size()) return {kNoFigure, kNoFigure, kNoFigure, kNoFigure};
  const double travel = value_at(h.t, h.travel, h.travel_speed, lowest);
  std::vector<double> tyre, tyre_speed;
  for (std::size_t i = 0; i < h.t.size(); ++i) {
    tyre.push_back(h.travel[i] - h.stroke[i]);
    tyre_speed.push_back(h.travel_speed[i] - h.speed[i]);
  }
  const double ground = top_of(h.t, h.ground_load).value;
  const std::size_t end = lowest.before + 1;
  const double absorbed = work_between(h.t, h.load, h.speed, 0, end) +
                          work_between(h.t, h.ground_load, tyre_speed, 0, end);
  return {travel, top_of(h.t, tyre).value, ground, absorbed / (ground * travel)};
}

// The parameter `symbol` of an effect, over the effect's part in the stroke; nothing where the effect
// sees more than the stroke.
std::optional<double> stroke_parameter(const Model& model, const Model::Term& term,
                                       const std::vector<double>& theta, std::string_view symbol) {
  for (int e = 0; e < model.coordinates(); ++e) {
    const bool seen = term.sees[static_cast<std::size_t>(e)] != 0.0;
    if (seen != (e == model.observed())) return std::nullopt;
  }
  const auto own = term.effect->parameters();
  for (std::size_t k = 0; k < own.size(); ++k) {
    if (own[k].symbol == symbol) return theta[static_cast<std::size_t>(term.first_parameter) + k];
  }
  return std::nullopt;
}

}  // namespace

double end_of_rebound(const DropHistory& h) {
  const auto deepest = std::max_element(h.stroke.begin(), h.stroke.end()) - h.stroke.begin();
  bool back = false;
  for (auto i = static_cast<std::size_t>(deepest); i < h.t.size(); ++i) {
    back = back || h.speed[i] < 0.0;
    if (back && h.speed[i] >= 0.0) return h.t[i];
  }
  return h.t.back();
}

StrokeEnd DropTest::stroke_end(const std::vector<double>& theta) const {
  StrokeEnd end;
  const auto bound_by = [&](double stroke, StrokeEnd::By by) {
    if (stroke < end.stroke) end = {stroke, by};
  };
  bound_by(conditions_.stroke_limit, StrokeEnd::By::stated_limit);
  for (const Model::Term& term : model_.terms()) {
    const auto share = term.sees[static_cast<std::size_t>(model_.observed())];
    if (term.effect->name() == "end_stop") {
      const auto met = stroke_parameter(model_, term, theta, "u_s");
      const auto stiffness = stroke_parameter(model_, term, theta, "k");
      if (met && *stiffness > 0.0)
        bound_by(*met / share - conditions_.extended, StrokeEnd::By::end_stop);
    }
    if (term.effect->name() != "gas_spring") continue;
    if (const auto theta3 = stroke_parameter(model_, term, theta, "theta3"))
      bound_by(1.0 / (*theta3 * share) - conditions_.extended, StrokeEnd::By::gas);
  }
  return end;
}

Result<PeakLoad> DropTest::peak_load(const std::vector<double>& theta) const {
  const auto run = this->run(theta, true);
  if (!run) return run.error();
  const auto& load = run->history.load;
  const auto peak = std::max_element(load.begin(), load.end()) - load.begin();
  const auto count = static_cast<std::ptrdiff_t>(theta.size());
  const auto first = run->load_derivatives.begin() + peak * count;
  return PeakLoad{load[static_cast<std::size_t>(peak)], {first, first + count}};
}

// Reversals of the stroke are interpolated between the times of the history.
Result<void> DropTest::read_off(DropRun& run, const std::vector<double>& theta) const {
  const DropHistory& h = run.history;
  const std::size_t n = h.t.size();
  const CurvePlace peak = deepest_turn(h.t, h.stroke, h.speed);
  if (peak.before == n)
    return Error{
        ErrorKind::not_converged,
        fmt::format("the drop does not turn: after {:g} s the stroke is {:.4g} {} and still "
                    "grows by {:.3g} {}/s; check that the model has a spring that stops it, "
                    "its start values and units, or give a longer duration (--duration)",
                    conditions_.duration, h.stroke.back(), model_.length_unit(), h.speed.back(),
                    model_.length_unit())};
  const CurvePlace rebound = turn_after(h.speed, peak.before + 1, -1.0);
  const bool rebounds = rebound.before < n;
  const std::size_t last = rebounds ? rebound.before + 1 : n - 1;
  const CurveTop blow = top_of(h.t, h.load);
  const double stroke = value_at(h.t, h.stroke, h.speed, peak);
  const double absorbed = work_between(h.t, h.load, h.speed, 0, peak.before + 1);
  const double returned = -work_between(h.t, h.load, h.speed, peak.before + 1, last);
  const auto out_begin = h.speed.begin() + static_cast<std::ptrdiff_t>(peak.before) + 1;
  const auto out_end = h.speed.begin() + static_cast<std::ptrdiff_t>(last) + 1;
  run.figures = {stroke,
                 peak.time(h.t),
                 blow.value - (weight_ - lift_),
                 blow.value,
                 peak.of(h.load),
                 rebounds ? value_at(h.t, h.stroke, h.speed, rebound) : kNoFigure,
                 -*std::min_element(out_begin, out_end),
                 absorbed,
                 absorbed - returned,
                 absorbed / (blow.value * stroke),
                 blow.time};
  for (const double figure : gear_figures(h, stroke))
    run.figures.push_back(figure);
  const double margin = stroke_end(theta).stroke - stroke;
  run.figures.push_back(std::isfinite(margin) ? margin : kNoFigure);
  return {};
}

}  // namespace shaker::estimator
