/// \file
/// The periodic solution of a model at one excitation, discretised over the cyclic time. One
/// factorisation gives the Newton step and the sensitivities dz/dtheta. Equations (5.13)-(5.19),
/// (5.23), (5.24).
///
/// A PeriodicSystem is a mutable workspace for one thread; the Model is immutable and may be
/// shared. After construction linearise(), solve_step(), advance() and solve() do not allocate with
/// a difference scheme. Two events are exceptions: the first step that needs row exchanges, and the
/// first factorise().
///
/// "m" in the units of this folder stands for the model's length unit.
///
/// The grid has n equal steps; z_i is the state at tau = i / n. Damping such as |v| v has a kink at
/// v = 0: u'''' jumps there, and so does the third derivative of the sensitivities. With
/// `correct_reversals` the differences are corrected for these jumps (velocity_reversals.hpp). The
/// correction restores about the declared order; without it the state is of third order, the
/// sensitivities of second.
#pragma once

#include <array>
#include <complex>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "estimator/math/aligned.hpp"
#include "estimator/math/cyclic_banded_lu.hpp"
#include "estimator/model/instrument/observation.hpp"
#include "estimator/model/model.hpp"
#include "estimator/solve/periodic/scheme.hpp"
#include "estimator/solve/periodic/velocity_reversals.hpp"

namespace shaker::estimator {

/// The grid of a periodic solution.
struct GridOptions {
  Scheme scheme = Scheme::order4;  ///< of the derivatives over time
  int points = 256;                ///< steps in a period
  bool correct_reversals = true;   ///< correct the differences where the velocity changes sign
};

/// How a search for a periodic solution ended.
enum class SolveStatus { converged, no_equilibrium, no_convergence, inadmissible, singular };

/// What a search for a periodic solution reports.
struct SolveReport {
  SolveStatus status = SolveStatus::converged;  ///< how it ended
  int iterations = 0;                           ///< Newton steps
  double residual = 0.0;                        ///< largest |g|, m/s^2
  /// The last Newton step, relative to the state, if damping could not use it; 0 otherwise.
  double step_left = 0.0;
  double amplitude_reached = 1.0;  ///< share of the excitation at which a continuation stopped
  bool turned_back = false;        ///< the continuation in amplitude passed a fold
  /// \return a sentence for the operator
  std::string sentence() const;
};

/// The periodic solution of one model at one excitation, as a workspace. n: points; s: coordinates;
/// p: parameters. Unknown i * s + c is coordinate c at point i. One thread at a time may use it.
class PeriodicSystem {
 public:
  /// `model` must outlive the system. Throws std::invalid_argument for too few points.
  /// \param model the equations
  /// \param options the grid
  PeriodicSystem(const Model& model, GridOptions options);
  /// Releases the workspace.
  ~PeriodicSystem();
  /// Takes the workspace over; the other may only be destroyed.
  PeriodicSystem(PeriodicSystem&&) noexcept;
  PeriodicSystem& operator=(PeriodicSystem&&) = delete;

  /// \return the model
  const Model& model() const { return *model_; }
  /// \return the number n of points
  int points() const { return n_; }
  /// \return the grid
  const GridOptions& options() const { return options_; }
  /// \return the frequency of the excitation, Hz
  double frequency() const { return frequency_; }

  /// Sets the excitation to amplitude * cos(2 pi tau); `amplitude` in m/s^2.
  /// \param frequency_hz above 0
  /// \param amplitude of the cosine, m/s^2
  void set_excitation(double frequency_hz, double amplitude);
  /// Sets the excitation to the Fourier series of `samples` (one period on equal steps, m/s^2),
  /// truncated after `harmonics`. The mean is dropped: the acceleration of a periodic table motion
  /// has none, so a mean is the offset of the accelerometer.
  /// \param frequency_hz above 0
  /// \param samples one period, m/s^2
  /// \param harmonics number of harmonics to keep
  void set_excitation(double frequency_hz, std::span<const double> samples, int harmonics);

  /// Sets the excitation from its n values on the grid.
  /// \param frequency_hz above 0
  /// \param points n values, m/s^2
  void set_excitation_points(double frequency_hz, std::span<const double> points);
  /// \return the excitation at the n points, m/s^2
  std::span<const double> excitation() const { return {x_.data(), static_cast<std::size_t>(n_)}; }

