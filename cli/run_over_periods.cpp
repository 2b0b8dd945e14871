#include "cli/run_over_periods.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include <Eigen/Dense>
#include <fmt/format.h>

#include "cli/excitation_phase.hpp"
#include "estimator/math/dense.hpp"

namespace shaker::cli {
namespace {

using estimator::RunData;

constexpr std::size_t kLookedAt = 32;     // points of a cycle that is only checked
constexpr double kFewestInPeriod = 8.0;   // samples, for cubic interpolation
constexpr int kExcitationHarmonics = 24;  // above them an oleo's velocity reversals show
constexpr int kFewestHarmonics = 8;       // fewer would hide part of the response
constexpr double kHarmonicsOfGap = 0.4;   // largest gap between phases; the limit is 0.5
constexpr Eigen::Index kBlock = 256;      // rows of the normal equations in a block
constexpr std::size_t kFewestGroups = 4;  // groups that are needed to decide what is steady
constexpr double kUnsteady = 1.5;         // relative to the noise, as in the daemon's gate
constexpr double kDrift = 2e-3;           // in periods; an oleo's noise of about 0.1 mm hides less
constexpr double kDriftErrors = 5.0;      // in standard errors

// The mean of whole groups of n points each, and the sum of the squared deviations from it.
void average(const std::vector<double>& y, std::size_t n, RunData& run) {
  const std::size_t groups = y.size() / n;
  run.cycles = static_cast<double>(groups);
  run.displacement.assign(n, 0.0);
  for (std::size_t i = 0; i < groups * n; ++i)
    run.displacement[i % n] += y[i] / run.cycles;
  for (std::size_t i = 0; i < groups * n; ++i) {
    const double off = y[i] - run.displacement[i % n];
    run.scatter += off * off;
  }
}

// The excitation repeats with every period, also where the response does not.
std::vector<double> repeated(const std::vector<double>& one, int times) {
  std::vector<double> out;
  for (int k = 0; k < times; ++k)
    out.insert(out.end(), one.begin(), one.end());
  return out;
}

// Lagrange's cubic through the four samples around `at`.
double cubic_at(const std::vector<double>& t, const std::vector<double>& y, double at) {
  const auto next = std::upper_bound(t.begin(), t.end(), at) - t.begin();
  const auto last = static_cast<std::ptrdiff_t>(t.size()) - 4;
  const auto first = static_cast<std::size_t>(std::clamp<std::ptrdiff_t>(next - 2, 0, last));
  double value = 0.0;
  for (std::size_t j = first; j < first + 4; ++j) {
    double weight = y[j];
    for (std::size_t k = first; k < first + 4; ++k) {
      if (k != j) weight *= (at - t[k]) / (t[j] - t[k]);
    }
    value += weight;
  }
  return value;
}

// The number of harmonics of the group's period that samples at these phases determine.
int harmonics_of(std::vector<double> tau, int periods) {
  std::sort(tau.begin(), tau.end());
  double gap = tau.front() + 1.0 - tau.back();
  for (std::size_t i = 1; i < tau.size(); ++i)
    gap = std::max(gap, tau[i] - tau[i - 1]);
  return std::min(kExcitationHarmonics * periods, static_cast<int>(kHarmonicsOfGap / gap));
}

void fill_row(double tau, int harmonics, Eigen::Ref<Eigen::RowVectorXd> row) {
  row[0] = 1.0;
  for (int h = 1; h <= harmonics; ++h) {
    row[2 * h - 1] = std::cos(2.0 * std::numbers::pi * h * tau);
    row[2 * h] = std::sin(2.0 * std::numbers::pi * h * tau);
  }
}

Eigen::MatrixXd rows_of(const std::vector<double>& tau, int harmonics, Eigen::Index first,
                        Eigen::Index count) {
  Eigen::MatrixXd rows(count, 1 + 2 * harmonics);
  Eigen::RowVectorXd row(1 + 2 * harmonics);
  for (Eigen::Index i = 0; i < count; ++i) {
    fill_row(tau[static_cast<std::size_t>(first + i)], harmonics, row);
    rows.row(i) = row;
  }
  return rows;
}

// Uses as many points as coefficients. When the samples are spread over the whole period, the
// errors of the points are independent, and each point is the mean of count / n samples.
void average_by_harmonics(const std::vector<double>& tau, const std::vector<double>& y,
                          int harmonics, RunData& run) {
  const Eigen::Index n = 1 + 2 * harmonics, count = static_cast<Eigen::Index>(y.size());
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(n, n);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(n);
  const Eigen::Map<const Eigen::VectorXd> all(y.data(), count);
  for (Eigen::Index first = 0; first < count; first += kBlock) {
    const Eigen::Index size = std::min(kBlock, count - first);
    const Eigen::MatrixXd rows = rows_of(tau, harmonics, first, size);
    estimator::add_gram(normal, rows);
    right += rows.transpose() * all.segment(first, size);
  }
  const Eigen::VectorXd c = estimator::Ldlt(normal).solve(right);
  for (Eigen::Index first = 0; first < count; first += kBlock) {
    const Eigen::Index size = std::min(kBlock, count - first);
    run.scatter +=
        (all.segment(first, size) - rows_of(tau, harmonics, first, size) * c).squaredNorm();
  }
  Eigen::RowVectorXd row(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    fill_row(static_cast<double>(i) / static_cast<double>(n), harmonics, row);
    run.displacement.push_back(row.dot(c));
  }
  run.cycles = static_cast<double>(count) / static_cast<double>(n);
}

// Averages the samples of whole groups, given their phases.
Result<void> average_anywhere(const CsvTable& table, const std::string& origin, double frequency,
                              std::size_t cycles, int periods, RunData& run) {
  const auto& t = table.columns.at("t");
  const auto& y = table.columns.at(table.columns.contains("y") ? "y" : "displacement");
  const double first = std::ceil(t.front() * frequency - 1e-9);
  const double groups = std::floor(static_cast<double>(cycles) / periods);
  std::vector<double> tau, value;
  for (std::size_t i = 0; i < t.size(); ++i) {
    const double turn = (t[i] * frequency - first) / periods;
    if (turn < 0.0 || turn >= groups) continue;
    tau.push_back(turn - std::floor(turn));
    value.push_back(y[i]);
  }
  const int harmonics = harmonics_of(tau, periods);
  if (harmonics < kFewestHarmonics * periods)
    return Error{
        ErrorKind::invalid,
        fmt::format("{}: its samples show {:.1f} harmonics of the excitation; at least {} "
                    "are needed for a response over {} periods: sample faster",
                    origin, static_cast<double>(harmonics) / periods, kFewestHarmonics, periods)};
  average_by_harmonics(tau, value, harmonics, run);
  return {};
}

// Checks that the groups begin in the same phase of the excitation along the whole record.
Result<void> check_phase(const CsvTable& table, const std::string& origin, double frequency_hz) {
  if (!table.columns.contains("excitation")) return {};
  const PhaseDrift drift =
      phase_drift(table.columns.at("t"), table.columns.at("excitation"), frequency_hz);
  if (std::fabs(drift.turns) < std::max(kDrift, kDriftErrors * drift.error)) return {};
  return Error{
      ErrorKind::invalid,
      fmt::format("{}: the excitation drifts by {:.3f} of a period against {:g} Hz over the "
                  "record, so that cycles cut by that are not alike: its frequency is "
                  "{:.7g} Hz; give that with --frequency",
                  origin, drift.turns, frequency_hz, drift.frequency_hz)};
}

// The first group of the steady part: the next earlier group differs from the later ones by
// more than the noise.
std::size_t first_steady(const Cycles& groups) {
  const std::size_t n = groups.points, count = groups.count();
  if (count <= kFewestGroups) return 0;
  std::size_t first = count - kFewestGroups;
  const auto tail = [&](std::size_t from) {
    return Cycles{{groups.y.begin() + static_cast<std::ptrdiff_t>(from * n), groups.y.end()}, n};
  };
  while (first > 0) {
    const Cycles kept = tail(first);
    RunData mean;
    average(kept.y, n, mean);
    double squares = 0.0;
    for (std::size_t i = 0; i < n; ++i) {
      const double off = groups.y[(first - 1) * n + i] - mean.displacement[i];
      squares += off * off;
    }
    const double noise = scatter_after(kept, 1) * std::sqrt(1.0 + 1.0 / mean.cycles);
    if (std::sqrt(squares / static_cast<double>(n)) > kUnsteady * noise) break;
    --first;
  }
  return first;
}

// Sets the excitation of `run` to the mean over the rows from `first` on.
void excite(const std::vector<record::CycleRow>& rows, std::size_t first, int periods,
            RunData& run) {
  const auto count = static_cast<double>(rows.size() - first);
  std::vector<double> excitation(rows.back().excitation.size(), 0.0);
  double variance = 0.0;
  for (std::size_t r = first; r < rows.size(); ++r) {
    const record::CycleRow& row = rows[r];
    run.frequency_hz += row.frequency_hz / count;
    run.amplitude += row.amplitude / count;
    variance += row.excitation_error * row.excitation_error / (count * count);
    for (std::size_t i = 0; i < excitation.size(); ++i)
      excitation[i] += row.excitation[i] / count;
  }
  run.excitation = repeated(excitation, periods);
  run.excitation_error = std::sqrt(variance);
}

std::size_t begin_of_unbroken(const std::vector<record::CycleRow>& rows) {
  std::size_t first = rows.empty() ? 0 : rows.size() - 1;
  while (first > 0 && rows[first - 1].index + 1 == rows[first].index &&
         rows[first - 1].displacement.size() == rows.back().displacement.size() &&
         rows[first - 1].excitation.size() == rows.back().excitation.size())
    --first;
  return first;
}

}  // namespace

Cycles cycles_of(const CsvTable& table, double frequency_hz) {
  const auto& t = table.columns.at("t");
  const auto& y = table.columns.at(table.columns.contains("y") ? "y" : "displacement");
  if (const std::size_t n = points_of_equal_steps(t, frequency_hz))
    return {{y.begin(), y.begin() + static_cast<std::ptrdiff_t>(y.size() / n * n)}, n};
  const double first = std::ceil(t.front() * frequency_hz - 1e-9);
  const double turns = (t.back() - t.front()) * frequency_hz;
  if (static_cast<double>(t.size() - 1) < kFewestInPeriod * turns) return {};
  // The last step may reach to the end of a period without a sample there.
  const double beyond = turns / static_cast<double>(t.size() - 1);
  const double whole = std::floor(t.back() * frequency_hz + beyond - first + 1e-9);
  Cycles out{{}, kLookedAt};
  for (std::size_t i = 0; static_cast<double>(i) < whole * static_cast<double>(kLookedAt); ++i) {
    const double turn = first + static_cast<double>(i) / static_cast<double>(kLookedAt);
    out.y.push_back(cubic_at(t, y, std::min(turn / frequency_hz, t.back())));
  }
  return out;
}

Result<RunOverPeriods> run_over_periods(const CsvTable& table, const std::string& origin,
                                        const Dwell& dwell, int periods) {
  const auto found = run_from_table(table, origin, dwell);
  if (!found) return found.error();
  const Cycles cycles = cycles_of(table, dwell.frequency_hz);
  if (cycles.points == 0)
    return Error{ErrorKind::invalid,
                 fmt::format("{}: fewer than {:.0f} samples in a period do not show a response "
                             "over {} of them",
                             origin, kFewestInPeriod, periods)};
  if (auto good = check_phase(table, origin, dwell.frequency_hz); !good) return good.error();
  if (auto good = check_repetition(cycles, periods, origin); !good) return good.error();
  RunOverPeriods out;
  RunData& run = out.data;
  run.frequency_hz = found->frequency_hz;
  run.amplitude = found->amplitude;
  run.excitation = repeated(found->excitation, periods);
  run.excitation_error = found->excitation_error;
  run.periods = periods;
  const std::size_t m = static_cast<std::size_t>(periods);
  out.cycles = static_cast<long>(cycles.count() / m * m);
  if (points_of_equal_steps(table.columns.at("t"), dwell.frequency_hz))
    average(cycles.y, cycles.points * m, run);
  else if (auto good =
               average_anywhere(table, origin, dwell.frequency_hz, cycles.count(), periods, run);
           !good)
    return good.error();
  return out;
}

Cycles last_unbroken_cycles(const std::vector<record::CycleRow>& rows) {
  Cycles out;
  if (rows.empty()) return out;
  out.points = rows.back().displacement.size();
  for (std::size_t r = begin_of_unbroken(rows); r < rows.size(); ++r)
    out.y.insert(out.y.end(), rows[r].displacement.begin(), rows[r].displacement.end());
  return out;
}

Result<RunOverPeriods> run_over_periods(const std::vector<record::CycleRow>& rows,
                                        const std::string& place, const std::string& name,
                                        int periods) {
  const auto m = static_cast<std::size_t>(periods);
  Cycles cycles = last_unbroken_cycles(rows);
  // The last group ends with the last cycle.
  const auto drop = [&](std::size_t count) {
    cycles.y.erase(cycles.y.begin(),
                   cycles.y.begin() + static_cast<std::ptrdiff_t>(count * cycles.points));
  };
  if (cycles.count() > m) drop(cycles.count() % m);
  if (cycles.count() >= 2 * m) drop(m * first_steady({cycles.y, cycles.points * m}));
  if (auto good = check_repetition(cycles, periods, place, name); !good) return good.error();
  RunOverPeriods out;
  out.data.periods = periods;
  out.cycles = static_cast<long>(cycles.count());
  excite(rows, rows.size() - cycles.count(), periods, out.data);
  average(cycles.y, cycles.points * m, out.data);
  return out;
}

}  // namespace shaker::cli
