#include "sim/instruments.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace shaker::sim {
namespace {

constexpr Parameter kParameters[] = {
    {"sensor_gain", "1", 1.0, 0.1, 10.0, "G in y = G u + b"},
    {"sensor_offset", "m", 0.0, -1.0, 1.0, "b in y = G u + b"},
    {"sensor_delay", "s", 0.0, 0.0, 1.0, "dead time of the stroke against the excitation"},
    {"sensor_lag", "s", 0.0, 0.0, 1.0, "time constant of the stroke's first-order low pass"},
    {"sensor_quadratic", "1/m", 0.0, -10.0, 10.0, "q in y = G (u + q u^2) + b"},
    {"sensor_drift", "m/s", 0.0, -1e-2, 1e-2, "rate at which b grows"},
    {"series_stiffness", "1/s^2", 0.0, 0.0, 1e9,
     "k_n of the fixture under the damper's force, inside the transducer's span; 0: rigid"},
    {"excitation_sensor_gain", "1", 1.0, 0.1, 10.0, "gain of the recorded excitation"},
    {"excitation_sensor_delay", "s", 0.0, 0.0, 1.0, "dead time of the recorded excitation"},
    {"excitation_sensor_phase", "rad", 0.0, -3.0, 3.0,
     "by how much the recorded excitation's fundamental is late"},
    {"excitation_unrecorded", "1", 0.0, 0.0, 1.0,
     "1: the record of the excitation lacks the table's harmonics"},
    {"table_gain", "1", 1.0, 0.1, 2.0, "motion of the table over what was ordered"},
    {"table_drift", "1/s", 0.0, -0.01, 0.01, "growth of this gain per second since the start"},
    {"excitation_h2", "1", 0.0, -1.0, 1.0, "2nd harmonic of the table over its fundamental"},
    {"excitation_h3", "1", 0.0, -1.0, 1.0, "3rd harmonic"},
    {"excitation_h4", "1", 0.0, -1.0, 1.0, "4th harmonic"},
    {"excitation_h5", "1", 0.0, -1.0, 1.0, "5th harmonic"}};

}  // namespace

std::span<const Parameter> instrument_parameters() {
  return kParameters;
}

Instruments::Instruments(const RigOptions& options, const Values& values, Nanoseconds start)
    : options_(options),
      gain_(values.at("sensor_gain")),
      offset_(values.at("sensor_offset")),
      quadratic_(values.at("sensor_quadratic")),
      drift_(values.at("sensor_drift")),
      excitation_gain_(values.at("excitation_sensor_gain")),
      period_s_(1.0 / options.sample_rate_hz),
      rate_(1.0 + 1e-6 * options.clock_offset_ppm),
      start_(start),
      due_(start),
      stroke_delay_(values.at("sensor_delay") * options.sample_rate_hz),
      excitation_delay_(values.at("excitation_sensor_delay") * options.sample_rate_hz),
      noise_source_(options.seed),
      arrival_source_(options.seed ^ 0x9e3779b97f4a7c15u) {
  const double lag = values.at("sensor_lag");
  if (lag > 0.0) {
    // Exact for a parabola through three samples. Holding a sample would shift the signal by
    // half a period. A straight line between two samples takes (omega T)^2 / 12 off the
    // amplitude, a sixth of what a lag of one period takes off.
    const double periods = lag / period_s_;
    lag_kept_ = std::exp(-1.0 / periods);
    lag_slope_ = 1.0 - periods * (1.0 - lag_kept_);
    lag_bend_ = 0.5 * (1.0 - (2.0 * periods + 1.0) * lag_slope_);
  }
  due_ = instant(++k_);
}

// Multiplied, not summed, so that the rate stays exact.
Nanoseconds Instruments::instant(std::int64_t k) const {
  const double since = static_cast<double>(k) * period_s_ / rate_;
  return start_ + Nanoseconds(std::llround(since * 1e9));
}

DeadTime::DeadTime(double samples)
    : whole_(static_cast<std::size_t>(samples)),
      part_(samples - static_cast<double>(whole_)),
      past_(whole_ + 2) {}

double DeadTime::pass(double value) {
  if (first_) std::ranges::fill(past_, value);
  first_ = false;
  newest_ = (newest_ + 1) % past_.size();
  past_[newest_] = value;
  const auto back = [&](std::size_t n) {
    return past_[(newest_ + past_.size() - n) % past_.size()];
  };
  return (1.0 - part_) * back(whole_) + part_ * back(whole_ + 1);
}

double Instruments::through_transducer(double stroke) {
  const double delayed = stroke_delay_.pass(stroke);
  if (!lagged_) lagged_ = before_lag_ = long_before_lag_ = delayed;
  lagged_ = lag_kept_ * *lagged_ + (1.0 - lag_kept_ - lag_slope_) * before_lag_ +
            lag_slope_ * delayed + lag_bend_ * (delayed - 2.0 * before_lag_ + long_before_lag_);
  long_before_lag_ = before_lag_;
  before_lag_ = delayed;
  const double bent = *lagged_ * (1.0 + quadratic_ * *lagged_);
  return gain_ * bent + offset_ + drift_ * static_cast<double>(k_) * period_s_;
}

double Instruments::read_out(double truth, double noise, double quantum) {
  const double noisy = truth + noise * normal_(noise_source_);
  return quantum > 0.0 ? std::round(noisy / quantum) * quantum : noisy;
}

void Instruments::take(double stroke, double excitation, const AuxiliaryValues& auxiliary,
                       Fault fault) {
  RigSample sample;
  sample.auxiliary = auxiliary;
  sample.displacement = read_out(through_transducer(stroke), options_.noise_m, options_.quantum_m);
  sample.excitation = read_out(excitation_gain_ * excitation_delay_.pass(excitation),
                               options_.noise_m_s2, options_.quantum_m_s2);
  const double late = options_.jitter_fraction * period_s_ * uniform_(arrival_source_);
  sample.dropped = uniform_(arrival_source_) < options_.dropout_fraction;
  sample.t = due_ + Nanoseconds(std::llround(late * 1e9));
  sample.counter = static_cast<std::uint32_t>(k_);
  sample.device_us =
      static_cast<std::uint32_t>(std::llround(static_cast<double>(k_) * period_s_ * 1e6));

  if (fault != Fault::sensor_frozen) frozen_.reset();
  if (fault == Fault::sensor_frozen) {
    if (!frozen_) frozen_ = sample.displacement;
    sample.displacement = *frozen_;
  } else if (fault == Fault::sensor_nan) {
    sample.displacement = std::numeric_limits<double>::quiet_NaN();
  } else if (fault == Fault::sensor_inverted) {
    sample.displacement = -sample.displacement;
  }
  if (fault != Fault::sensor_silent) on_its_way_ = sample;
  due_ = instant(++k_);
}

void Instruments::deliver(Nanoseconds now, std::vector<RigSample>& out) {
  if (!on_its_way_ || on_its_way_->t > now) return;
  out.push_back(*on_its_way_);
  on_its_way_.reset();
}

}  // namespace shaker::sim
