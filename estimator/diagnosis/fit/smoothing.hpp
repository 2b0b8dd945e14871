// Corners of a model (dry friction, valves, stops) made as sharp as a grid can follow.
//
// Effects round their corners over a stated width, which a plant does not; against quiet data that
// alone looks like one more effect. Here a width is a share of what the motion passes in one step
// of the grid, run by run: that is resolved, and its influence is even and smooth in the width.
// Two grids, the second of twice the points, lead to the parameters, and the solution of width 0 is
// taken there with its slopes (smoothing_limit.hpp), as often as the parameters move; of a record,
// by extrapolation from three widths.
#pragma once

#include <limits>
#include <memory>
#include <optional>
#include <vector>

#include "estimator/diagnosis/fit/harmonic_fit.hpp"

namespace shaker::estimator::diagnosis {

// Some effect of the model has a corner that no width is stated for.
bool has_edges(const config::ModelSpec& spec);
// The same, or a memory, whose grid error is treated alike.
bool has_smoothing(const config::ModelSpec& spec);

// The model with corners as sharp as `datum`'s motion allows in `points` steps; what the model file
// itself states stays.
config::ModelSpec rounded_for(const config::ModelSpec& spec, const RunDatum& datum, int points);

// The model with corners as wide as the catalogue states them, written into it.
config::ModelSpec stated_for(const config::ModelSpec& spec);

// A friction that turns round over a velocity `e` which its own line, or the catalogue, states: the
// width that a step of the grid is held against.
struct Turning {
  std::size_t line;
  std::string symbol, unit;
  double width, usual;  // the line's, and the catalogue's
  bool stated;          // by the line
};
// Of the damper's effects without a memory.
std::vector<Turning> turnings_of(const config::ModelSpec& spec);
// Friction whose width no line states, stated as the narrowest that estimates take well: so a model
// file says that it turns round at once.
config::ModelSpec stated_sharp(const config::ModelSpec& spec);
// The same without what such a file states; `speed`: of the motion, by order of magnitude.
config::ModelSpec sharp_freed(const config::ModelSpec& spec, double speed);

// The model with every corner narrow whose width no line states: fits are taken to corners of no
// width, and a prediction in time has them too.
config::ModelSpec with_narrow_smoothing(const config::ModelSpec& spec);

// Twice as many points again and again, until no run passes more than half of the narrowest width
// that the model's lines state in one step where its motion turns round; `points` where none does.
int points_for(const config::ModelSpec& spec, const std::vector<RunDatum>& data, int points);

// A fit on the finest of the grids to data that tell what it lacks to the limit (`to_limit`), with
// what the extrapolation leaves open in their covariance.
struct Sharpened {
  std::shared_ptr<const HarmonicFit> fit;
  std::shared_ptr<const std::vector<RunDatum>> data;
};
// What makes it worth while.
struct Sharpening {
  // Share of chi-squared that the next finer grid changes, at least; the farther from noise, the
  // more is wanted (up to an eighth).
  double touched = 0.01;
  // Chi-squared, below which corners half as wide, or by their example those of no width, must
  // lead.
  double hopeless = std::numeric_limits<double>::infinity();
  // Whether the finest of the grids will do: their limit takes up to 64 times the points.
  bool on_grids = false;
};
// Nothing when it is not worth while, or the corners cannot be made sharper than one grid allows.
std::optional<Sharpened> sharpen(const HarmonicFit& first, const std::vector<RunDatum>& data,
                                 const FitOptions& options, const Sharpening& worth = {});
// The same for other errors of the same runs: `fit` was fitted to `limits`, and what they tell of
// the limit is true for `data` too. Nothing where they do not tell it, or not as exactly as these
// errors ask for, or where the parameters go farther than its slopes are good for.
std::optional<Sharpened> carried(const HarmonicFit& fit, const std::vector<RunDatum>& limits,
                                 const std::vector<RunDatum>& data, const FitOptions& options);

}  // namespace shaker::estimator::diagnosis
