#include "cli/joined_drop.hpp"

#include <cmath>

#include <fmt/format.h>

#include "base/unit.hpp"
#include "cli/drop_figures.hpp"
#include "cli/quantity.hpp"
#include "report/text_table.hpp"

namespace shaker::cli {
namespace {

using OrderedJson = nlohmann::ordered_json;

std::string verdict_of(const DiagnosedDrop& drop, std::size_t at) {
  const estimator::JoinedDrop& joined = drop.joined->drop;
  const estimator::HypothesisInDrop& said = joined.hypotheses[at];
  const std::string name = name_of(joined.damper.hypotheses[at]);
  if (said.left == 0.0)
    return fmt::format("the measured drop cannot be fitted by \"{}\", which stays as it was: {}",
                       name, said.trouble);
  const std::string left = fmt::format(
      "it leaves {:.2g} {} at {} samples with a noise of {:.2g} {}, and moves the parameters by "
      "{:.2g} of their standard errors",
      said.left, drop.length, joined.points, joined.noise, drop.length, said.moved);
  if (said.joined) return fmt::format("the measured drop agrees with \"{}\": {}", name, left);
  if (said.agrees)
    return fmt::format("the measured drop agrees with \"{}\", which stays as it was: {}", name,
                       said.trouble);
  return fmt::format(
      "the measured drop disagrees with \"{}\", which stays as it was, by more than noise "
      "explains: {}",
      name, left);
}

}  // namespace

Result<estimator::DropRecord> joining_record(const DropOptions& options,
                                             const MeasuredDrop& measured,
                                             const std::string& length) {
  if (measured.stroke.empty())
    return Error{ErrorKind::invalid,
                 fmt::format("{}: has no stroke, and only a stroke can join the estimate; leave "
                             "--join out",
                             options.measured.string())};
  estimator::DropRecord record;
  record.t = measured.t;
  record.stroke = measured.stroke;
  if (options.measured_noise.empty()) return record;
  const auto noise = quantity("--measured-noise", options.measured_noise, Dimension::length);
  if (!noise) return noise.error();
  const auto metre = unit_called(length, Dimension::length);
  if (!metre || !(*noise > 0.0))
    return Error{ErrorKind::invalid,
                 fmt::format("--measured-noise {}: it must be a length above 0, and the model "
                             "must count in a unit that has a size",
                             options.measured_noise)};
  record.noise = *noise / metre->scale;
  return record;
}

std::vector<std::vector<std::string>> joined_rows(const DiagnosedDrop& drop) {
  const ComparisonWords& words = drop.output.sections.words;
  std::vector<std::vector<std::string>> rows = {
      {"figure", "before", "95 %", "with the measured drop", "95 %", "unit"}};
  const auto add = [](const estimator::MixtureBand& band, double k, std::vector<std::string>& row) {
    const double error = 0.25 * k * (band.upper - band.lower);
    row.push_back(fmt::format("{:.6g}", k * band.value));
    row.push_back(error > 0.0 ? fmt::format("{} to {}", report::rounded_to(k * band.lower, error),
                                            report::rounded_to(k * band.upper, error))
                              : "-");
  };
  for (std::size_t f = 0; f < estimator::kDropFigureCount; ++f) {
    const auto& before = drop.drop.bands[f];
    const auto& after = drop.joined->after.bands[f];
    if (!std::isfinite(before.value) || !std::isfinite(after.value)) continue;
    std::vector<std::string> row = {words.label[f]};
    add(before, words.scale[f], row);
    add(after, words.scale[f], row);
    row.push_back(words.unit[f]);
    rows.push_back(std::move(row));
  }
  return rows;
}

std::vector<std::string> joined_sentences(const DiagnosedDrop& drop) {
  const estimator::JoinedDrop& joined = drop.joined->drop;
  std::vector<std::string> sentences;
  for (std::size_t h = 0; h < joined.hypotheses.size(); ++h)
    sentences.push_back(fmt::format("{} (its probability is then {:.3f})", verdict_of(drop, h),
                                    joined.damper.hypotheses[h].probability));
  if (!joined.intervals_hold)
    sentences.emplace_back(
        "the intervals do not hold: the likeliest hypothesis disagrees with the measured drop, "
        "which narrows nothing there; check its touch-down, sink speed, mass, lift and "
        "--measured-noise before you call the damper another one");
  return sentences;
}

std::string joined_text(const DiagnosedDrop& drop) {
  std::string text = report::text_table(joined_rows(drop), {false, true, true, true, true, false});
  for (const std::string& sentence : joined_sentences(drop))
    text += (drop.joined->drop.intervals_hold ? "" : "! ") + sentence + "\n";
  return text + "\n";
}

OrderedJson joined_json(const DiagnosedDrop& drop) {
  const estimator::JoinedDrop& joined = drop.joined->drop;
  const ComparisonWords& words = drop.output.sections.words;
  OrderedJson hypotheses = OrderedJson::array(), figures = OrderedJson::array();
  for (std::size_t h = 0; h < joined.hypotheses.size(); ++h) {
    const auto& said = joined.hypotheses[h];
    OrderedJson entry = {{"effects", joined.damper.hypotheses[h].effects},
                         {"probability", joined.damper.hypotheses[h].probability},
                         {"agrees", said.agrees},
                         {"joined", said.joined},
                         {"left", said.left},
                         {"moved", said.moved}};
    if (!said.trouble.empty()) entry["trouble"] = said.trouble;
    hypotheses.push_back(std::move(entry));
  }
  for (std::size_t f = 0; f < estimator::kDropFigureCount; ++f) {
    const auto& band = drop.joined->after.bands[f];
    if (!std::isfinite(band.value)) continue;
    const double k = words.scale[f];
    figures.push_back({{"name", estimator::kDropFigures[f].name},
                       {"unit", words.unit[f]},
                       {"value", k * band.value},
                       {"interval", {k * band.lower, k * band.upper}}});
  }
  return {{"intervals_hold", joined.intervals_hold},
          {"noise", joined.noise},
          {"points", joined.points},
          {"unnamed_probability", joined.damper.unnamed_probability},
          {"hypotheses", std::move(hypotheses)},
          {"figures", std::move(figures)}};
}

}  // namespace shaker::cli
