// Universal Files as an import's source: data sets 58, ASCII, time responses.
#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <fstream>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "cli/csv.hpp"
#include "cli/data/import_data.hpp"

namespace shaker::cli {
namespace {

constexpr std::size_t kIdLines = 5, kFormatLines = 6;
constexpr int kTimeResponses = 1;  // function type

std::string_view without_blanks(std::string_view text) {
  while (!text.empty() && (text.back() == ' ' || text.back() == '\r'))
    text.remove_suffix(1);
  while (!text.empty() && text.front() == ' ')
    text.remove_prefix(1);
  return text;
}

std::string_view part(const std::string& line, std::size_t at, std::size_t width) {
  return at >= line.size() ? std::string_view()
                           : without_blanks(std::string_view(line).substr(at, width));
}

// A number of Fortran: its exponent may be written with a D. Empty if it is none.
std::optional<double> number_in(std::string_view text) {
  std::string plain(text);
  std::ranges::replace(plain, 'D', 'E');
  if (plain.starts_with('+')) plain.erase(0, 1);
  double value = 0.0;
  const auto [end, code] = std::from_chars(plain.data(), plain.data() + plain.size(), value);
  if (plain.empty() || code != std::errc() || end != plain.data() + plain.size()) return {};
  return value;
}

int integer_in(std::string_view text) {
  return static_cast<int>(std::clamp(number_in(text).value_or(0.0), -1e9, 1e9));
}

// The lines of a data set between its delimiters, and where they begin.
struct RawSet {
  std::size_t line = 0;
  std::vector<std::string> lines;
};

// A time response.
struct Series {
  std::string title, origin, label, unit, time_unit;
  int quantity = 0;  // 8 displacement, 9 and 13 force, 12 acceleration
  std::vector<double> t, values;
};

class SetReader {
 public:
  SetReader(const RawSet& set, std::string file) : set_(set), file_(std::move(file)) {}

  Result<Series> read() {
    Series series;
    series.title = without_blanks(set_.lines[0]);
    series.origin = without_blanks(set_.lines[4]);
    const std::string& form = set_.lines[6];
    const int type = integer_in(part(form, 0, 10)), count = integer_in(part(form, 10, 10));
    even_ = integer_in(part(form, 20, 10)) == 1;
    if (type != 2 && type != 4)
      return wrong(6, fmt::format("data of type {} are not real numbers", type));
    if (count < 1 || static_cast<std::size_t>(count) > kMaxCsvRows)
      return wrong(6, fmt::format("{} values; 1 to {} are read", count, kMaxCsvRows));
    series.time_unit = unit_in(set_.lines[7]);
    series.quantity = integer_in(part(set_.lines[8], 0, 10));
    series.label = part(set_.lines[8], 26, 20);
    series.unit = unit_in(set_.lines[8]);
    if (auto good = read_values(type == 4, static_cast<std::size_t>(count), series); !good)
      return good.error();
    const auto first = number_in(part(form, 30, 13)), step = number_in(part(form, 43, 13));
    if (!even_) return series;
    if (!first || !step || !(*step > 0.0))
      return wrong(6, "the step between the values is not above 0");
    for (std::size_t i = 0; i < series.values.size(); ++i)
      series.t.push_back(*first + *step * static_cast<double>(i));
    return series;
  }

 private:
  static std::string unit_in(const std::string& axis) {
    const auto unit = part(axis, 47, 20);
    return unit == "NONE" ? std::string() : std::string(unit);
  }
  Error wrong(std::size_t line, const std::string& why) const {
    return {ErrorKind::invalid, fmt::format("{}:{}: {}", file_, set_.line + line, why)};
  }

  // Formats 6E13.5 and 4E20.12 on even steps; pairs of 6E13.5 and of 2(E13.5,E20.12) otherwise.
  Result<void> read_values(bool is_double, std::size_t count, Series& series) {
    bool is_time = !even_;
    for (std::size_t row = kIdLines + kFormatLines; row < set_.lines.size(); ++row) {
      const std::string& line = set_.lines[row];
      for (std::size_t at = 0; at < line.size() && series.values.size() < count;) {
        const std::size_t width = is_double && !is_time ? 20 : 13;
        const std::string_view text = part(line, at, width);
        at += width;
        if (text.empty()) continue;
        const auto value = number_in(text);
        if (!value || !std::isfinite(*value))
          return wrong(row, fmt::format("\"{}\" is not a number", text.substr(0, 40)));
        (is_time ? series.t : series.values).push_back(*value);
        if (!even_) is_time = !is_time;
      }
    }
    if (series.values.size() == count) return {};
    return wrong(set_.lines.size(), fmt::format("the data set ends after {} of its {} values",
                                                series.values.size(), count));
  }

