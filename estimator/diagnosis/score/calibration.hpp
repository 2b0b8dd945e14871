// How large the statistics of a design become when nothing is missing.
//
// A design is what was measured and how well: the whitened Jacobian of the model's parameters, the
// degrees of freedom behind each standard error, and the signatures of everything that may be
// missing. Noise is drawn as the data have it (normal, over standard errors that are themselves
// estimated), projected as the fit projects it, and scored as the data are scored; so the rate of
// false alarms over the whole catalogue is the one that was asked for, whatever the catalogue.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include <Eigen/Dense>

namespace shaker::estimator::diagnosis {

// A signature's part that the parameters cannot imitate, of unit length: 0 vector when there is
// none. `sign`: of the coefficient that is admissible, 0 for both.
struct Signature {
  Eigen::VectorXd direction;
  double visible = 0.0;  // length of that part before it was made unit, per unit of coefficient
  double hidden = 0.0;   // share of the whole signature that the parameters imitate, 0..1
  int sign = 0;
};

struct Design {
  Eigen::MatrixXd jacobian;           // whitened, a row a datum
  Eigen::VectorXd freedom;            // behind each datum's standard error
  std::vector<Signature> signatures;  // all shapes of all candidates
};

class Calibration {
 public:
  Calibration(const Design& design, int draws, std::uint64_t seed);
  // As it was drawn before; each ascending.
  Calibration(std::vector<double> lengths, std::vector<double> gains, std::vector<double> smaller)
      : lengths_(std::move(lengths)), gains_(std::move(gains)), smaller_(std::move(smaller)) {}

  // Probability of a residual's length, and of the best signature's gain, at least as large by
  // chance; beyond the draws by the tail of a fitted gamma distribution.
  double of_length(double chi_squared) const;
  double of_best_gain(double gain) const;
  // Of the smaller of the two.
  double combined(double chi_squared, double gain) const;

  const std::vector<double>& lengths() const { return lengths_; }
  const std::vector<double>& gains() const { return gains_; }
  const std::vector<double>& smaller() const { return smaller_; }

 private:
  std::vector<double> lengths_, gains_, smaller_;  // ascending
};

// Removes from whitened residuals or signatures what the columns of `jacobian` can imitate.
class Projector {
 public:
  explicit Projector(const Eigen::MatrixXd& jacobian);
  Eigen::MatrixXd operator()(const Eigen::MatrixXd& columns) const;

 private:
  Eigen::MatrixXd basis_;
};

// Gain in chi-squared of a projected residual along a signature; 0 for an inadmissible sign.
double gain_of(const Signature& signature, const Eigen::VectorXd& residual);

}  // namespace shaker::estimator::diagnosis
