// Detects a change of the damper's parameters during a run: a generalised likelihood-ratio (GLR)
// test in every cycle (Willsky and Jones 1976; Basseville and Nikiforov 1993, section 2.4.3).
//
// Each cycle k, linearised at one fixed theta near the truth, gives its score x_k = J^T e and
// its information L_k = J^T J. If theta is off by d, then x_k ~ N(L_k d, s^2 L_k). For every
// candidate instant k0 and parameter j, the test compares the hypothesis "only theta_j jumped,
// at k0, by an unknown amount" with "nothing jumped". It estimates the unknown d before the
// jump as well. With L_a, x_a summed after k0 and L, x summed over all cycles,
//     c = (x_a - L_a L^-1 x)_j,   v = (L_a - L_a L^-1 L_a)_jj,   G = c^2 / (s^2 v),   jump = c / v.
// G is twice the logarithm of the likelihood ratio. It is chi-squared with one degree of
// freedom if nothing jumped. The test compares its maximum over k0 and j with a threshold.
// Candidates are 1, 2, 3, 4, 6, 8, 12, ... up to 64 cycles back. A slow drift is detected as
// the jump that fits it best.
//
// Other influences (resampling, temperature of the sensor) may make the scores scatter more
// than s says. The test estimates the scatter from successive differences, on which a jump has
// almost no influence, and divides G by its excess.
//
// A second test decides which parameter jumped. If all parameters may jump, the statistic is
// F = c^T v^-1 c / s^2. If only j jumped, F - G_j is chi-squared with one degree of freedom less
// than there are parameters. Parameter j alone explains the change if F - G_j is not
// significant at kNamedLevel. A parameter that jumped alone is thus missed with about that
// probability, however similar the effects of the others are.
//
// The threshold follows from a required false-alarm rate by simulation: see glr_threshold. One
// thread at a time may use a detector. `add` allocates small matrices and does no I/O.
#pragma once

#include <deque>
#include <optional>
#include <vector>

#include <Eigen/Core>

namespace shaker::estimator::online {

// Threshold of G for a false-alarm rate of `per_cycle` a cycle (1e-9 to 1e-2, clamped) and 1 to
// 8 parameters; more count as 8. bench_glr simulates the mean run length between false alarms,
// from which it was fitted; docs/online.md has the table.
double glr_threshold(double per_cycle, int parameters);

struct Change {
  int parameter = 0;    // index in the score
  long cycles_ago = 0;  // number of cycles since the change
  double jump = 0.0;    // of the parameter
  double standard_error = 0.0;
  double statistic = 0.0;  // G
  // Other parameters whose jump alone explains the data as well as a jump of all parameters
  // does, likeliest first. If `alone` is false above, also those whose own jump exceeds the
  // threshold.
  std::vector<Change> alternatives = {};
  // True if this parameter's jump is a sufficient explanation. If no parameter's is, then
  // several changed, or the response has not settled since (later cycles are tested again), or
  // the model lacks what changed.
  bool alone = true;
};

class ChangeDetector {
 public:
  // `parameters`: length of the score. `threshold`: of G.
  ChangeDetector(int parameters, double threshold);

  // Adds the next cycle: score J^T e (p), information J^T J (p x p), and the present noise
  // variance s^2. Returns each change only once. The detector then starts again with the cycles
  // since the change as its reference.
  std::optional<Change> add(const Eigen::VectorXd& score, const Eigen::MatrixXd& information,
                            double variance = 1.0);
  void reset();
  long cycles() const { return cycles_; }

  static constexpr long kReference = 12;  // least number of cycles before a change
  static constexpr double kNamedLevel = 0.01;

 private:
  struct Cycle {
    Eigen::VectorXd score;
    Eigen::MatrixXd information;
  };
  struct Evidence {  // for one instant
    double statistic = 0.0;
    int back = 0;
    Eigen::VectorXd c;
    Eigen::MatrixXd v;
  };
  std::optional<Change> test(double variance) const;
  Change named(std::vector<Change> best, const Evidence& at, double variance) const;
  double excess(int parameter, double variance) const;
  void watch_scatter(const Cycle& cycle);

  int parameters_;
  double threshold_;
  long cycles_ = 0;
  std::deque<Cycle> window_;  // newest last
  Eigen::VectorXd score_;     // sum over all cycles
  Eigen::MatrixXd information_;
  // Squared successive differences of the standardised scores (sum), and their number.
  Eigen::VectorXd last_, differences_;
  double pairs_ = 0.0;
};

}  // namespace shaker::estimator::online