  const RawSet& set_;
  std::string file_;
  bool even_ = true;
};

// The data sets 58 of a file.
Result<std::vector<RawSet>> sets_of(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in)
    return Error{ErrorKind::io, fmt::format("{}: cannot be read; check that it is a file, and its "
                                            "permissions",
                                            file.string())};
  std::vector<RawSet> sets;
  std::string line;
  std::size_t number = 0;
  bool inside = false, wanted = false, kind_next = false;
  while (std::getline(in, line)) {
    ++number;
    if (line.size() > kMaxCsvLine)
      return Error{ErrorKind::invalid,
                   fmt::format("{}:{}: longer than {} bytes; is this a Universal "
                               "File?",
                               file.string(), number, kMaxCsvLine)};
    const std::string_view text = without_blanks(line);
    if (kind_next) {
      kind_next = false;
      if (text.starts_with("58b"))
        return Error{ErrorKind::invalid,
                     fmt::format("{}:{}: the data set 58 is binary; write it as ASCII",
                                 file.string(), number)};
      wanted = text == "58";
      if (wanted) sets.push_back({number + 1, {}});
    } else if (text == "-1") {
      inside = !inside;
      kind_next = inside;
      wanted = false;
    } else if (wanted) {
      sets.back().lines.push_back(line);
    }
  }
  if (sets.empty())
    return Error{ErrorKind::invalid,
                 fmt::format("{}: holds no data set 58; is this a Universal File?", file.string())};
  for (const RawSet& set : sets) {
    if (set.lines.size() > kIdLines + kFormatLines) continue;
    return Error{ErrorKind::invalid,
                 fmt::format("{}:{}: the data set has no values", file.string(), set.line)};
  }
  return sets;
}

// The run that is being read, and what its file calls the excitation.
struct OpenRun {
  ImportRun* run = nullptr;
  std::string excitation;

  bool has(const std::string& channel) const {
    return run != nullptr && run->columns.contains(channel);
  }
};

// The channel of a series; empty if a run has no place for it.
std::string channel_in(const Series& series, const OpenRun& open, const ByChannel& columns) {
  for (const auto& [channel, label] : columns)
    if (label == series.label || label == series.title) return channel;
  const auto free = [&](const char* channel) { return !columns.contains(channel); };
  if (series.quantity == 8 && free("displacement")) return "displacement";
  if ((series.quantity == 9 || series.quantity == 13) && free("force")) return "force";
  if (series.quantity != 12) return "";
  const bool again = open.has("excitation") && series.label != open.excitation;
  if (free("excitation") && !again) return "excitation";
  return free("acceleration") ? "acceleration" : "";
}

// "shakerd, 1.5 Hz, 2.5 m/s^2, run r01": what `shakerctl export` says in the fifth line. The
// step of a data set has 6 digits, so that the times follow from the frequency.
void take_origin(const Series& series, ImportRun& run) {
  constexpr double kSixDigits = 2e-4;
  if (!series.origin.starts_with("shakerd, ")) return;
  std::string_view rest = std::string_view(series.origin).substr(9);
  const auto hz = rest.find(" Hz, "), acceleration = rest.find(" m/s^2, run ");
  if (hz == rest.npos || acceleration == rest.npos || acceleration < hz) return;
  run.frequency_hz = number_in(rest.substr(0, hz));
  run.amplitude = number_in(rest.substr(hz + 5, acceleration - hz - 5));
  run.name = rest.substr(acceleration + 12);
  std::vector<double>& t = run.columns.at("t").values;
  if (!run.frequency_hz || !(*run.frequency_hz > 0.0) || t.size() < 2) return;
  const double points = 1.0 / (*run.frequency_hz * (t[1] - t[0]));
  if (std::fabs(points - std::round(points)) > kSixDigits * points) return;
  for (std::size_t i = 0; i < t.size(); ++i)
    t[i] = static_cast<double>(i) / (std::round(points) * *run.frequency_hz);
}

}  // namespace

Result<ImportData> read_uff(const std::filesystem::path& file, const ByChannel& columns) {
  const auto sets = sets_of(file);
  if (!sets) return sets.error();
  ImportData data;
  data.name = file.stem().string();
  OpenRun open;
  for (const RawSet& set : *sets) {
    if (integer_in(part(set.lines[5], 0, 5)) != kTimeResponses) continue;
    auto series = SetReader(set, file.string()).read();
    if (!series) return series.error();
    const std::string channel = channel_in(*series, open, columns);
    if (channel.empty()) {
      data.left_out.push_back(series->title);
      continue;
    }
    // A run ends where one of its channels comes again, or other times begin.
    if (open.run == nullptr || open.has(channel) ||
        open.run->columns.at("t").values.size() != series->t.size()) {
      open.run = &data.runs.emplace_back();
      open.run->name = fmt::format("run{}", data.runs.size());
      open.run->columns["t"] = {series->t, series->time_unit};
      take_origin(*series, *open.run);
    }
    if (channel == "excitation") open.excitation = series->label;
    open.run->columns[channel] = {std::move(series->values), series->unit};
  }
  if (data.runs.empty())
    return Error{ErrorKind::invalid,
                 fmt::format("{}: holds no time response of a displacement, an acceleration or a "
                             "force{}{}; name the channels with --column CHANNEL=LABEL",
                             file.string(), data.left_out.empty() ? "" : ", only ",
                             fmt::join(data.left_out, ", "))};
  if (const auto& ids = sets->front().lines; ids[4].starts_with("shakerd, ")) {
    data.name = without_blanks(ids[1]);
    data.facts = {{"started_utc", std::string(without_blanks(ids[2]))},
                  {"rig", std::string(part(ids[3], 4, 76))}};
  }
  return data;
}

}  // namespace shaker::cli
