// The periodic solution of a model at one excitation, discretised over the cyclic time: state,
// residual, Newton step and sensitivities dz/dtheta from one factorisation. Equations
// (5.13)-(5.19), (5.23), (5.24).
//
// Mutable workspace of one thread beside an immutable Model. Nothing allocates after construction,
// but for one coordinate's first step that needs row exchanges, or its first factorise().
//
// The grid has n equal steps; z_i is the state at tau = i / n. Where the model's damping has a kink
// at v = 0 (|v| v), u'''' jumps there, and the third derivative of the sensitivities; the
// differences are corrected for these jumps when `correct_kink` is set (kinks.hpp), which brings a
// fixed grid back from third order, second for sensitivities, to about its declared one.
#pragma once

#include <array>
#include <complex>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "estimator/instrument/observation.hpp"
#include "estimator/math/aligned.hpp"
#include "estimator/math/cyclic_banded_lu.hpp"
#include "estimator/model.hpp"
#include "estimator/periodic/kinks.hpp"
#include "estimator/periodic/scheme.hpp"

namespace shaker::estimator {

struct GridOptions {
  Scheme scheme = Scheme::order4;
  int points = 256;
  bool correct_kink = true;
};

enum class SolveStatus { converged, no_equilibrium, no_convergence, inadmissible, singular };

struct SolveReport {
  SolveStatus status = SolveStatus::converged;
  int iterations = 0;
  double residual = 0.0;  // largest |g|, m/s^2
  // Newton's step that no damping made use of, against the state; 0 where a search ended otherwise.
  double step_left = 0.0;
  double amplitude_reached = 1.0;  // share of the excitation at which a continuation stopped
  bool turned_back = false;        // there: the solutions meet unstable ones and go no further
  std::string sentence() const;    // for the operator
};

class PeriodicSystem {
 public:
  // `model` must outlive the system. Throws std::invalid_argument for too few points.
  PeriodicSystem(const Model& model, GridOptions options);
  ~PeriodicSystem();
  PeriodicSystem(PeriodicSystem&&) noexcept;
  PeriodicSystem& operator=(PeriodicSystem&&) = delete;

  const Model& model() const { return *model_; }
  int points() const { return n_; }
  const GridOptions& options() const { return options_; }
  double frequency() const { return frequency_; }

  // amplitude * cos(2 pi tau).
  void set_excitation(double frequency_hz, double amplitude);
  // Fourier series through `samples` on equal steps, cut after `harmonics`, put on the grid. The
  // mean is left out: a table that moves periodically has none, so it is the accelerometer's
  // offset.
  void set_excitation(double frequency_hz, std::span<const double> samples, int harmonics);

  // As it stands on the grid, one value a point: for excitations that are made elsewhere.
  void set_excitation_points(double frequency_hz, std::span<const double> points);
  std::span<const double> excitation() const { return {x_.data(), static_cast<std::size_t>(n_)}; }

  // --- state z: index i * coordinates + c
  std::span<double> state() { return z_; }
  // Forgets what earlier solutions left behind: call it when the state is given anew.
  void begin();
  std::span<const double> state() const { return z_; }
  double value(int point, int coordinate) const { return z_[point * s_ + coordinate]; }
  // A start from another grid's solution of the same model.
  void interpolate_from(const PeriodicSystem& coarser);
  // One point of a solution that was found elsewhere (one coordinate): state, velocity,
  // acceleration, and the row (Newton step, sensitivities) with its columns `stride` apart.
  void put(int point, double z, double v, double a, const double* row, int stride);

  // --- one linearisation. `linearise` evaluates residual and slopes at the state; false when some
  // point is inadmissible. `solve_step` then solves for the rows; false when singular.
  bool linearise(std::span<const double> theta);
  double residual() const { return residual_; }
  bool solve_step();
  // Row of unknown (point, coordinate): [0] Newton step of z, [1 + k] dz/dtheta_k.
  std::span<const double> row(int point, int coordinate) const {
    return {&rows_[static_cast<std::size_t>(point * s_ + coordinate) * stride_],
            static_cast<std::size_t>(1 + p_)};
  }
  // --- what is measured: channels, in the order given; to begin with one, the displacement seen
  // through the model's instruments. Allocates.
  void set_channels(std::span<const Quantity> quantities);
  // The channel's prediction at the state of the last solve_step (followed by `advance`), and its
  // row: [0] by the Newton step of z, [1 + k] its derivative over theta_k, instrument's parameters
  // included. The same as value() and row() where nothing stands between.
  double observed(int point, int channel = 0) const;
  std::span<const double> observed_row(int point, int channel = 0) const;
  // Adds weight * sum e e^T over data on every `every`-th point (GramSum); false when this system
  // has no such fast form (several coordinates, instruments, Fourier, very many parameters).
  bool add_products(std::span<const double> data, int every, bool with_newton, double weight,
                    double* products) const;
  // z += newton * (Newton step) + sensitivities * delta_theta. Returns the largest Newton step of
  // the observed coordinate against its largest value before.
  double advance(double newton, std::span<const double> delta_theta);
  // The step that makes the state of the last linearisation follow a change of theta and end on the
  // solution: advance(1, delta).