  // --- state z: index i * coordinates + c
  /// \return n * s values, in the model's length unit; the caller may write them
  std::span<double> state() { return z_; }
  /// Discards what earlier solutions left in the workspace. Call it after the state was replaced.
  void begin();
  /// \return n * s values, in the model's length unit
  std::span<const double> state() const { return z_; }
  /// \param point index from 0
  /// \param coordinate index from 0
  /// \return the state there, in the model's length unit
  double value(int point, int coordinate) const { return z_[point * s_ + coordinate]; }
  /// Interpolates the state from a solution of the same model on another grid.
  /// \param coarser the solution on another grid
  void interpolate_from(const PeriodicSystem& coarser);
  /// Moves the other coordinates to the solution of their own equations along the present motion of
  /// the observed one: the start of a solution from a measured motion. They begin at rest.
  /// \param theta p parameters, in the model's units
  /// \return false if there is no such solution
  bool follow_observed(std::span<const double> theta);
  /// Stores one point of a solution that was computed elsewhere (models with one coordinate only):
  /// state, velocity, acceleration, and the row (Newton step, sensitivities). The columns of the
  /// row are `stride` values apart.
  /// \param point index from 0
  /// \param z state
  /// \param v velocity, unit of z per s
  /// \param a acceleration, unit of z per s^2
  /// \param row 1 + p columns
  /// \param stride distance of the columns
  void put(int point, double z, double v, double a, const double* row, int stride);

  // --- one linearisation
  /// Evaluates residual and partial derivatives at the state.
  /// \param theta p parameters, in the model's units
  /// \return false if a point is inadmissible
  bool linearise(std::span<const double> theta);
  /// \return the largest residual of the last linearisation, m/s^2
  double residual() const { return residual_; }
  /// Solves for the rows, the Newton step and the sensitivities, after linearise().
  /// \return false if the system is singular or a channel cannot be predicted
  bool solve_step();
  /// The row of unknown (point, coordinate): [0] Newton step of z, [1 + k] dz/dtheta_k.
  /// \param point index from 0
  /// \param coordinate index from 0
  /// \return 1 + p values; valid until the next call that changes the system
  std::span<const double> row(int point, int coordinate) const {
    return {&rows_[static_cast<std::size_t>(point * s_ + coordinate) * stride_],
            static_cast<std::size_t>(1 + p_)};
  }
  // --- measured channels
  /// Sets the measured quantities in this order. The default is one channel: the displacement as
  /// the model's instruments show it. Allocates.
  /// \param quantities one for each channel
  void set_channels(std::span<const Quantity> quantities);
  /// The channel's prediction at the state of the last solve_step (advance() updates it). Without
  /// an instrument the displacement gives value().
  /// \param point index from 0
  /// \param channel index from 0
  /// \return the prediction, in the unit of the quantity
  double observed(int point, int channel = 0) const;
  /// The channel's row: [0] the change by the Newton step of z, [1 + k] the derivative over
  /// theta_k, including the parameters of the instruments. Without an instrument the displacement
  /// gives row().
  /// \param point index from 0
  /// \param channel index from 0
  /// \return 1 + p values; valid until the next call that changes the system
  std::span<const double> observed_row(int point, int channel = 0) const;
  /// Adds weight * sum e e^T to `products`, for data at every `every`-th point, where
  /// e = (residual, dz/dtheta_1, ...).
  /// \param data measured values, in the model's length unit
  /// \param every distance of the data in points
  /// \param with_newton true: the residual includes the Newton step of z
  /// \param weight factor of the products
  /// \param products (1 + p) x (1 + p), row by row
  /// \return false, and nothing is added, if this fast form does not exist: a first channel other
  ///   than the plain state, or too many parameters
  bool add_products(std::span<const double> data, int every, bool with_newton, double weight,
                    double* products) const;
  /// z += newton * (Newton step) + sensitivities * delta_theta. advance(1, delta) is the step to
  /// the solution at theta + delta, to first order.
  /// \param newton share of the Newton step to take
  /// \param delta_theta p changes, in the model's units
  /// \return the largest Newton step of the observed coordinate, relative to its largest value
  ///   before
  double advance(double newton, std::span<const double> delta_theta);

