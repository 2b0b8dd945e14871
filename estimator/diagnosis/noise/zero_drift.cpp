#include "estimator/diagnosis/noise/internal/zero_drift.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "estimator/diagnosis/cycles/internal/cycle_line.hpp"
#include "estimator/diagnosis/noise/internal/noise.hpp"
#include "estimator/math/statistics.hpp"

namespace shaker::estimator::diagnosis {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kChance = 1e-4;             // of one drift in all runs
constexpr double kChanceOfOne = 1e-6;        // of a drift in some run
constexpr double kOneRate = 1e-4;            // probability below which runs do not share theirs
constexpr double kMinChiSquaredApart = 9.0;  // of chi-squared between two readings
constexpr double kShape = 0.5;     // of the means' chi-squared, by harmonics that move as well
constexpr double kEffects = 40.0;  // that might be missing as well

double two_sided(double t, double freedom) {
  return student_t_two_sided(t, std::max(freedom, 1.0));
}

// Lines through what the cycles do beside following the driver: a table that grows warm and weak
// moves the response as well.
std::vector<CycleLine> own_lines(const std::vector<SteadyRun>& runs, HarmonicFit* fit) {
  std::vector<MatrixXd> cycles, driver;
  std::vector<VectorXd> when;
  for (const SteadyRun& run : runs) {
    cycles.push_back(run.response);
    driver.push_back(run.driver);
    when.push_back(run.when);
  }
  std::vector<CycleLine> lines = lines_through(cycles, when);
  VectorXd variance(static_cast<Index>(runs.size())), freedom(variance.size());
  for (std::size_t r = 0; r < runs.size(); ++r) {
    const auto at = static_cast<Index>(r);
    const VectorXd t = when[r].array() - when[r].mean();
    variance[at] = std::pow(lines[r].error[0], 2) * t.squaredNorm();
    freedom[at] = lines[r].freedom;
  }
  variance = variance.cwiseMax(1e-300);
  moderate(MatrixXd::Ones(variance.size(), 1), variance, freedom);
  const std::vector<CycleLine> drives = lines_through(driver, when);
  for (std::size_t r = 0; r < runs.size(); ++r) {
    const auto at = static_cast<Index>(r);
    const VectorXd t = when[r].array() - when[r].mean();
    lines[r].error[0] = std::sqrt(variance[at] / t.squaredNorm());
    lines[r].freedom = freedom[at];
    if (fit == nullptr || !runs[r].driver_measured) continue;
    const MatrixXd slope = fit->predictions[r].over_excitation(runs[r].driver_harmonics);
    const auto shared = std::min(slope.rows(), lines[r].rate.size());
    const Index columns = slope.cols();
    const MatrixXd followed = slope.topRows(shared);
    lines[r].rate.head(shared) -= followed * drives[r].rate.tail(columns);
    lines[r].error.head(shared) = (lines[r].error.head(shared).cwiseAbs2() +
                                   followed.cwiseAbs2() * drives[r].error.tail(columns).cwiseAbs2())
                                      .cwiseSqrt();
  }
  return lines;
}

// Chi-squared of the lines when nothing but the mean moves, and when a parameter does; each run at
// a rate of its own.
struct Readings {
  double all = 0.0, of_zero = 0.0, harmonics = 0.0;
  double of_parameter = std::numeric_limits<double>::infinity();
  std::string parameter;
};

Readings read(const std::vector<CycleLine>& lines, const HarmonicFit* fit) {
  Readings readings;
  for (const CycleLine& line : lines) {
    const VectorXd unit = line.rate.cwiseQuotient(line.error);
    readings.all += unit.squaredNorm();
    readings.of_zero += unit.tail(unit.size() - 1).squaredNorm();
    readings.harmonics += static_cast<double>(unit.size() - 1);
  }
  if (fit == nullptr) return readings;
  for (const int k : fit->free) {
    double left = readings.all;
    for (std::size_t r = 0; r < lines.size(); ++r) {
      const VectorXd column = fit->predictions[r].jacobian().col(k);
      const auto shared = std::min(column.size(), lines[r].rate.size());
      const VectorXd error = lines[r].error.head(shared);
      const VectorXd way = column.head(shared).cwiseQuotient(error);
      if (way.squaredNorm() > 0.0)
        left -= std::pow(way.dot(lines[r].rate.head(shared).cwiseQuotient(error)), 2) /
                way.squaredNorm();
    }
    if (left >= readings.of_parameter) continue;
    readings.of_parameter = left;
    readings.parameter = fit->model->parameters()[static_cast<std::size_t>(k)].name;
  }
  return readings;
}

// One rate over all runs, and whether it does for all.
void combine(const std::vector<SteadyRun>& runs, const std::vector<CycleLine>& lines,
             ZeroDrift& drift) {
  double weight = 0.0, apart = 0.0;
  drift.freedom = 0.0;
  for (const CycleLine& line : lines) {
    const double w = 1.0 / (line.error[0] * line.error[0]);
    weight += w;
    drift.rate += w * line.rate[0];
    drift.freedom += line.freedom;
  }
  drift.rate /= weight;
  double of_one = 1.0;
  for (const CycleLine& line : lines) {
    apart += std::pow((line.rate[0] - drift.rate) / line.error[0], 2);
    of_one = std::min(of_one, two_sided(line.rate[0] / line.error[0], line.freedom));
  }
  const auto others = static_cast<double>(lines.size()) - 1.0;
  drift.standard_error = std::sqrt((others > 0.0 ? std::max(1.0, apart / others) : 1.0) / weight);
  drift.chance = two_sided(drift.rate / drift.standard_error, drift.freedom);
  drift.found = drift.chance < kChance;
  of_one *= static_cast<double>(lines.size());
  if (of_one < kChanceOfOne) {
    drift.found = true;
    drift.chance = std::min(drift.chance, of_one);
  }
  drift.common = others < 1.0 || chi_squared_above(apart, others) > kOneRate;
  for (std::size_t r = 0; r < runs.size(); ++r)
    drift.of_run[runs[r].name] = drift.common ? drift.rate : lines[r].rate[0];
}

}  // namespace