  // The last linearisation itself, for whoever solves another system with it (stability,
  // continuation): the residual and its partial derivatives at a point.
  double g(int point, int equation) const { return g_[equation][point]; }
  double g_u(int point, int equation, int c) const { return g_u_[equation * s_ + c][point]; }
  double g_v(int point, int equation, int c) const { return g_v_[equation * s_ + c][point]; }
  double g_a(int point, int equation, int c) const { return g_a_[equation * s_ + c][point]; }
  double g_theta(int point, int equation, int k) const {
    return g_theta_[equation * p_ + k][point];
  }
  // Factorises dg/dz; false when singular. Then solves for `width` right-hand sides in place, row
  // point * coordinates + equation, rows right after each other.
  bool factorise();
  // Precondition: the last call on this object that solved anything was factorise().
  void solve_factorised(std::span<double> rows, int width);
  // The same with (dg/dz) transposed, of which a row is an equation: weights of a few things that
  // are seen of the state become their slopes over the residual at every point.
  void solve_transposed(std::span<double> rows, int width);

  // Response of the last linearised state to the excitation's harmonics 1 to `harmonics`, per unit
  // of their cosine and sine parts: `out` gets 2 * harmonics columns for each unknown, row by row
  // (cos 1, sin 1, cos 2, ...). Factorises anew, for the few times when it is wanted; false when
  // singular. Allocates.
  bool excitation_response(int harmonics, std::vector<double>& out);

  // Gives back the memory of all but state, excitation and channels, of a solution that is only
  // kept: what was linearised or observed is gone, and must not be asked for (state, excitation and
  // anew() may). The next linearisation takes it again (and so allocates), and knows nothing of
  // sensitivities.
  void rest();
  // Another system of the same model, grid, excitation and state, whether or not this one rests.
  PeriodicSystem anew() const;

  // --- whole solutions
  static constexpr double kTolerance = 1e-11;  // of the residual, m/s^2
  // From static equilibrium through amplitude continuation: needs no start. Where the solutions
  // bend, it creeps: `most` ends it, in Newton steps.
  static constexpr int kMostFromRest = 1 << 20;
  SolveReport solve_from_rest(std::span<const double> theta, double tolerance = kTolerance,
                              int most = kMostFromRest);
  // Newton from the present state. On success the last rows hold the sensitivities.
  SolveReport solve(std::span<const double> theta, int max_iterations = 30,
                    double tolerance = kTolerance);

  // Velocity and acceleration of the state as last linearised, m/s and m/s^2.
  double velocity(int point, int coordinate) const { return v_[coordinate][point]; }
  double acceleration(int point, int coordinate) const { return a_[coordinate][point]; }

 private:
  class Observer;
  void take_memory();
  ModelPoints model_points() const;
  const Stencil& stencil_of(int coordinate) const {
    return model_->order(coordinate) == 2 ? stencil_ : upwind_;
  }
  void set_share(double share);  // of the excitation
  void interpolate_quintic(const PeriodicSystem& coarser);
  void interpolate_cubic(const PeriodicSystem& coarser);
  void analyse_excitation();
  bool solve_rows(bool with_sensitivities);  // or with Newton's step alone, where that is cheaper
  bool observe();
  void differentiate();
  void differentiate_fourier();
  bool solve_scalar();
  bool solve_banded(int columns);
  bool factorise_banded();
  void fill_dense();
  bool solve_dense();
  void fill_right_hand_sides();
  void fill_rows();
  double advance_rows(double newton, std::span<const double> delta_theta);
  void learn_jumps();
  bool equilibrium(std::span<const double> theta);
  bool evaluate_at_rest(std::span<const double> theta);
  void step_at_rest(std::span<double> step) const;
  double damped_step(std::span<const double> theta);

  const Model* model_;
  GridOptions options_;
  Stencil stencil_, upwind_;
  int n_, s_, p_, padded_, groups_, stride_;
  double frequency_ = 1.0;
  double residual_ = 0.0;
  double excitation_scale_ = 1.0;

  AlignedVector z_, saved_, x_full_, x_, rows_, band_, upper_;
  AlignedVector quadrature_full_, quadrature_, carrier_cos_,
      carrier_sin_;  // if the model wants them
  double carrier_full_ = 0.0, carrier_ = 0.0;
  std::array<double, 2 * kCarriedHarmonics> harmonics_full_{}, harmonics_{};
  AlignedVector store_;  // all arrays of points
  std::vector<double*> u_, v_, a_, g_, g_u_, g_v_, g_a_, g_theta_, scratch_;
  std::vector<const double*> left_;        // one coordinate: g, then its derivatives over theta
  std::unique_ptr<KinkCorrection> kinks_;  // null when there is none to correct
  AlignedVector kappa_theta_;              // dkappa/dtheta_k in the lane of theta_k
  std::vector<double> theta_;              // of the last linearisation
  bool rows_hold_sensitivities_ = false;   // of this state, nearly
  std::unique_ptr<CyclicBandedLu> banded_;
  struct Dense;
  std::unique_ptr<Dense> dense_;
  std::vector<Quantity> channels_;
  std::unique_ptr<Observer> observer_;  // null at rest
};

}  // namespace shaker::estimator
