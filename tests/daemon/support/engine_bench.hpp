// An engine with test doubles: a rig of a few formulas, an outlet that keeps every document, an
// estimator that answers on demand, and the simulated clock. A test can set every fault.
#pragma once

#include <cmath>
#include <deque>
#include <functional>
#include <limits>
#include <numbers>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "daemon/engine.hpp"
#include "daemon/state_table.hpp"

namespace shaker::testing {

class FakeExciter final : public daemon::ExciterCommands {
 public:
  explicit FakeExciter(const SimulatedClock& clock) : clock_(clock) {}
  void set(const drivers::Setpoint& s) override {
    sets.push_back(s);
    if (refuse_next > 0) {
      --refuse_next;
      errors.push_back(refusal_);
      return;
    }
    if (deaf_to_orders) return;
    from_ = amplitude();
    phase_ = phase();
    if (from_ == 0.0 && s.amplitude > 0.0) phase_ = 0.0;
    target_ = s;
    t0_ = clock_.now();
  }
  void stop() override {
    ++stops;
    if (fault == kDeadmanFault) fault = 0;
    if (runs_on) return;
    phase_ = phase();
    from_ = 0.0;
    target_ = {};
    t0_ = clock_.now();
  }
  void keep_alive(bool wanted) override {
    if (alive && !wanted) withheld_ = clock_.now();
    alive = wanted;
  }
  // The dead-man of the drive: it trips when the drive is enabled and gets no heartbeat.
  void turn() {
    if (!target_.enable || alive || seconds(clock_.now() - withheld_) < deadman_s) return;
    fault = kDeadmanFault;
    from_ = 0.0;
    target_ = {};
    t0_ = clock_.now();
  }
  void clear_fault() override {
    ++clears;
    if (clearable) fault = 0;
  }

  double amplitude() const {
    const double s = seconds(clock_.now() - t0_);
    if (target_.ramp_s <= 0.0 || s >= target_.ramp_s) return target_.amplitude;
    return from_ + (target_.amplitude - from_) * s / target_.ramp_s;
  }
  double phase() const {
    return phase_ + 2.0 * std::numbers::pi *
                        (target_.frequency_hz * frequency_part * (1.0 + 200e-6) *
                             seconds(clock_.now() - t0_) -
                         late_turns);
  }
  // From now on this part of the frequency; the motion goes on without a jump.
  void turn_at(double part) {
    phase_ += 2.0 * std::numbers::pi * target_.frequency_hz * (frequency_part - part) *
              (1.0 + 200e-6) * seconds(clock_.now() - t0_);
    frequency_part = part;
  }
  drivers::ExciterStatus status() const {
    const bool moves = target_.enable && (amplitude() > 0.0 || target_.amplitude > 0.0);
    return {.t = clock_.now(),
            .ready = ready && fault == 0,
            .running = moves && !stands && !claims_rest,
            .fault = fault,
            .frequency_hz = target_.frequency_hz * (admits ? frequency_part : 1.0),
            .amplitude = claims_rest ? 0.0 : amplitude() * (admits ? moves_part : 1.0),
            .heartbeat_timeout_s = heartbeat_timeout_s};
  }

  std::vector<drivers::Setpoint> sets;
  std::deque<Error> errors;
  int stops = 0, refuse_next = 0;
  int clears = 0;
  bool clearable = true;
  bool alive = false;
  bool ready = true, stands = false, deaf_to_orders = false, runs_on = false;
  bool silent = false;          // gives no status
  bool claims_rest = false;     // its status always reports rest
  double frequency_part = 1.0;  // frequency in motion over the one ordered
  double late_turns = 0.0;      // of the motion
  bool admits = false;          // and reports the wrong frequency
  double moves_part = 1.0;      // motion over the order; 0: the table does not move
  std::uint32_t fault = 0;
  std::optional<double> heartbeat_timeout_s = 0.5;
  double deadman_s = std::numeric_limits<double>::infinity();  // true value of the drive

