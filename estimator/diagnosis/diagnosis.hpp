// What a diagnosis says: plain data, for documents, reports and tests.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "config/model.hpp"
#include "estimator/diagnosis/campaign.hpp"
#include "estimator/estimate.hpp"
#include "estimator/time/identified_damper.hpp"

namespace shaker::estimator::diagnosis {

enum class Verdict { adequate, explained, unexplained };
constexpr const char* name(Verdict verdict) {
  constexpr const char* names[] = {"adequate", "explained", "unexplained"};
  return names[static_cast<int>(verdict)];
}

// The run that would tell an effect from its rivals best.
struct DiscriminatingRun {
  double frequency_hz = 0.0, amplitude = 0.0;
  std::string channel;    // an extra channel that would do it where no run does; empty: none
  double separation = 0;  // in standard errors, from that run together with this campaign
};

struct NamedEffect {
  std::string name, meaning, formula;
  double probability = 0.0;
  std::vector<ParameterEstimate> parameters;
  std::vector<std::string> confusable_with;  // what this campaign cannot tell from it
  std::optional<DiscriminatingRun> discriminating_run;
  std::string where;                    // in an operator's words
  std::optional<double> held_out_gain;  // share of the held-out gap that it closes
};

// Root mean squares over the cycle, in the response's unit. `noise` is what noise alone is expected
// to leave in the mean cycle, `noise_floor` the level below which it stays in 95 of 100 such
// campaigns, after the parameters have been fitted to it (noise_floor.hpp).
struct Gap {
  double noise = 0.0, noise_floor = 0.0, before = 0.0, after = 0.0;
  std::optional<double> held_out_before, held_out_after;
  std::string unit;
};

struct RunGap {
  std::string name;
  Role role = Role::fit;
  double frequency_hz = 0.0, amplitude = 0.0;
  int cycles = 0;
  double before = 0.0, after = 0.0;
  double noise = 0.0, noise_floor = 0.0;  // as for the whole
};

// One entry of the catalogue, as it was scored on the model as it came.
struct Ranked {
  std::string name;
  double gain = 0.0;         // in chi-squared, linearised
  double hidden = 0.0;       // share of its signature that the parameters imitate
  double probability = 0.0;  // 0 when it was not refitted
  std::optional<double> gain_refitted, cross_validated;  // in chi-squared, in log probability
  std::string disqualified;                              // why; empty: it is not
};

// An entry of the catalogue that was not scored.
struct NotTried {
  std::string name, reason;
  bool failed = false;  // a computation did: the effect may be what is missing
};

// One cycle of a run on equal steps of tau, for drawings; of a run that is not periodic the stretch
// of it where most happens.
struct RunCurves {
  std::string name;
  double from = 0.0, seconds = 0.0;             // of that stretch; seconds 0: a cycle
  std::vector<double> measured, before, after;  // displacement (force of imposed motion)
  std::vector<double> stroke, velocity;         // of the measured motion
  // Of the predicted ones; empty where no displacement is compared, or there is no period.
  std::vector<double> velocity_before, velocity_after;
  std::vector<double> force_before, force_after;  // residual force by inverse dynamics
};

// Residual force before and after, averaged over bins of stroke, velocity and phase.
struct ForceBin {
  double at = 0.0, before = 0.0, after = 0.0;
};

struct Location {
  std::string words;   // "at velocity reversal: 71 % of the gap"
  double share = 0.0;  // of the gap's force that lies there
  std::vector<ForceBin> over_stroke, over_velocity, over_phase;
  std::vector<double> share_of_harmonic;  // of the gap, from the mean on
};

// A cell of stroke and velocity where the motion has been: means over its part inside of it.
struct ForceCell {
  double stroke = 0.0, velocity = 0.0;
  double force = 0.0, standard_error = 0.0;  // acceleration
  double time = 0.0;                         // share of the cycles that is spent there
  // More than twice its standard error away from 0.
  bool significant() const { return force * force > 4.0 * standard_error * standard_error; }
};

// What is left of an unexplained gap as a force of stroke and velocity, its part that no parameter
// can imitate (remaining_force.hpp).
struct RemainingForce {
  std::string words;   // "up to 0.24 m/s^2 on extension between 12 and 20 mm/s"
  double share = 0.0;  // of the residuals' square that a force of stroke and velocity explains
  double stroke_step = 0.0, velocity_step = 0.0;  // of the grid
  std::vector<ForceCell> cells;
};

struct Diagnosis {
  Verdict verdict = Verdict::adequate;
  std::string campaign, model;
  std::vector<NamedEffect> effects;
  Gap gap;
  std::vector<RunGap> runs;
  std::vector<Ranked> ranking;
  std::vector<NotTried> not_tried;  // all of the catalogue that is not in `ranking`
  std::vector<ParameterEstimate> parameters_before, parameters_after;
  double false_alarm_rate = 0.0;
  double probability_before = 1.0, probability_after = 1.0;  // that noise alone makes such a gap
  double chi_squared_before = 0.0, chi_squared_after = 0.0;
  int observations = 0;
  Location location;
  std::optional<RemainingForce> remaining;  // only when unexplained
  std::vector<RunCurves> curves;
  config::ModelSpec improved;  // the model file that comes out, starts at the estimates
  IdentifiedDamper damper;     // the hypotheses that are not excluded, for predictions
  bool cut_short = false;      // more could have been tried; there is a warning then
  std::vector<std::string> warnings;
};

}  // namespace shaker::estimator::diagnosis
