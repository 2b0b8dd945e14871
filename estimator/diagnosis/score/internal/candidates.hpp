// The candidates: every effect of the catalogue that the model does not have yet, with its
// coefficients at their absent value and its other parameters on a small grid.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "config/model.hpp"
#include "estimator/diagnosis/campaign.hpp"
#include "estimator/diagnosis/diagnosis.hpp"
#include "estimator/diagnosis/internal/inputs.hpp"
#include "estimator/model/effects/effect.hpp"

namespace shaker::estimator::diagnosis {

// One shape of an effect: a line of a model file with the coefficients at their absent value. An
// effect without an absent value (a valve's threshold, a spring in series) is probed where it acts,
// and scored by the difference that it makes.
struct Probe {
  config::EffectSpec line;
  std::vector<std::string>
      coefficients;  // symbols of the parameters that switch it on; may be none
};

struct Candidate {
  const Effect* effect = nullptr;
  std::vector<Probe> probes;  // at least one
  // The effect's, and that of the input which drives it.
  const std::string& name() const { return probes.front().line.effect; }
};

// The whole catalogue: the candidates, and the effects that cannot be scored, each with the reason.
struct Catalogue {
  std::vector<Candidate> tried;
  std::vector<NotTried> not_tried;
};

// The range of the measured motion. A shape outside of it has no influence.
struct MotionRange {
  double low = 0.0, high = 0.0;  // of the stroke
  double speed = 0.0;            // largest
  double force = 0.0;            // largest, per unit mass
  bool imposed = false;          // nobody knows the mass that moves along with the stroke
};

// By what the motion differs in size from that for which the catalogue's numbers are meant.
config::MotionScale scale_of(const MotionRange& range);

// A load path has at most one part in series.
constexpr std::string_view kOnePartInSeries =
    "the model has a play or a joint in its load path already";

// Returns the candidates. For an imposed motion these are effects of the damper only: there is no
// excitation, and the motion is not predicted. In a model of several coordinates an effect of the
// damper gets the coordinate of the first of the damper's effects that carries load and sees the
// observed coordinate. `notes` names the effects that have no such place: effects without load (the
// coordinate of a mass or a tyre is unknown), or those whose name stands in another place already.
//
// Each input gives loads of the damper more: those that are in proportion to coefficients of their
// own, in proportion to the input too. They stand behind the others.
Catalogue candidates(const config::ModelSpec& base, const MotionRange& range, Kind kind,
                     std::vector<std::string>& notes, const std::vector<DrivingInput>& inputs = {});

}  // namespace shaker::estimator::diagnosis
