// The engine's implementation; included by the engine_*.cpp files only.
//
//   engine.cpp            the public interface
//   engine_states.cpp     transitions, faults, the end of runs and campaigns
//   engine_motion.cpp     CHECK, RAMP and RAMP_DOWN: orders to the exciter
//   engine_pause.cpp      a pause and its end
//   engine_trim.cpp       the correction of the ordered amplitude
//   engine_deadman.cpp    the proof of the exciter's dead-man
//   engine_watch.cpp      supervision in every state
//   engine_periods.cpp    supervision of the motion, period by period
//   engine_cycles.cpp     samples, cycles, the gate, estimates
//   engine_documents.cpp  published documents
#pragma once

#include <array>
#include <atomic>
#include <complex>
#include <optional>
#include <string>
#include <vector>

#include "daemon/cycles/cycle_assembler.hpp"
#include "daemon/cycles/cycle_noise.hpp"
#include "daemon/cycles/steady_gate.hpp"
#include "daemon/engine.hpp"
#include "daemon/safety/channel_monitor.hpp"
#include "daemon/safety/detectors.hpp"
#include "daemon/safety/frequency_watch.hpp"
#include "daemon/safety/period_watch.hpp"
#include "daemon/safety/rest_watch.hpp"
#include "daemon/safety/self_check.hpp"
#include "daemon/state_table.hpp"

namespace shaker::daemon {

// Constants that the rig file cannot change; times in s.
inline constexpr double kCheckS = 1.0;           // at rest, to measure noise and rate
inline constexpr double kCheckGiveUpS = 4.0;     // limit for sensors and exciter to appear
inline constexpr double kRestGiveUpS = 20.0;     // limit for the damper to come to rest
inline constexpr double kConfirmS = 2.0;         // limit after a ramp's end for its confirmation
inline constexpr double kLagS = 0.3;             // delay of a drive behind its order
inline constexpr double kExciterSilenceS = 1.0;  // limit without a status while it moves
inline constexpr int kMissedAnswers = 3;         // limit in a row, with no status between them
inline constexpr double kReadyGraceS = 1.0;      // from enabling to "ready"
inline constexpr double kEstimateGiveUpS = 5.0;  // limit for the last estimates of a run
inline constexpr double kStopAgainS = 0.5;       // a stop that is not confirmed is repeated
inline constexpr double kClearS = 2.0;           // limit for the exciter to clear its fault
inline constexpr double kUnknownRest = 0.01;     // of the largest excitation: noise before CHECK
inline constexpr std::size_t kSaidMost = 64;
inline constexpr double kSameAlarmS = 10.0;   // the same message of a device is published once
inline constexpr double kGentlePart = 0.25;   // of the run's amplitude: level of the sign check
inline constexpr int kGentleCycles = 4;       // whole cycles before the sign check
inline constexpr int kGentleCyclesMax = 12;   // cycles before it fails: transients may mislead
inline constexpr double kReachedPart = 0.02;  // of the run's amplitude: tolerance of a ramp's end
// A drift that has not fallen to half in this many cycles is not a transient: the damper
// changes.
inline constexpr int kCreepCycles = 16;
inline constexpr int kRestlessCycles = 3;  // cycles lost in a row before MEASURE returns to SETTLE

enum class RampStep { lower, gentle, prove, rise };
// What follows RAMP_DOWN: IDLE, a latched FAULT, or PAUSE.
enum class After { idle, fault, pause };
enum class Motion { unknown, rests, moves };

struct RunEnd {
  std::string status, reason;
  Nanoseconds deadline{};
};

struct DeadmanProof {
  bool in_motion = false;
  bool withheld = false;  // the heartbeat is withheld since `began`; before, it is sent
  Nanoseconds began{};
};

struct Engine::Impl {
  Impl(const config::RigConfig& rig_config, Clock& clock_, ExciterCommands& exciter_,
       EstimatorCommands& estimator_, Outlet& outlet_)
      : rig(rig_config),
        clock(clock_),
        exciter(exciter_),
        estimator(estimator_),
        outlet(outlet_),
        detectors(rig.limits) {
    // What a program before has left in motion its dead-man stops. What rest is, a CHECK shows; before
    // the first one any large motion counts.
    stop_ordered = clock.now() + from_seconds(rig.exciter.deadman_max_s);
    if (!moves_nothing())
      rest(protocol::Channel::excitation).learn(kUnknownRest * rig.limits.excitation_max_m_s2);
  }

