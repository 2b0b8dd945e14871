#include "estimator/discrepancy/weigh/wrong_unit.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include <fmt/format.h>

#include "estimator/discrepancy/cycles/harmonics.hpp"
#include "estimator/discrepancy/fit/prediction.hpp"

namespace shaker::estimator::discrepancy {
namespace {

constexpr double kMuchLeft = 0.2;     // of the response's motion, that any look is worth it
constexpr double kTenth = 0.1;        // of what is left without the factor
constexpr double kWithoutFit = 0.01;  // of the motion: a true factor leaves a thousandth
constexpr double kApart = 15.0;       // times the other runs' response to what drives them
constexpr double kNear = 2.5;         // times a conversion factor, of a run that stands apart

constexpr double kOtherUnit = 100.0;  // times what the start values give
constexpr double kGivenBack = 0.1;    // of speed times force

struct Conversion {
  double factor;  // on the values, to be what is said
  const char* sentence;
};

constexpr std::array<Conversion, 8> kLengths = {
    {{1e-3, "millimetres that are called metres"},
     {1e3, "metres that are called millimetres"},
     {1e-2, "centimetres that are called metres"},
     {1e2, "metres that are called centimetres"},
     {0.0254, "inches that are called metres"},
     {1.0 / 0.0254, "metres that are called inches"},
     {25.4, "inches that are called millimetres"},
     {1.0 / 25.4, "millimetres that are called inches"}}};
constexpr std::array<Conversion, 4> kAccelerations = {{{9.80665, "g that are called m/s^2"},
                                                       {1.0 / 9.80665, "m/s^2 that are called g"},
                                                       {1e-3, "mm/s^2 that are called m/s^2"},
                                                       {1e3, "m/s^2 that are called mm/s^2"}}};

// Of every run the share of the motion that the fit leaves, the mean apart; root mean square.
double left_by(const std::vector<RunDatum>& data, const HarmonicFit& fit) {
  if (!fit.trouble.empty() || !std::isfinite(fit.chi_squared) ||
      fit.predictions.size() != data.size())
    return std::numeric_limits<double>::infinity();
  double sum = 0.0;
  for (std::size_t r = 0; r < data.size(); ++r) {
    const Eigen::Index moving = data[r].response.size() - 1;
    const double left = (data[r].response - fit.predictions[r].value()).tail(moving).norm();
    sum += std::pow(left / data[r].response.tail(moving).norm(), 2.0);
  }
  return std::sqrt(sum / static_cast<double>(data.size()));
}

// What is left when some runs' response, or every run's driver, is multiplied.
class Trial {
 public:
  Trial(const Look& look, const config::ModelSpec& model, const FitOptions& options)
      : look_(look), model_(model), options_(options) {}

  double response(double factor, const std::vector<std::size_t>& which) const {
    std::vector<SteadyRun> runs = look_.runs;
    for (const std::size_t r : which) {
      runs[r].response *= factor;
      runs[r].quantum *= factor;
    }
    return left(runs);
  }
  double driver(double factor) const {
    std::vector<SteadyRun> runs = look_.runs;
    for (SteadyRun& run : runs)
      run.driver *= factor;
    return left(runs);
  }

 private:
  double left(const std::vector<SteadyRun>& runs) const {
    const Weighed weighed = weigh(runs);
    return left_by(weighed.data, fit_harmonics(model_, weighed.data, {}, nullptr, options_));
  }