ZeroDrift zero_drift(const std::vector<SteadyRun>& runs, HarmonicFit* fit) {
  ZeroDrift drift;
  const std::vector<CycleLine> lines = own_lines(runs, fit);
  combine(runs, lines, drift);
  if (!drift.found) return drift;
  const Readings readings = read(lines, fit);
  const double means = readings.all - readings.of_zero;
  const double apart = readings.of_parameter - readings.of_zero;
  if (apart < -kMinChiSquaredApart) {
    drift.found = false;
    drift.instead = fmt::format(
        "the damper itself changes while it is measured: the cycles' mean and shape move together, "
        "as if {} went on changing (oil that warms, gas that leaks); let it come to rest, or "
        "record shorter runs",
        readings.parameter);
    return drift;
  }
  const double beside = readings.of_zero - readings.harmonics;
  if (beside > kShape * means && beside > 6.0 * std::sqrt(2.0 * readings.harmonics)) {
    drift.found = false;
    drift.instead =
        "the cycles' mean moves with time and so does their shape: the damper changes while it is "
        "measured";
    return drift;
  }
  if (apart < kMinChiSquaredApart) drift.rival = readings.parameter;
  const double log_odds = 0.5 * (means - std::log(drift.freedom + 1.0)) - std::log(kEffects);
  const auto share = [](double log_ratio) { return 1.0 / (1.0 + std::exp(-log_ratio)); };
  drift.probability = std::min({0.999, share(log_odds), share(0.5 * std::min(apart, 100.0))});
  return drift;
}

}  // namespace shaker::estimator::diagnosis
