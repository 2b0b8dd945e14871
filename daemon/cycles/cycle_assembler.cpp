#include "daemon/cycles/cycle_assembler.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <span>
#include <utility>

#include <fmt/format.h>

#include "daemon/cycles/resampler.hpp"

namespace shaker::daemon {
namespace {

// The ring buffer holds this many periods: the one being cut, the one arriving, and a reserve
// for late polls.
constexpr double kPeriodsKept = 3.0;
// A fundamental below this multiple of its standard error carries no phase.
constexpr double kPhaseSigmas = 20.0;
// Regular time stamps replace the given ones if they reduce the residual at least to this part.
constexpr double kClearlyBetter = 0.95;

}  // namespace

void CycleAssembler::restart(const CycleOptions& options, Nanoseconds from) {
  options_ = options;
  const double period = 1.0 / options.nominal_hz;
  const double rate = std::max(options.sample_rate_hz, options.excitation_rate_hz);
  const auto a_period = static_cast<std::size_t>(std::max(32.0, 1.3 * rate * period)) + 64;
  displacement_.reset(static_cast<std::size_t>(kPeriodsKept * static_cast<double>(a_period)));
  excitation_.reset(static_cast<std::size_t>(kPeriodsKept * static_cast<double>(a_period)));
  fitter_ = HarmonicFitter(2 * a_period);
  for (auto* scratch : {&t_, &value_, &smooth_, &scratch_})
    scratch->assign(2 * a_period, 0.0);
  const auto n = static_cast<std::size_t>(options.points);
  other_.assign(n, 0.0);
  cycle_.measured.displacement.assign(n, 0.0);
  cycle_.measured.excitation.assign(options.excitation_measured ? n : 0, 0.0);
  tracker_.restart(options.nominal_hz);
  from_ = next_block_ = from;
  offset_turns_ = 0.0;
}

void CycleAssembler::push(protocol::Channel channel, Nanoseconds t, double value) {
  if (channel == protocol::Channel::displacement) {
    displacement_.push(t, value);
  } else if (channel == protocol::Channel::excitation && options_.excitation_measured) {
    excitation_.push(t, value);
  }
}

bool CycleAssembler::extract(const ChannelBuffer& from, Nanoseconds begin, Nanoseconds end,
                             Nanoseconds origin) {
  const auto first = from.find(begin), last = from.find(end);
  extracted_ = static_cast<std::size_t>(last - first);
  if (extracted_ > t_.size()) return false;
  for (std::size_t i = 0; i < extracted_; ++i) {
    const auto& point = from[first + i];
    t_[i] = seconds(point.t - origin);
    value_[i] = point.value;
  }
  return true;
}

HarmonicFit CycleAssembler::fit_reference(Nanoseconds begin, Nanoseconds end) {
  if (!extract(reference(), begin, end, begin)) return {};
  const std::span<const double> value(value_.data(), extracted_);
  const std::span<const double> t(t_.data(), extracted_);
  HarmonicFit best = fitter_.fit(t, value, tracker_.frequency_hz());
  const std::span<double> smooth(smooth_.data(), extracted_);
  if (smooth_stamps(t, smooth, scratch_).ok) {
    const HarmonicFit fit = fitter_.fit(smooth, value, tracker_.frequency_hz());
    if (fit.ok && fit.noise < kClearlyBetter * best.noise) best = fit;
  }
  const double phase_error = best.noise * std::sqrt(2.0 / static_cast<double>(best.used));
  if (best.ok && best.amplitude() < kPhaseSigmas * phase_error) best.ok = false;
  return best;
}

// The phase of a fit is most accurate, and independent of the frequency error, in the middle of
// its block.
double CycleAssembler::turns_at_middle(const HarmonicFit& fit, Nanoseconds begin,
                                       Nanoseconds end) const {
  return fit.turns() + seconds((end - begin) / 2) * tracker_.frequency_hz();
}

bool CycleAssembler::revise_first() {
  const Nanoseconds end = first_block_ + from_seconds(1.0 / options_.nominal_hz);
  const HarmonicFit fit = fit_reference(first_block_, end);
  if (fit.ok) tracker_.revise(1, turns_at_middle(fit, first_block_, end));
  return fit.ok;
}

// The first period gives the phase. Cycles begin at the next turn with samples on both sides.
bool CycleAssembler::begin() {
  const Nanoseconds period = from_seconds(1.0 / options_.nominal_hz);
  if (reference().empty() || reference().latest() < next_block_ + period) return false;
  const HarmonicFit fit = fit_reference(next_block_, next_block_ + period);
  if (fit.ok) {
    tracker_.add(next_block_ + period / 2, fit.turns() + 0.5);
    first_block_ = next_block_;
    first_only_ = true;
    if (!options_.excitation_measured) {
      offset_turns_ =
          seconds(next_block_ - from_) * options_.nominal_hz - tracker_.turns_at(next_block_);
    }
    const double margin =
        2.0 / options_.points + 6.0 * options_.nominal_hz / options_.sample_rate_hz;
    next_turn_ = std::ceil(tracker_.turns_at(next_block_) + offset_turns_ + margin);
  }
  next_block_ += period;
  return fit.ok;
}

const AssembledCycle* CycleAssembler::poll() {
  if (!tracker_.started() && !begin()) return nullptr;
  Nanoseconds begin_at = tracker_.time_of(turn_start(next_turn_));
  Nanoseconds end_at = tracker_.time_of(turn_start(next_turn_ + 1.0));
  // The last point needs four samples after it, which matters at a low sample rate.
  const double step = 1.0 / options_.points;
  const double after =
      std::max(0.0, 4.5 * tracker_.frequency_hz() / options_.sample_rate_hz - step);
  const Nanoseconds needed = end_at + from_seconds(after / tracker_.frequency_hz());
  if (displacement_.empty() || displacement_.latest() < needed) return nullptr;
  if (reference().empty() || reference().latest() < end_at) return nullptr;

  HarmonicFit fit = fit_reference(begin_at, end_at);
  const Nanoseconds middle = begin_at + (end_at - begin_at) / 2;
  double at_middle = turns_at_middle(fit, begin_at, end_at);
  if (fit.ok) {
    tracker_.add(middle, at_middle);
    // The first two blocks were fitted at the nominal frequency. Together they give a better
    // frequency, so they are fitted again.
    const bool second = std::exchange(first_only_, false) && tracker_.observations() == 2;
    if (second && revise_first()) {
      fit = fit_reference(begin_at, end_at);
      at_middle = turns_at_middle(fit, begin_at, end_at);
      tracker_.revise(0, at_middle);
    }
    begin_at = tracker_.time_of(turn_start(next_turn_));
    end_at = tracker_.time_of(turn_start(next_turn_ + 1.0));
  }
  cycle_.last_sample = std::max(displacement_.latest(), reference().latest());
  assemble(begin_at, end_at, fit);
  describe_excitation(fit, at_middle - seconds(middle - begin_at) * tracker_.frequency_hz());
  next_turn_ += 1.0;
  return &cycle_;
}

void CycleAssembler::assemble(Nanoseconds begin_at, Nanoseconds end_at, const HarmonicFit& fit) {
  const double period = seconds(end_at - begin_at);
  cycle_.whole = false;
  cycle_.begin = begin_at;
  cycle_.why.clear();
  cycle_.measured.frequency_hz = tracker_.frequency_hz();
  cycle_.measured.amplitude = options_.excitation_measured ? fit.amplitude() : 0.0;
  cycle_.measured.excitation_error =
      options_.excitation_measured && fit.used > 0
          ? fit.noise * std::sqrt(2.0 / static_cast<double>(fit.used))
          : 0.0;
  cycle_.excitation_noise = options_.excitation_measured ? fit.noise : 0.0;
  const double margin = std::max(period / options_.points, 8.0 / options_.sample_rate_hz);
  const bool fits = extract(displacement_, begin_at - from_seconds(margin),
                            end_at + from_seconds(margin), begin_at);
  cycle_.samples =
      static_cast<long>(std::ranges::count_if(std::span(t_).first(fits ? extracted_ : 0),
                                              [&](double t) { return t >= 0.0 && t < period; }));
  if (!fits) {
    cycle_.why = fmt::format(
        "more than {} samples in one period: the sensor is faster than it was "
        "when it was checked",
        t_.size());
    return;
  }
  count_gaps(period);
  const double allowed = std::max(period / options_.points, 2.5 / options_.sample_rate_hz);
  if (cycle_.longest_gap_s > allowed) {
    cycle_.why = fmt::format("gap of {:.1f} ms; up to {:.1f} ms is allowed",
                             1e3 * cycle_.longest_gap_s, 1e3 * allowed);
    return;
  }
  if (!fit.ok) {
    cycle_.why = options_.excitation_measured
                     ? "the measured excitation is too small or too broken to carry a phase"
                     : "the stroke is too small to carry a phase";
    return;
  }
  if (!resample_best(period)) {
    cycle_.why =
        fmt::format("{} samples are too few for {} points", cycle_.samples, options_.points);
    return;
  }
  describe_stroke();
  cycle_.whole = true;
}

// Evaluates the excitation at the phase of this cycle's own fit. If the phase wanders, the line
// that cuts the cycles follows it late, and the stroke at tau = 0 belongs to another phase.
void CycleAssembler::describe_excitation(const HarmonicFit& fit, double turns_at_begin) {
  for (std::size_t i = 0; i < cycle_.measured.excitation.size(); ++i)
    cycle_.measured.excitation[i] =
        fit.periodic_part(turns_at_begin + static_cast<double>(i) / options_.points);
}

void CycleAssembler::count_gaps(double period) {
  cycle_.gaps = 0;
  cycle_.longest_gap_s = 0.0;
  const double missing = 1.5 / options_.sample_rate_hz;
  double before = extracted_ > 0 && t_[0] < 0.0 ? t_[0] : -period;
  for (std::size_t i = 0; i <= extracted_; ++i) {
    const double t = i < extracted_ ? t_[i] : period;
    if (t < 0.0) {
      before = t;
      continue;
    }
    const double step = t - before;
    if (step > missing) ++cycle_.gaps;
    cycle_.longest_gap_s = std::max(cycle_.longest_gap_s, step);
    before = t;
    if (t >= period) break;
  }
}

bool CycleAssembler::resample_best(double period) {
  const std::span<const double> value(value_.data(), extracted_);
  const std::span<double> t(t_.data(), extracted_), smooth(smooth_.data(), extracted_);
  const StampFit stamps = smooth_stamps(t, smooth, scratch_);
  cycle_.jitter_fraction = stamps.jitter;
  for (auto& x : t)
    x /= period;
  Resampled best = resample(t, value, cycle_.measured.displacement);
  if (stamps.ok && best.ok && stamps.jitter > 1e-5) {
    for (auto& x : smooth)
      x /= period;
    const Resampled regular = resample(smooth, value, other_);
    if (regular.ok && regular.sample_noise < kClearlyBetter * best.sample_noise) {
      best = regular;
      std::ranges::copy(other_, cycle_.measured.displacement.begin());
    }
  }
  cycle_.sample_noise = best.sample_noise;
  cycle_.point_noise = best.point_noise;
  return best.ok;
}

void CycleAssembler::describe_stroke() {
  const auto& u = cycle_.measured.displacement;
  const auto [low, high] = std::ranges::minmax_element(u);
  cycle_.stroke_min = *low;
  cycle_.stroke_max = *high;
  std::complex<double> c = 0.0;
  const double n = static_cast<double>(u.size());
  for (std::size_t i = 0; i < u.size(); ++i) {
    c += u[i] * std::polar(2.0 / n, -2.0 * std::numbers::pi * static_cast<double>(i) / n);
  }
  cycle_.stroke_amplitude = std::abs(c);
  const double lag = -std::arg(c) / (2.0 * std::numbers::pi);
  cycle_.lag_turns = lag < 0.0 ? lag + 1.0 : lag;
}

}  // namespace shaker::daemon
