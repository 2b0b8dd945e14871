// The blind suite's cases: what is hidden in the virtual rig, how strongly, under which noise, and
// what answers count as right. The truth stays on this side: the workflow is given records only.
#pragma once

#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "sim/campaign_recorder.hpp"

namespace shaker::blind {

using Truth = std::map<std::string, double>;  // parameters of the virtual rig

// One kind of effect in three sizes.
struct Kind {
  std::string_view name;     // as the catalogue of the estimator has it; or of what it has not
  bool in_catalogue = true;  // false: "unexplained" is the answer wanted
  Truth sizes[3];            // small, medium, large
};
std::span<const Kind> kinds();

// Two effects at once.
struct Pair {
  std::string_view first, second;
  Truth truth;
};
std::span<const Pair> pairs();

inline constexpr std::string_view kSizeNames[] = {"small", "medium", "large"};

struct Noise {
  std::string_view name;
  double displacement, excitation;  // standard deviations of a sample, m and m/s^2
};
std::span<const Noise> noises();

// Excitations: four runs to fit, two held out.
struct Design {
  std::string_view name;
  std::vector<sim::RecordedRun> runs;
};
std::span<const Design> designs();

// 14 cycles a run at 1 kHz, quantised, on a clock 50 ppm off.
sim::CampaignRecording recording(const Design& design, const Noise& noise, const Truth& truth,
                                 std::uint64_t seed);

}  // namespace shaker::blind
