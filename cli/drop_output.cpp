#include "cli/drop_output.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>

#include <fmt/format.h>

#include "cli/drop_figures.hpp"
#include "cli/drop_picture.hpp"
#include "report/text_table.hpp"

namespace shaker::cli {

ComparisonWords figure_words(const std::string& length, const std::optional<double>& mass) {
  ComparisonWords words;
  for (std::size_t f = 0; f < estimator::kDropFigureCount; ++f) {
    words.label.push_back(figure_label(f, mass.has_value()));
    words.unit.push_back(figure_unit(f, length, mass.has_value()));
    words.scale.push_back(words.unit[f] == "N" || words.unit[f] == "J" ? mass.value_or(1.0) : 1.0);
  }
  return words;
}

namespace {

estimator::ServicingRange servicing_range(const std::vector<double>& ends, double otherwise,
                                          double offset = 0.0) {
  if (ends.size() != 2) return {otherwise, otherwise};
  return {ends[0] - offset, ends[1] - offset};
}

Result<void> find_envelope(const DropOptions& options, const PredictionOf& prediction,
                           DropSections& s) {
  estimator::ServicingRanges ranges;
  ranges.charge = servicing_range(options.charge, 1.0);
  ranges.oil = servicing_range(options.oil, 0.0);
  ranges.temperature = servicing_range(options.temperature, 0.0, s.setup.tested_temperature);
  ranges.tested_temperature = s.setup.kelvin();
  if (options.charge.size() < 2 && options.oil.size() < 2 && options.temperature.size() < 2)
    return {};
  auto envelope = estimator::servicing_envelope(
      prediction.model, s.setup.conditions, ranges,
      {figure_called("peak_load"), figure_called("peak_stroke"), figure_called("efficiency")});
  if (!envelope) return envelope.error();
  if (prediction.damper != nullptr)
    estimator::add_bands(*envelope, *prediction.damper, s.setup.conditions, ranges,
                         mixture_options(options));
  s.envelope = std::move(*envelope);
  return {};
}

void find_margin(const estimator::DropTest& test, const PredictedDrop& predicted,
                 const ProbabilityWithin& probability, DropSections& s) {
  constexpr double kUnbounded = std::numeric_limits<double>::infinity();
  const std::size_t figure = figure_called(kMarginFigure);
  s.stroke_end = test.stroke_end(test.model().start());
  s.bottoming.reset();
  if (s.stroke_end.by == estimator::StrokeEnd::By::nothing) return;
  const auto& margin = predicted.figures[figure];
  s.margin = margin.value;
  s.margin_lower = margin.lower;
  s.margin_upper = margin.upper;
  if (s.banded)
    s.bottoming =
        std::clamp(1.0 - probability(figure, kUnbounded) + probability(figure, 0.0), 0.0, 1.0);
}

}  // namespace

estimator::MixtureOptions mixture_options(const DropOptions& options) {
  estimator::MixtureOptions how;
  how.priors = {options.discharge_spread, options.index_spread};
  return how;
}

std::string prior_words(const estimator::ExtrapolationPriors& priors) {
  if (priors.discharge_spread <= 0.0 && priors.index_spread <= 0.0)
    return "No prior widens the band beyond the tested velocities: the discharge coefficient and "
           "the polytropic index are taken to stay (--cd-spread, --index-spread).";
  return fmt::format(
      "Priors that widen the band: {:g} of C_d for each decade of the Reynolds number beyond the "
      "tested velocities, {:g} of the polytropic index; both are standard deviations.",
      priors.discharge_spread, priors.index_spread);
}

Result<void> complete(const DropOptions& options, const PredictionOf& prediction, DropOutput& out) {
  const config::ModelSpec& model = prediction.model;
  const PredictedDrop& predicted = prediction.predicted;
  DropSections& s = out.sections;
  s.words = figure_words(model.length_unit, s.setup.mass);
  const estimator::DropTest test(model, s.setup.conditions);
  auto shares = test.shares(test.model().start());
  if (!shares) return shares.error();
  s.shares = std::move(*shares);
  const auto& deceleration = predicted.figures[figure_called("peak_deceleration")];
  s.deceleration = deceleration.value;
  s.deceleration_lower = deceleration.lower;
  s.deceleration_upper = deceleration.upper;
  find_margin(test, predicted, prediction.probability, s);
  s.met.clear();
  for (const DropLimit& limit : s.setup.limits) {
    if (is_gear_figure(limit.figure) && !std::isfinite(predicted.figures[limit.figure].value))
      return Error{ErrorKind::invalid, fmt::format("--limit {}: this gear has no tyre; give one "
                                                   "with --tyre-stiffness",
                                                   limit.name)};
    s.met.push_back(s.banded ? prediction.probability(limit.figure, limit.value)
                             : (predicted.figures[limit.figure].value <= limit.value ? 1.0 : 0.0));
  }
  if (options.piston_area) {
    if (!s.setup.mass)
      return Error{ErrorKind::invalid,
                   "--piston-area: a pressure needs --mass, the mass above the damper, in kg"};
    s.gas_pressure = gas_pressure(s.shares, *s.setup.mass, *options.piston_area);
  }
  if (auto done = find_envelope(options, prediction, s); !done) return done;
  if (options.measured.empty()) return {};
  auto measured =
      read_measured_drop(options.measured, model.length_unit, s.setup.mass.value_or(0.0));
  if (!measured) return measured.error();
  out.measured = std::move(*measured);
  auto compared = compare_drop(*out.measured, predicted);
  if (!compared)
    return Error{compared.error().kind,
                 fmt::format("{}: {}", options.measured.string(), compared.error().what)};
  out.comparison = std::move(*compared);
  return {};
}

ExitCode drop_exit_code(const Error& error) {
  return error.kind == ErrorKind::not_converged ? kNotUsable : kBadInput;
}

std::string drop_output_text(const DropOutput& output) {
  return "\n" + drop_sections_text(output.sections) + comparison_text(output);
}

std::string comparison_text(const DropOutput& output) {
  if (!output.comparison) return "";
  std::string text;
  const auto rows = comparison_rows(*output.comparison, output.sections.words);
  text += report::text_table(rows, {false, true, true, true, true, false});
  for (const std::string& sentence : band_sentences(*output.comparison))
    text += sentence + "\n";
  return text + "\n";
}

void add_drop_output(const DropOutput& output, nlohmann::ordered_json& json) {
  add_drop_sections(output.sections, json);
  if (output.comparison)
    json["measured"] = comparison_json(*output.comparison, output.sections.words);
}

Result<void> write_drop_picture(const DropOptions& options, const DropOutput& output,
                                const estimator::DropRun& run, const estimator::HistoryBand& band,
                                const estimator::DropHistory* truth, const std::string& length) {
  if (options.svg.empty()) return {};
  DropPictureOptions how;
  how.sink_speed = output.sections.setup.conditions.sink_speed;
  how.mass = output.sections.setup.mass;
  how.length_unit = length;
  how.band = &band;
  how.measured = output.measured ? &*output.measured : nullptr;
  std::ofstream out(options.svg);
  out << drop_picture(run, truth, how);
  if (out.flush()) return {};
  return Error{ErrorKind::io, fmt::format("{}: cannot be written", options.svg.string())};
}

}  // namespace shaker::cli
