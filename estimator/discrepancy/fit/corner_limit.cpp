#include "estimator/discrepancy/fit/corner_limit.hpp"

#include <algorithm>
#include <limits>
#include <memory>

#include "estimator/discrepancy/fit/corners.hpp"
#include "estimator/model.hpp"

namespace shaker::estimator::discrepancy {
namespace {

using Eigen::VectorXd;

// e, e log e, e^2, e^2 log e, e^3: what halving the width makes of them; a logarithm is a double
// root.
constexpr double kRoots[] = {2.0, 2.0, 4.0, 4.0, 8.0};
constexpr std::size_t kFewest = 4, kMost = 7;  // rungs
constexpr double kSettled = 0.3;  // of the noise, all harmonics of a run together: left open
constexpr double kTrifle = 0.02;  // of what the limit leaves of the run: what is far off stays so
// Twice as wide as a step makes them sharpest: there the grid's own error is a hundredth.
constexpr int kPointsAWidth = 2;

}  // namespace

CornerLimit eliminated(const std::vector<VectorXd>& rungs, const RunDatum& datum) {
  std::vector<VectorXd> column = rungs;
  CornerLimit best{rungs.back(), {}};
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t order = 0; order + 1 < rungs.size() && order < std::size(kRoots); ++order) {
    const VectorXd last = column.back();
    const double root = kRoots[order];
    for (std::size_t k = column.size(); k-- > 1;)
      column[k] = (root * column[k] - column[k - 1]) / (root - 1.0);
    column.erase(column.begin());
    const VectorXd open = column.back() - last;
    const double size = whitened(datum, open).norm();
    if (!(size < least)) continue;
    least = size;
    best = {column.back(), open};
  }
  return best;
}

std::optional<CornerLimit> corner_limit(const config::ModelSpec& spec, const RunDatum& datum,
                                        const std::vector<double>& theta, const Prediction& near,
                                        int points) {
  std::vector<VectorXd> rungs;
  std::optional<CornerLimit> limit;
  std::unique_ptr<Model> model;
  std::unique_ptr<Prediction> last;
  for (std::size_t k = 0; k < kMost; ++k, points *= 2) {
    auto finer = std::make_unique<Model>(rounded_for(spec, datum, points / kPointsAWidth));
    auto prediction = std::make_unique<Prediction>(*finer, datum, points);
    prediction->start_from(last ? *last : near);
    if (!prediction->at(theta, HowFar::near)) break;
    rungs.push_back(prediction->value());
    last = std::move(prediction);
    model = std::move(finer);
    if (rungs.size() < kFewest) continue;
    limit = eliminated(rungs, datum);
    const double left = whitened(datum, datum.response - limit->value).norm();
    if (whitened(datum, limit->open).norm() < std::max(kSettled, kTrifle * left)) break;
  }
  return limit;
}

}  // namespace shaker::estimator::discrepancy