  // --- engine.cpp
  Result<void> may_start() const;
  Result<void> admit(const config::CampaignSpec& wanted) const;
  Result<void> admit_run(const config::RunSpec& run) const;
  Result<void> admit_levels() const;
  Result<void> cause_persists() const;
  bool may_clear() const;
  void leave_fault(const std::string& who);
  void tick_clearing();

  // --- engine_states.cpp
  void enter(State to, const std::string& why);
  void ramp_down(const std::string& status, const std::string& why, After then);
  void trip(const std::string& why);  // zero at once, then FAULT
  void end_run(const std::string& status, const std::string& why);
  void finish_ended_run();
  void close_campaign();
  void next_run_or_end();
  Result<void> begin_run(std::size_t index);
  bool keep(const Result<void>& recorded);
  void watch_outlet();
  void end_at_rest(const std::string& outcome, const std::string& why);
  void act(Detector detector);

  // --- engine_pause.cpp
  bool pausing() const;  // ramps to rest, for a pause
  void end_instead_of_pausing(const std::string& outcome, const std::string& why, After then);
  void resume(const std::string& why);

  // --- engine_trim.cpp
  bool trims() const;
  double trimmed(double amplitude) const;  // the order for an amplitude that is asked for
  double order_on_the_way() const;
  void reset_trim();
  bool correct_for(double measured);
  void say_trimmed(double measured);
  void note_deviation(const AssembledCycle& cycle);
  double agreed_deviation() const;
  void trim_before_rise();
  std::string trim(const AssembledCycle& cycle);
  void order_correction(double measured, bool far);

  // --- engine_deadman.cpp
  bool moves_nothing() const;
  double deadman_s() const;
  bool wants_deadman_proof() const;
  void begin_proof_at_rest();
  void begin_proof_in_motion();
  void tick_proof();
  void end_proof(double took);
  void fail_proof(const std::string& why);

  // --- engine_watch.cpp
  void watch_levels();
  bool awaits_report(Detector detector);
  void watch_ages();
  void watch_hold();
  void learn_rest();
  bool table_is_seen() const;
  bool stroke_is_seen() const;
  Motion table_motion(Nanoseconds from) const;
  Motion stroke_motion(Nanoseconds from);
  void watch_rest();
  void moves_unasked(const std::string& why, bool sure);
  void say_may_move(const std::string& why);
  void device_trouble(const std::string& code, const std::string& why);
  void watch_exciter();
  void compare_report();

  // --- engine_periods.cpp
  void begin_periods();
  void watch_period(protocol::Channel channel, Nanoseconds t, double value);
  void watch_frequency(Nanoseconds t, double value);
  void judge_command(const PeriodFigures& period);
  bool judge_alone(const PeriodFigures& stroke, bool whole);
  void judge_response(const PeriodFigures& period, std::complex<double> answer, bool vanished);

  // --- engine_motion.cpp
  void command(double frequency_hz, double amplitude);
  void halt();
  void begin_check(const std::string& why);
  void tick_check();
  bool stood_still();
  void wait_for_rest();
  void tick_ramp();
  std::optional<Nanoseconds> must_rest_since();
  void tick_ramp_down();
  void begin_ramp();
  void begin_gentle_or_rise();
  void tick_prove();
  void pass_proof(const std::optional<Finding>& finding);
  bool arrived() const;
  double ramp_s() const;

  // --- engine_cycles.cpp
  void take(std::span<const drivers::Sample> samples);
  void collect();
  void on_cycle(const AssembledCycle& cycle);
  void watch_cycle(const AssembledCycle& cycle);
  void prove_cycle(const AssembledCycle& cycle);
  void steady_begins();
  bool right_polarity(const AssembledCycle& cycle, const GateVerdict& verdict);
  void accept(const AssembledCycle& cycle, const GateVerdict& verdict);
  void reject(const AssembledCycle& cycle, const GateVerdict& verdict, const std::string& why);
  bool damper_changes(const GateVerdict& verdict);
  void restart_assembler();
  void estimated(const EstimateOutcome& outcome);
  void changed(const std::vector<estimator::ParameterChange>& changes);
  bool measured() const { return run_accepted >= run().cycles; }

