#include "estimator/solve/periodic/internal/lane_reversals.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/solve/periodic/internal/lane_reversal_parts.hpp"

namespace shaker::estimator {

using lane_reversals::kOrders;

LaneReversals::LaneReversals(const Stencil& stencil, int points, int sensitivities, int columns)
    : stencil_(stencil),
      n_(points),
      sensitivities_(sensitivities),
      columns_(columns),
      zeros_(kMost),
      jumps_(kMost * static_cast<std::size_t>(kOrders * sensitivities * kLanes)) {
  const int reach = stencil_.reach;
  for (int r = 0; r < 2 * reach; ++r) {
    ReversalPartners& row = partners_[static_cast<std::size_t>(r)];
    const int own = r - reach + 1;  // against base
    const bool before = own <= 0;
    for (int k = before ? 1 - own : -reach; k <= (before ? reach : -own); ++k, ++row.count) {
      const double side = before ? -1.0 : 1.0;
      row.offset[row.count] = own + k;
      row.first[row.count] = side * stencil_.first[static_cast<std::size_t>(k + reach)];
      row.second[row.count] = side * stencil_.second[static_cast<std::size_t>(k + reach)];
    }
  }
  used_ = static_cast<int>(kMost);
  forget();
}

void LaneReversals::forget() {
  for (int c = 0; c < used_; ++c) {
    LaneZero& zero = zeros_[static_cast<std::size_t>(c)];
    zero.here = zero.known = LaneMask{};
    zero.jump4 = zero.jump5 = zero.damping = zero.stiffness = Lanes{};
    zero.inertia = Lanes{} + 1.0;
  }
  count_.fill(0);
  known_.fill(0);
  used_ = 0;
}

void LaneReversals::inherit(const LaneReversals& coarser) {
  forget();
  known_ = coarser.known_;
  used_ = *std::max_element(known_.begin(), known_.end());
  std::copy_n(coarser.jumps_.begin(), used_ * kOrders * sensitivities_ * kLanes, jumps_.begin());
  for (int c = 0; c < used_; ++c) {
    LaneZero& zero = zeros_[static_cast<std::size_t>(c)];
    const LaneZero& old = coarser.zeros_[static_cast<std::size_t>(c)];
    for (std::size_t l = 0; l < kLanes; ++l) {
      if (known_[l] <= c) continue;
      zero.inertia[l] = old.inertia[l];
      zero.damping[l] = old.damping[l];
      zero.stiffness[l] = old.stiffness[l];
    }
  }
}

int LaneReversals::most_zeros() const {
  return *std::max_element(count_.begin(), count_.end());
}

void LaneReversals::find_zeros(unsigned moving, const Lanes* v) {
  for (std::size_t l = 0; l < kLanes; ++l) {
    if ((moving >> l & 1U) != 0) count_[l] = 0;
  }
  unsigned lanes = 0;
  for (int i = lane_reversals::next_change(n_, 0, v, lanes); i < n_;
       i = lane_reversals::next_change(n_, i + 1, v, lanes)) {
    for (std::size_t l = 0; l < kLanes; ++l) {
      if ((lanes & moving) >> l == 0) break;
      if (((lanes & moving) >> l & 1U) == 0 || count_[l] == static_cast<int>(kMost)) continue;
      LaneZero& zero = zeros_[static_cast<std::size_t>(count_[l]++)];
      if (zero.base[l] != i || !std::isfinite(zero.fraction[l] + zero.jump5[l])) zero.known[l] = 0;
      if (zero.known[l] == 0 && !std::isfinite(zero.damping[l] + zero.inertia[l])) {
        zero.damping[l] = zero.stiffness[l] = 0.0;
        zero.inertia[l] = 1.0;
      }
      zero.base[l] = i;
    }
  }
  const int most = most_zeros();
  used_ = std::max(used_, most);
  for (int c = 0; c < most; ++c) {
    LaneZero& zero = zeros_[static_cast<std::size_t>(c)];
    zero.together = true;
    for (std::size_t l = 0; l < kLanes; ++l) {
      zero.here[l] = count_[l] > c ? -1 : 0;
      zero.together = zero.together && zero.base[l] == zero.base[0];
    }
  }
}

void LaneReversals::correct_state(const Lanes& kappa, const Lanes& rate, unsigned moving, Lanes* v,
                                  Lanes* a) {
  kappa_ = kappa;
  rate_ = rate;
  unsigned kinked = 0;
  for (int l = 0; l < kLanes; ++l)
    kinked |= kappa[l] != 0.0 ? 1U << l : 0U;
  for (std::size_t l = 0; l < kLanes; ++l) {
    if ((moving & ~kinked) >> l & 1U) count_[l] = 0;
  }
  find_zeros(moving & kinked, v);
  const lane_reversals::Located in{{n_, stencil_.reach}, &partners_, rate, kappa,
                                   mask_of(moving),      v,          a};
  const int most = most_zeros();
  for (int c = 0; c < most; ++c)
    lane_reversals::locate(in, zeros_[static_cast<std::size_t>(c)]);
  for (int c = 0; c < most; ++c)
    lane_reversals::put_jumps(in, zeros_[static_cast<std::size_t>(c)]);
}

void LaneReversals::add_jumps(Lanes* v, Lanes* a) const {
  const lane_reversals::Located in{{n_, stencil_.reach}, &partners_, rate_, kappa_,
                                   ~LaneMask{},          v,          a};
  const int most = most_zeros();
  for (int c = 0; c < most; ++c)
    lane_reversals::put_jumps(in, zeros_[static_cast<std::size_t>(c)]);
}

void LaneReversals::learn_slopes(unsigned moving, const Lanes* g_u, const Lanes* g_v,
                                 const Lanes* g_a, const Lanes* v) {
  const int most = most_zeros();
  for (int c = 0; c < most; ++c)
    lane_reversals::take_slopes({n_, stencil_.reach}, mask_of(moving), kappa_, g_u, g_v, g_a, v,
                                zeros_[static_cast<std::size_t>(c)]);
}

void LaneReversals::learn_sensitivities(unsigned moving, const Lanes* rows,
                                        const Lanes* kappa_theta) {
  for (std::size_t l = 0; l < kLanes; ++l) {
    if ((moving >> l & 1U) == 0 || known_[l] == count_[l]) continue;
    const int values = count_[l] * kOrders * sensitivities_;
    for (int i = 0; i < values; ++i)
      jumps_[static_cast<std::size_t>(i) * kLanes + l] = 0.0;
    known_[l] = count_[l];
  }
  const int most = most_zeros();
  for (int c = 0; c < most; ++c)
    lane_reversals::learn({{n_, stencil_.reach},
                           &stencil_,
                           rate_,
                           kappa_,
                           mask_of(moving),
                           rows,
                           columns_,
                           sensitivities_,
                           kappa_theta,
                           jumps(c, 0)},
                          zeros_[static_cast<std::size_t>(c)]);
}

void LaneReversals::correct_left(unsigned moving, const Lanes* g_v, const Lanes* g_a,
                                 double* const* left) const {
  unsigned lanes = 0;
  for (std::size_t l = 0; l < kLanes; ++l)
    lanes |= known_[l] == count_[l] ? 1U << l : 0U;
  const int most = most_zeros();
  for (int c = 0; c < most; ++c)
    lane_reversals::correct({{n_, stencil_.reach},
                             mask_of(lanes & moving),
                             g_v,
                             g_a,
                             jumps(c, 0),
                             sensitivities_,
                             left},
                            zeros_[static_cast<std::size_t>(c)]);
}

}  // namespace shaker::estimator