  const Look& look_;
  const config::ModelSpec& model_;
  const FitOptions& options_;
};

// Runs whose response to what drives them is many times the others', and by how much.
std::vector<std::size_t> standing_apart(const std::vector<SteadyRun>& runs, double& times) {
  std::vector<double> gains, sorted;
  for (const SteadyRun& run : runs)
    gains.push_back(std::hypot(run.mean()[1], run.mean()[2]) /
                    std::hypot(run.mean_driver()[1], run.mean_driver()[2]));
  sorted = gains;
  std::sort(sorted.begin(), sorted.end());
  // The widest step between neighbours: the fewer are apart.
  std::size_t above = 0;
  times = 1.0;
  for (std::size_t i = 1; i < sorted.size(); ++i) {
    if (!(sorted[i] > times * sorted[i - 1])) continue;
    times = sorted[i] / sorted[i - 1];
    above = i;
  }
  const bool high = 2 * (sorted.size() - above) <= sorted.size();
  std::vector<std::size_t> apart;
  for (std::size_t r = 0; r < gains.size(); ++r) {
    if ((gains[r] >= sorted[above]) == high) apart.push_back(r);
  }
  if (!high) times = 1.0 / times;
  return apart;
}

std::string names_of(const std::vector<SteadyRun>& runs, const std::vector<std::size_t>& which) {
  std::string names;
  for (const std::size_t r : which)
    names += (names.empty() ? "" : ", ") + runs[r].name;
  return names;
}

// Below which a factor is believed. Where the model has no fit, only one that leaves next to
// nothing.
double believed_below(double left) {
  return std::isfinite(left) ? std::min(kTenth * left, kMuchLeft) : kWithoutFit;
}

std::string as_it_is(double left) {
  return std::isfinite(left) ? fmt::format("as it is {:.3g} %", 100.0 * left)
                             : std::string("and as it is there is no fit at all");
}

Error wrong(const std::string& where, const char* channel, const Conversion& conversion,
            double before, double after) {
  return {ErrorKind::invalid,
          fmt::format("{} the {} does not count in the unit that is said: multiplied by {:.4g} the "
                      "model leaves {:.2g} % of the response, {}; {}? Mend /units, or the files",
                      where, channel, conversion.factor, 100.0 * after, as_it_is(before),
                      conversion.sentence)};
}

Result<void> every_run(const Look& look, const Trial& trial, double left) {
  std::vector<std::size_t> all(look.runs.size());
  for (std::size_t r = 0; r < all.size(); ++r)
    all[r] = r;
  double least = believed_below(left);
  Result<void> said;
  for (const Conversion& length : kLengths) {
    const double after = trial.response(length.factor, all);
    if (!(after < least)) continue;
    said = wrong("in every run", "displacement", length, left, after);
    least = after;
  }
  for (const Conversion& acceleration : kAccelerations) {
    const double after = trial.driver(acceleration.factor);
    if (!(after < least)) continue;
    said = wrong("in every run", "excitation", acceleration, left, after);
    least = after;
  }
  return said;
}

Result<void> some_runs(const Look& look, const Trial& trial, double left) {
  double times = 1.0;
  const auto apart = standing_apart(look.runs, times);
  if (std::fabs(std::log(times)) < std::log(kApart)) return {};
  double least = believed_below(left);
  Result<void> said;
  for (const Conversion& length : kLengths) {
    if (std::fabs(std::log(times * length.factor)) > std::log(kApart * kNear)) continue;
    const double after = trial.response(length.factor, apart);
    if (!(after < least)) continue;
    said = wrong("in run " + names_of(look.runs, apart), "displacement", length, left, after);
    least = after;
  }
  return said;
}

// Of an imposed motion the force scales with the parameters, and a fit tells nothing: the start
// values do, and that a damper takes energy.
Result<void> force_as_said(const Look& look, const config::ModelSpec& spec, int points) {
  const Model model(spec);
  bool other = true, giving = true;
  double times = 1.0;
  for (std::size_t r = 0; r < look.runs.size(); ++r) {
    const RunDatum& datum = look.weighed.data[r];
    Prediction expected(model, datum, points);
    if (!expected.at(model.start())) return {};
    const Eigen::Index moving = datum.response.size() - 1;
    times = datum.response.tail(moving).norm() / expected.value().tail(moving).norm();
    other = other && std::fabs(std::log(times)) > std::log(kOtherUnit);
    const Eigen::VectorXd speed = derivative(datum.driver, datum.frequency_hz);
    const Eigen::Index shared = std::min(speed.size(), datum.response.size()) - 1;
    const double power = speed.segment(1, shared).dot(datum.response.segment(1, shared));
    giving = giving && power < -kGivenBack * speed.norm() * datum.response.tail(moving).norm();
  }
  if (other)
    return Error{
        ErrorKind::invalid,
        fmt::format("in every run the force is far from the model's: {:.3g} times what its start "
                    "values give in run {}; is /units/force what the files count in, and "
                    "reference_mass the mass? If they are, mend the start values",
                    times, look.runs.back().name)};
  if (giving)
    return Error{ErrorKind::invalid,
                 "in every run the damper gives out energy: force and speed are opposed; turn the "
                 "sign of the force, or that of the displacement"};
  return {};
}

}  // namespace

Result<void> in_one_unit(const Look& look, const config::ModelSpec& model,
                         const FitOptions& options) {
  if (look.runs.front().kind == Kind::imposed_motion)
    return force_as_said(look, model, options.points);
  if (look.runs.front().kind != Kind::periodic || look.runs.size() < 2) return {};
  const double left = look.fitted() ? left_by(look.weighed.data, look.fit)
                                    : std::numeric_limits<double>::infinity();
  if (!(left > kMuchLeft)) return {};
  const Trial trial(look, model, options);
  if (auto good = some_runs(look, trial, left); !good) return good;
  return every_run(look, trial, left);
}

}  // namespace shaker::estimator::discrepancy
