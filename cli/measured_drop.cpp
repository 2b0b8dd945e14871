#include "cli/measured_drop.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "base/unit.hpp"
#include "cli/csv.hpp"
#include "cli/drop_figures.hpp"
#include "cli/model_units.hpp"

namespace shaker::cli {
namespace {

using OrderedJson = nlohmann::ordered_json;

constexpr double kQuantileOf95 = 1.959964;
constexpr double kNotComparable = std::numeric_limits<double>::quiet_NaN();
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

double energy_of(const MeasuredDrop& drop, std::size_t end) {
  double sum = 0.0;
  for (std::size_t i = 0; i < end; ++i)
    sum += 0.5 * (drop.load[i] + drop.load[i + 1]) * (drop.stroke[i + 1] - drop.stroke[i]);
  return sum;
}

std::size_t top_index(const std::vector<double>& values) {
  return static_cast<std::size_t>(std::max_element(values.begin(), values.end()) - values.begin());
}

// The largest value of samples: the top of the parabola through it and its neighbours.
void find_peak(const std::vector<double>& t, const std::vector<double>& values, double& peak,
               double& time) {
  const std::size_t i = top_index(values);
  peak = values[i];
  time = t[i];
  if (i == 0 || i + 1 >= values.size()) return;
  const double h1 = t[i] - t[i - 1], h2 = t[i + 1] - t[i];
  const double d1 = (values[i] - values[i - 1]) / h1, d2 = (values[i + 1] - values[i]) / h2;
  const double bend = (d2 - d1) / (h1 + h2);  // half the second derivative
  const double slope = (d1 * h2 + d2 * h1) / (h1 + h2);
  if (!(bend < 0.0)) return;
  const double shift = std::clamp(-0.5 * slope / bend, -h1, h2);
  peak += slope * shift + bend * shift * shift;
  time += shift;
}

double linear_at(const std::vector<double>& t, const std::vector<double>& values, double at) {
  const auto above = std::upper_bound(t.begin(), t.end(), at);
  const auto i = static_cast<std::size_t>(
      std::clamp<std::ptrdiff_t>(above - t.begin(), 1, static_cast<std::ptrdiff_t>(t.size()) - 1));
  const double share = (at - t[i - 1]) / (t[i] - t[i - 1]);
  return values[i - 1] + share * (values[i] - values[i - 1]);
}

class Comparer {
 public:
  Comparer(const MeasuredDrop& measured, const PredictedDrop& predicted)
      : m_(measured), p_(predicted) {}

  Result<MeasuredComparison> run() {
    double peak = 0.0, time = 0.0;
    if (!m_.stroke.empty()) {
      if (top_index(m_.stroke) + 1 == m_.stroke.size())
        return Error{ErrorKind::invalid,
                     "the measured stroke is still growing at its end: the drop does not turn; "
                     "give a longer record"};
      find_peak(m_.t, m_.stroke, peak, time);
      add("peak_stroke", peak);
      add("time_of_peak_stroke", time);
    }
    if (!m_.load.empty()) {
      find_peak(m_.t, m_.load, peak, time);
      add("peak_load", peak);
      add("time_of_peak_load", time);
    }
    if (!m_.acceleration.empty()) {
      find_peak(m_.t, m_.acceleration, peak, time);
      add("peak_deceleration", peak);
      if (m_.load.empty()) add("time_of_peak_load", time);
    }
    if (!m_.stroke.empty() && !m_.load.empty())
      add("energy_absorbed", energy_of(m_, top_index(m_.stroke)));
    const double carried = p_.figures[figure_called("peak_load")].value -
                           p_.figures[figure_called("peak_deceleration")].value;
    count("stroke", m_.stroke, p_.band.stroke_lower, p_.band.stroke_upper, 0.0);
    count("load", m_.load, p_.band.load_lower, p_.band.load_upper, 0.0);
    count("acceleration", m_.acceleration, p_.band.load_lower, p_.band.load_upper, carried);
    return out_;
  }

 private:
  void add(const char* name, double measured) {
    const std::size_t figure = figure_called(name);
    const auto& predicted = p_.figures[figure];
    const double error = 0.5 * (predicted.upper - predicted.lower) / kQuantileOf95;
    const double off = predicted.value - measured;
    out_.figures.push_back({figure, measured, predicted.value,
                            measured != 0.0 ? 100.0 * off / measured : kNotComparable,
                            error > 0.0 ? off / error : kNotComparable});
  }

  // `carried`: what a load holds more than an acceleration does.
  void count(const char* channel, const std::vector<double>& values,
             const std::vector<double>& lower, const std::vector<double>& upper, double carried) {
    if (values.empty() || lower.empty()) return;
    MeasuredComparison::InBand in = {channel, 0, 0};
    for (std::size_t i = 0; i < values.size() && m_.t[i] <= p_.band.t.back(); ++i) {
      const double value = values[i] + carried;
      ++in.points;
      if (value >= linear_at(p_.band.t, lower, m_.t[i]) &&
          value <= linear_at(p_.band.t, upper, m_.t[i]))
        ++in.inside;
    }
    out_.in_band.push_back(std::move(in));
  }

  const MeasuredDrop& m_;
  const PredictedDrop& p_;
  MeasuredComparison out_;
};

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

Result<MeasuredComparison> compare_drop(const MeasuredDrop& measured,
                                        const PredictedDrop& predicted) {
  return Comparer(measured, predicted).run();
}

std::vector<std::vector<std::string>> comparison_rows(const MeasuredComparison& comparison,
                                                      const ComparisonWords& words) {
  std::vector<std::vector<std::string>> rows = {
      {"figure", "measured", "predicted", "error", "standard errors", "unit"}};
  for (const ComparedFigure& one : comparison.figures) {
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
  for (const ComparedFigure& one : comparison.figures) {
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
