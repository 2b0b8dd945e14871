#include "estimator/discrepancy/fit/corner_limit.hpp"

#include <algorithm>
#include <limits>
#include <memory>

#include "estimator/discrepancy/fit/corners.hpp"
#include "estimator/model.hpp"

namespace shaker::estimator::discrepancy {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

// e, e log e, e^2, e^2 log e, e^3: what halving the width makes of them; a logarithm is a double
// root.
constexpr double kRoots[] = {2.0, 2.0, 4.0, 4.0, 8.0};
constexpr std::size_t kFewest = 4, kMost = 7;  // rungs
constexpr double kSettled = 0.3;  // of the noise, all harmonics of a run together: left open
constexpr double kTrifle = 0.02;  // of what the limit leaves of the run: what is far off stays so
// Twice as wide as a step makes them sharpest: there the grid's own error is a hundredth.
constexpr int kPointsAWidth = 2;

// A grid, and the model with corners as wide as its steps are long.
struct Rung {
  Rung() = default;
  Rung(const config::ModelSpec& rounded, const RunDatum& datum, int points)
      : model(std::make_unique<Model>(rounded)),
        prediction(std::make_unique<Prediction>(*model, datum, points)) {}
  std::unique_ptr<Model> model;
  std::unique_ptr<Prediction> prediction;
};

}  // namespace

CornerLimit eliminated(const std::vector<MatrixXd>& rungs, const RunDatum& datum) {
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

std::optional<CornerLimit> corner_limit(const config::ModelSpec& spec, const RunDatum& datum,
                                        const std::vector<double>& theta, const Prediction& near,
                                        int points) {
  std::vector<MatrixXd> values;
  std::optional<CornerLimit> limit;
  Rung last, before;
  for (std::size_t k = 0; k < kMost; ++k, points *= 2) {
    Rung finer(rounded_for(spec, datum, points / kPointsAWidth), datum, points);
    Prediction& prediction = *finer.prediction;
    const Prediction& begin = last.prediction ? *last.prediction : near;
    if (before.prediction)
      prediction.start_beyond(begin, *before.prediction);
    else
      prediction.start_from(begin);
    if (!prediction.at(theta, HowFar::near)) {
      prediction.start_from(begin);
      if (!before.prediction || !prediction.at(theta, HowFar::near)) break;
    }
    values.emplace_back(prediction.value().size(), 1 + prediction.jacobian().cols());
    values.back() << prediction.value(), prediction.jacobian();
    before = std::move(last);
    last = std::move(finer);
    if (values.size() < kFewest) continue;
    limit = eliminated(values, datum);
    const double left = whitened(datum, datum.response - limit->value).norm();
    if (whitened(datum, limit->open).norm() < std::max(kSettled, kTrifle * left)) break;
  }
  return limit;
}

}  // namespace shaker::estimator::discrepancy
