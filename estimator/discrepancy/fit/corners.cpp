#include "estimator/discrepancy/fit/corners.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/discrepancy/cycles/harmonics.hpp"
#include "estimator/discrepancy/fit/corner_limit.hpp"
#include "estimator/effects/catalogue.hpp"

namespace shaker::estimator::discrepancy {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr int kLevels = 3, kRounds = 2;
constexpr double kSharpest = 1e-4, kBluntest = 50.0;  // of the widths that effects state
constexpr int kMostSteps = 25;                        // of a fit that begins at the last grid's
constexpr double kFarFromNoise = 4.0;  // of chi-squared a datum: corners alone do not mend that
constexpr double kTouched = 0.01;      // of chi-squared, by the next finer grid: worth a refit
constexpr double kStatedAt = 256.0;  // points at which a width is as stated where there is no cycle
constexpr double kJump = 0.5, kBend = 0.05;  // widths in steps
constexpr int kSmoothHarmonics = 6;          // of the motion: those above carry noise

struct Corner {
  std::size_t line;
  std::string symbol, unit;
  double width;
};

// The widths that the catalogue calls e, w and, of a hysteretic displacement, r.
std::vector<Corner> corners_of(const config::ModelSpec& spec) {
  std::vector<Corner> corners;
  for (std::size_t i = 0; i < spec.effects.size(); ++i) {
    const Effect* effect = find_effect(spec.effects[i].effect);
    if (effect == nullptr || effect->group() != Group::damper) continue;
    for (const ConstantInfo& info : effect->constants()) {
      const std::string symbol(info.symbol);
      const bool edge = symbol == "e" || symbol == "w" || symbol == "r";
      if (info.width && edge && !spec.effects[i].constants.contains(symbol))
        corners.push_back({i, symbol, std::string(info.unit), info.value});
    }
  }
  return corners;
}

// A force that jumps must be spread over half a step for its solution to be smooth on the grid; one
// that only bends (a valve that opens, a chamber, a stop) is a derivative milder: there a width of
// a whole step would be as large as the force at which a valve opens.
double share_of_step(const Corner& corner) {
  if (corner.symbol == "e") return kJump;
  return corner.symbol == "w" ? kBend : 1.0;
}

// Largest speed, acceleration where the motion turns round, and jerk of a run.
struct Pace {
  double speed = 0.0, turning = 0.0, jerk = 0.0;
};

Pace pace_of(const RunDatum& datum) {
  constexpr int kPoints = 256;
  const VectorXd& whole = datum.kind == Kind::imposed_motion ? datum.driver
                          : datum.motion.size() > 0          ? datum.motion
                                                             : datum.response;
  const Index size = std::min(whole.size(), harmonic_size(kSmoothHarmonics));
  const VectorXd v = derivative(whole.head(size), datum.frequency_hz);
  const VectorXd a = derivative(v, datum.frequency_hz);
  const auto synthesis = synthesis_matrix(static_cast<int>((size - 1) / 2), kPoints);
  const VectorXd speed = synthesis * v;
  const VectorXd acceleration = synthesis * a;
  Pace pace{speed.cwiseAbs().maxCoeff(), 0.0,
            (synthesis * derivative(a, datum.frequency_hz)).cwiseAbs().maxCoeff()};
  for (Index i = 0; i < kPoints; ++i) {
    const Index next = (i + 1) % kPoints;
    if (speed[i] * speed[next] <= 0.0)
      pace.turning =
          std::max({pace.turning, std::fabs(acceleration[i]), std::fabs(acceleration[next])});
  }
  return pace;
}

// The next finer grid changes the prediction by a share of what is left that could matter.
bool worth_sharpening(const HarmonicFit& first, const std::vector<RunDatum>& data, int points) {
  if (first.chi_squared < kFarFromNoise * first.observations) return true;
  double change = 0.0;
  for (std::size_t r = 0; r < data.size(); ++r) {
    if (data[r].role != Role::fit) continue;
    const Model model(rounded_for(first.spec, data[r], points));
    Prediction finer(model, data[r], points);
    finer.start_from(first.predictions[r]);
    if (!finer.at(first.theta, false)) return true;
    change += whitened(data[r], finer.value() - first.predictions[r].value()).squaredNorm();
  }
  return change > kTouched * first.chi_squared;
}

// A record has no finer grid than its samples: three widths, which go with 1, 2, 4.
std::optional<CornerLimit> limit_on_samples(const std::vector<std::shared_ptr<HarmonicFit>>& fits,
                                            const HarmonicFit& at, std::size_t run) {
  std::vector<VectorXd> y;
  for (std::size_t k = fits.size(); k-- > 0;) {
    if (!fits[k]->predictions[run].at(at.theta)) return std::nullopt;
    y.push_back(fits[k]->predictions[run].value());
  }
  const VectorXd even = (4.0 * y[0] - y[1]) / 3.0;
  if (y.size() < 3) return CornerLimit{even, y[0] - y[1]};
  const VectorXd limit = (8.0 * y[0] - 6.0 * y[1] + y[2]) / 3.0;
  return CornerLimit{limit, limit - even};
}

// What is left to corners of no width at the parameters of `at`, taken away from the data, with
// what stays open in their covariance. Null where a grid has no solution.
std::shared_ptr<const std::vector<RunDatum>> less_corners(
    const std::vector<std::shared_ptr<HarmonicFit>>& fits, const HarmonicFit& at,
    const std::vector<RunDatum>& data, int points) {
  auto corrected = std::make_shared<std::vector<RunDatum>>(data);
  for (std::size_t r = 0; r < data.size(); ++r) {
    const Prediction& near = at.predictions[r];
    const auto limit = data[r].sampled ? limit_on_samples(fits, at, r)
                                       : corner_limit(at.spec, data[r], at.theta, near, points);
    if (!limit) return nullptr;
    RunDatum& datum = (*corrected)[r];
    datum.response -= limit->value - near.value();
    set_covariance(datum, covariance_of(datum) + limit->open * limit->open.transpose());
  }
  return corrected;
}

}  // namespace

