#include "estimator/diagnosis/noise/internal/wrong_unit.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <vector>

#include <fmt/format.h>

#include "base/unit.hpp"
#include "estimator/diagnosis/cycles/harmonics.hpp"
#include "estimator/diagnosis/fit/internal/prediction.hpp"
#include "estimator/diagnosis/records/internal/transient_run.hpp"

namespace shaker::estimator::diagnosis {
namespace {

constexpr double kAnsweredOtherwise = 1.4;  // times what the fit says
constexpr double kMinShareLeft = 0.2;       // of the response's motion, that any look is worth it
constexpr double kTenth = 0.1;              // of what is left without the factor
constexpr double kWithoutFit = 0.01;        // of the motion: a true factor leaves a thousandth
constexpr double kMinApartRatio = 15.0;     // times the other runs' response to what drives them
constexpr double kMaxFactorRatio = 2.5;     // times a conversion factor, of a run that stands apart

constexpr double kOtherSize = 100.0;  // times what the start values give
constexpr double kGivenBack = 0.1;    // of speed times force

// Values in one unit that are said to be in another one.
struct Misnomer {
  const char *unit, *said, *sentence;
  double factor() const { return conversion(unit, said)->scale; }  // on the values
};

constexpr std::array<Misnomer, 8> kLengths = {{{"mm", "m", "millimetres that are called metres"},
                                               {"m", "mm", "metres that are called millimetres"},
                                               {"cm", "m", "centimetres that are called metres"},
                                               {"m", "cm", "metres that are called centimetres"},
                                               {"in", "m", "inches that are called metres"},
                                               {"m", "in", "metres that are called inches"},
                                               {"in", "mm", "inches that are called millimetres"},
                                               {"mm", "in", "millimetres that are called inches"}}};
constexpr std::array<Misnomer, 4> kAccelerations = {
    {{"g", "m/s^2", "g that are called m/s^2"},
     {"m/s^2", "g", "m/s^2 that are called g"},
     {"mm/s^2", "m/s^2", "mm/s^2 that are called m/s^2"},
     {"m/s^2", "mm/s^2", "m/s^2 that are called mm/s^2"}}};
constexpr std::array<Misnomer, 4> kForces = {{{"N", "kN", "N that are called kN"},
                                              {"kN", "N", "kN that are called N"},
                                              {"kgf", "N", "kgf that are called N"},
                                              {"N", "kgf", "N that are called kgf"}}};

// Of every run the share of the motion that the fit leaves, the mean apart; root mean square. Of
// forces the mean as well: what bears the load gives it.
double left_by(const std::vector<RunDatum>& data, const HarmonicFit& fit) {
  if (!fit.trouble.empty() || !std::isfinite(fit.chi_squared) ||
      fit.predictions.size() != data.size())
    return std::numeric_limits<double>::infinity();
  double sum = 0.0;
  for (std::size_t r = 0; r < data.size(); ++r) {
    const Eigen::Index moving = data[r].response.size() - 1;
    const Eigen::Index seen = moving + (data[r].kind == Kind::imposed_motion ? 1 : 0);
    const double left = (data[r].response - fit.predictions[r].value()).tail(seen).norm();
    sum += std::pow(left / data[r].response.tail(moving).norm(), 2.0);
  }
  return std::sqrt(sum / static_cast<double>(data.size()));
}

// With its errors.
void multiply_response(RunDatum& datum, double factor) {
  datum.response *= factor;
  datum.error *= factor;
  datum.clock *= factor;
  if (datum.whitening)
    datum.whitening = std::make_shared<const Eigen::MatrixXd>(*datum.whitening / factor);
}

// What is left when some runs' response, or every run's driver, is multiplied.
class Trial {
 public:
  Trial(const Look& look, const config::ModelSpec& model, const FitOptions& options)
      : look_(look), model_(model), options_(options) {}

  double response(double factor, const std::vector<std::size_t>& which) const {
    std::vector<RunDatum> data = look_.weighed.data;
    for (const std::size_t r : which)
      multiply_response(data[r], factor);
    return left(data);
  }
  double driver(double factor, const std::vector<std::size_t>& which) const {
    std::vector<RunDatum> data = look_.weighed.data;
    for (const std::size_t r : which)
      data[r].driver *= factor;
    return left(data);
  }

