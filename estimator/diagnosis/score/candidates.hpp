// What may be missing: every effect of the catalogue that the model does not hold yet, at "as if it
// were not there", with the parameters that only shape it on a small grid.
#pragma once

#include <string>
#include <vector>

#include "config/model.hpp"
#include "estimator/diagnosis/campaign.hpp"
#include "estimator/diagnosis/diagnosis.hpp"
#include "estimator/effects/effect.hpp"

namespace shaker::estimator::diagnosis {

// One shape of an effect: a line of a model file whose coefficients are at their absent value. An
// effect that has no such value (a valve's threshold, a spring in series) is probed where it does
// something, and scored by the difference that it makes.
struct Probe {
  config::EffectSpec line;
  std::vector<std::string>
      coefficients;  // symbols of the parameters that switch it on; may be none
};

struct Candidate {
  const Effect* effect = nullptr;
  std::vector<Probe> probes;
};

// The whole catalogue: what can be scored, and what cannot, each with its reason.
struct Catalogue {
  std::vector<Candidate> tried;
  std::vector<NotTried> not_tried;
};

// The motion that was measured; shapes that lie outside of it can have no influence.
struct MotionRange {
  double low = 0.0, high = 0.0;  // of the stroke
  double speed = 0.0;            // largest
  double force = 0.0;            // largest, per unit mass
};

// Where the motion is imposed, only what the damper may lack: there is no excitation, and no motion
// to be mismeasured. In a model of several coordinates effects of the damper stand where its own
// stand, the first that carries load and sees the observed coordinate; `notes` names those that
// cannot: without load (of a mass or a tyre: of which?), or with their name taken in another place.
Catalogue candidates(const config::ModelSpec& base, const MotionRange& range, Kind kind,
                     std::vector<std::string>& notes);

}  // namespace shaker::estimator::diagnosis
