// Has a parameter of the damper changed while it ran? A generalised likelihood-ratio test, cycle by
// cycle (Willsky and Jones 1976; Basseville and Nikiforov 1993, section 2.4.3).
//
// Each cycle k gives, linearised at one fixed theta near the truth, its score x_k = J^T e and
// information L_k = J^T J: x_k ~ N(L_k d, s^2 L_k) when theta is off by d. For every candidate
// instant k0 and parameter j the hypothesis "only theta_j jumped, at k0, by an unknown amount" is
// held against "nothing did", with the unknown d of before estimated along: with L_a, x_a summed up
// after k0 and L, x over all,
//     c = (x_a - L_a L^-1 x)_j,   v = (L_a - L_a L^-1 L_a)_jj,   G = c^2 / (s^2 v),   jump = c / v,
// twice the logarithm of the likelihood ratio, chi-squared with one degree of freedom if nothing
// happened. Its maximum over k0 and j against a threshold is the test. Candidates lie 1, 2, 3, 4,
// 6, 8, 12, ... up to 64 cycles back; a slow drift is seen as the jump that fits it best.
//
// Scores scatter from cycle to cycle by more than s says when something else does (resampling,
// temperature of the sensor). The scatter is watched through successive differences, which a jump
// does not disturb, and G is divided by its excess.
//
// Whose jump it was is a second question. With all parameters free to jump the statistic is
// F = c^T v^-1 c / s^2, and F - G_j is chi-squared with one degree of freedom less than there are
// parameters if j alone jumped: j is named when that is not significant at kNamedLevel. So the
// parameter that jumped, alone, stays unnamed about that often, however alike the others look.
//
// The threshold belongs to a stated rate of false alarms, calibrated by simulation: see
// glr_threshold. Pure arithmetic; one thread; allocates while its window fills only.
#pragma once

#include <deque>
#include <optional>
#include <vector>

#include <Eigen/Core>

namespace shaker::estimator::online {

// Threshold of G for `per_cycle` false alarms a cycle (1e-2 to 1e-6), up to 8 parameters; more
// count as 8. Calibrated: bench_glr simulates the average run length between false alarms;
// docs/online.md has the table.
double glr_threshold(double per_cycle, int parameters);

struct Change {
  int parameter = 0;    // index in the score
  long cycles_ago = 0;  // it happened before the last so many cycles
  double jump = 0.0;    // of the parameter
  double standard_error = 0.0;
  double statistic = 0.0;  // G
  // Other parameters whose own jump, alone, explains what was seen as well as any jump of all of
  // them does; likeliest first. Where the one above does not (`alone` is false), also those whose
  // own jump would have been an alarm too.
  std::vector<Change> alternatives = {};
  // This parameter's jump is enough. If no parameter's is, several changed, or the response has not
  // settled since (it is judged again with the cycles to come), or the model lacks what changed.
  bool alone = true;
};

class ChangeDetector {
 public:
  // `threshold` of G.
  ChangeDetector(int parameters, double threshold);

  // Score J^T e and information J^T J of the next cycle, and the variance s^2 as it is now known. A
  // change, once found, is reported once: the detector then begins anew with the cycles since the
  // change as its reference.
  std::optional<Change> add(const Eigen::VectorXd& score, const Eigen::MatrixXd& information,
                            double variance = 1.0);
  void reset();
  long cycles() const { return cycles_; }

  static constexpr long kReference = 12;  // cycles before a change that a test needs at least
  static constexpr double kNamedLevel = 0.01;

 private:
  struct Cycle {
    Eigen::VectorXd score;
    Eigen::MatrixXd information;
  };
  struct Evidence {  // at one instant
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
  Eigen::VectorXd score_;     // summed up over all cycles
  Eigen::MatrixXd information_;
  // Squares of successive differences of the standardised scores, and how many.
  Eigen::VectorXd last_, differences_;
  double pairs_ = 0.0;
};

}  // namespace shaker::estimator::online
