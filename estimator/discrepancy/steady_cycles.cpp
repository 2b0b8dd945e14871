#include "estimator/discrepancy/steady_cycles.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <span>

#include <fmt/format.h>

#include "estimator/discrepancy/channel_faults.hpp"
#include "estimator/discrepancy/harmonics.hpp"
#include "estimator/discrepancy/phase_fit.hpp"
#include "estimator/discrepancy/succession.hpp"

namespace shaker::estimator::discrepancy {
namespace {

constexpr double kTwoPi = 2.0 * std::numbers::pi;
constexpr double kAmplitudeApart = 0.25;   // a quarter more or less than was said
constexpr double kSamplesAHarmonic = 2.6;  // least samples a cycle for each harmonic that is fitted

Error bad(const Recording& r, const std::string& why) {
  return {ErrorKind::invalid, fmt::format("run {}: {}", r.name, why)};
}

// Not a mistake in the file: the run as it went cannot be used.
Error unfit(const Recording& r, const std::string& why) {
  return {ErrorKind::not_converged, fmt::format("run {}: {}", r.name, why)};
}

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

Result<void> check_column(const Recording& r, const std::vector<double>& column, const char* name) {
  if (column.size() != r.t.size())
    return bad(r, fmt::format("{} samples of the {} for {} times: the channels are not on one "
                              "clock; give them on common times",
                              column.size(), name, r.t.size()));
  for (std::size_t i = 0; i < column.size(); ++i) {
    if (!std::isfinite(column[i]))
      return bad(r,
                 fmt::format("sample {} of the {} is missing or not finite; leave such lines out",
                             i + 1, name));
  }
  return {};
}

Result<void> check(const Recording& r) {
  if (!(r.frequency_hz > 0.0) || !std::isfinite(r.frequency_hz))
    return bad(r,
               fmt::format("frequency_hz is {}; a periodic run needs one above 0", r.frequency_hz));
  if (r.t.size() < 16) return bad(r, fmt::format("{} samples are too few", r.t.size()));
  for (std::size_t i = 1; i < r.t.size(); ++i) {
    if (!(r.t[i] > r.t[i - 1]))
      return bad(r, fmt::format("time does not increase: t = {:.9g} is followed by {:.9g} (sample "
                                "{}); are the channels on one clock?",
                                r.t[i - 1], r.t[i], i + 1));
  }
  if (auto good = check_column(r, response_of(r), response_name(r)); !good) return good;
  if (!driver_of(r).empty()) {
    if (auto good = check_column(r, driver_of(r), driver_name(r)); !good) return good;
    const auto [low, high] = std::minmax_element(driver_of(r).begin(), driver_of(r).end());
    if (!(*high - *low > 1e-12 * (1.0 + std::fabs(*high))))
      return unfit(r,
                   fmt::format("the {} never changes; without motion there is nothing to diagnose",
                               driver_name(r)));
  } else if (!(r.amplitude > 0.0)) {
    return bad(r, "there is no excitation column, and no amplitude above 0 that was commanded");
  }
  const auto [low, high] = std::minmax_element(response_of(r).begin(), response_of(r).end());
  if (!(*high > *low))
    return unfit(r, fmt::format("the {} never changes; is the sensor alive?", response_name(r)));
  return {};
}

// Least-squares harmonics of the samples of one cycle; false when the samples do not carry them.
bool fit_cycle(const std::vector<double>& tau, const double* y, int harmonics,
               Eigen::VectorXd& out) {
  const auto columns = harmonic_size(harmonics);
  Eigen::MatrixXd basis(static_cast<Eigen::Index>(tau.size()), columns);
  for (std::size_t i = 0; i < tau.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    basis(row, 0) = 1.0;
    const double c = std::cos(kTwoPi * tau[i]);
    const double s = std::sin(kTwoPi * tau[i]);
    double ch = 1.0, sh = 0.0;
    for (Eigen::Index h = 1; h <= harmonics; ++h) {
      const double next = ch * c - sh * s;
      sh = sh * c + ch * s;
      ch = next;
      basis(row, 2 * h - 1) = ch;
      basis(row, 2 * h) = sh;
    }
  }
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(columns, columns);
  normal.selfadjointView<Eigen::Lower>().rankUpdate(basis.transpose());
  const Eigen::Map<const Eigen::VectorXd> values(y, static_cast<Eigen::Index>(tau.size()));
  const Eigen::LLT<Eigen::MatrixXd> factor(normal.selfadjointView<Eigen::Lower>());
  if (factor.info() != Eigen::Success) return false;
  out = factor.solve(basis.transpose() * values);
  return out.allFinite();
}

struct Cut {
  std::vector<std::size_t> first, last;  // samples of each whole cycle
  std::vector<double> start;             // its turn
  double samples = 0.0;                  // in a full cycle
};

Cut cut(const Recording& r, const PhaseFit& phase) {
  Cut all;
  const double first = std::ceil(phase.turn(phase.from) - 1e-9);
  std::vector<std::size_t> counts;
  for (double turn = first; phase.turn(phase.to) + 1e-9 >= turn + 1.0; turn += 1.0) {
    const auto at = [&](double wanted) {
      const double t = (wanted - phase.offset) / phase.frequency_hz;
      return static_cast<std::size_t>(std::lower_bound(r.t.begin(), r.t.end(), t) - r.t.begin());
    };
    all.first.push_back(at(turn - 1e-9));
    all.last.push_back(at(turn + 1.0 - 1e-9));
    all.start.push_back(turn);
    counts.push_back(all.last.back() - all.first.back());
  }
  if (counts.empty()) return all;
  std::sort(counts.begin(), counts.end());
  all.samples = static_cast<double>(counts[counts.size() / 2]);
  return all;
}

void drop_front(Eigen::MatrixXd& rows, Eigen::Index count) {
  if (rows.rows() > 0) rows = rows.bottomRows(rows.rows() - count).eval();
}

}  // namespace

Result<SteadyRun> steady_cycles(const Recording& r, const SteadyOptions& options) {
  if (auto good = check(r); !good) return good.error();
  SteadyRun run;
  run.name = r.name;
  run.kind = r.kind;
  run.role = r.role;
  run.driver_measured = !driver_of(r).empty();
  PhaseFit phase;
  if (run.driver_measured) {
    phase = fit_phase(r.t, driver_of(r), r.frequency_hz);
    if (!phase.ok)
      return unfit(r, fmt::format("no steady {} near {:g} Hz was found: it must hold one frequency "
                                  "and amplitude for at least {} cycles; check frequency_hz",
                                  driver_name(r), r.frequency_hz, options.fewest_cycles));
  } else {
    phase = {true, r.frequency_hz, 0.0, r.amplitude, r.t.front(), r.t.back()};
  }
  run.frequency_hz = phase.frequency_hz;
  const Cut cycles = cut(r, phase);
  if (cycles.first.size() < static_cast<std::size_t>(options.fewest_cycles))
    return unfit(r, fmt::format("{} whole cycle{} at {:g} Hz; at least {} are needed",
                                cycles.first.size(), cycles.first.size() == 1 ? "" : "s",
                                run.frequency_hz, options.fewest_cycles));
  run.samples_a_cycle = cycles.samples;
  run.harmonics = std::min(options.harmonics, static_cast<int>(cycles.samples / kSamplesAHarmonic));
  run.driver_harmonics = run.driver_measured ? std::min(run.kind == Kind::imposed_motion
                                                            ? options.harmonics
                                                            : options.excitation_harmonics,
                                                        run.harmonics)
                                             : 1;
  if (run.harmonics < 3)
    return bad(r, fmt::format("{:.1f} samples a cycle are too few; at least 8 are needed",
                              cycles.samples));

  const auto count = static_cast<Eigen::Index>(cycles.first.size());
  const auto wide = harmonic_size(run.harmonics);
  run.response.resize(count, wide);
  run.driver = Eigen::MatrixXd::Zero(count, harmonic_size(run.driver_harmonics));
  const bool accelerometer = r.acceleration.size() == r.t.size();
  const bool load_cell = run.kind == Kind::periodic && r.force.size() == r.t.size();
  if (accelerometer) run.acceleration.resize(count, wide);
  if (load_cell) run.force.resize(count, wide);
  Eigen::Index kept = 0;
  std::vector<double> tau;
  Eigen::VectorXd curve;
  for (std::size_t k = 0; k < cycles.first.size(); ++k) {
    tau.clear();
    double gap = 0.0;
    for (std::size_t i = cycles.first[k]; i < cycles.last[k]; ++i) {
      tau.push_back(phase.turn(r.t[i]) - cycles.start[k]);
      if (tau.size() > 1) gap = std::max(gap, tau.back() - tau[tau.size() - 2]);
    }
    if (static_cast<double>(tau.size()) < 0.9 * cycles.samples || gap > 0.5 / run.harmonics)
      continue;  // samples are missing
    const auto from = cycles.first[k];
    if (!fit_cycle(tau, &response_of(r)[from], run.harmonics, curve)) continue;
    run.response.row(kept) = curve;
    if (run.driver_measured) {
      // More than are used: what lies above must not leak into what is.
      if (!fit_cycle(tau, &driver_of(r)[from], run.harmonics, curve)) continue;
      run.driver.row(kept) = curve.head(run.driver.cols());
    } else {
      run.driver(kept, 1) = r.amplitude;
    }
    if (accelerometer) {
      if (!fit_cycle(tau, &r.acceleration[from], run.harmonics, curve)) continue;
      run.acceleration.row(kept) = curve;
    }
    if (load_cell) {
      if (!fit_cycle(tau, &r.force[from], run.harmonics, curve)) continue;
      run.force.row(kept) = curve;
    }
    ++kept;
  }
  run.response.conservativeResize(kept, Eigen::NoChange);
  run.driver.conservativeResize(kept, Eigen::NoChange);
  if (accelerometer) run.acceleration.conservativeResize(kept, Eigen::NoChange);
  if (load_cell) run.force.conservativeResize(kept, Eigen::NoChange);
  if (run.kind == Kind::periodic) run.driver.col(0).setZero();  // an accelerometer's offset
  run.cycles_recorded = static_cast<int>(count);
  if (kept < count)
    run.warnings.push_back(fmt::format("run {}: {} of {} cycles lack samples and are left out",
                                       r.name, count - kept, count));
  if (const double slip = clock_slip(run.response); slip != 0.0)
    return unfit(r, fmt::format("with every cycle the {} slips by {:.2g} degrees against the {}, "
                                "evenly and at one amplitude: the channels are not on one clock "
                                "({:.2g} % apart); record both on one",
                                response_name(r), 360.0 * std::fabs(slip), driver_name(r),
                                100.0 * std::fabs(slip)));
  const auto drop = static_cast<Eigen::Index>(cycles_of_transient(run.response));
  drop_front(run.response, drop);
  drop_front(run.driver, drop);
  drop_front(run.acceleration, drop);
  drop_front(run.force, drop);
  run.cycles_dropped = run.cycles_recorded - run.cycles();
  if (run.cycles() < options.fewest_cycles)
    return unfit(r, fmt::format("only {} of {} whole cycles are steady; at least {} are needed: "
                                "record the run for longer",
                                run.cycles(), count, options.fewest_cycles));
  const auto in_range = [&](const std::vector<double>& y, const char* name) -> Result<void> {
    const std::span<const double> steady(&y[cycles.first.front()],
                                         cycles.last.back() - cycles.first.front());
    for (const bool top : {true, false}) {
      if (clipped(steady, cycles.samples, static_cast<double>(count), top))
        return unfit(r, fmt::format("the {} stays on its {} value: the sensor is clipped; record "
                                    "the run within the sensor's range",
                                    name, top ? "highest" : "lowest"));
    }
    return {};
  };
  if (auto good = in_range(response_of(r), response_name(r)); !good) return good.error();
  if (run.driver_measured) {
    if (auto good = in_range(driver_of(r), driver_name(r)); !good) return good.error();
    if (r.kind == Kind::periodic && r.amplitude > 0.0 &&
        std::fabs(std::log(phase.amplitude / r.amplitude)) > kAmplitudeApart)
      run.warnings.push_back(
          fmt::format("run {}: the {} has an amplitude of {:.4g}, the campaign says {:.4g}; the "
                      "measured one counts",
                      r.name, driver_name(r), phase.amplitude, r.amplitude));
  }
  const Succession after = examine(run.response);
  run.subharmonic = after.subharmonic;
  run.drifting = after.trend;
  if (run.subharmonic > 0)
    run.warnings.push_back(
        fmt::format("run {}: the response repeats only every {} cycles (a subharmonic)", r.name,
                    run.subharmonic));
  if (run.drifting)
    run.warnings.push_back(
        fmt::format("run {}: the cycles still drift after {} were dropped as transient", r.name,
                    run.cycles_dropped));
  return run;
}

}  // namespace shaker::estimator::discrepancy
