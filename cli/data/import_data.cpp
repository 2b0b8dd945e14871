#include "cli/data/import_data.hpp"

#include <algorithm>
#include <cmath>
#include <set>

#include <fmt/format.h>

#include "base/unit.hpp"
#include "cli/data/export_data.hpp"

namespace shaker::cli {
namespace {

Dimension dimension_of(const std::string& channel) {
  if (channel == "t") return Dimension::time;
  if (channel == "displacement") return Dimension::length;
  return channel == "force" ? Dimension::force : Dimension::acceleration;
}

Error bad_run(const ImportRun& run, const std::string& why) {
  return {ErrorKind::invalid, fmt::format("run {}: {}", run.name, why)};
}

// The unit of a column: the file's, the command line's, or s for times.
Result<Unit> unit_of_column(const ImportRun& run, const std::string& channel,
                            const ImportColumn& column, const ByChannel& units) {
  const auto dimension = dimension_of(channel);
  const auto given = units.find(channel);
  std::string name = column.unit;
  if (given != units.end()) {
    const auto from_file = conversion(column.unit, given->second);
    if (!column.unit.empty() && (!from_file || from_file->scale != 1.0))
      return bad_run(run, fmt::format("{} is in \"{}\" by the file and in \"{}\" by --unit; leave "
                                      "the wrong one out",
                                      channel, column.unit, given->second));
    name = given->second;
  }
  if (name.empty() && channel == "t") name = "s";
  if (name.empty())
    return bad_run(
        run, fmt::format("the file states no unit of {0}; say --unit {0}=UNIT, one of {1}", channel,
                         units_of(dimension)));
  const auto unit = unit_called(name, dimension);
  if (!unit)
    return bad_run(run, fmt::format("{} is in \"{}\", which is no unit of it; known are {}",
                                    channel, name, units_of(dimension)));
  return *unit;
}

Result<void> to_si(ImportRun& run, const ByChannel& units) {
  for (auto& [channel, column] : run.columns) {
    const auto unit = unit_of_column(run, channel, column, units);
    if (!unit) return unit.error();
    for (double& value : column.values)
      value = unit->to_si(value);
    column.unit = si_unit(unit->dimension);
  }
  return {};
}

Result<void> check_columns(const ImportRun& run) {
  for (const char* channel : {"t", "displacement"}) {
    if (!run.columns.contains(channel))
      return bad_run(
          run, fmt::format("has no channel {0}; name its column with --column {0}=NAME", channel));
  }
  const std::vector<double>& t = run.columns.at("t").values;
  for (const auto& [channel, column] : run.columns) {
    if (column.values.size() != t.size())
      return bad_run(run, fmt::format("{} has {} values and t has {}; cut them to the same times",
                                      channel, column.values.size(), t.size()));
    const auto wrong =
        std::ranges::find_if(column.values, [](double value) { return !std::isfinite(value); });
    if (wrong != column.values.end())
      return bad_run(run, fmt::format("value {} of {} is not a finite number; cut it out",
                                      wrong - column.values.begin() + 1, channel));
  }
  for (std::size_t i = 1; i < t.size(); ++i) {
    if (!(t[i] > t[i - 1]))
      return bad_run(run, fmt::format("time does not increase: t = {:.9g} is followed by {:.9g} "
                                      "(value {})",
                                      t[i - 1], t[i], i + 1));
  }
  return {};
}

// One number for all runs, or one for each.
Result<void> give(const std::vector<double>& numbers, const char* option, ImportData& data,
                  std::optional<double> ImportRun::*field) {
  if (numbers.empty()) return {};
  if (numbers.size() != 1 && numbers.size() != data.runs.size())
    return Error{ErrorKind::invalid,
                 fmt::format("{} has {} numbers and there are {} runs; give one, or one for each",
                             option, numbers.size(), data.runs.size())};
  for (std::size_t i = 0; i < data.runs.size(); ++i)
    data.runs[i].*field = numbers[numbers.size() == 1 ? 0 : i];
  return {};
}

}  // namespace

Result<void> complete(ImportData& data, const ImportWanted& wanted) {
  if (auto good = give(wanted.frequencies_hz, "--frequency", data, &ImportRun::frequency_hz); !good)
    return good;
  if (auto good = give(wanted.amplitudes, "--amplitude", data, &ImportRun::amplitude); !good)
    return good;
  std::set<std::string> names;
  for (ImportRun& run : data.runs) {
    if (!names.insert(plain_file_name(run.name)).second)
      return bad_run(run, "two runs of the source have this name; name each differently");
    if (auto good = to_si(run, wanted.units); !good) return good;
    if (auto good = check_columns(run); !good) return good;
    if (run.columns.contains("force") && run.columns.contains("excitation") &&
        wanted.reference_mass == 0.0)
      return bad_run(run,
                     "has a force in N; say --reference-mass with the mass that the load cell "
                     "carries, in kg");
  }
  return {};
}

}  // namespace shaker::cli
