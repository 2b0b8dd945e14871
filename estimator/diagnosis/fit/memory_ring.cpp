#include "estimator/diagnosis/fit/internal/memory_ring.hpp"

#include <algorithm>
#include <vector>

#include "estimator/solve/periodic/ring_step.hpp"

namespace shaker::estimator::diagnosis {

MemoryRing::MemoryRing(const Model& model, double frequency_hz, int points)
    : n_(points),
      s_(model.coordinates()),
      p_(model.parameter_count()),
      memories_(s_ - 1),
      steps_per_second_(frequency_hz * points),
      closed_(points + 2 * stencil_.reach) {
  const int groups = lane_groups(1 + p_, stencil_.reach, memories_);
  stride_ = groups * kLanes;
  const auto equations = static_cast<std::size_t>(n_ * memories_);
  rows_.resize(equations * static_cast<std::size_t>(stride_));
  if (!ring_step_exists(memories_, stencil_.reach, groups)) return;
  const auto places = equations * static_cast<std::size_t>(packed(memories_));
  band_.resize(8 * places);
  upper_.resize(4 * places);
}

void MemoryRing::differentiate(ModelArrays& at) {
  const int reach = stencil_.reach;
  for (int c = 1; c < s_; ++c) {
    const double* w = at.u[static_cast<std::size_t>(c)];
    std::copy_n(w + n_ - reach, reach, closed_.data());
    std::copy_n(w, n_, closed_.data() + reach);
    std::copy_n(w, reach, closed_.data() + reach + n_);
    Eigen::Map<Eigen::VectorXd> rate(at.v[static_cast<std::size_t>(c)], n_);
    rate.setZero();
    for (int k = 0; k <= 2 * reach; ++k)
      rate +=
          steps_per_second_ * stencil_.first[static_cast<std::size_t>(k)] * closed_.segment(k, n_);
  }
}

void MemoryRing::fill_rows(const ModelArrays& at) {
  std::fill(rows_.begin(), rows_.end(), 0.0);
  const auto next = static_cast<std::ptrdiff_t>(memories_) * stride_;
  for (int d = 1; d < s_; ++d) {
    for (int k = 0; k <= p_; ++k) {
      const double* column = k == 0 ? at.g[static_cast<std::size_t>(d)]
                                    : at.g_theta[static_cast<std::size_t>(d * p_ + k - 1)];
      double* to = &rows_[static_cast<std::size_t>((d - 1) * stride_ + k)];
      for (int i = 0; i < n_; ++i)
        to[i * next] = -column[i];
    }
  }
}

bool MemoryRing::solve_ring(const ModelArrays& at) {
  const int reach = stencil_.reach;
  double first[kMostBlock][kMostAcross];
  const double second[kMostBlock][kMostAcross] = {};
  for (auto& of_memory : first) {
    for (std::size_t k = 0; k < kMostAcross; ++k)
      of_memory[k] = steps_per_second_ * stencil_.first[k];
  }
  if (memories_ > 1) {
    std::vector<const double*> g_u, g_v, g_a;
    for (int d = 1; d < s_; ++d) {
      for (int e = 1; e < s_; ++e) {
        const auto de = static_cast<std::size_t>(d * s_ + e);
        g_u.push_back(at.g_u[de]);
        g_v.push_back(at.g_v[de]);
        g_a.push_back(at.g_a[de]);
      }
    }
    fill_block_band(
        {n_, memories_, reach, g_u.data(), g_v.data(), g_a.data(), first, second, band_.data()});
  } else {
    const double *over_w = at.g_u[3], *over_rate = at.g_v[3];
    for (int i = 0; i < n_; ++i) {
      double* values = &band_[static_cast<std::size_t>(8 * i)];
      for (int k = 0; k <= 2 * reach; ++k)
        values[k] = over_rate[i] * first[0][k];
      values[reach] += over_w[i];
    }
  }
  return solve_ring_step(
      {n_, reach, 1 + p_, stride_ / kLanes, band_.data(), upper_.data(), rows_.data(), memories_});
}

bool MemoryRing::solve_with_exchanges(const ModelArrays& at) {
  if (!exchanging_) exchanging_.emplace(n_, memories_, stencil_.reach);
  exchanging_->clear();
  for (int i = 0; i < n_; ++i) {
    for (int d = 1; d < s_; ++d) {
      for (int e = 1; e < s_; ++e) {
        const auto de = static_cast<std::size_t>(d * s_ + e);
        double values[kMostAcross];
        for (std::size_t k = 0; k < kMostAcross; ++k)
          values[k] = at.g_v[de][i] * steps_per_second_ * stencil_.first[k];
        values[stencil_.reach] += at.g_u[de][i];
        exchanging_->add(i, d - 1, e - 1, values);
      }
    }
  }
  if (!exchanging_->factorise()) return false;
  exchanging_->solve(rows_.data(), stride_, 1 + p_);
  return true;
}

bool MemoryRing::solve(const ModelArrays& at) {
  fill_rows(at);
  if (!band_.empty()) {
    if (solve_ring(at)) return true;
    fill_rows(at);
  }
  return solve_with_exchanges(at);
}

void MemoryRing::add_to_slope(int memory, const double* over_w, const double* over_rate,
                              Eigen::MatrixXd& slope) const {
  const int reach = stencil_.reach;
  for (int i = 0; i < n_; ++i) {
    const double rate = over_rate[i] * steps_per_second_;
    const double* at[kMostAcross];
    for (int k = -reach; k <= reach; ++k)
      at[reach + k] = row((i + k + n_) % n_, memory);
    for (int p = 1; p <= p_; ++p) {
      double sum = 0.0;
      for (int k = 0; k <= 2 * reach; ++k)
        sum += stencil_.first[static_cast<std::size_t>(k)] * at[k][p];
      slope(i, p - 1) += over_w[i] * at[reach][p] + rate * sum;
    }
  }
}

}  // namespace shaker::estimator::diagnosis