 private:
  static constexpr std::uint32_t kDeadmanFault = 9;
  const SimulatedClock& clock_;
  const Error refusal_{ErrorKind::refused, "exciter: exception 03, value refused"};
  drivers::Setpoint target_;
  double from_ = 0.0, phase_ = 0.0;
  Nanoseconds t0_{}, withheld_{};
};

class FakeEstimator final : public daemon::EstimatorCommands {
 public:
  void begin(const config::ModelSpec&, const estimator::OnlineOptions& options) override {
    ++begun;
    begun_with = options;
  }
  void add(const estimator::MeasuredCycle& cycle, Nanoseconds last_sample) override {
    asked.push_back({.run = cycle.run, .cycle = cycle.index, .last_sample = last_sample});
    cycles.push_back(cycle);
  }
  std::deque<daemon::EstimateOutcome> asked;
  std::vector<estimator::MeasuredCycle> cycles;
  estimator::OnlineOptions begun_with;
  int begun = 0;
  bool answers = true, fails = false;
};

class FakeOutlet final : public daemon::Outlet {
 public:
  Result<void> record_campaign(const config::CampaignSpec&) override {
    if (full) return Error{ErrorKind::exhausted, "disk full"};
    ++opened;
    return {};
  }
  Result<void> record_run(int, const config::RunSpec&) override { return result(); }
  Result<void> record_samples(std::span<const drivers::Sample> s) override {
    samples += s.size();
    return result();
  }
  Result<void> record_cycle(const estimator::MeasuredCycle& c, bool accepted) override {
    if (accepted) recorded.push_back(c.index);
    return result();
  }
  void close_campaign() override { ++closed; }
  Result<void> healthy() override {
    if (hung) return Error{ErrorKind::exhausted, "campaign.db: a write hangs"};
    return {};
  }
  Result<void> publish(const protocol::Document& d) override {
    if (const auto* cycle = std::get_if<protocol::CycleDocument>(&d)) {
      if (cycle->accepted) {
        record_came_first =
            record_came_first && !recorded.empty() && recorded.back() == cycle->cycle;
      }
    }
    documents.push_back(d);
    if (on_publish) on_publish(d);
    return {};
  }
  Result<void> result() const {
    if (full) return Error{ErrorKind::exhausted, "campaign.db: no space left on device"};
    return {};
  }

  template <class T>
  std::vector<T> all() const {
    std::vector<T> found;
    for (const auto& d : documents) {
      if (const auto* one = std::get_if<T>(&d)) found.push_back(*one);
    }
    return found;
  }
  int alarms(const std::string& code) const {
    int count = 0;
    for (const auto& a : all<protocol::AlarmDocument>())
      count += a.code == code ? 1 : 0;
    return count;
  }
  std::string states() const {
    std::string text, last;
    for (const auto& s : all<protocol::StateDocument>()) {
      if (s.state == last) continue;
      text += (text.empty() ? "" : " ") + s.state;
      last = s.state;
    }
    return text;
  }

  std::vector<protocol::Document> documents;
  std::function<void(const protocol::Document&)> on_publish;
  std::vector<long> recorded;
  std::size_t samples = 0;
  int opened = 0, closed = 0;
  bool full = false, hung = false, record_came_first = true;
};

inline config::RigConfig bench_rig() {
  config::RigConfig rig;
  rig.name = "bench";
  rig.exciter.device = config::SimulatedExciter{};
  rig.exciter.ramp_s = 0.5;
  rig.sensors = {config::SimulatedSensor{}};
  return rig;
}

inline config::CampaignSpec bench_campaign(int runs = 1, int cycles = 5) {
  config::CampaignSpec campaign;
  campaign.name = "c";
  campaign.model.name = "oleo";
  campaign.settle_cycles_max = 60;
  for (int i = 0; i < runs; ++i) {
    campaign.runs.push_back({.name = "r0" + std::to_string(i + 1),
                             .frequency_hz = 4.0 + i,
                             .amplitude = 4.0,
                             .cycles = cycles});
  }
  return campaign;
}

class EngineBench {
 public:
  explicit EngineBench(config::RigConfig rig = bench_rig())
      : exciter(clock), engine(rig, clock, exciter, estimator, outlet) {}

  // Advances simulated time, with samples at 1 kHz and a call every 5 ms.
  void run(double duration) {
    const Nanoseconds end = clock.now() + from_seconds(duration);
    while (clock.now() < end)
      step();
  }
  bool run_until(daemon::State wanted, double at_most = 60.0) {
    const Nanoseconds end = clock.now() + from_seconds(at_most);
    while (clock.now() < end && engine.state() != wanted)
      step();
    return engine.state() == wanted;
  }
  // From IDLE through one campaign into MEASURE.
  bool measuring(const config::CampaignSpec& campaign = bench_campaign(1, 1000)) {
    run(0.3);
    return engine.start(campaign).ok() && run_until(daemon::State::measure);
  }

