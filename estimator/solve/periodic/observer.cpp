#include "estimator/solve/periodic/internal/observer.hpp"

#include <algorithm>
#include <numbers>

#include "estimator/model/instrument/instrument.hpp"
#include "estimator/solve/periodic/internal/dense.hpp"

namespace shaker::estimator {
PeriodicSystem::Observer::Observer(const PeriodicSystem& system,
                                   std::span<const Quantity> quantities)
    : n_(system.n_),
      s_(system.s_),
      p_(system.p_),
      stride_(system.stride_),
      padded_(system.padded_) {
  const Model& model = *system.model_;
  for (const Quantity quantity : quantities) {
    Series series;
    series.quantity = quantity;
    series.direct = quantity == Quantity::displacement && model.instruments().empty();
    if (!series.direct) resize(series);
    channels_.push_back(std::move(series));
  }
  if (idle()) return;
  for (const Model::Term& stage : model.instruments())
    sees_load_ = sees_load_ || stage.effect->instrument()->sees_load();
  resize(load_);
  resize(before_);
  const int further = 2 + kMostParameters;  // arrays of a stage: y_y, y_load, y_theta
  const int arrays = 3 * s_ + p_ + std::max(observation_arrays(model), further);
  store_.resize(static_cast<std::size_t>(arrays) * system.padded_);
  double* next = store_.data();
  const auto cut = [&](std::vector<double*>& list, int count) {
    for (int i = 0; i < count; ++i, next += system.padded_)
      list.push_back(next);
  };
  cut(y_u_, s_);
  cut(y_v_, s_);
  cut(y_a_, s_);
  cut(y_theta_, p_);
  cut(workspace_, std::max(observation_arrays(model), further));
  time_.resize(static_cast<std::size_t>(system.padded_));
  factors_.resize(static_cast<std::size_t>(1 + kMostParameters) * (n_ / 2 + 1));
  curve_.resize(n_);
  spectrum_.resize(n_ / 2 + 1);
  changed_.resize(n_ / 2 + 1);
}

void PeriodicSystem::Observer::resize(Series& series) const {
  series.y.resize(static_cast<std::size_t>(padded_));
  series.rows.resize(static_cast<std::size_t>(n_) * stride_);
}

bool PeriodicSystem::Observer::idle() const {
  return std::all_of(channels_.begin(), channels_.end(), [](const Series& s) { return s.direct; });
}

bool PeriodicSystem::Observer::observe(const PeriodicSystem& system,
                                       std::span<const double> theta) {
  if (idle()) return true;
  system_ = &system;
  if (sees_load_ && !take(Quantity::damper_force, theta, load_)) return false;
  for (int i = 0; i < n_; ++i)
    time_[i] = (static_cast<double>(i) / n_ - 0.5) / system_->frequency_;
  for (Series& series : channels_) {
    if (series.direct) continue;
    if (!take(series.quantity, theta, series)) return false;
    if (series.quantity != Quantity::displacement) continue;
    for (const Model::Term& stage : system_->model_->instruments()) {
      if (stage.effect->instrument()->filters())
        filter(stage, theta, series);
      else
        pointwise(stage, theta, series);
    }
  }
  return true;
}

// Computes the quantity and its rows: dy = sum over coordinates of
// (y_u + y_v d/dt + y_a d2/dt2) dz, plus the direct derivatives over the parameters.
bool PeriodicSystem::Observer::take(Quantity quantity, std::span<const double> theta, Series& out) {
  const ObservedMotion motion{out.y.data(), y_u_.data(), y_v_.data(), y_a_.data(), y_theta_.data()};
  if (!observe_motion(*system_->model_, quantity, system_->model_points(), theta.data(), motion,
                      workspace_.data()))
    return false;
  for (int i = 0; i < n_; ++i) {
    double* row = &out.rows[static_cast<std::size_t>(i) * stride_];
    std::fill_n(row, stride_, 0.0);
    for (int k = 0; k < p_; ++k)
      row[1 + k] = y_theta_[k][i];
  }
  for (int c = 0; c < s_; ++c) {
    add_rows(c, 0, y_u_[c], out);
    add_rows(c, 1, y_v_[c], out);
    add_rows(c, 2, y_a_[c], out);
  }
  return true;
}

void PeriodicSystem::Observer::add_rows(int c, int derivative, const double* slope,
                                        Series& out) const {
  const int width = 1 + p_;
  const auto add = [&](int i, int j, double weight) {
    const double* from = &system_->rows_[static_cast<std::size_t>(j * s_ + c) * stride_];
    double* row = &out.rows[static_cast<std::size_t>(i) * stride_];
    for (int m = 0; m < width; ++m)
      row[m] += weight * from[m];
  };
  const double f = system_->frequency_;
  const Stencil& stencil = system_->stencil_of(c);
  for (int i = 0; i < n_; ++i) {
    if (slope[i] == 0.0) continue;
    if (derivative == 0) {
      add(i, i, slope[i]);
    } else if (system_->dense_) {
      const auto& matrix = derivative == 1 ? system_->dense_->first : system_->dense_->second;
      for (int j = 0; j < n_; ++j)
        add(i, j,
            slope[i] * (derivative == 1 ? f : f * f) *
                matrix[static_cast<std::size_t>(j) * n_ + i]);
    } else {
      const auto& weights = derivative == 1 ? stencil.first : stencil.second;
      const double scale = slope[i] * (derivative == 1 ? f * n_ : f * f * n_ * n_);
      for (int k = -stencil.reach; k <= stencil.reach; ++k)
        add(i, (i + k + n_) % n_, scale * weights[static_cast<std::size_t>(k + stencil.reach)]);
    }
  }
}

void PeriodicSystem::Observer::pointwise(const Model::Term& stage, std::span<const double> theta,
                                         Series& series) {
  const Instrument& instrument = *stage.effect->instrument();
  double local[kMostParameters];
  stage.gather(theta.data(), local);
  const int own = static_cast<int>(stage.effect->parameters().size());
  double* const* y_theta = workspace_.data() + 2;
  Signal signal{n_, series.y.data(), nullptr, nullptr};
  if (instrument.sees_load()) signal.load = load_.y.data();
  if (instrument.sees_time()) signal.t = time_.data();
  const Seen seen{before_.y.data(), workspace_[0], workspace_[1], y_theta};
  instrument.observe(signal, local, stage.constants.data(), seen);
  std::copy_n(before_.y.data(), n_, series.y.data());
  for (int i = 0; i < n_; ++i) {
    double* row = &series.rows[static_cast<std::size_t>(i) * stride_];
    const double* load = &load_.rows[static_cast<std::size_t>(i) * stride_];
    for (int m = 0; m < 1 + p_; ++m) {
      row[m] *= workspace_[0][i];
      if (signal.load != nullptr) row[m] += workspace_[1][i] * load[m];
    }
    for (int k = 0; k < own; ++k)
      row[1 + stage.parameter(k)] += stage.factor(k) * y_theta[k][i];
  }
}

void PeriodicSystem::Observer::filter(const Model::Term& stage, std::span<const double> theta,
                                      Series& series) {
  const Instrument& instrument = *stage.effect->instrument();
  double local[kMostParameters];
  stage.gather(theta.data(), local);
  const std::size_t own = stage.effect->parameters().size();
  const std::size_t harmonics = static_cast<std::size_t>(n_ / 2 + 1);
  for (std::size_t k = 0; k < harmonics; ++k) {
    std::complex<double> slopes[kMostParameters];
    const double omega = 2.0 * std::numbers::pi * system_->frequency_ * static_cast<double>(k);
    factors_[k] = instrument.transfer(omega, local, stage.constants.data(), slopes);
    for (std::size_t m = 0; m < own; ++m)
      factors_[(1 + m) * harmonics + k] = slopes[m];
  }
  const auto change_row = [&](std::size_t column, std::size_t by) {
    for (int i = 0; i < n_; ++i)
      curve_[i] = series.rows[static_cast<std::size_t>(i) * stride_ + column];
    to_harmonics();
    from_harmonics(by);
    for (int i = 0; i < n_; ++i)
      series.rows[static_cast<std::size_t>(i) * stride_ + column] = curve_[i];
  };
  for (std::size_t m = 0; m < static_cast<std::size_t>(1 + p_); ++m)
    change_row(m, 0);
  std::copy_n(series.y.data(), n_, curve_.data());
  to_harmonics();
  for (std::size_t m = 0; m <= own; ++m) {
    from_harmonics(m * harmonics);
    if (m == 0) {
      std::copy_n(curve_.data(), n_, series.y.data());
      continue;
    }
    const std::size_t column = 1 + stage.parameter(m - 1);
    for (int i = 0; i < n_; ++i)
      series.rows[static_cast<std::size_t>(i) * stride_ + column] +=
          stage.factor(m - 1) * curve_[i];
  }
}

void PeriodicSystem::Observer::to_harmonics() {
  fourier_.forward(curve_.data(), n_, spectrum_.data());
}

// Transforms back the harmonics times the factors that begin at `first`. The highest harmonic of a
// ring with an even number of points has no phase, so only the real part of its factor acts.
void PeriodicSystem::Observer::from_harmonics(std::size_t first) {
  const std::size_t harmonics = static_cast<std::size_t>(n_ / 2 + 1);
  for (std::size_t k = 0; k < harmonics; ++k)
    changed_[k] = spectrum_[k] * factors_[first + k];
  changed_[0] = changed_[0].real();
  if (n_ % 2 == 0)
    changed_[harmonics - 1] = spectrum_[harmonics - 1] * factors_[first + harmonics - 1].real();
  fourier_.backward(changed_.data(), n_, curve_.data());
}

void PeriodicSystem::Observer::advance(double newton, std::span<const double> delta_theta) {
  for (Series& series : channels_) {
    for (int i = 0; i < n_ && !series.direct; ++i) {
      const double* row = &series.rows[static_cast<std::size_t>(i) * stride_];
      double sum = newton * row[0];
      for (int k = 0; k < p_; ++k)
        sum += delta_theta[k] * row[1 + k];
      series.y[i] += sum;
    }
  }
}

}  // namespace shaker::estimator