  // --- engine_documents.cpp
  void publish(const protocol::Document& document);
  void alarm(const std::string& severity, const std::string& code, const std::string& text,
             std::optional<config::Action> action = std::nullopt);
  void raise(protocol::AlarmDocument document);
  void acknowledge_alarms(const std::string& who);
  void set_warnings_aside();
  void detector_alarm(Detector detector, config::Action action);
  void alarm_once(const std::string& code, const std::string& text);
  void publish_cycle(const AssembledCycle& cycle, bool accepted, const std::string& why,
                     const GateVerdict& verdict);
  void publish_health();
  std::optional<protocol::CycleNoiseEntry> cycle_noise() const;
  protocol::ChannelHealth channel_health(protocol::Channel channel);
  protocol::StateDocument state_document() const;
  double planned_s(const config::RunSpec& run) const;
  double done_s() const;

  // --- small helpers
  const config::RunSpec& run() const { return campaign->runs[run_index]; }
  double since(Nanoseconds t) const { return seconds(clock.now() - t); }
  bool moving() const { return row(state).keeps_alive; }
  // Nothing is commanded, and watch_rest supervises the table.
  bool resting() const {
    return state == State::idle || state == State::fault || state == State::pause;
  }
  bool cutting() const { return state == State::settle || state == State::measure; }
  ChannelMonitor& monitor(protocol::Channel c) { return monitors[static_cast<std::size_t>(c)]; }
  const ChannelMonitor& monitor(protocol::Channel c) const {
    return monitors[static_cast<std::size_t>(c)];
  }
  static bool is_watched(protocol::Channel c) { return static_cast<std::size_t>(c) < 2; }
  RestWatch& rest(protocol::Channel c) { return rests[static_cast<std::size_t>(c)]; }
  const RestWatch& rest(protocol::Channel c) const { return rests[static_cast<std::size_t>(c)]; }

  const config::RigConfig rig;
  Clock& clock;
  ExciterCommands& exciter;
  EstimatorCommands& estimator;
  Outlet& outlet;

  std::atomic<State> state = State::idle;  // any thread reads it; changed before it is published
  std::string reason = "started";
  Nanoseconds entered{};
  Nanoseconds rest_began{};  // begin of the measurement at rest

  // the campaign
  std::optional<config::CampaignSpec> campaign;
  std::size_t run_index = 0;
  bool recording = false;  // the outlet has a campaign open and has not failed
  std::optional<Error> outlet_trouble;
  bool outlet_trouble_told = false;
  std::optional<RunEnd> ending;  // of the current run, once it has an outcome
  bool run_open = false;         // run_start was published, run_stop was not
  bool run_done = false;         // the current run ended without an interruption
  long run_cycles = 0, run_accepted = 0, run_rejected = 0;
  long outstanding = 0;  // estimates that were requested and have not arrived
  long cycles_skipped = 0;
  bool excitation_measured = false;

