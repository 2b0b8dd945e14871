// Universal File Format, data set 58, ASCII, as the Structural Dynamics Research Laboratory of the
// University of Cincinnati describes it: "Function at Nodal DOF".
#include <complex>

#include <fmt/format.h>

#include "cli/data/formats.hpp"
#include "cli/data/out_file.hpp"
#include "estimator/math/harmonic_basis.hpp"

namespace shaker::cli {
namespace {

// From the tables of the format.
enum FunctionType { kTimeResponse = 1, kFrequencyResponse = 4 };
enum DataType { kRealDouble = 4, kComplexDouble = 6 };
enum Quantity { kNone = 0, kDisplacement = 8, kAcceleration = 12, kTime = 17, kFrequency = 18 };

struct Axis {
  Quantity quantity = kNone;
  std::string label = "NONE", unit = "NONE";
};
const Axis kStroke{kDisplacement, "Stroke", "m"}, kTable{kAcceleration, "Table", "m/s^2"};

// At most 80 characters in a line, without a line end.
std::string line_of(std::string text) {
  text.resize(std::min<std::size_t>(text.size(), 80));
  for (char& c : text) {
    if (static_cast<unsigned char>(c) < 0x20) c = ' ';
  }
  return text.empty() ? "NONE" : text;
}

class DataSet {
 public:
  // `origin`: the fifth line, from which an import knows the run.
  DataSet(OutFile& out, const ExportData& data, const std::string& title, const std::string& origin)
      : out_(out) {
    out_.write("{:>6}\n{:>6}\n", -1, 58);
    for (const std::string& line :
         {title, data.campaign.name, data.campaign.started_utc, "rig " + data.campaign.rig, origin})
      out_.write("{}\n", line_of(line));
  }
  ~DataSet() { out_.write("{}{:>6}\n", at_ % per_line_ == 0 ? "" : "\n", -1); }
  DataSet(const DataSet&) = delete;
  DataSet& operator=(const DataSet&) = delete;

  void function(FunctionType type, int number) {
    out_.write("{:5}{:10}{:5}{:10} {:<10}{:10}{:4} {:<10}{:10}{:4}\n", static_cast<int>(type),
               number, 1, 0, "NONE", 1, 3, "NONE", 2, 3);
  }
  void abscissa(DataType type, std::size_t points, bool even, double first, double step) {
    out_.write("{:10}{:10}{:10}{:13.5E}{:13.5E}{:13.5E}\n", static_cast<int>(type), points,
               even ? 1 : 0, first, step, 0.0);
  }
  void axis(const Axis& axis) {
    out_.write("{:10}{:5}{:5}{:5} {:<20} {:<20}\n", static_cast<int>(axis.quantity), 0, 0, 0,
               axis.label, axis.unit);
  }
  // Even steps: four values in a line, format 4E20.12.
  void value(double number) {
    out_.write("{:20.12E}{}", number, ++at_ % per_line_ == 0 ? "\n" : "");
  }
  // Uneven steps: one value in a line, format E13.5, 2E20.12.
  void value(double at, std::complex<double> number) {
    out_.write("{:13.5E}{:20.12E}{:20.12E}\n", at, number.real(), number.imag());
  }

 private:
  OutFile& out_;
  static constexpr int per_line_ = 4;
  int at_ = 0;
};

void write_series(OutFile& out, const ExportData& data, const ExportRun& run, int number,
                  const Axis& ordinate, std::vector<double> record::CycleRow::*channel) {
  std::vector<double> values;
  for (const record::CycleRow& cycle : run.cycles)
    values.insert(values.end(), (cycle.*channel).begin(), (cycle.*channel).end());
  if (values.empty()) return;
  const auto points = static_cast<double>((run.cycles.front().*channel).size());
  DataSet set(out, data,
              fmt::format("{} {}, {} cycles one after the other", run.row.name, ordinate.label,
                          run.cycles.size()),
              fmt::format("shakerd, {} Hz, {} m/s^2, run {}", run.mean_frequency(),
                          run.row.amplitude, run.row.name));
  set.function(kTimeResponse, number);
  set.abscissa(kRealDouble, values.size(), true, 0.0, 1.0 / (points * run.mean_frequency()));
  set.axis({kTime, "Time", "s"});
  set.axis(ordinate);
  set.axis({});
  set.axis({});
  for (const double value : values)
    set.value(value);
}

std::complex<double> first_harmonic(const std::vector<double>& cycle) {
  return 2.0 * estimator::fourier_sum(cycle, 1) / static_cast<double>(cycle.size());
}

// The ratio of stroke to table acceleration at the fundamental of each run, m per m/s^2.
void write_response(OutFile& out, const ExportData& data, int number) {
  std::vector<std::pair<double, std::complex<double>>> points;
  for (const ExportRun& run : data.runs) {
    std::complex<double> stroke = 0.0, table = 0.0;
    for (const record::CycleRow& cycle : run.cycles) {
      stroke += first_harmonic(cycle.displacement);
      // An excitation that was not measured is a cosine, by the definition of the phase.
      table += cycle.excitation.empty() ? cycle.amplitude : first_harmonic(cycle.excitation);
    }
    if (std::abs(table) > 0.0) points.emplace_back(run.mean_frequency(), stroke / table);
  }
  if (points.empty()) return;
  DataSet set(out, data, "First harmonic of the stroke over that of the table, a point a run",
              "shakerd");
  set.function(kFrequencyResponse, number);
  set.abscissa(kComplexDouble, points.size(), false, 0.0, 0.0);
  set.axis({kFrequency, "Frequency", "Hz"});
  set.axis(kStroke);
  set.axis(kTable);
  set.axis({});
  for (const auto& [frequency, value] : points)
    set.value(frequency, value);
}

}  // namespace

Result<std::vector<Written>> write_uff(const ExportData& data,
                                       const std::filesystem::path& folder) {
  Written file{"", folder / (export_name(data, "export") + ".uff"), 0};
  OutFile out(file.file);
  int number = 0;
  for (const ExportRun& run : data.runs) {
    write_series(out, data, run, ++number, kStroke, &record::CycleRow::displacement);
    write_series(out, data, run, ++number, kTable, &record::CycleRow::excitation);
    file.count += run.cycles.size();
  }
  write_response(out, data, ++number);
  if (auto done = out.finish(); !done) return done.error();
  return std::vector{file};
}

}  // namespace shaker::cli
