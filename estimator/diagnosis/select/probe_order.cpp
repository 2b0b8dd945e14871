#include "estimator/diagnosis/select/internal/probe_order.hpp"

#include <algorithm>

#include "estimator/model/effects/catalogue.hpp"

namespace shaker::estimator::diagnosis {

std::vector<OrderedProbe> ordered(const Scoring& scoring) {
  std::vector<OrderedProbe> best;
  for (const Score& s : scoring.scores) {
    auto found = std::find_if(best.begin(), best.end(),
                              [&](const OrderedProbe& o) { return o.candidate == s.candidate; });
    if (found == best.end()) {
      best.push_back({s.candidate, &s.candidate->probes[s.probe], s.gain});
    } else if (s.gain > found->gain) {
      found->probe = &s.candidate->probes[s.probe];
      found->gain = s.gain;
    }
  }
  std::erase_if(best, [](const OrderedProbe& o) { return o.gain < kMinRefitGain; });
  std::stable_sort(best.begin(), best.end(),
                   [](const OrderedProbe& a, const OrderedProbe& b) { return a.gain > b.gain; });
  return best;
}

void put_memory_last(std::vector<OrderedProbe>& probes) {
  std::stable_partition(probes.begin(), probes.end(), [](const OrderedProbe& o) {
    const Effect* effect = find_effect(o.candidate->name());
    return effect == nullptr || effect->internals().empty();
  });
}

}  // namespace shaker::estimator::diagnosis
