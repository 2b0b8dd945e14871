#include "estimator/drop/measured_drop.hpp"

#include <algorithm>
#include <limits>

#include "estimator/drop/drop.hpp"
#include "estimator/drop/internal/drop_curves.hpp"

namespace shaker::estimator {
namespace {

constexpr double kQuantileOf95 = 1.959964;
constexpr double kNotComparable = std::numeric_limits<double>::quiet_NaN();

double energy_of(const MeasuredDrop& drop, std::size_t end) {
  double sum = 0.0;
  for (std::size_t i = 0; i < end; ++i)
    sum += 0.5 * (drop.load[i] + drop.load[i + 1]) * (drop.stroke[i + 1] - drop.stroke[i]);
  return sum;
}

std::size_t top_index(const std::vector<double>& values) {
  return static_cast<std::size_t>(std::max_element(values.begin(), values.end()) - values.begin());
}

// The largest value of samples at any times: the top of the parabola through it and its neighbours.
CurveTop top_of_samples(const std::vector<double>& t, const std::vector<double>& values) {
  const std::size_t i = top_index(values);
  const CurveTop plain = {values[i], t[i]};
  if (i == 0 || i + 1 >= values.size()) return plain;
  const double h1 = t[i] - t[i - 1], h2 = t[i + 1] - t[i];
  const double d1 = (values[i] - values[i - 1]) / h1, d2 = (values[i + 1] - values[i]) / h2;
  const double bend = (d2 - d1) / (h1 + h2);  // half the second derivative
  const double slope = (d1 * h2 + d2 * h1) / (h1 + h2);
  if (!(bend < 0.0)) return plain;
  const double shift = std::clamp(-0.5 * slope / bend, -h1, h2);
  return {plain.value + slope * shift + bend * shift * shift, plain.time + shift};
}

class Comparer {
 public:
  Comparer(const MeasuredDrop& measured, const PredictedDrop& predicted)
      : m_(measured), p_(predicted) {}

  Result<MeasuredComparison> run() {
    if (!m_.stroke.empty()) {
      if (top_index(m_.stroke) + 1 == m_.stroke.size())
        return Error{ErrorKind::invalid,
                     "the measured stroke is still growing at its end: the drop does not turn; "
                     "give a longer record"};
      const CurveTop top = top_of_samples(m_.t, m_.stroke);
      add("peak_stroke", top.value);
      add("time_of_peak_stroke", top.time);
    }
    if (!m_.load.empty()) {
      const CurveTop top = top_of_samples(m_.t, m_.load);
      add("peak_load", top.value);
      add("time_of_peak_load", top.time);
    }
    if (!m_.acceleration.empty()) {
      const CurveTop top = top_of_samples(m_.t, m_.acceleration);
      add("peak_deceleration", top.value);
      if (m_.load.empty()) add("time_of_peak_load", top.time);
    }
    if (!m_.stroke.empty() && !m_.load.empty())
      add("energy_absorbed", energy_of(m_, top_index(m_.stroke)));
    const double carried = p_.figures[figure_called("peak_load")].value -
                           p_.figures[figure_called("peak_deceleration")].value;
    count("stroke", m_.stroke, p_.band.stroke_lower, p_.band.stroke_upper, 0.0);
    count("load", m_.load, p_.band.load_lower, p_.band.load_upper, 0.0);
    count("acceleration", m_.acceleration, p_.band.load_lower, p_.band.load_upper, carried);
    return out_;
  }

 private:
  void add(const char* name, double measured) {
    const std::size_t figure = figure_called(name);
    const auto& predicted = p_.figures[figure];
    const double error = 0.5 * (predicted.upper - predicted.lower) / kQuantileOf95;
    const double off = predicted.value - measured;
    out_.figures.push_back({figure, measured, predicted.value,
                            measured != 0.0 ? 100.0 * off / measured : kNotComparable,
                            error > 0.0 ? off / error : kNotComparable});
  }

  // `carried`: what a load holds more than an acceleration does.
  void count(const char* channel, const std::vector<double>& values,
             const std::vector<double>& lower, const std::vector<double>& upper, double carried) {
    if (values.empty() || lower.empty()) return;
    MeasuredComparison::InBand in = {channel, 0, 0};
    for (std::size_t i = 0; i < values.size() && m_.t[i] <= p_.band.t.back(); ++i) {
      const double value = values[i] + carried;
      ++in.points;
      if (value >= linear_at(p_.band.t, lower, m_.t[i]) &&
          value <= linear_at(p_.band.t, upper, m_.t[i]))
        ++in.inside;
    }
    out_.in_band.push_back(std::move(in));
  }

  const MeasuredDrop& m_;
  const PredictedDrop& p_;
  MeasuredComparison out_;
};

}  // namespace

Result<MeasuredComparison> compare_drop(const MeasuredDrop& measured,
                                        const PredictedDrop& predicted) {
  return Comparer(measured, predicted).run();
}

}  // namespace shaker::estimator
