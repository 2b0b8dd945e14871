// A drop test, predicted from an identified model: what the whole shaker method is for (figures 1
// and 2 of the paper). Stroke, load, rebound and energy of a gear that touches down with a sink
// speed, with a band from the covariance of its parameters.
//
// The mass falls with everything at rest relative to it: all coordinates at 0, and the sink speed
// is the rate of the coordinate that meets the ground (the last one: the stroke, or the tyre below
// it). No excitation. Lift is a constant force on the mass, a share of the weight. Loads are per
// unit mass (m/s^2): what the first equation's mass feels from everything but weight and lift.
//
// The band is that of the parameters: it does not know effects that the model lacks. Two are given:
// linearised (delta method, with the sensitivities (5.10)) and sampled (parameters drawn from
// Student's distribution with the estimate's covariance, inside their bounds).
#pragma once

#include <string>
#include <vector>

#include "base/result.hpp"
#include "config/model.hpp"
#include "estimator/model.hpp"
#include "estimator/time/state_equations.hpp"

namespace shaker::estimator {

struct DropConditions {
  double sink_speed = 0.0;  // of the model's length unit per s; above 0
  double lift = 0.0;        // share of the weight, 0 to 1
  double duration = 1.5;    // s
  int contact = -1;         // coordinate that meets the ground; -1: the last with a mass
};

// In the order of kDropFigures.
struct DropFigure {
  const char* name;  // "peak_stroke"
  const char* label;
  int length, time;  // powers in its unit: m^length s^time
};
inline constexpr DropFigure kDropFigures[] = {
    {"peak_stroke", "peak stroke", 1, 0},
    {"time_of_peak_stroke", "time of peak stroke", 0, 1},
    {"peak_deceleration", "peak deceleration", 1, -2},
    {"peak_load", "peak load per mass", 1, -2},
    {"load_at_peak_stroke", "load per mass at peak stroke", 1, -2},
    {"rebound_stroke", "stroke after rebound", 1, 0},
    {"rebound_speed", "speed of rebound", 1, -1},
    {"energy_absorbed", "energy absorbed per mass", 2, -2},
    {"energy_dissipated", "of it, not returned in rebound", 2, -2},
    {"efficiency", "efficiency of the stroke", 0, 0},
};
inline constexpr std::size_t kDropFigureCount = std::size(kDropFigures);

struct DropHistory {
  std::vector<double> t, stroke, speed, load;    // load per mass
  std::vector<double> stroke_error, load_error;  // standard errors by the delta method, or empty
};

struct DropRun {
  std::vector<double> figures;  // one for each of kDropFigures; NaN for what did not happen
  DropHistory history;
  std::vector<double> stroke_derivatives, load_derivatives;  // times x parameters, or empty
  double fastest = 0.0;                                      // of the stroke
};

class DropTest {
 public:
  // Throws std::invalid_argument for conditions that make no sense, with what is allowed.
  DropTest(const config::ModelSpec& spec, DropConditions conditions);

  const Model& model() const { return model_; }
  // An Error when the stroke does not turn within the duration, or leaves what is admissible.
  Result<DropRun> run(const std::vector<double>& theta, bool derivatives) const;

 private:
  void loads(DropRun& run, const std::vector<double>& theta, const std::vector<double>& states,
             const std::vector<double>& sensitivities) const;
  Result<void> read_off(DropRun& run) const;

  Model model_;
  DropConditions conditions_;
  double weight_ = 0.0, lift_ = 0.0;  // of the first equation, per mass
  std::vector<double> mass_;          // its row
  StateEquations equations_;
};

struct DropBand {
  double value = 0.0, error = 0.0;  // delta method
  double lower = 0.0, upper = 0.0;  // of the delta method, with `quantile`
  double sampled_lower = 0.0, sampled_upper = 0.0;
};

struct DropPrediction {
  DropRun run;
  std::vector<DropBand> bands;  // one for each of kDropFigures
  int samples = 0;              // that gave a drop
  int lost = 0;                 // outside the bounds, or without a drop
};

struct DropUncertainty {
  std::vector<int> parameters;     // indices that the covariance is of
  std::vector<double> covariance;  // row by row; empty: no band
  double degrees_of_freedom = 0.0;
  int samples = 400;
  unsigned long seed = 1;
  double confidence = 0.95;
};

Result<DropPrediction> predict_drop(const DropTest& test, const std::vector<double>& theta,
                                    const DropUncertainty& uncertainty);

}  // namespace shaker::estimator
