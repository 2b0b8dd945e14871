#include "cli/measured_drop.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "base/unit.hpp"
#include "cli/csv.hpp"
#include "cli/model_units.hpp"

namespace shaker::cli {
namespace {

using OrderedJson = nlohmann::ordered_json;

constexpr std::size_t kFewestDropSamples = 10;

Error measured_refused(const std::filesystem::path& file, const std::string& why) {
  return {ErrorKind::invalid, fmt::format("{}: {}", file.string(), why)};
}

// Every set of the three channels, the largest first.
std::vector<std::vector<std::string>> drop_columns() {
  return {{"t", "stroke", "load", "acceleration"},
          {"t", "stroke", "load"},
          {"t", "stroke", "acceleration"},
          {"t", "load", "acceleration"},
          {"t", "stroke"},
          {"t", "load"},
          {"t", "acceleration"}};
}

Result<double> drop_factor(const CsvTable& table, const std::filesystem::path& file,
                           const std::string& column, const ModelUnits& units) {
  const std::string channel = column == "stroke" ? "displacement"
                              : column == "load" ? "force"
                                                 : column;
  const auto unit = table.units.find(column);
  if (column == "load" && unit == table.units.end())
    return measured_refused(file,
                            "column \"load\": state its unit behind the name, as in "
                            "load [kN]");
  if (column == "load" && units.mass == 0.0 && unit_called(unit->second, Dimension::force))
    return measured_refused(file,
                            "column \"load\" is a force: give the mass above the damper, "
                            "in kg, with --mass");
  return column_factor(table, file.string(), column, channel, units, std::nullopt);
}

}  // namespace

Result<MeasuredDrop> read_measured_drop(const std::filesystem::path& file,
                                        const std::string& length_unit, double mass) {
  const auto table = read_csv(file, drop_columns(), 1e30);
  if (!table) return table.error();
  const ModelUnits units{length_unit, mass};
  MeasuredDrop drop;
  for (const auto& [name, column] :
       {std::pair{"t", &MeasuredDrop::t}, std::pair{"stroke", &MeasuredDrop::stroke},
        std::pair{"load", &MeasuredDrop::load},
        std::pair{"acceleration", &MeasuredDrop::acceleration}}) {
    const auto found = table->columns.find(name);
    if (found == table->columns.end()) continue;
    const auto factor = drop_factor(*table, file, name, units);
    if (!factor) return factor.error();
    drop.*column = found->second;
    for (double& value : drop.*column)
      value *= *factor;
  }
  const auto back =
      std::adjacent_find(drop.t.begin(), drop.t.end(), [](double a, double b) { return b <= a; });
  if (back != drop.t.end())
    return measured_refused(file, fmt::format("line {}: t does not grow; sort the samples by time",
                                              back - drop.t.begin() + 3));
  const auto before = std::lower_bound(drop.t.begin(), drop.t.end(), 0.0) - drop.t.begin();
  for (auto* column : {&drop.t, &drop.stroke, &drop.load, &drop.acceleration}) {
    if (!column->empty()) column->erase(column->begin(), column->begin() + before);
  }
  if (drop.t.size() < kFewestDropSamples)
    return measured_refused(file, fmt::format("{} samples after touch-down (t = 0); it takes {}",
                                              drop.t.size(), kFewestDropSamples));
  return drop;
}

std::vector<std::vector<std::string>> comparison_rows(const MeasuredComparison& comparison,
                                                      const ComparisonWords& words) {
  std::vector<std::vector<std::string>> rows = {
      {"figure", "measured", "predicted", "error", "standard errors", "unit"}};
  for (const estimator::ComparedFigure& one : comparison.figures) {
    const double k = words.scale[one.figure];
    rows.push_back(
        {words.label[one.figure], fmt::format("{:.6g}", k * one.measured),
         fmt::format("{:.6g}", k * one.predicted),
         std::isfinite(one.percent) ? fmt::format("{:+.2f} %", one.percent) : "-",
         std::isfinite(one.standard_errors) ? fmt::format("{:+.2f}", one.standard_errors) : "-",
         words.unit[one.figure]});
  }
  return rows;
}

std::vector<std::string> band_sentences(const MeasuredComparison& comparison) {
  std::vector<std::string> sentences;
  for (const auto& one : comparison.in_band)
    sentences.push_back(fmt::format("{:.1f} % of {} points of the measured {} lie in the 95 % band",
                                    100.0 * static_cast<double>(one.inside) /
                                        static_cast<double>(std::max<std::size_t>(1, one.points)),
                                    one.points, one.channel));
  return sentences;
}

OrderedJson comparison_json(const MeasuredComparison& comparison, const ComparisonWords& words) {
  OrderedJson figures = OrderedJson::array(), in_band = OrderedJson::object();
  for (const estimator::ComparedFigure& one : comparison.figures) {
    const double k = words.scale[one.figure];
    OrderedJson entry = {{"name", estimator::kDropFigures[one.figure].name},
                         {"unit", words.unit[one.figure]},
                         {"measured", k * one.measured},
                         {"predicted", k * one.predicted}};
    if (std::isfinite(one.percent)) entry["error_percent"] = one.percent;
    if (std::isfinite(one.standard_errors)) entry["standard_errors"] = one.standard_errors;
    figures.push_back(std::move(entry));
  }
  for (const auto& one : comparison.in_band)
    in_band[one.channel] = {{"points", one.points}, {"inside", one.inside}};
  return {{"figures", std::move(figures)}, {"in_band", std::move(in_band)}};
}

}  // namespace shaker::cli