 private:
  double left(const std::vector<RunDatum>& data) const {
    return left_by(data, fit_harmonics(model_, data, {}, nullptr, options_));
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
  return std::isfinite(left) ? std::min(kTenth * left, kMinShareLeft) : kWithoutFit;
}

std::string as_it_is(double left) {
  return std::isfinite(left) ? fmt::format("as it is {:.3g} %", 100.0 * left)
                             : std::string("and as it is there is no fit at all");
}

Error wrong(const std::string& where, const char* channel, const Misnomer& misnomer, double before,
            double after) {
  return {ErrorKind::invalid,
          fmt::format("{} the {} does not count in the unit that is said: multiplied by {:.4g} the "
                      "model leaves {:.2g} % of the response, {}; {}? Mend /units, or the files",
                      where, channel, misnomer.factor(), 100.0 * after, as_it_is(before),
                      misnomer.sentence)};
}

std::vector<std::size_t> all_of(const Look& look) {
  std::vector<std::size_t> all(look.runs.size());
  for (std::size_t r = 0; r < all.size(); ++r)
    all[r] = r;
  return all;
}

// The conversion that leaves least, if any is believed.
template <class Misnomers, class Left>
Result<void> best_of(const std::string& where, const char* channel, const Misnomers& misnomers,
                     double before, double& least, const Left& left) {
  Result<void> said;
  for (const Misnomer& misnomer : misnomers) {
    const double after = left(misnomer.factor());
    if (!(after < least)) continue;
    said = wrong(where, channel, misnomer, before, after);
    least = after;
  }
  return said;
}

Result<void> every_run(const Look& look, const Trial& trial, double left) {
  const auto all = all_of(look);
  const bool imposed = look.runs.front().kind == Kind::imposed_motion;
  const auto response = [&](double factor) { return trial.response(factor, all); };
  const auto driver = [&](double factor) { return trial.driver(factor, all); };
  double least = believed_below(left);
  const std::string where = "in every run";
  auto first = imposed ? best_of(where, "force", kForces, left, least, response)
                       : best_of(where, "displacement", kLengths, left, least, response);
  auto second = imposed ? best_of(where, "displacement", kLengths, left, least, driver)
                        : best_of(where, "excitation", kAccelerations, left, least, driver);
  return second ? first : second;
}

// Runs that answered by far more or less than the fit says of them.
std::vector<std::size_t> answered_otherwise(const Look& look) {
  std::vector<std::size_t> runs;
  for (std::size_t r = 0; r < look.runs.size() && look.fitted(); ++r) {
    const RunDatum& datum = look.weighed.data[r];
    const Eigen::VectorXd& said = look.fit.predictions[r].value();
    const double times = datum.response.segment(1, 2).norm() / said.segment(1, 2).norm();
    if (std::fabs(std::log(times)) > std::log(kAnsweredOtherwise)) runs.push_back(r);
  }
  return runs;
}

// Runs that were driven in another unit than the others: one after the other, as long as each
// leaves less. A damper's gain goes with frequency and amplitude, and does not tell them.
Result<void> some_excitations(const Look& look, const Trial& trial, double left) {
  double least = believed_below(left);
  Result<void> said;
  const std::vector<std::size_t> otherwise = answered_otherwise(look);
  for (const Misnomer& acceleration : kAccelerations) {
    std::vector<std::size_t> which;
    double reached = left;
    while (2 * (which.size() + 1) <= look.runs.size()) {
      std::vector<std::size_t> best;
      for (const std::size_t r : otherwise) {
        if (std::find(which.begin(), which.end(), r) != which.end()) continue;
        std::vector<std::size_t> more = which;
        more.push_back(r);
        const double after = trial.driver(acceleration.factor(), more);
        if (!(after < reached)) continue;
        reached = after;
        best = more;
      }
      if (best.empty()) break;
      which = best;
    }
    if (which.empty() || !(reached < least)) continue;
    std::sort(which.begin(), which.end());
    said = wrong("in run " + names_of(look.runs, which), "excitation", acceleration, left, reached);
    least = reached;
  }
  return said;
}

Result<void> some_runs(const Look& look, const Trial& trial, double left) {
  double times = 1.0;
  const auto apart = standing_apart(look.runs, times);
  if (std::fabs(std::log(times)) < std::log(kMinApartRatio)) return {};
  double least = believed_below(left);
  Result<void> said;
  for (const Misnomer& length : kLengths) {
    if (std::fabs(std::log(times * length.factor())) > std::log(kMinApartRatio * kMaxFactorRatio))
      continue;
    const double after = trial.response(length.factor(), apart);
    if (!(after < least)) continue;
    said = wrong("in run " + names_of(look.runs, apart), "displacement", length, left, after);
    least = after;
  }
  return said;
}

// How many times as large as the start values say the forces along an imposed motion are, the least
// far of all runs; nothing where they say nothing.
double times_expected(const Look& look, const Model& model, int points) {
  double nearest = 0.0;
  for (const RunDatum& datum : look.weighed.data) {
    Prediction expected(model, datum, points);
    if (!expected.at(model.start())) return 0.0;
    const Eigen::Index moving = datum.response.size() - 1;
    const double times = datum.response.tail(moving).norm() / expected.value().tail(moving).norm();
    if (!std::isfinite(times) || !(times > 0.0)) return 0.0;
    if (nearest == 0.0 || std::fabs(std::log(times)) < std::fabs(std::log(nearest)))
      nearest = times;
  }
  return nearest;
}

Error opposed_everywhere() {
  return {ErrorKind::invalid,
          "in every run the damper gives out energy: force and speed are opposed; turn the sign of "
          "the force, or that of the displacement"};
}

bool gives_out_energy(const RunDatum& datum) {
  const Eigen::VectorXd speed = derivative(datum.driver, datum.frequency_hz);
  const Eigen::Index moving = datum.response.size() - 1;
  const Eigen::Index shared = std::min<Eigen::Index>(speed.size() - 1, moving);
  const double power = speed.segment(1, shared).dot(datum.response.segment(1, shared));
  return power < -kGivenBack * speed.norm() * datum.response.tail(moving).norm();
}

// True where the model's file says anything about the size of its forces.
bool states_starts(const config::ModelSpec& spec) {
  for (const config::EffectSpec& effect : spec.effects) {
    for (const auto& [name, parameter] : effect.parameters) {
      if (parameter.start.value_or(0.0) != 0.0) return true;
    }
  }
  return false;
}

// Along an imposed motion force and coefficients scale together: where a fit takes the forces as
// they are, start values that are far off are as likely as another unit.
Result<void> force_as_said(const Look& look, const config::ModelSpec& spec,
                           const FitOptions& options, std::vector<std::string>& warnings) {
  const auto& data = look.weighed.data;
  if (std::all_of(data.begin(), data.end(), gives_out_energy)) return opposed_everywhere();
  const double left =
      look.fitted() ? left_by(data, look.fit) : std::numeric_limits<double>::infinity();
  if (left > kMinShareLeft) {
    if (auto good = every_run(look, Trial(look, spec, options), left); !good) return good;
  }
  const double times =
      states_starts(spec) ? times_expected(look, Model(spec), options.points) : 0.0;
  if (times > 0.0 && std::fabs(std::log(times)) > std::log(kOtherSize))
    warnings.push_back(fmt::format(
        "in every run the force is far from what the start values give, at least {:.3g} times it: "
        "if they are near the damper's, look whether /units/force and /units/displacement are "
        "what the files count in, and reference_mass is the mass",
        times));
  return {};
}

}  // namespace

Result<void> in_one_unit(const Look& look, const config::ModelSpec& model,
                         const FitOptions& options, std::vector<std::string>& warnings) {
  if (look.runs.front().kind == Kind::imposed_motion)
    return force_as_said(look, model, options, warnings);
  if (look.runs.front().kind != Kind::periodic || look.runs.size() < 2) return {};
  const double left = look.fitted() ? left_by(look.weighed.data, look.fit)
                                    : std::numeric_limits<double>::infinity();
  if (!(left > kMinShareLeft)) return {};
  const Trial trial(look, model, options);
  if (auto good = some_runs(look, trial, left); !good) return good;
  if (auto good = some_excitations(look, trial, left); !good) return good;
  return every_run(look, trial, left);
}

Result<void> takes_in_energy(const std::vector<std::shared_ptr<SampledRun>>& along_motions) {
  const bool all = std::all_of(along_motions.begin(), along_motions.end(), [](const auto& run) {
    const Eigen::VectorXd force = run->response.array() - run->response.mean();
    return run->v.dot(force) < -kGivenBack * run->v.norm() * force.norm();
  });
  if (all) return opposed_everywhere();
  return {};
}

}  // namespace shaker::estimator::diagnosis
