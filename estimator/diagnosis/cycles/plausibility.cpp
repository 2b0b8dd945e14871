#include "estimator/diagnosis/cycles/internal/plausibility.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include <Eigen/Dense>
#include <fmt/format.h>

#include "estimator/diagnosis/cycles/harmonics.hpp"
#include "estimator/math/harmonic_basis.hpp"
#include "estimator/solve/periodic/periodic_system.hpp"

namespace shaker::estimator::diagnosis {
namespace {

constexpr int kPoints = 128;
constexpr double kOtherUnit = 100.0;
constexpr double kOpposite = 150.0 / 180.0 * std::numbers::pi;

// A motion over a period: where it stands, and its fundamental.
struct Motion {
  double mean = 0.0, cosine = 0.0, sine = 0.0;
  double size() const { return std::hypot(cosine, sine); }
};

struct Pair {
  std::string run;
  Motion measured, expected;
  double ratio() const { return measured.size() / expected.size(); }
  bool opposite() const {
    const double along = measured.cosine * expected.cosine + measured.sine * expected.sine;
    return along < std::cos(kOpposite) * measured.size() * expected.size();
  }
  bool mirrored() const {
    return std::fabs(expected.mean) > 2.0 * expected.size() &&
           -measured.mean / expected.mean > 0.5 && -measured.mean / expected.mean < 2.0;
  }
};

std::optional<Pair> compare(const SteadyRun& run, const Model& model) {
  const Eigen::VectorXd drive = run.mean_driver(), response = run.mean();
  PeriodicSystem system(model, {Scheme::order4, kPoints, true});
  system.set_excitation(run.frequency_hz, std::hypot(drive[1], drive[2]));
  if (system.solve_from_rest(model.start()).status != SolveStatus::converged) return {};
  Pair pair{run.name, {response[0], response[1], response[2]}, {}};
  std::vector<double> curve;
  for (int i = 0; i < kPoints; ++i)
    curve.push_back(system.observed(i));
  const auto wave = fourier_sum(curve, 1, 2.0 / kPoints);
  pair.expected = {fourier_sum(curve, 0, 1.0 / kPoints).real(), wave.real(), -wave.imag()};
  if (!(pair.measured.size() > 0.0) || !(pair.expected.size() > 0.0)) return {};
  return pair;
}

}  // namespace

Result<void> plausible(const std::vector<SteadyRun>& runs, const config::ModelSpec& spec,
                       std::vector<std::string>& warnings) {
  const Model model(spec);
  std::vector<Pair> pairs;
  for (const SteadyRun& run : runs) {
    if (run.kind != Kind::periodic) return {};
    if (const auto pair = compare(run, model)) pairs.push_back(*pair);
  }
  if (pairs.empty()) return {};
  const auto every = [&](const auto& property) {
    return std::all_of(pairs.begin(), pairs.end(), property);
  };
  const std::string& unit = spec.length_unit;
  const Pair& first = pairs.front();
  if (every([](const Pair& p) { return p.ratio() > kOtherUnit; }) ||
      every([](const Pair& p) { return p.ratio() < 1.0 / kOtherUnit; }))
    return Error{
        ErrorKind::invalid,
        fmt::format("in every run the stroke's amplitude is far from the model's: {:.3g} {} in run "
                    "{}, where its start values give {:.3g} {}; is /units/displacement what the "
                    "files count in? If it is, mend the start values",
                    first.measured.size(), unit, first.run, first.expected.size(), unit)};
  if (every([](const Pair& p) { return p.mirrored(); }))
    return Error{
        ErrorKind::invalid,
        fmt::format("in every run the stroke stands on the other side of zero than the model: at "
                    "{:.3g} {} in run {}, where its start values give {:.3g} {}; the stroke is "
                    "positive in compression: turn the sensor's sign",
                    first.measured.mean, unit, first.run, first.expected.mean, unit)};
  if (every([](const Pair& p) { return p.opposite(); }))
    warnings.emplace_back(
        "in every run the stroke moves against the model at its start values: is the sensor's "
        "sign, or that of the excitation, turned?");
  return {};
}

}  // namespace shaker::estimator::diagnosis