  /// The residual and its partial derivatives at a point, as last linearised. Stability and
  /// continuation solve other systems with them.
  /// \param point index from 0
  /// \param equation index from 0
  /// \return the residual, m/s^2
  double g(int point, int equation) const { return g_[equation][point]; }
  /// Derivative over a coordinate.
  /// \param point index from 0
  /// \param equation index from 0
  /// \param c index of the coordinate
  /// \return the derivative of the residual, m/s^2 per unit of what it is taken over
  double g_u(int point, int equation, int c) const { return g_u_[equation * s_ + c][point]; }
  /// Derivative over a velocity.
  /// \param point index from 0
  /// \param equation index from 0
  /// \param c index of the coordinate
  /// \return the derivative
  double g_v(int point, int equation, int c) const { return g_v_[equation * s_ + c][point]; }
  /// Derivative over an acceleration.
  /// \param point index from 0
  /// \param equation index from 0
  /// \param c index of the coordinate
  /// \return the derivative
  double g_a(int point, int equation, int c) const { return g_a_[equation * s_ + c][point]; }
  /// Derivative over a parameter.
  /// \param point index from 0
  /// \param equation index from 0
  /// \param k index of the parameter
  /// \return the derivative
  double g_theta(int point, int equation, int k) const {
    return g_theta_[equation * p_ + k][point];
  }
  /// Factorises dg/dz as last linearised.
  /// \return false if it is singular; not tested with Fourier collocation
  bool factorise();
  /// Solves with the factors for `width` right-hand sides in place. `rows` holds one row for each
  /// equation (row point * coordinates + equation), without gaps.
  /// Precondition: the last call on this object that solved anything was factorise().
  /// \param rows n * s rows of `width` values, right-hand sides on entry, solutions on return
  /// \param width number of right-hand sides
  void solve_factorised(std::span<double> rows, int width);
  /// Solves with (dg/dz) transposed (adjoint). On entry a column holds the derivatives of one
  /// quantity over the unknowns; on return, its derivatives over the equations' right-hand sides.
  /// Same precondition.
  /// \param rows n * s rows of `width` values
  /// \param width number of columns
  void solve_transposed(std::span<double> rows, int width);

  /// The response of the last linearised state to the excitation's harmonics 1 to `harmonics`, per
  /// unit of their cosine and sine parts. `out` gets a row of 2 * harmonics columns (cos 1, sin 1,
  /// cos 2, ...) for each unknown. Factorises anew. Allocates.
  /// \param harmonics number of harmonics
  /// \param out receives n * s rows of 2 * `harmonics` columns
  /// \return false if the matrix is singular
  bool excitation_response(int harmonics, std::vector<double>& out);

  /// Releases all memory except state, excitation and channels, for a solution that is only stored.
  /// Afterwards only state, excitation and anew() may be used. The next linearisation allocates the
  /// memory again and starts without sensitivities.
  void rest();
  /// \return a new system with the same model, grid, excitation and state; allowed after rest()
  PeriodicSystem anew() const;

  // --- whole solutions
  static constexpr double kTolerance = 1e-11;    ///< of the residual, m/s^2
  static constexpr int kMostFromRest = 1 << 20;  ///< Newton steps of solve_from_rest()
  /// Solves from the static equilibrium by continuation in the excitation's amplitude; it needs no
  /// start. Near a fold the steps get very small; `most` limits the Newton steps. Allocates.
  /// \param theta p parameters, in the model's units
  /// \param tolerance of the residual, m/s^2
  /// \param most limit of Newton steps
  /// \return how it ended
  SolveReport solve_from_rest(std::span<const double> theta, double tolerance = kTolerance,
                              int most = kMostFromRest);
  /// Damped Newton from the present state. On success the rows hold the sensitivities.
  /// \param theta p parameters, in the model's units
  /// \param max_iterations limit of Newton steps
  /// \param tolerance of the residual, m/s^2
  /// \return how it ended
  SolveReport solve(std::span<const double> theta, int max_iterations = 30,
                    double tolerance = kTolerance);

  /// \param point index from 0
  /// \param coordinate index from 0
  /// \return the velocity of the state as last linearised, m/s
  double velocity(int point, int coordinate) const { return v_[coordinate][point]; }
  /// \param point index from 0
  /// \param coordinate index from 0
  /// \return the acceleration of the state as last linearised, m/s^2
  double acceleration(int point, int coordinate) const { return a_[coordinate][point]; }

 private:
  class Observer;
  void take_memory();
  ModelPoints model_points() const;
  const Stencil& stencil_of(int coordinate) const {
    return model_->order(coordinate) == 2 ? stencil_ : upwind_;
  }
  void set_share(double share);  // scales the excitation
  void interpolate_quintic(const PeriodicSystem& coarser);
  void interpolate_cubic(const PeriodicSystem& coarser);
  void analyse_excitation();
  bool solve_rows(bool with_sensitivities);  // false: only the Newton step, where that is cheaper
  bool observe();
  void differentiate();
  void differentiate_fourier();
  bool solve_ring();
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
  bool ring_ = false;  // solve_ring_step has a solver of this shape
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
  std::vector<const double*> left_;  // of each equation: g, then its derivatives over theta
  std::unique_ptr<ReversalCorrection> reversals_;  // null: no kinks to correct
  AlignedVector kappa_theta_;                      // dkappa/dtheta_k in the lane of theta_k
  std::vector<double> theta_;                      // of the last linearisation
  bool rows_hold_sensitivities_ = false;           // of the last solved linearisation
  std::unique_ptr<CyclicBandedLu> banded_;
  struct Dense;
  std::unique_ptr<Dense> dense_;
  std::vector<Quantity> channels_;
  std::unique_ptr<Observer> observer_;  // null after rest()
};

}  // namespace shaker::estimator
