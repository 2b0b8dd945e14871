// The curves of a drop: their times, values between the times, integrals, and largest values.
//
// The times are dense at touch-down, where a tyre or an oil spring takes the first blow in less
// than a millisecond. They are a smooth function of their index, and so everything is interpolated
// and integrated over the index. Pure; any thread.
#pragma once

#include <cstddef>
#include <vector>

namespace shaker::estimator {

// The time of a history at `share` (0 to 1) of its index, over the whole duration.
double drop_time_share(double share);

// A position between two times of a history.
struct CurvePlace {
  std::size_t before = 0;  // the number of times: the event did not occur
  double share = 0.0;
  // Interpolates by the cubic through the four values around the position.
  double of(const std::vector<double>& values) const;
  double time(const std::vector<double>& t) const;
};

// Interpolates by straight lines between samples, and goes on beyond their ends. `t` increases.
double linear_at(const std::vector<double>& t, const std::vector<double>& values, double time);

// Interpolates by the cubic through value and rate at both ends.
double value_at(const std::vector<double>& t, const std::vector<double>& value,
                const std::vector<double>& rate, const CurvePlace& place);

// Where the rate loses the sign `sign` (+1 or -1) first, at or after index `from`.
CurvePlace turn_after(const std::vector<double>& rate, std::size_t from, double sign);

// The deepest of all turns of a curve from growing to falling: an oil spring may turn a stroke
// before.
CurvePlace deepest_turn(const std::vector<double>& t, const std::vector<double>& value,
                        const std::vector<double>& rate);

// Work of `load` on a motion with `speed`, from index `from` to `to`: each interval is the integral
// of the cubic through four neighbouring values; the last one of the history is a trapezoid.
double work_between(const std::vector<double>& t, const std::vector<double>& load,
                    const std::vector<double>& speed, std::size_t from, std::size_t to);

// The largest value: the top of the parabola through it and its neighbours, unless the curve jumps
// there, as friction does where the stroke turns.
struct CurveTop {
  double value = 0.0, time = 0.0;
};
CurveTop top_of(const std::vector<double>& t, const std::vector<double>& values);

}  // namespace shaker::estimator