bool has_corners(const config::ModelSpec& spec) {
  const Model model(spec);
  return !corners_of(spec).empty() || model.coordinates() > model.mechanical();
}

config::ModelSpec rounded_for(const config::ModelSpec& spec, const RunDatum& datum, int points) {
  const auto corners = corners_of(spec);
  if (corners.empty()) return spec;
  config::ModelSpec rounded = spec;
  const Pace pace = datum.sampled ? Pace{} : pace_of(datum);
  const double step = 1.0 / (std::max(datum.frequency_hz, 1e-6) * points);
  for (const Corner& corner : corners) {
    double passed = corner.width * kStatedAt / points;
    if (!datum.sampled) {
      if (corner.unit == "m") passed = pace.speed * step;
      if (corner.unit == "m/s") passed = pace.turning * step;
      if (corner.unit == "m/s^2") passed = pace.jerk * step;
      passed *= share_of_step(corner);
    }
    rounded.effects[corner.line].constants[corner.symbol] =
        std::clamp(passed, kSharpest * corner.width, kBluntest * corner.width);
  }
  return rounded;
}

std::optional<Sharpened> sharpen(const HarmonicFit& first, const std::vector<RunDatum>& data,
                                 const FitOptions& options) {
  FitOptions level = options;
  level.sharp = true;
  level.max_iterations = kMostSteps;
  if (!worth_sharpening(first, data, 2 * options.points)) return std::nullopt;
  std::vector<std::shared_ptr<HarmonicFit>> fits;
  for (int k = 0; k < kLevels; ++k, level.points *= 2) {
    const HarmonicFit& near = fits.empty() ? first : *fits.back();
    auto fit =
        std::make_shared<HarmonicFit>(fit_harmonics(first.spec, data, near.theta, &near, level));
    if (!std::isfinite(fit->chi_squared) || !fit->converged) break;
    fits.push_back(std::move(fit));
  }
  if (fits.size() < 2) return std::nullopt;
  // The limit moves with the parameters, and they with it: of periodic runs, where it is cheap, it
  // is taken again.
  const int rounds = data.front().sampled ? 1 : kRounds;
  level.points = fits.back()->predictions.front().points();
  Sharpened sharp{fits.back(), nullptr};
  for (int round = 0; round < rounds; ++round) {
    sharp.data = less_corners(fits, *sharp.fit, data, options.points);
    if (!sharp.data) return std::nullopt;
    sharp.fit = std::make_shared<const HarmonicFit>(
        fit_harmonics(first.spec, *sharp.data, sharp.fit->theta, sharp.fit.get(), level));
    if (!std::isfinite(sharp.fit->chi_squared)) return std::nullopt;
  }
  return sharp;
}

}  // namespace shaker::estimator::discrepancy
