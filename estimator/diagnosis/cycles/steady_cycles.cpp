#include "estimator/diagnosis/cycles/steady_cycles.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>

#include <fmt/format.h>

#include "estimator/diagnosis/cycles/harmonics.hpp"
#include "estimator/diagnosis/cycles/internal/channel_faults.hpp"
#include "estimator/diagnosis/cycles/internal/clipping.hpp"
#include "estimator/diagnosis/cycles/internal/found_frequency.hpp"
#include "estimator/diagnosis/cycles/internal/phase_fit.hpp"
#include "estimator/diagnosis/cycles/internal/quantisation_step.hpp"
#include "estimator/diagnosis/cycles/internal/whole_cycles.hpp"
#include "estimator/diagnosis/cycles/record_checks.hpp"
#include "estimator/signal/stationarity.hpp"

namespace shaker::estimator::diagnosis {
namespace {

// Of what was said: the samples' own frequency is tried instead, is told, and is taken for a wrong
// unit of time (of its logarithm).
constexpr double kOtherFrequency = 0.05, kFrequencyApart = 0.005, kLogOtherUnit = 1.7;
constexpr double kAmplitudeApart = 0.25;   // a quarter more or less than was said
constexpr double kMostChange = 0.05;       // of the driver's amplitude over the cycles
constexpr double kSureChange = 8.0;        // standard errors
constexpr double kSamplesAHarmonic = 2.6;  // least samples a cycle for each harmonic that is fitted

const std::vector<double>& response_of(const Recording& r) {
  return r.kind == Kind::imposed_motion ? r.force : r.displacement;
}
const std::vector<double>& driver_of(const Recording& r) {
  return r.kind == Kind::imposed_motion ? r.displacement : r.excitation;
}
const char* response_name(const Recording& r) {
  return r.kind == Kind::imposed_motion ? "force" : "displacement";
}
const char* driver_name(const Recording& r) {
  return r.kind == Kind::imposed_motion ? "displacement" : "excitation";
}

Result<void> check(const Recording& r) {
  const bool to_be_found = r.frequency_hz == 0.0 && !driver_of(r).empty();
  if (!to_be_found && (!(r.frequency_hz > 0.0) || !std::isfinite(r.frequency_hz)))
    return mistake_in(
        r, fmt::format("frequency_hz is {}; a periodic run needs one above 0", r.frequency_hz));
  if (r.t.size() < 16) return unfit(r, fmt::format("{} samples are too few", r.t.size()));
  if (auto good = check_times(r); !good) return good;
  if (auto good = check_column(r, response_of(r), response_name(r)); !good) return good;
  if (!driver_of(r).empty()) {
    if (auto good = check_column(r, driver_of(r), driver_name(r)); !good) return good;
    const double high = *std::max_element(driver_of(r).begin(), driver_of(r).end());
    if (!(range_of(driver_of(r)) > 1e-12 * (1.0 + std::fabs(high))))
      return unfit(r,
                   fmt::format("the {} never changes; without motion there is nothing to diagnose",
                               driver_name(r)));
  } else if (!(r.amplitude > 0.0)) {
    return mistake_in(r,
                      "there is no excitation column, and no amplitude above 0 that was "
                      "commanded");
  }
  if (!(range_of(response_of(r)) > 0.0))
    return unfit(r, fmt::format("the {} never changes; is the sensor alive?", response_name(r)));
  return {};
}

SteadyRun begun(const Recording& r, const SteadyOptions& options) {
  SteadyRun run;
  run.name = r.name;
  run.kind = r.kind;
  run.role = r.role;
  run.condition = r.condition;
  run.driver_measured = !driver_of(r).empty();
  run.recorded_at = r.t.front();
  run.quantisation_step = quantisation_step_of(response_of(r));
  run.drift_taken = options.drift;
  return run;
}

// Of the driver's frequency, in the whole record.
double periods_in(const Recording& r) {
  const double step = (r.t.back() - r.t.front()) / static_cast<double>(r.t.size() - 1);
  return r.frequency_hz * (r.t.back() - r.t.front() + step);
}

// Why no phase was found: the record is short, or its driver is not steady.
Error without_phase(const Recording& r, const SteadyOptions& options) {
  const double periods = periods_in(r);
  if (periods > 0.0 && periods < options.fewest_cycles)
    return unfit(r, fmt::format("{:.3g} cycles at {:g} Hz; at least {} are needed: record the run "
                                "for longer",
                                periods, r.frequency_hz, options.fewest_cycles));
  return unfit(
      r,
      fmt::format("no steady {}{} was found: it must hold one frequency and amplitude for "
                  "at least {} cycles",
                  driver_name(r), periods > 0.0 ? fmt::format(" near {:g} Hz", r.frequency_hz) : "",
                  options.fewest_cycles));
}

Result<PhaseFit> phase_of(const Recording& r, const SteadyOptions& options) {
  if (driver_of(r).empty())
    return PhaseFit{true, r.frequency_hz, 0.0, r.amplitude, r.t.front(), r.t.back()};
  // What the file says, or what the samples do where that is not it.
  const auto found = found_frequency(r.t, driver_of(r));
  const bool near = found && std::fabs(r.frequency_hz / *found - 1.0) < kOtherFrequency;
  PhaseFit phase;
  if (near || !found) phase = fit_phase(r.t, driver_of(r), r.frequency_hz);
  if (!phase.ok && found) phase = fit_phase(r.t, driver_of(r), *found);
  if (!phase.ok) return without_phase(r, options);
  const double times = phase.frequency_hz / r.frequency_hz;
  if (std::isfinite(times) && std::fabs(std::log(times)) > kLogOtherUnit)
    return mistake_in(
        r, fmt::format("frequency_hz says {:g}, but the {} has {:.5g} Hz: check the unit of its "
                       "time, or say {:.5g}",
                       r.frequency_hz, driver_name(r), phase.frequency_hz, phase.frequency_hz));
  return phase;
}

void compare_frequency(const Recording& r, const PhaseFit& phase, SteadyRun& run) {
  if (driver_of(r).empty()) return;
  if (r.frequency_hz == 0.0)
    run.warnings.push_back(fmt::format("run {}: no frequency_hz was given; the {} has {:.5g} Hz",
                                       r.name, driver_name(r), phase.frequency_hz));
  else if (std::fabs(phase.frequency_hz / r.frequency_hz - 1.0) > kFrequencyApart)
    run.warnings.push_back(
        fmt::format("run {}: frequency_hz says {:g}, but the {} has {:.5g} Hz, which counts",
                    r.name, r.frequency_hz, driver_name(r), phase.frequency_hz));
}

// How many harmonics the samples carry.
Result<void> size_up(const Recording& r, const WholeCycles& cycles, const SteadyOptions& options,
                     SteadyRun& run) {
  if (cycles.count() < static_cast<std::size_t>(options.fewest_cycles))
    return unfit(
        r, fmt::format("{} whole cycle{} at {:g} Hz; at least {} are needed", cycles.count(),
                       cycles.count() == 1 ? "" : "s", run.frequency_hz, options.fewest_cycles));
  run.samples_a_cycle =
      static_cast<double>(r.t.size() - 1) / ((r.t.back() - r.t.front()) * run.frequency_hz);
  run.harmonics = std::min(options.harmonics, static_cast<int>(cycles.samples / kSamplesAHarmonic));
  const int of_driver =
      run.kind == Kind::imposed_motion ? options.harmonics : options.excitation_harmonics;
  run.driver_harmonics = run.driver_measured ? std::min(of_driver, run.harmonics) : 1;
  if (run.harmonics >= 3) return {};
  return unfit(
      r, fmt::format("{:.1f} samples a cycle are too few; at least 8 are needed", cycles.samples));
}

std::vector<double> without_drift(const Recording& r, double drift) {
  std::vector<double> level = response_of(r);
  for (std::size_t i = 0; i < level.size(); ++i)
    level[i] -= drift * (r.t[i] - r.t.front());
  return level;
}

// Harmonics of every cycle and channel.
void fill_rows(const Recording& r, const PhaseFit& phase, const WholeCycles& cycles,
               SteadyRun& run) {
  const auto wide = harmonic_size(run.harmonics);
  const std::vector<double> response = without_drift(r, run.drift_taken);
  std::vector<CycleChannel> channels;
  const auto take = [&](const std::vector<double>& samples, Eigen::MatrixXd& rows,
                        Eigen::Index columns) {
    rows.resize(0, columns);
    channels.push_back({&samples, &rows, nullptr});
  };
  take(response, run.response, wide);
  // The displacement of a mass does not jump.
  if (run.kind == Kind::imposed_motion) channels.back().sampling = &run.sampling;
  if (run.driver_measured) take(driver_of(r), run.driver, harmonic_size(run.driver_harmonics));
  if (r.acceleration.size() == r.t.size()) take(r.acceleration, run.acceleration, wide);
  if (run.kind == Kind::periodic && r.force.size() == r.t.size()) take(r.force, run.force, wide);
  const auto fitted = fit_cycles(r, phase, cycles, run.harmonics, channels);
  const auto kept = static_cast<Eigen::Index>(fitted.size());
  if (!run.driver_measured) {
    run.driver = Eigen::MatrixXd::Zero(kept, harmonic_size(run.driver_harmonics));
    run.driver.col(1).setConstant(r.amplitude);
  }
  if (run.kind == Kind::periodic) run.driver.col(0).setZero();  // an accelerometer's offset
  run.when.resize(kept);
  for (Eigen::Index k = 0; k < kept; ++k)
    run.when[k] = (cycles.start[fitted[static_cast<std::size_t>(k)]] + 0.5 - phase.offset) /
                      phase.frequency_hz -
                  r.t.front();
  run.cycles_recorded = static_cast<int>(cycles.count());
  if (fitted.size() < cycles.count())
    run.warnings.push_back(fmt::format("run {}: {} of {} cycles lack samples and are left out",
                                       r.name, cycles.count() - fitted.size(), cycles.count()));
}

Result<void> on_one_clock(const Recording& r, const SteadyRun& run) {
  const double slip = clock_slip(run.response);
  if (slip == 0.0) return {};
  return unfit(r,
               fmt::format("with every cycle the {} slips by {:.2g} degrees against the {}, "
                           "evenly and at one amplitude: {} ({:.2g} % apart); record both on one",
                           response_name(r), 360.0 * std::fabs(slip), driver_name(r), kTwoClocks,
                           100.0 * std::fabs(slip)));
}

// Of a harmonic of one cycle, when its samples are rounded independently.
ExpectedScatter expected_scatter(const SteadyRun& run) {
  return {run.quantisation_step / std::sqrt(6.0 * run.samples_a_cycle), run.sampling.most,
          run.sampling.offsets};
}

void drop_front(Eigen::MatrixXd& rows, Eigen::Index count) {
  if (rows.rows() > 0) rows = rows.bottomRows(rows.rows() - count).eval();
}

Result<void> drop_transient(const Recording& r, const SteadyOptions& options, SteadyRun& run) {
  const auto drop =
      static_cast<Eigen::Index>(cycles_of_transient(run.response, expected_scatter(run)));
  for (Eigen::MatrixXd* rows : {&run.response, &run.driver, &run.acceleration, &run.force})
    drop_front(*rows, drop);
  run.when = run.when.tail(run.when.size() - drop).eval();
  auto& offsets = run.sampling.offsets;
  if (!offsets.empty()) offsets.erase(offsets.begin(), offsets.begin() + drop);
  run.cycles_dropped = run.cycles_recorded - run.cycles();
  if (run.cycles() >= options.fewest_cycles) return {};
  return unfit(r, fmt::format("only {} of {} whole cycles are steady; at least {} are needed: "
                              "record the run for longer",
                              run.cycles(), run.cycles_recorded, options.fewest_cycles));
}

std::span<const double> steady_part(const WholeCycles& cycles, const std::vector<double>& y) {
  return {&y[cycles.first.front()], cycles.last.back() - cycles.first.front()};
}

// The end of the sensor's range that a channel meets: true for the upper one.
std::optional<bool> end_met(const WholeCycles& cycles, const std::vector<double>& y, Course course,
                            double quantisation_step) {
  for (const bool top : {true, false}) {
    if (clipped(steady_part(cycles, y), cycles.samples, static_cast<double>(cycles.count()), top,
                course, quantisation_step))
      return top;
  }
  return {};
}

Result<void> in_range(const Recording& r, const WholeCycles& cycles, const SteadyRun& run) {
  const bool imposed = r.kind == Kind::imposed_motion;
  const Course course = imposed ? Course::kinked : Course::inert;
  if (const auto top = end_met(cycles, response_of(r), course, run.quantisation_step))
    return unfit(r, clipped_sentence(response_name(r), *top));
  if (!run.driver_measured) return {};
  const auto top = end_met(cycles, driver_of(r), Course::commanded, 0.0);
  if (!top || (imposed && held_at_end(steady_part(cycles, r.displacement),
                                      steady_part(cycles, r.force), cycles.samples, *top)))
    return {};
  return unfit(r, clipped_sentence(driver_name(r), *top));
}

// A channel beside the displacement can be done without.
void leave_out_broken(const Recording& r, const WholeCycles& cycles, SteadyRun& run) {
  const auto look_at = [&](const std::vector<double>& y, const char* name, Eigen::MatrixXd& rows) {
    if (rows.rows() == 0) return;
    std::string why;
    if (!(range_of(y) > 0.0))
      why = fmt::format("the {} never changes; is the sensor alive?", name);
    else if (const auto top = end_met(cycles, y, Course::kinked, quantisation_step_of(y)))
      why = clipped_sentence(name, *top);
    if (why.empty()) return;
    run.warnings.push_back(fmt::format("run {}: {} (this channel is left out)", r.name, why));
    rows.resize(0, 0);
  };
  look_at(r.acceleration, "acceleration", run.acceleration);
  look_at(r.force, "force", run.force);
}

// The amplitude's own straight line: a band of it is steady enough for the phase, and a damper that
// is driven harder and harder within it has no one solution.
Result<void> held(const Recording& r, const SteadyRun& run) {
  const Eigen::Index n = run.driver.rows();
  if (!run.driver_measured || n < 4) return {};
  const Eigen::VectorXd size = run.driver.col(1).cwiseAbs2() + run.driver.col(2).cwiseAbs2();
  const Eigen::VectorXd amplitude = size.cwiseSqrt();
  const Eigen::VectorXd along = Eigen::VectorXd::LinSpaced(n, -0.5, 0.5);
  const double change = along.dot(amplitude) / along.squaredNorm();
  const double mean = amplitude.mean();
  const double left = (amplitude.array() - mean - change * along.array()).matrix().norm();
  const double error = left / std::sqrt(static_cast<double>(n - 2)) / along.norm();
  if (std::fabs(change) < kMostChange * mean || std::fabs(change) < kSureChange * error) return {};
  return unfit(r, fmt::format("the {} is not steady: its amplitude goes from {:.3g} to {:.3g} over "
                              "{} cycles; hold it, or give the run as a \"transient\"",
                              driver_name(r), mean - 0.5 * change, mean + 0.5 * change, n));
}

void name_spikes(const Recording& r, const std::vector<double>& y, const char* name,
                 SteadyRun& run) {
  if (y.empty()) return;  // an excitation that is only stated
  // In the cycles that are kept: a ramp has corners.
  const double period = 1.0 / run.frequency_hz;
  const auto at = [&](double cycle, double edge) {
    const double t = r.t.front() + cycle + edge * period;
    return std::lower_bound(r.t.begin(), r.t.end(), t) - r.t.begin();
  };
  const auto first = at(run.when[0], -0.5), last = at(run.when[run.when.size() - 1], 0.5);
  const auto spikes = lone_spikes({y.begin() + first, y.begin() + last});
  if (spikes.empty()) return;
  const std::size_t i = spikes.front() + static_cast<std::size_t>(first);
  const std::string more =
      spikes.size() > 1 ? fmt::format(", and {} more like it", spikes.size() - 1) : "";
  run.warnings.push_back(
      fmt::format("run {}: the {} is {:.4g} at t = {:.6g} s, between {:.4g} and {:.4g}: one sample "
                  "that stands alone{}; it counts as noise: leave its line out",
                  r.name, name, y[i], r.t[i], y[i - 1], y[i + 1], more));
}

void compare_amplitude(const Recording& r, const PhaseFit& phase, SteadyRun& run) {
  if (r.kind != Kind::periodic || !run.driver_measured || !(r.amplitude > 0.0) ||
      std::fabs(std::log(phase.amplitude / r.amplitude)) <= kAmplitudeApart)
    return;
  run.warnings.push_back(fmt::format(
      "run {}: the {} has an amplitude of {:.4g}, the campaign says {:.4g}; the measured one "
      "counts",
      r.name, driver_name(r), phase.amplitude, r.amplitude));
}

void look_for_order(SteadyRun& run) {
  const Stationarity after = stationarity_of(run.response, expected_scatter(run));
  run.subharmonic = after.subharmonic;
  run.drifting = after.trend;
  run.dying = after.dying;
  if (run.dying)
    run.warnings.push_back(
        fmt::format("run {}: its cycles still differ, about every {} alike, by what is dying away: "
                    "a transient of that frequency; record the run for longer",
                    run.name, run.subharmonic));
  else if (run.subharmonic > 0)
    run.warnings.push_back(
        fmt::format("run {}: the response repeats only every {} cycles (a subharmonic)", run.name,
                    run.subharmonic));
  if (run.drifting)
    run.warnings.push_back(
        fmt::format("run {}: the cycles still drift after {} were dropped as transient", run.name,
                    run.cycles_dropped));
}

}  // namespace

Result<SteadyRun> steady_cycles(const Recording& r, const SteadyOptions& options) {
  if (auto good = check(r); !good) return good.error();
  SteadyRun run = begun(r, options);
  const auto phase = phase_of(r, options);
  if (!phase) return phase.error();
  run.frequency_hz = phase->frequency_hz;
  const WholeCycles cycles = whole_cycles(r, *phase);
  if (auto good = size_up(r, cycles, options, run); !good) return good.error();
  fill_rows(r, *phase, cycles, run);
  if (auto good = on_one_clock(r, run); !good) return good.error();
  if (auto good = drop_transient(r, options, run); !good) return good.error();
  if (auto good = in_range(r, cycles, run); !good) return good.error();
  leave_out_broken(r, cycles, run);
  if (auto good = held(r, run); !good) return good.error();
  name_spikes(r, response_of(r), response_name(r), run);
  name_spikes(r, driver_of(r), driver_name(r), run);
  compare_frequency(r, *phase, run);
  compare_amplitude(r, *phase, run);
  look_for_order(run);
  return run;
}

}  // namespace shaker::estimator::diagnosis
