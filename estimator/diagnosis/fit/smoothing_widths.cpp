// How wide corners are: as a grid can follow them, as the catalogue states them, as a file does.
#include <algorithm>
#include <cmath>

#include "estimator/diagnosis/cycles/harmonics.hpp"
#include "estimator/diagnosis/fit/internal/model_of_run.hpp"
#include "estimator/diagnosis/fit/internal/smoothing.hpp"
#include "estimator/model/effects/catalogue.hpp"
#include "estimator/model/effects/scaled.hpp"

namespace shaker::estimator::diagnosis {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr double kSharpest = 1e-4, kBluntest = 50.0;  // of the widths that effects state
constexpr double kStatedAt = 192.0;  // points at which a width is as stated where there is no cycle
constexpr double kJump = 0.5, kBend = 0.05;  // widths in steps
// m/s, scaled: the largest width with which a friction begins on a record. The widths of the catalogue,
// which differ, must not decide between frictions.
constexpr double kTurnsOnRecord = 2e-3;
// Of the width that the catalogue states: a bend on a record, which has no grid. Wider ones hide a play.
constexpr double kBendOnRecord = 0.025;
// Of the width that the catalogue states: 0.2 mm/s. Twice that leaves f_c 0.3 % off, twice as far.
constexpr double kAtOnce = 0.04;
// Of the largest speed: somewhat more than the above makes of any friction of the catalogue.
constexpr double kSeenAtOnce = 6e-4;
constexpr double kNarrow = 0.02;       // of it, in a prediction in time
constexpr double kShareOfWidth = 0.5;  // that a run may pass in a step
constexpr int kMostTimes = 32;         // the points
constexpr int kSmoothHarmonics = 6;    // of the motion: those above carry noise

struct Corner {
  std::size_t line;
  std::string symbol, unit;
  double width, on_record;
  bool jumps;
};

// The widths that the catalogue calls e, w and, of a hysteretic displacement, r.
std::vector<Corner> corners_of(const config::ModelSpec& spec) {
  std::vector<Corner> corners;
  for (std::size_t i = 0; i < spec.effects.size(); ++i) {
    const Effect* effect = find_effect(spec.effects[i].effect);
    if (effect == nullptr || effect->group() != Group::damper) continue;
    for (const ConstantInfo& stated : effect->constants()) {
      const ConstantInfo info = scaled(stated, spec.effects[i].scale);
      const std::string symbol(info.symbol);
      const bool edge = symbol == "e" || symbol == "w" || symbol == "r";
      if (info.width && edge && !spec.effects[i].constants.contains(symbol))
        corners.push_back(
            {i, symbol, std::string(info.unit), info.value,
             (symbol == "e" ? std::min(1.0, kTurnsOnRecord / stated.value) : kBendOnRecord) *
                 info.value,
             jumps(*effect)});
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
  const VectorXd speed = synthesised(v, kPoints);
  const VectorXd acceleration = synthesised(a, kPoints);
  const VectorXd jerk = synthesised(derivative(a, datum.frequency_hz), kPoints);
  Pace pace{speed.cwiseAbs().maxCoeff(), 0.0, jerk.cwiseAbs().maxCoeff()};
  for (Index i = 0; i < kPoints; ++i) {
    const Index next = (i + 1) % kPoints;
    if (speed[i] * speed[next] <= 0.0)
      pace.turning =
          std::max({pace.turning, std::fabs(acceleration[i]), std::fabs(acceleration[next])});
  }
  return pace;
}

}  // namespace

bool has_edges(const config::ModelSpec& spec) {
  return !corners_of(spec).empty();
}

bool has_smoothing(const config::ModelSpec& spec) {
  const Model model(spec);
  return has_edges(spec) || model.coordinates() > model.mechanical();
}

config::ModelSpec rounded_for(const config::ModelSpec& spec, const RunDatum& datum, int points,
                              bool at_once) {
  const auto corners = corners_of(spec);
  if (corners.empty()) return spec;
  config::ModelSpec rounded = spec;
  const Pace pace = datum.sampled ? Pace{} : pace_of(datum);
  const double step = 1.0 / (std::max(datum.frequency_hz, 1e-6) * points);
  for (const Corner& corner : corners) {
    if (at_once && corner.jumps) {
      rounded.effects[corner.line].constants[corner.symbol] = width_of_jump(*datum.sampled);
      continue;
    }
    double passed = corner.on_record * kStatedAt / points;
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

std::shared_ptr<const Model> rounded_model(const config::ModelSpec& spec, const RunDatum& datum,
                                           int points, bool at_once) {
  return model_of_run(rounded_for(spec, datum, points, at_once), datum);
}

config::ModelSpec stated_for(const config::ModelSpec& spec) {
  config::ModelSpec stated = spec;
  for (const Corner& corner : corners_of(spec))
    stated.effects[corner.line].constants[corner.symbol] = corner.width;
  return stated;
}

config::ModelSpec stated_sharp(const config::ModelSpec& spec) {
  config::ModelSpec sharp = spec;
  for (const Turning& turning : turnings_of(spec)) {
    if (!turning.stated)
      sharp.effects[turning.line].constants[turning.symbol] = kAtOnce * turning.usual;
  }
  return sharp;
}

config::ModelSpec with_narrow_smoothing(const config::ModelSpec& spec) {
  config::ModelSpec narrow = spec;
  for (const Corner& corner : corners_of(spec))
    narrow.effects[corner.line].constants[corner.symbol] = kNarrow * corner.width;
  return narrow;
}

config::ModelSpec sharp_freed(const config::ModelSpec& spec, double speed) {
  config::ModelSpec freed = spec;
  for (const Turning& turning : turnings_of(spec)) {
    if (turning.stated && turning.width <= kSeenAtOnce * speed)
      freed.effects[turning.line].constants.erase(turning.symbol);
  }
  return freed;
}

int points_for(const config::ModelSpec& spec, const std::vector<RunDatum>& data, int points) {
  double narrowest = std::numeric_limits<double>::infinity();
  for (const Turning& turning : turnings_of(spec)) {
    if (turning.stated) narrowest = std::min(narrowest, turning.width);
  }
  double passed = 0.0;  // in a cycle, at the pace of its turning
  for (const RunDatum& datum : data) {
    if (!datum.sampled) passed = std::max(passed, pace_of(datum).turning / datum.frequency_hz);
  }
  int most = kMostTimes;
  for (; most > 1 && passed / points > kShareOfWidth * narrowest; most /= 2)
    points *= 2;
  return points;
}

}  // namespace shaker::estimator::diagnosis
