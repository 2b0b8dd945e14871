/// \file
/// How large the statistics of a design become when nothing is missing.
///
/// A design is what was measured and how well: the whitened Jacobian of the model's parameters, the
/// degrees of freedom behind each standard error, and the signatures of everything that may be
/// missing. Noise is drawn as the data have it (normal, over standard errors that are themselves
/// estimated), projected as the fit projects it, and scored as the data are scored; so the rate of
/// false alarms over the whole catalogue is the one that was asked for, whatever the catalogue.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include <Eigen/Dense>

namespace shaker::estimator::diagnosis {

/// A signature's part that the parameters cannot imitate.
struct Signature {
  Eigen::VectorXd direction;  ///< of unit length, a value a datum; 0 vector when there is none
  double visible = 0.0;  ///< length of that part before it was made unit, per unit of coefficient
  double hidden = 0.0;   ///< share of the whole signature that the parameters imitate, 0..1
  int sign = 0;          ///< of the coefficient that is admissible; 0: both
};

/// What was measured and how well.
struct Design {
  Eigen::MatrixXd jacobian;           ///< whitened, a row a datum
  Eigen::VectorXd freedom;            ///< behind each datum's standard error
  std::vector<Signature> signatures;  ///< all shapes of all candidates
};

/// The distribution of a design's statistics where nothing is missing. Immutable; all threads may
/// use one object.
class Calibration {
 public:
  /// Draws noise and scores it. Blocks; one core; allocates.
  /// \param design what was measured
  /// \param draws number of draws
  /// \param seed of the random numbers
  Calibration(const Design& design, int draws, std::uint64_t seed);
  /// As it was drawn before; each ascending.
  /// \param lengths squared lengths of the residual, one a draw
  /// \param gains of the best signature, one a draw
  /// \param smaller the smaller probability of the two, one a draw
  Calibration(std::vector<double> lengths, std::vector<double> gains, std::vector<double> smaller)
      : lengths_(std::move(lengths)), gains_(std::move(gains)), smaller_(std::move(smaller)) {}

  /// Probabilities beyond the draws come from the tail of a fitted gamma distribution.
  /// \param chi_squared squared length of the residual
  /// \return the probability of a residual at least as long by chance
  double of_length(double chi_squared) const;
  /// \param gain of the best signature, in chi-squared
  /// \return the probability of a gain at least as large by chance
  double of_best_gain(double gain) const;
  /// \param chi_squared squared length of the residual
  /// \param gain of the best signature, in chi-squared
  /// \return the probability that the smaller of these two is at least as small by chance
  double combined(double chi_squared, double gain) const;

  /// \return the squared lengths, ascending
  const std::vector<double>& lengths() const { return lengths_; }
  /// \return the gains, ascending
  const std::vector<double>& gains() const { return gains_; }
  /// \return the smaller probabilities, ascending
  const std::vector<double>& smaller() const { return smaller_; }

 private:
  std::vector<double> lengths_, gains_, smaller_;  // ascending
};

/// Removes from whitened residuals or signatures what the columns of `jacobian` can imitate.
class Projector {
 public:
  /// \param jacobian a row a datum, a column a parameter
  explicit Projector(const Eigen::MatrixXd& jacobian);
  /// \param columns a row a datum
  /// \return the columns without what the parameters can imitate
  Eigen::MatrixXd operator()(const Eigen::MatrixXd& columns) const;

 private:
  Eigen::MatrixXd basis_;
};

/// Gain in chi-squared of a projected residual along a signature; 0 for an inadmissible sign.
/// \param signature of unit length
/// \param residual projected, a value a datum
/// \return the gain
double gain_of(const Signature& signature, const Eigen::VectorXd& residual);

}  // namespace shaker::estimator::diagnosis
