// Prediction of a drop test from an identified model, the purpose of the shaker method (figures 1
// and 2 of the paper). It gives stroke, load, rebound and energy of a landing gear that touches
// down with a sink speed, with an uncertainty band from the covariance of the parameters.
//
// At touchdown everything is at rest relative to the mass: all coordinates are 0, and internal
// states have their rest values. The sink speed is the rate of the coordinate that meets the ground
// (by default the last one: the stroke, or the tyre below it). There is no excitation. Lift is a
// constant force on the mass, a share of the weight. Loads are per unit mass (m/s^2): the force on
// the first equation's mass without weight and lift.
//
// The band contains the uncertainty of the parameters only, not that of effects which the model
// lacks. It is given twice: linearised (delta method; histories with the sensitivities (5.10),
// figures with central differences) and sampled (parameters drawn from Student's distribution with
// the estimate's covariance, inside their bounds).
#pragma once

#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.hpp"
#include "config/model.hpp"
#include "estimator/model/model.hpp"
#include "estimator/solve/time/excitation.hpp"
#include "estimator/solve/time/state_equations.hpp"

namespace shaker::estimator {

// Degrees of freedom behind a campaign's covariance, at most: those of one harmonic, cosine and sine,
// of a dozen cycles, whatever the count over all harmonics says. docs/drop_coverage.md has how often
// intervals hold.
constexpr double kMostCampaignFreedom = 22.0;

struct DropConditions {
  double sink_speed = 0.0;  // the model's length unit per s; above 0
  double lift = 0.0;        // share of the weight, 0 to 1
  double duration = 1.5;    // s
  int contact = -1;         // coordinate that meets the ground; -1: the last mechanical one
  double extended = 0.0;    // the model's stroke at touch-down; strokes are counted from it
  // The greatest stroke of the strut, counted likewise, where it is known beside the model.
  double stroke_limit = std::numeric_limits<double>::infinity();
};

struct DropFigure {
  const char* name;  // "peak_stroke"
  const char* label;
  int length, time;  // powers in its unit: m^length s^time
  // What it is at least and at most, by its definition.
  double lower = 0.0, upper = std::numeric_limits<double>::infinity();
};
inline constexpr double kNoLowerEnd = -std::numeric_limits<double>::infinity();
inline constexpr DropFigure kDropFigures[] = {
    {"peak_stroke", "peak stroke", 1, 0},
    {"time_of_peak_stroke", "time of peak stroke", 0, 1},
    {"peak_deceleration", "peak deceleration", 1, -2, kNoLowerEnd},
    {"peak_load", "peak load per mass", 1, -2},
    {"load_at_peak_stroke", "load per mass at peak stroke", 1, -2, kNoLowerEnd},
    {"rebound_stroke", "stroke after rebound", 1, 0, kNoLowerEnd},
    {"rebound_speed", "speed of rebound", 1, -1},
    {"energy_absorbed", "energy absorbed per mass", 2, -2},
    {"energy_dissipated", "of it, not returned in rebound", 2, -2},
    {"efficiency", "efficiency of the stroke", 0, 0, 0.0, 1.0},
    {"time_of_peak_load", "time of peak load", 0, 1},
    // The descent of the mass is the stroke plus the deflection of a tyre. Without a tyre the three
    // others have no value.
    {"travel", "descent of the mass", 1, 0},
    {"tyre_deflection", "deflection of the tyre", 1, 0},
    {"peak_ground_load", "peak load on the ground per mass", 1, -2},
    {"gear_efficiency", "efficiency of strut and tyre", 0, 0, 0.0, 1.0},
    // The stroke that is left at the peak. No value where no greatest stroke is known.
    {"margin_to_bottoming", "margin to bottoming", 1, 0, kNoLowerEnd},
};
inline constexpr std::size_t kDropFigureCount = std::size(kDropFigures);

// The index of the figure with that name; kDropFigureCount if there is none.
constexpr std::size_t figure_called(std::string_view name) {
  std::size_t figure = 0;
  while (figure < kDropFigureCount && name != kDropFigures[figure].name)
    ++figure;
  return figure;
}

struct DropHistory {
  std::vector<double> t, stroke, speed, load;  // load per mass
  // The descent of the mass, its rate, and the load on the ground per mass; empty unless the model
  // has two coordinates, the stroke and the deflection of a tyre below it.
  std::vector<double> travel, travel_speed, ground_load;
  std::vector<double> stroke_error, load_error;  // standard errors by the delta method, or empty
};

// When the rebound from the deepest stroke ends, s; the last time where it does not. No figure
// needs what follows.
double end_of_rebound(const DropHistory& history);

// How a drop is integrated.
struct DropEffort {
  double tolerance = 1e-9;  // relative, of a step
  bool stiff = false;       // known to be: Adams is not tried first
  int steps = 3000;         // between the times of the history
};

struct DropRun {
  std::vector<double> figures;  // one for each of kDropFigures; NaN if the event did not occur
  DropHistory history;
  std::vector<double> stroke_derivatives, load_derivatives;  // times x parameters, or empty
  double fastest = 0.0;                                      // largest |speed| of the stroke
  bool stiff = false;                                        // Adams was not enough
};

// The largest load per mass of a drop with all parameters `theta`, and its derivatives: those of the
// load at its time, since it is largest there.
struct PeakLoad {
  double value = 0.0;
  std::vector<double> derivatives;  // one for each parameter
};

// Where the stroke ends: at the least of the limit that the conditions state, the stroke at which an
// end stop is met, and the one that would crush the gas to nothing.
struct StrokeEnd {
  enum class By { nothing, stated_limit, end_stop, gas };
  double stroke = std::numeric_limits<double>::infinity();  // counted from touch-down
  By by = By::nothing;
};

// "gas", "orifice", "friction", or "other".
std::string_view effect_family(std::string_view effect);

// What an effect of the model takes part in: its own force along the drop, per mass.
struct EffectShare {
  std::string effect;
  std::vector<double> load;   // at the times of the history
  double of_peak_load = 0.0;  // of the load where that is largest
  double of_energy = 0.0;     // of the energy that the strut absorbs up to the deepest stroke
};

// The forces of the effects, each computed by itself, and the balance of energy that they give.
struct DropShares {
  std::vector<EffectShare> effects;
  // What came in (kinetic energy, and the work of weight without lift) less what the effects and a
  // tyre took and what is still moving at the deepest stroke, over what came in.
  double energy_residual = 0.0;
};

class DropTest {
 public:
  // Throws std::invalid_argument for conditions out of range; the message names the range.
  DropTest(const config::ModelSpec& spec, DropConditions conditions);

