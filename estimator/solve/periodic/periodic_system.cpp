#include "estimator/solve/periodic/periodic_system.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <fmt/format.h>

#include "estimator/math/fourier.hpp"
#include "estimator/math/harmonic_basis.hpp"
#include "estimator/math/lanes.hpp"
#include "estimator/math/numbers.hpp"
#include "estimator/model/model_arrays.hpp"
#include "estimator/solve/periodic/internal/dense.hpp"
#include "estimator/solve/periodic/internal/observer.hpp"
#include "estimator/solve/periodic/ring_step.hpp"

namespace shaker::estimator {
namespace {

SHAKER_SIMD_CLONES double largest(int n, const double* g) {
  Lanes worst{};
  int i = 0;
  for (; i + kLanes <= n; i += kLanes)
    keep_largest(worst, as_lanes(g)[i / kLanes]);
  for (; i < n; ++i)
    worst[0] = std::max(worst[0], std::fabs(g[i]));
  for (int l = 1; l < kLanes; ++l)
    worst[0] = std::max(worst[0], worst[l]);
  return worst[0];
}

}  // namespace

std::string SolveReport::sentence() const {
  switch (status) {
    case SolveStatus::converged:
      return "converged";
    case SolveStatus::no_equilibrium:
      return "the model has no static equilibrium at these parameters";
    case SolveStatus::inadmissible:
      return "the state is inadmissible: the stroke reaches the wall of the gas spring "
             "(1 - theta3 u <= 0)";
    case SolveStatus::singular:
      return "the linearised equations are singular";
    case SolveStatus::no_convergence:
      break;
  }
  // Newton's method alone, without continuation.
  if (amplitude_reached >= 1.0) return "no periodic solution was found at this excitation";
  return fmt::format(
      "no periodic solution was found at this excitation; the continuation in amplitude got to "
      "{:.3g} % of it{}",
      100.0 * amplitude_reached, turned_back ? ", where the solutions turn back (a fold)" : "");
}

PeriodicSystem::PeriodicSystem(const Model& model, GridOptions options)
    : model_(&model),
      options_(options),
      stencil_(stencil(options.scheme)),
      upwind_(upwind_stencil(options.scheme)),
      n_(options.points),
      s_(model.coordinates()),
      p_(model.parameter_count()) {
  const int least = options.scheme == Scheme::fourier ? 3 : 3 * stencil_.reach + 2;
  if (n_ < least)
    throw std::invalid_argument(
        fmt::format("a grid of {} points is too coarse for scheme {}: it "
                    "needs at least {}",
                    n_, shaker::estimator::name(options.scheme), least));
  padded_ = (n_ + 7) / 8 * 8;
  groups_ = lane_groups(1 + p_, stencil_.reach, s_);
  ring_ = options.scheme != Scheme::fourier && ring_step_exists(s_, stencil_.reach, groups_);
  stride_ = groups_ * kLanes;
  z_.resize(static_cast<std::size_t>(n_) * s_);
  x_.resize(padded_);
  x_full_.resize(padded_);
  if (options.scheme == Scheme::fourier) dense_ = std::make_unique<Dense>(n_, n_ * s_, 1 + p_);
  if (model.needs_carrier()) {
    for (AlignedVector* v : {&quadrature_full_, &quadrature_, &carrier_cos_, &carrier_sin_})
      v->resize(padded_);
  }
  theta_.resize(static_cast<std::size_t>(p_));
  channels_ = {Quantity::displacement};
  take_memory();
}

PeriodicSystem::~PeriodicSystem() = default;
PeriodicSystem::PeriodicSystem(PeriodicSystem&&) noexcept = default;

// Allocates all that rest() releases.
void PeriodicSystem::take_memory() {
  saved_.resize(z_.size());
  rows_.resize(static_cast<std::size_t>(n_) * s_ * stride_);
  const int halo = 16;  // room for a stencil's neighbours around each array of u
  store_.resize(point_arrays(*model_) * static_cast<std::size_t>(padded_ + 2 * halo));
  for (std::vector<double*>* list : {&u_, &v_, &a_, &g_, &g_u_, &g_v_, &g_a_, &g_theta_, &scratch_})
    list->clear();
  cut_point_arrays(*model_, store_.data() + halo, padded_ + 2 * halo,
                   {u_, v_, a_, g_, g_u_, g_v_, g_a_, g_theta_, scratch_});
  left_.clear();
  for (int d = 0; d < s_; ++d) {
    left_.push_back(g_[d]);
    left_.insert(left_.end(), g_theta_.begin() + d * p_, g_theta_.begin() + (d + 1) * p_);
  }
  if (!dense_) {
    if (options_.correct_reversals && model_->has_velocity_kink()) {
      reversals_ = std::make_unique<ReversalCorrection>(stencil_, n_, p_, stride_);
      kappa_theta_.resize(stride_);
    }
    if (ring_) {
      const auto places = static_cast<std::size_t>(n_ * s_ * packed(s_));
      band_.resize(places * 8);
      upper_.resize(places * 4);
    }
  }
  observer_ = std::make_unique<Observer>(*this, channels_);
}

void PeriodicSystem::rest() {
  for (AlignedVector* v : {&saved_, &rows_, &store_, &band_, &upper_})
    AlignedVector().swap(*v);
  banded_.reset();
  reversals_.reset();
  observer_.reset();
  rows_hold_sensitivities_ = false;
}

PeriodicSystem PeriodicSystem::anew() const {
  PeriodicSystem another(*model_, options_);
  another.set_excitation_points(frequency_, excitation());
  std::copy(z_.begin(), z_.end(), another.z_.begin());
  return another;
}

void PeriodicSystem::set_excitation(double frequency_hz, double amplitude) {
  frequency_ = frequency_hz;
  for (int i = 0; i < n_; ++i)
    x_full_[i] = amplitude * harmonic_term(1, i, n_);
  analyse_excitation();
}

void PeriodicSystem::set_excitation(double frequency_hz, std::span<const double> samples,
                                    int harmonics) {
  frequency_ = frequency_hz;
  const int count = static_cast<int>(samples.size());
  const int last = std::min(harmonics, (count - 1) / 2);
  std::fill(x_full_.begin(), x_full_.end(), 0.0);
  for (int h = 1; h <= last; ++h) {
    const std::complex<double> c = fourier_sum(samples, h, 2.0 / count);
    for (int i = 0; i < n_; ++i)
      x_full_[i] += (c * std::conj(fourier_factor(h, i, n_))).real();
  }
  analyse_excitation();
}

void PeriodicSystem::set_excitation_points(double frequency_hz, std::span<const double> points) {
  frequency_ = frequency_hz;
  std::copy_n(points.begin(), n_, x_full_.begin());
  analyse_excitation();
}

// Computes the quadrature of the excitation (each harmonic delayed by a quarter of its period), the
// carrier of the fundamental, and the first harmonics relative to the carrier's phase.
void PeriodicSystem::analyse_excitation() {
  if (!model_->needs_carrier()) {
    x_ = x_full_;
    return;
  }
  // The analytic signal, whose real part is the excitation: only positive harmonics.
  FourierTransform fourier;
  std::vector<std::complex<double>> spectrum(static_cast<std::size_t>(n_)), analytic = spectrum;
  fourier.forward(x_full_.data(), n_, spectrum.data());
  const auto harmonics = static_cast<std::size_t>((n_ - 1) / 2);
  for (std::size_t h = 0; h < spectrum.size(); ++h)
    spectrum[h] *= h > 0 && h <= harmonics ? 2.0 : 0.0;
  fourier.backward(spectrum.data(), n_, analytic.data());
  for (int i = 0; i < n_; ++i)
    quadrature_full_[i] = analytic[static_cast<std::size_t>(i)].imag();
  const auto harmonic = [&](std::size_t h) { return spectrum[h] / static_cast<double>(n_); };
  carrier_full_ = std::abs(harmonic(1));
  const std::complex<double> phase = carrier_full_ > 0.0 ? harmonic(1) / carrier_full_ : 1.0;
  std::complex<double> phase_back = 1.0;  // conj(phase)^h
  harmonics_full_.fill(0.0);
  for (std::size_t h = 1; h <= std::min<std::size_t>(kCarriedHarmonics, harmonics); ++h) {
    phase_back *= std::conj(phase);
    const std::complex<double> over_carrier = harmonic(h) * phase_back;
    harmonics_full_[2 * h - 2] = over_carrier.real();
    harmonics_full_[2 * h - 1] = -over_carrier.imag();
  }
  for (int i = 0; i < n_; ++i) {
    const std::complex<double> turned = phase * std::conj(fourier_factor(1, i, n_));
    carrier_cos_[i] = turned.real();
    carrier_sin_[i] = turned.imag();
  }
  set_share(1.0);
}

void PeriodicSystem::set_share(double share) {
  for (int i = 0; i < n_; ++i)
    x_[i] = share * x_full_[i];
  carrier_ = share * carrier_full_;
  for (std::size_t i = 0; i < quadrature_.size(); ++i)
    quadrature_[i] = share * quadrature_full_[i];
  for (std::size_t i = 0; i < harmonics_.size(); ++i)
    harmonics_[i] = share * harmonics_full_[i];
}

ModelPoints PeriodicSystem::model_points() const {
  ModelPoints points;
  points.n = n_;
  points.u = u_.data();
  points.v = v_.data();
  points.a = a_.data();
  points.x = x_.data();
  if (model_->needs_carrier()) {
    points.x_quadrature = quadrature_.data();
    points.carrier_cos = carrier_cos_.data();
    points.carrier_sin = carrier_sin_.data();
    points.carrier_amplitude = carrier_;
    points.carrier_omega = kTwoPi * frequency_;
    points.harmonics = harmonics_.data();
  }
  return points;
}

void PeriodicSystem::set_channels(std::span<const Quantity> quantities) {
  channels_.assign(quantities.begin(), quantities.end());
  observer_ = std::make_unique<Observer>(*this, quantities);
}

double PeriodicSystem::observed(int point, int channel) const {
  return observer_->direct(channel) ? value(point, model_->observed())
                                    : observer_->value(point, channel);
}

std::span<const double> PeriodicSystem::observed_row(int point, int channel) const {
  if (observer_->direct(channel)) return row(point, model_->observed());
  return {observer_->row(point, channel), static_cast<std::size_t>(1 + p_)};
}

void PeriodicSystem::begin() {
  rows_hold_sensitivities_ = false;
  if (reversals_) reversals_->forget();
}

void PeriodicSystem::put(int point, double z, double v, double a, const double* row, int stride) {
  if (store_.empty()) take_memory();
  z_[point] = z;
  v_[0][point] = v;
  a_[0][point] = a;
  for (int k = 0; k <= p_; ++k)
    rows_[static_cast<std::size_t>(point) * stride_ + k] = row[k * stride];
}

bool PeriodicSystem::linearise(std::span<const double> theta) {
  if (store_.empty()) take_memory();
  differentiate();
  std::copy(theta.begin(), theta.end(), theta_.begin());
  if (reversals_)
    reversals_->correct_state(model_->velocity_kink(theta.data()), frequency_ * n_, v_[0], a_[0]);
  const ModelForces forces{g_.data(),   g_u_.data(),     g_v_.data(),
                           g_a_.data(), g_theta_.data(), scratch_.data()};
  if (!model_->evaluate(model_points(), theta.data(), forces)) return false;
  if (reversals_) reversals_->learn_slopes(g_u_[0], g_v_[0], g_a_[0], v_[0]);
  residual_ = 0.0;
  for (int d = 0; d < s_; ++d)
    residual_ = std::max(residual_, largest(n_, g_[d]));
  return std::isfinite(residual_);
}

}  // namespace shaker::estimator