  // In IDLE after a short campaign: the engine has measured the stroke at rest.
  bool idle_after_a_campaign() {
    return measuring(bench_campaign(1, 3)) && run_until(daemon::State::idle);
  }

  void step() {
    batch_.clear();
    for (int i = 0; i < 5; ++i) {
      clock.advance(std::chrono::milliseconds(1));
      sample();
    }
    engine.on_samples(batch_);
    exciter.turn();
    const bool due = clock.now() >= next_status_;
    if (due) next_status_ = clock.now() + std::chrono::milliseconds(50);
    while (!exciter.errors.empty()) {
      const Error error = exciter.errors.front();
      exciter.errors.pop_front();
      engine.on_exciter_error(error);
    }
    if (due && !exciter.silent) engine.on_exciter_status(exciter.status());
    while (estimator.answers && !estimator.asked.empty()) {
      auto outcome = estimator.asked.front();
      estimator.asked.pop_front();
      if (estimator.fails) {
        outcome.estimate = Error{ErrorKind::not_converged, "the fit did not converge"};
      } else {
        estimator::Estimate estimate;
        estimate.model = "oleo";
        estimate.usable = true;
        outcome.estimate = estimate;
      }
      engine.on_estimate(outcome);
    }
    engine.tick();
  }

  SimulatedClock clock;
  FakeExciter exciter;
  FakeEstimator estimator;
  FakeOutlet outlet;
  daemon::Engine engine;

  // The plant and its sensors.
  double mean = 0.15, gain = 0.004, lag_turns = 0.1, noise = 2e-5;
  double polarity = 1.0;
  double subharmonic_m = 0.0, wander_m = 0.0, spike_m = 0.0;
  double ring_m = 0.0;  // free oscillation of 2 Hz, decay time 4 s, from when it is set
  bool silent = false, nan = false, frozen = false;
  bool excitation_silent = false;
  double excitation_gain = 1.0;  // of the accelerometer on the table

 private:
  void sample() {
    const double a = exciter.amplitude() * exciter.moves_part, phase = exciter.phase();
    const double lag = 2.0 * std::numbers::pi * lag_turns;
    double u = mean + polarity * gain * a * std::cos(phase - lag) + noise * normal_(random_);
    if (a > 3.9) u += subharmonic_m * std::cos(phase / 2.0);
    if (ring_m > 0.0) {
      if (ringing_ == 0.0) ringing_ = seconds(clock.now());
      const double s = seconds(clock.now()) - ringing_;
      u += ring_m * std::exp(-s / 4.0) * std::cos(2.0 * std::numbers::pi * 2.0 * s);
    }
    if (count_ % 250 == 0) u += spike_m;  // one sample in each period at 4 Hz
    if (++count_ % 200 == 0) wander_ = wander_m * normal_(random_);
    u += wander_;
    if (!frozen) stuck_ = u;
    const double x = excitation_gain * a * std::cos(phase) + 5e-3 * normal_(random_);
    if (nan) u = std::numeric_limits<double>::quiet_NaN();
    if (!silent) {
      batch_.push_back({.t = clock.now(),
                        .value = frozen ? stuck_ : u,
                        .channel = protocol::Channel::displacement});
    }
    if (!excitation_silent) {
      batch_.push_back({.t = clock.now(), .value = x, .channel = protocol::Channel::excitation});
    }
  }

  std::vector<drivers::Sample> batch_;
  std::mt19937_64 random_{42};
  std::normal_distribution<double> normal_;
  Nanoseconds next_status_{};
  double stuck_ = 0.0, wander_ = 0.0, ringing_ = 0.0;
  long count_ = 0;
};

// Status and reason of the end of the last run.
inline std::string last_stop(const EngineBench& bench) {
  const auto stops = bench.outlet.all<protocol::RunStopDocument>();
  return stops.empty() ? "none" : stops.back().status + ": " + stops.back().reason;
}

}  // namespace shaker::testing
