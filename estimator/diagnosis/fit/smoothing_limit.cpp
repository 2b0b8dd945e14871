#include "estimator/diagnosis/fit/internal/smoothing_limit.hpp"

#include <algorithm>
#include <limits>
#include <memory>

#include "estimator/diagnosis/fit/internal/smoothing.hpp"
#include "estimator/model/model.hpp"

namespace shaker::estimator::diagnosis {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

// e, e log e, e^2, e^2 log e, e^3: what halving the width makes of them; a logarithm is a double
// root.
constexpr double kRoots[] = {2.0, 2.0, 4.0, 4.0, 8.0};
constexpr std::size_t kFewest = 4, kMost = 7;  // rungs
constexpr double kTrifleOfRest =
    0.02;  // of what the limit leaves of the run: what is far off stays so
// Twice as wide as a step makes them sharpest: there the grid's own error is a hundredth.
constexpr int kPointsAWidth = 2;

// A grid, and the model with corners as wide as its steps are long.
struct Rung {
  std::shared_ptr<const Model> model;
  std::vector<Prediction> channels;  // those that have not settled; one solution for all
};

// What a channel has seen of the rungs.
struct Climb {
  const RunDatum& datum;
  std::vector<MatrixXd> values;
  std::optional<SmoothingLimit> limit;
  bool settled = false;

  void see(const Prediction& prediction, double most) {
    values.emplace_back(prediction.value().size(), 1 + prediction.jacobian().cols());
    values.back() << prediction.value(), prediction.jacobian();
    if (values.size() < kFewest) return;
    limit = eliminated(values, datum);
    const double left = whitened(datum, datum.response - limit->value).norm();
    settled = whitened(datum, limit->open).norm() < std::max(most, kTrifleOfRest * left);
  }
};

Rung rung_of(const config::ModelSpec& spec, const std::vector<Climb*>& open, int points,
             AnalysisMatrices& matrices) {
  const RunDatum& run = open.front()->datum;
  Rung rung{rounded_model(spec, run, points / kPointsAWidth), {}};
  rung.channels.reserve(open.size());
  rung.channels.emplace_back(*rung.model, run, points);
  for (std::size_t c = 1; c < open.size(); ++c)
    rung.channels.emplace_back(rung.channels.front(), open[c]->datum);
  for (Prediction& channel : rung.channels)
    channel.share(matrices);
  return rung;
}

// False where it has no solution. From beyond the rungs before it, and if that leads nowhere from
// the last.
bool climb(Rung& rung, const Prediction& last, const Prediction* before,
           const std::vector<double>& theta) {
  Prediction& first = rung.channels.front();
  if (before != nullptr)
    first.start_beyond(last, *before);
  else
    first.start_from(last);
  if (!first.at(theta, HowFar::near)) {
    first.start_from(last);
    if (before == nullptr || !first.at(theta, HowFar::near)) return false;
  }
  return std::all_of(rung.channels.begin() + 1, rung.channels.end(),
                     [&](Prediction& other) { return other.at(theta, HowFar::near); });
}

}  // namespace

SmoothingLimit eliminated(const std::vector<MatrixXd>& rungs, const RunDatum& datum) {
  std::vector<MatrixXd> column = rungs;
  MatrixXd best = rungs.back();
  VectorXd open;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t order = 0; order + 1 < rungs.size() && order < std::size(kRoots); ++order) {
    const VectorXd last = column.back().col(0);
    const double root = kRoots[order];
    for (std::size_t k = column.size(); k-- > 1;)
      column[k] = (root * column[k] - column[k - 1]) / (root - 1.0);
    column.erase(column.begin());
    const VectorXd moved = column.back().col(0) - last;
    const double size = whitened(datum, moved).norm();
    if (!(size < least)) continue;
    least = size;
    best = column.back();
    open = moved;
  }
  return {best.col(0), best.rightCols(best.cols() - 1), open};
}

std::optional<std::vector<SmoothingLimit>> smoothing_limits(
    const config::ModelSpec& spec, const std::vector<const RunDatum*>& channels,
    const std::vector<double>& theta, const Prediction& near, int points,
    AnalysisMatrices& matrices, double left_open) {
  std::vector<Climb> climbs;
  for (const RunDatum* channel : channels)
    climbs.push_back({*channel, {}, {}, false});
  std::vector<Climb*> open;
  for (Climb& one : climbs)
    open.push_back(&one);
  Rung last, before;
  for (std::size_t k = 0; k < kMost && !open.empty(); ++k, points *= 2) {
    Rung finer = rung_of(spec, open, points, matrices);
    if (!climb(finer, last.model ? last.channels.front() : near,
               before.model ? &before.channels.front() : nullptr, theta))
      break;
    for (std::size_t c = 0; c < open.size(); ++c)
      open[c]->see(finer.channels[c], left_open);
    std::erase_if(open, [](const Climb* one) { return one->settled; });
    before = std::move(last);
    last = std::move(finer);
  }
  std::vector<SmoothingLimit> limits;
  for (Climb& one : climbs) {
    if (!one.limit) return std::nullopt;
    limits.push_back(std::move(*one.limit));
  }
  return limits;
}

}  // namespace shaker::estimator::diagnosis
