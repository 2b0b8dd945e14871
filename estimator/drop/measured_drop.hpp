// A measured drop beside its prediction: errors of peak, time and energy, in per cent and in standard
// errors of the prediction, and the share of the points that lie in the band.
#pragma once

#include <string>
#include <vector>

#include "base/result.hpp"
#include "estimator/drop/drop_mixture.hpp"

namespace shaker::estimator {

// Columns of equal length, in the model's units; those that were not measured are empty.
struct MeasuredDrop {
  std::vector<double> t;             // s after touch-down, increasing
  std::vector<double> stroke, load;  // load per mass above the damper
  std::vector<double> acceleration;  // of that mass, upwards, -g in free fall
};

// A prediction as it is compared. `band` may be empty. Figures: value and 95 % interval of each of
// kDropFigures.
struct PredictedDrop {
  const DropHistory* history = nullptr;
  HistoryBand band;
  struct Figure {
    double value = 0.0, lower = 0.0, upper = 0.0;
  };
  std::vector<Figure> figures;
};

struct ComparedFigure {
  std::size_t figure = 0;  // of kDropFigures
  double measured = 0.0, predicted = 0.0;
  double percent = 0.0;          // predicted over measured, less 1; NaN where 0 was measured
  double standard_errors = 0.0;  // predicted less measured; NaN without a band
};
struct MeasuredComparison {
  std::vector<ComparedFigure> figures;
  struct InBand {
    std::string channel;
    std::size_t points = 0, inside = 0;
  };
  std::vector<InBand> in_band;  // of each channel; empty without a band
};

// An Error where the measured stroke does not turn. Pure.
Result<MeasuredComparison> compare_drop(const MeasuredDrop& measured,
                                        const PredictedDrop& predicted);

}  // namespace shaker::estimator
