// Detects a sensor at the end of its range. Some channels are truly flat: a damper that sticks, a
// valve that opens, a dynamometer that holds its ends, and a crest within one quantisation step.
#pragma once

#include <span>

namespace shaker::estimator::diagnosis {

// What kind of motion a channel has.
enum class Course {
  inert,      // the displacement of a mass comes to rest without a slope
  commanded,  // a table's acceleration or displacement: whatever was commanded, flats hardly
  kinked      // a force, and the acceleration that it makes: a valve or dry friction cuts it flat
};

// The channel stays on its highest (`top`) or lowest value for good; or it does so for a few
// samples of most cycles and
// - comes there with a slope that would have carried it on by more than a step of its grid; an
//   inert one also where noise lies on the flat; or
// - has noise of more than a step beside the flat and none on it.
// A kinked one is flat in truth within one step of a coarse grid.
// `quantisation_step`: step of the grid that the values stand on; 0: not known.
bool clipped(std::span<const double> y, double samples_a_cycle, double cycles, bool top,
             Course course, double quantisation_step = 0.0);

// Whether an imposed motion that stays at its end is held there: the force has come to rest too.
// Behind a clipped sensor the motion turns round, and the force changes most where it comes back.
bool held_at_end(std::span<const double> motion, std::span<const double> force,
                 double samples_a_cycle, bool top);

}  // namespace shaker::estimator::diagnosis
