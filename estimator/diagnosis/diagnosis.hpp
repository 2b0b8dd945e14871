/// \file
/// What a diagnosis says: plain data, for documents, reports and tests.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "config/model.hpp"
#include "estimator/diagnosis/campaign.hpp"
#include "estimator/fit/estimate.hpp"
#include "estimator/model/identified_damper.hpp"

namespace shaker::estimator::diagnosis {

/// What a diagnosis concludes. adequate: noise alone explains the gap. explained: the named effects
/// explain it. unexplained: a gap is left.
enum class Verdict { adequate, explained, unexplained };
/// \param verdict a verdict
/// \return its word in documents
constexpr const char* name(Verdict verdict) {
  constexpr const char* names[] = {"adequate", "explained", "unexplained"};
  return names[static_cast<int>(verdict)];
}

/// The run that would tell an effect from its rivals best.
struct DiscriminatingRun {
  /// Frequency, Hz, and amplitude of the excitation, m/s^2, of that run.
  /// @{
  double frequency_hz = 0.0, amplitude = 0.0;
  /// @}
  std::string channel;    ///< an extra channel that would do it where no run does; empty: none
  double separation = 0;  ///< in standard errors, from that run together with this campaign
};

/// An effect that the model lacks.
struct NamedEffect {
  /// Name in the catalogue, words for the operator, and formula for display.
  /// @{
  std::string name, meaning, formula;
  /// @}
  double probability = 0.0;                   ///< that it is present, given the campaign
  std::vector<ParameterEstimate> parameters;  ///< of the effect, as fitted
  std::vector<std::string> confusable_with;   ///< what this campaign cannot tell from it
  std::optional<DiscriminatingRun>
      discriminating_run;               ///< the next run to measure; empty: none is needed
  std::string where;                    ///< in an operator's words
  std::optional<double> held_out_gain;  ///< share of the held-out gap that it closes
};

/// Effects of one kind share the evidence: that any of them is missing is surer than each.
struct KindShare {
  /// An effect of the kind.
  struct Member {
    std::string name;          ///< in the catalogue
    double probability = 0.0;  ///< that it is present, given the campaign
  };
  std::string name;             ///< for a reader: "dry friction"
  double probability = 0.0;     ///< that at least one effect of the kind is missing
  std::vector<Member> members;  ///< most probable first; at least two
};

/// Root mean squares over the cycle, in the response's unit. `noise` is what noise alone is
/// expected to leave in the mean cycle, `noise_floor` the level below which it stays in 95 of 100
/// such campaigns, after the parameters have been fitted to it (noise_floor.hpp).
struct Gap {
  /// Expected noise, its upper level, and the gap before and after effects were added.
  /// @{
  double noise = 0.0, noise_floor = 0.0, before = 0.0, after = 0.0;
  /// @}
  /// The same gap in the runs that were not fitted; empty: there are none.
  /// @{
  std::optional<double> held_out_before, held_out_after;
  /// @}
  std::string unit;  ///< of these numbers
};

/// The gap of one run, in the unit of Gap.
struct RunGap {
  std::string name;       ///< of the run
  Role role = Role::fit;  ///< fitted or held out
  /// Frequency, Hz, and amplitude of the excitation, m/s^2.
  /// @{
  double frequency_hz = 0.0, amplitude = 0.0;
  /// @}
  int cycles = 0;  ///< number of whole cycles in the record
  /// Root mean square of the gap before and after effects were added.
  /// @{
  double before = 0.0, after = 0.0;
  /// @}
  /// Expected noise and its upper level, as in Gap.
  /// @{
  double noise = 0.0, noise_floor = 0.0;
  /// @}
};

/// One entry of the catalogue, as it was scored on the model as it came.
struct Ranked {
  std::string name;          ///< of the effect
  double gain = 0.0;         ///< in chi-squared, linearised
  double hidden = 0.0;       ///< share of its signature that the parameters imitate
  double probability = 0.0;  ///< 0 when it was not refitted
  /// Gain after a fit, in chi-squared, and on data that were not fitted, in log probability.
  /// @{
  std::optional<double> gain_refitted, cross_validated;
  /// @}
  std::string disqualified;  ///< why; empty: it is not
};

/// An entry of the catalogue that was not scored.
struct NotTried {
  /// Name of the effect, and why it was not scored.
  /// @{
  std::string name, reason;
  /// @}
  bool failed = false;  ///< a computation did: the effect may be what is missing
};

/// One cycle of a run on equal steps of tau, for drawings; of a run that is not periodic the
/// stretch of it where most happens.
struct RunCurves {
  std::string name;  ///< of the run
  /// Start and length of that stretch, s; length 0: a cycle.
  /// @{
  double from = 0.0, seconds = 0.0;
  /// @}
  /// Displacement (imposed motion: force), measured and as predicted before and after.
  /// @{
  std::vector<double> measured, before, after;
  /// @}
  /// Stroke and velocity of the measured motion, length unit and length unit per s.
  /// @{
  std::vector<double> stroke, velocity;
  /// @}
  /// Velocity of the predicted motions; empty where no displacement is compared or there is no
  /// period.
  /// @{
  std::vector<double> velocity_before, velocity_after;
  /// @}
  /// Residual force by inverse dynamics, m/s^2.
  /// @{
  std::vector<double> force_before, force_after;
  /// @}
};

/// Residual force before and after, averaged over bins of stroke, velocity and phase.
struct ForceBin {
  /// Middle of the bin (length unit, that per s, or phase in cycles), and the mean residual force
  /// in it, m/s^2.
  /// @{
  double at = 0.0, before = 0.0, after = 0.0;
  /// @}
};

/// Where in the motion the gap lies.
struct Location {
  std::string words;   ///< "at velocity reversal: 71 % of the gap"
  double share = 0.0;  ///< of the gap's force that lies there
  /// Bins over stroke, velocity and phase of the cycle.
  /// @{
  std::vector<ForceBin> over_stroke, over_velocity, over_phase;
  /// @}
  std::vector<double> share_of_harmonic;  ///< of the gap, from the mean on
};

/// A cell of stroke and velocity where the motion has been: means over its part inside of it.
struct ForceCell {
  /// Middle of the cell, length unit and length unit per s.
  /// @{
  double stroke = 0.0, velocity = 0.0;
  /// @}
  /// Mean residual force that no parameter can imitate, and its standard error, m/s^2.
  /// @{
  double force = 0.0, standard_error = 0.0;
  /// @}
  /// Mean force that acts beside the model with its estimates, and its standard error, m/s^2. The
  /// parameters can imitate a part of it, and were not moved there by the response.
  /// @{
  double beside = 0.0, beside_error = 0.0;
  /// @}
  double time = 0.0;  ///< share of the cycles that is spent there
  /// \return true if the force is more than twice its standard error away from 0
  bool significant() const { return force * force > 4.0 * standard_error * standard_error; }
};

/// What is left of an unexplained gap as a force of stroke and velocity, its part that no parameter
/// can imitate (remaining_force.hpp).
struct RemainingForce {
  std::string words;   ///< "up to 0.24 m/s^2 on extension between 12 and 20 mm/s"
  double share = 0.0;  ///< of the residuals' square that a force of stroke and velocity explains
  /// Steps of the grid: length unit, and length unit per s.
  /// @{
  double stroke_step = 0.0, velocity_step = 0.0;
  /// @}
  std::vector<ForceCell> cells;  ///< the cells that the motion visited
};

/// All that a diagnosis says.
struct Diagnosis {
  Verdict verdict = Verdict::adequate;  ///< the conclusion
  /// Names of campaign and model.
  /// @{
  std::string campaign, model;
  /// @}
  std::vector<NamedEffect>
      effects;  ///< that the model lacks, in the order in which they close the gap
  /// Kinds of named effects, where others of their kind may be it too.
  std::vector<KindShare> kinds;
  Gap gap;                          ///< of all fitted runs together
  std::vector<RunGap> runs;         ///< one element for each run
  std::vector<Ranked> ranking;      ///< the scored catalogue, best first
  std::vector<NotTried> not_tried;  ///< all of the catalogue that is not in `ranking`
  /// Parameters of the model as it came and of the improved one.
  /// @{
  std::vector<ParameterEstimate> parameters_before, parameters_after;
  /// @}
  double false_alarm_rate = 0.0;  ///< as it was asked for
  /// Probability that noise alone makes such a gap, before and after.
  /// @{
  double probability_before = 1.0, probability_after = 1.0;
  /// @}
  /// Weighted sums of squared residuals, in units of the noise, before and after.
  /// @{
  double chi_squared_before = 0.0, chi_squared_after = 0.0;
  /// @}
  int observations = 0;                     ///< number of data behind them
  Location location;                        ///< of the gap of the model as it came
  std::optional<RemainingForce> remaining;  ///< only when unexplained
  std::vector<RunCurves> curves;            ///< one element for each run
  config::ModelSpec improved;  ///< the model file that comes out, starts at the estimates
  IdentifiedDamper damper;     ///< the hypotheses that are not excluded, for predictions
  bool cut_short = false;      ///< more could have been tried; there is a warning then
  /// Of each record that was given a constant force of its own: that force beside the named effects,
  /// m/s^2; empty: none was.
  std::map<std::string, double> own_forces;
  std::vector<std::string> warnings;  ///< sentences for the operator
};

}  // namespace shaker::estimator::diagnosis
