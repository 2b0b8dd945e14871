// The cases of the blind suite: what is hidden in the virtual rig, its size, the noise, and
// which answers are right. The diagnosis gets the records only and never the truth.
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
  std::string_view name;     // as in the estimator's catalogue, or a name that it lacks
  bool in_catalogue = true;  // false: the right answer is "unexplained"
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

// Setpoints of a campaign: four runs to fit, two held out.
struct Design {
  std::string_view name;
  std::vector<sim::RecordedRun> runs;
};
std::span<const Design> designs();

// 14 cycles in each run at 1 kHz, quantised, with a clock error of 50 ppm.
sim::CampaignRecording recording(const Design& design, const Noise& noise, const Truth& truth,
                                 std::uint64_t seed);

}  // namespace shaker::blind