  // motion
  drivers::Setpoint setpoint;  // last order
  double asked = 0.0;          // its amplitude before the correction by trim_part
  double ramp_from = 0.0;      // what was asked for before it
  Nanoseconds ordered{};       // time of this order
  Nanoseconds enabled{};       // time of the enabling
  double trim_part = 1.0;      // ordered over asked, at this frequency
  Nanoseconds trim_ordered{};  // time of the last correction
  double trim_from = 0.0;      // the order before it
  // Measured over asked, minus 1, of the last cycles that answer the present order.
  std::array<double, 3> deviations{};
  std::size_t deviations_seen = 0;
  bool trim_limited = false;  // the bounds keep the table from what is asked for
  bool table_is_off = false;  // a correction of more than the tolerance was needed
  std::optional<double> order_of_cycle, corrected_to;  // for the document of a cycle
  RampStep step = RampStep::gentle;
  bool proved = false;  // signs and response were checked in this campaign
  bool polarity_known = false;
  int wrong_polarity = 0;  // steady cycles in a row with the wrong sign
  int spiked_cycles = 0;   // cycles in a row with a single sample beyond the stroke limits
  Nanoseconds step_began{};
  int gentle_cycles = 0;
  After after_ramp_down = After::idle;
  std::optional<Nanoseconds> rest_said;  // the exciter reported rest after the ramp's end
  std::optional<drivers::ExciterStatus> status;
  std::optional<Error> exciter_error;  // since the last good status
  int missed_answers = 0;              // since the last good status
  Nanoseconds stop_ordered{};
  std::optional<DeadmanProof> proving;
  std::optional<double> deadman_proved;  // measured delay, s
  bool deadman_proved_in_motion = false;
  bool proves_deadman = false;  // this campaign only proves the dead-man in motion
  double rate_hz = 0.0, excitation_rate_hz = 0.0;

  // watching
  std::array<ChannelMonitor, protocol::kChannelCount> monitors{};
  std::array<std::uint64_t, protocol::kChannelCount> counted{};  // for the rate in health
  Detectors detectors;
  std::array<bool, kDetectorCount> was_tripped{};
  std::array<std::optional<Nanoseconds>, kDetectorCount> weak_since{};
  std::string held_by;  // text of the holding detector; empty: not held
  Nanoseconds held_since{};
  struct Clearing {
    std::string who;
    Nanoseconds ordered{};
  };
  std::optional<Clearing> clearing;        // the exciter was told to clear its fault
  std::optional<Detector> fault_detector;  // an acknowledgement checks its level again
  int command_errors = 0, under_peaks = 0, response_changes = 0, other_reports = 0;
  // For displacement and excitation: rest detection, and the figures of each period.
  std::array<RestWatch, 2> rests{};
  std::array<PeriodWatch, 2> periods{};
  double stroke_noise = 0.0, table_noise = 0.0;  // standard deviation of a sample at rest
  bool stroke_lives = false;                     // the stroke shows noise at rest
  std::optional<PeriodFigures> table_period;     // figures of the last period
  // The last whole periods of both channels, at index modulo size, each until its like has come.
  std::array<std::array<PeriodFigures, 8>, 2> unpaired{};
  // Response of the stroke to the table: in the last period, and the running mean of the
  // periods since this run became steady.
  std::complex<double> last_answer;
  std::optional<std::complex<double>> response;
  // The last period's answer to the present order, and the last one that was like the one before it.
  std::optional<std::complex<double>> recent_answer, alike_answer;
  int alike_age = 0;                // periods since then
  FrequencyWatch frequency;         // of the table
  Nanoseconds frequency_ordered{};  // time of the last order of another frequency
  bool awaits_rest = false;         // a stop was ordered, and rest is not yet seen
  double level_before = 0.0;        // stroke level one second ago
  Nanoseconds level_taken{}, may_move_said{};
  int may_move_told = 0;
  std::string episode;  // code of the first error of the current incident
  int standing_errors = 0, standing_warnings = 0;  // alarms since the last acknowledgement
  double largest_stroke = 0.0;

  // cycles
  CycleAssembler assembler;
  bool collecting = false;
  SteadyGate gate;
  CycleNoise noise;
  double sensor_noise = 0.0;  // of a point in the last cycle
  double creep_began = 0.0;   // drift when the current drift began
  int creeping = 0;           // cycles since then
  long unsettled = 0;         // cycles since the last accepted one, or since SETTLE began
  int restless = 0;
  std::string last_why;
  estimator::MeasuredCycle outgoing;  // the copy that is handed out; its memory is reused

  // documents
  Nanoseconds last_health{}, last_tick{};
  drivers::SensorHealth sensor_health;
  drivers::StampSource stamps = drivers::StampSource::host_receive;
  struct Said {
    std::string key;
    Nanoseconds t{};
  };
  std::vector<Said> said;  // messages of devices in the last kSameAlarmS
  bool controlled = false;
  int clients = 0;
  double furthest = 0.0;  // planned seconds that are done; never decreases
};

}  // namespace shaker::daemon
