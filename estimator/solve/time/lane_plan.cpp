#include "estimator/solve/time/internal/lane_plan.hpp"

#include <algorithm>
#include <cmath>

namespace shaker::estimator {

LanePlan::Source LanePlan::source_of(const Arc& arc) {
  return {arc.times.data(), arc.excitation, arc.measured.data(), arc.times.size()};
}

bool LanePlan::is_of(std::span<const Arc> arcs, std::size_t first, int lanes) const {
  if (first != first_ || lanes != lanes_) return false;
  for (std::size_t lane = 0; lane < sources_.size(); ++lane) {
    const Arc& arc = arcs[first + lane];
    const Source now = source_of(arc);
    const Source& was = sources_[lane];
    if (arc.changed || now.times != was.times || now.excitation != was.excitation ||
        now.measured != was.measured || now.size != was.size)
      return false;
  }
  return true;
}

void LanePlan::lay(std::span<const Arc> arcs, std::size_t first, int lanes, double step) {
  first_ = first;
  lanes_ = lanes;
  const auto mine = arcs.subspan(first, static_cast<std::size_t>(lanes));
  std::size_t intervals = 0;
  bool compared = false;
  for (const Arc& arc : mine) {
    intervals = std::max(intervals, arc.times.size() - 1);
    compared = compared || !arc.measured.empty();
  }
  parts_.assign(intervals, 1);
  for (const Arc& arc : mine) {
    for (std::size_t i = 0; step > 0.0 && i + 1 < arc.times.size(); ++i) {
      const double parts = (arc.times[i + 1] - arc.times[i]) / step;
      parts_[i] = std::max(parts_[i], static_cast<int>(std::ceil(parts - 1e-9)));
    }
  }
  half_steps_.assign(1, 0);
  for (const int parts : parts_)
    half_steps_.push_back(half_steps_.back() + 2 * static_cast<std::size_t>(parts));
  uniform_ =
      std::all_of(parts_.begin(), parts_.end(), [&](int parts) { return parts == parts_[0]; });
  const auto n = mine.size(), padded = (n + 7) / 8 * 8;
  t_.resize((intervals + 1) * n);
  y_.assign(compared ? (intervals + 1) * n : 0, 0.0);
  x_.resize((half_steps_.back() + 1) * n);
  for (AlignedVector* bounds : {&last_, &from_, &to_})
    bounds->assign(padded, 0.0);
  sources_.clear();
  for (std::size_t lane = 0; lane < n; ++lane) {
    lay_lane(mine[lane], lane);
    sources_.push_back(source_of(mine[lane]));
  }
}

void LanePlan::lay_lane(const Arc& arc, std::size_t lane) {
  const auto n = static_cast<std::size_t>(lanes_);
  const std::size_t end = arc.times.size() - 1;
  for (std::size_t i = 0; i <= parts_.size(); ++i)
    t_[i * n + lane] = arc.times[std::min(i, end)];
  std::size_t node = 0;
  x_[lane] = arc.excitation->value(arc.times[0]);
  for (std::size_t i = 0; i < parts_.size(); ++i) {
    const double dt = i < end ? arc.times[i + 1] - arc.times[i] : 0.0;
    for (int half = 1; half <= 2 * parts_[i]; ++half, ++node)
      x_[(node + 1) * n + lane] =
          i < end ? arc.excitation->value(arc.times[i] + dt * half / (2 * parts_[i]))
                  : x_[node * n + lane];
  }
  for (std::size_t k = 0; k < arc.measured.size(); ++k)
    y_[(arc.first_measured + k) * n + lane] = arc.measured[k];
  last_[lane] = static_cast<double>(end);
  from_[lane] = static_cast<double>(arc.first_measured);
  to_[lane] = from_[lane] + static_cast<double>(arc.measured.size());
}

void lay_plans(std::span<Arc> arcs, double step, std::vector<LanePlan>& plans) {
  constexpr std::size_t kAbreast = kLanesAbreast;
  plans.resize((arcs.size() + kAbreast - 1) / kAbreast);
  std::size_t first = 0;
  for (LanePlan& plan : plans) {
    const std::size_t lanes = std::min(kAbreast, arcs.size() - first);
    if (!plan.is_of(arcs, first, static_cast<int>(lanes)))
      plan.lay(arcs, first, static_cast<int>(lanes), step);
    first += lanes;
  }
  for (Arc& arc : arcs)
    arc.changed = false;
}

}  // namespace shaker::estimator