  const Model& model() const { return model_; }
  double lift() const { return lift_; }    // its force on the mass, m/s^2
  std::vector<double> touch_down() const;  // all states at time 0, in the order of StateEquations
  // Integrates one drop with all parameters `theta`. Returns an Error (not_converged) when the
  // stroke does not reverse within the duration, becomes inadmissible, or the integrator fails.
  // `push`: an acceleration over time beside the model's forces, for example an unnamed force of
  // the damper with its sign turned; it counts as a part of the load.
  Result<DropRun> run(const std::vector<double>& theta, bool derivatives,
                      const Excitation& push = {}, const DropEffort& effort = {}) const;

  // Integrates one drop. The Error is that of run().
  Result<PeakLoad> peak_load(const std::vector<double>& theta) const;

  // The end of the stroke with all parameters `theta`. Only effects that see the stroke alone count.
  StrokeEnd stroke_end(const std::vector<double>& theta) const;

  // Integrates the drop once more and evaluates the effects along it, one after the other. The
  // Error is that of run().
  Result<DropShares> shares(const std::vector<double>& theta) const;

 private:
  struct Motion {
    std::vector<double> states, sensitivities;  // row by row, at the times of the history
  };
  Result<Motion> integrate(DropRun& run, const std::vector<double>& theta, bool derivatives,
                           const Excitation& push, const DropEffort& effort) const;
  // The lift in each equation. The coordinate of a tyre below the stroke; -1: there is none. The
  // unsprung mass and its weight over the mass on the damper.
  static std::vector<double> forces_of(const Model& model, double lift);
  int find_tyre() const;
  bool has_tyre() const { return tyre_ >= 0; }
  double unsprung_mass(const std::vector<double>& theta) const;
  double unsprung_weight(const std::vector<double>& theta) const;
  double energy_in(const DropHistory& history, std::size_t end,
                   const std::vector<double>& theta) const;
  void loads(DropRun& run, const std::vector<double>& theta, const std::vector<double>& states,
             const std::vector<double>& sensitivities, const Excitation& push) const;
  Result<void> read_off(DropRun& run, const std::vector<double>& theta) const;

  config::ModelSpec spec_;
  Model model_;
  DropConditions conditions_;
  double weight_ = 0.0, lift_ = 0.0;  // in the first equation, per reference mass
  double unsprung_weight_ = 0.0;      // in the second, if there is one
  std::vector<double> mass_;          // by which each coordinate's acceleration is in the first
  int tyre_ = -1;
  int unsprung_ = -1;  // the parameter that is the unsprung mass; -1: the model's own mass
  StateEquations equations_;
};

struct DropBand {
  double value = 0.0, error = 0.0;  // delta method
  double lower = 0.0, upper = 0.0;  // interval of the delta method
  double sampled_lower = 0.0, sampled_upper = 0.0;
};

struct DropPrediction {
  DropRun run;
  std::vector<DropBand> bands;             // one for each of kDropFigures
  int samples = 0;                         // draws with a drop
  int lost = 0;                            // draws outside the bounds, or without a drop
  int outside = 0;                         // of these, outside the bounds
  std::vector<std::vector<double>> drawn;  // of each of kDropFigures, sorted; empty without a band
};

struct DropUncertainty {
  std::vector<int> parameters;     // indices of the covariance's rows
  std::vector<double> covariance;  // row by row; empty: no band
  double degrees_of_freedom = 0.0;
  int samples = 400;
  unsigned long seed = 1;
  double confidence = 0.95;
};

// Predicts a drop with its band. It integrates two drops for each uncertain parameter and one for
// each sample. Returns an Error if the drop at `theta` or one of those next to it fails.
Result<DropPrediction> predict_drop(const DropTest& test, const std::vector<double>& theta,
                                    const DropUncertainty& uncertainty);

}  // namespace shaker::estimator
