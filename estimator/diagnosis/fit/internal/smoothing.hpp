// Smoothing widths of a model (dry friction, valves, stops), and their limit of zero.
//
// An effect smooths its corner over a stated width, which a plant does not do. Against quiet data
// that difference alone looks like one more effect. Here a width is a share of the motion in one
// step of the grid, for each run: the grid resolves it, and its influence is smooth in the width.
// Two grids, the second of twice the points, lead to the parameters. The solution of zero width is
// extrapolated there with its derivatives (smoothing_limit.hpp), and again whenever the parameters
// move. For a record it is extrapolated from three widths, unless its friction jumps
// (jumping_friction.hpp).
#pragma once

#include <limits>
#include <memory>
#include <optional>
#include <vector>

#include "estimator/diagnosis/fit/internal/harmonic_fit.hpp"
#include "estimator/model/effects/turning.hpp"

namespace shaker::estimator::diagnosis {

// True if an effect of the model has a corner whose width its line does not state.
bool has_edges(const config::ModelSpec& spec);
// The same, or an effect with a memory: its grid error is treated in the same way.
bool has_smoothing(const config::ModelSpec& spec);

// Returns the model with the smallest widths that `points` steps resolve for the motion of `datum`.
// Widths that the model file states stay. `at_once`: friction of records jumps.
config::ModelSpec rounded_for(const config::ModelSpec& spec, const RunDatum& datum, int points,
                              bool at_once = false);
// The same, as the run's own model.
std::shared_ptr<const Model> rounded_model(const config::ModelSpec& spec, const RunDatum& datum,
                                           int points, bool at_once = false);

// Returns the model with the widths of the catalogue written into its lines.
config::ModelSpec stated_for(const config::ModelSpec& spec);

// Returns the model with a narrow width in every line that states none: the narrowest with which an
// estimate converges reliably. A model file says in this way that the friction reverses at once.
config::ModelSpec stated_sharp(const config::ModelSpec& spec);
// The reverse: removes widths that are that narrow. `speed`: order of magnitude of the motion's
// velocity.
config::ModelSpec sharp_freed(const config::ModelSpec& spec, double speed);

// Returns the model with a narrow width for every corner whose width its line does not state. The
// fits are taken to zero width, and a prediction in time must agree with them.
config::ModelSpec with_narrow_smoothing(const config::ModelSpec& spec);

// Returns the number of grid points that resolves the narrowest width that the model's lines state:
// near a velocity reversal no run passes more than half of that width in one step. It is `points`
// times a power of two; `points` if no line states a width.
int points_for(const config::ModelSpec& spec, const std::vector<RunDatum>& data, int points);

// A fit of zero smoothing width: on the finest grid, to data with the difference to the limit
// (`to_limit`). Their covariance includes the uncertainty of the extrapolation.
struct ZeroWidthFit {
  std::shared_ptr<const HarmonicFit> fit;
  std::shared_ptr<const std::vector<RunDatum>> data;
};
// When to compute the limit of zero width.
struct ZeroWidthOptions {
  // Least share of chi-squared that the next finer grid must change. Farther from the noise the
  // required share grows, to at most an eighth.
  double touched = 0.01;
  // Gives up if half the width does not promise a chi-squared below this value.
  double hopeless = std::numeric_limits<double>::infinity();
  // True: the finest grid is enough. The limit itself takes up to 64 times the points.
  bool on_grids = false;
};
// Takes a fit to zero smoothing width. Empty if `worth` says that it does not pay, or if no finer
// grid has a solution.
std::optional<ZeroWidthFit> to_zero_width(const HarmonicFit& first,
                                          const std::vector<RunDatum>& data,
                                          const FitOptions& options,
                                          const ZeroWidthOptions& worth = {});
// The same for other errors of the same runs. `fit` was fitted to `limits`, whose extrapolation
// holds for `data` too. Empty if `limits` has no extrapolation, if it is less exact than these
// errors require, or if the parameters move farther than its derivatives hold.
std::optional<ZeroWidthFit> carried(const HarmonicFit& fit, const std::vector<RunDatum>& limits,
                                    const std::vector<RunDatum>& data, const FitOptions& options);

}  // namespace shaker::estimator::diagnosis
