#include "estimator/online/internal/change_detector.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include "estimator/math/dense.hpp"
#include "estimator/math/statistics.hpp"

namespace shaker::estimator::online {
namespace {

constexpr std::array kBack = {1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64};
constexpr double kFelt = 1e-10;  // least eigenvalue that counts, relative to a unit diagonal
// Number of cycles that the stated scatter counts for, beside the observed scatter.
constexpr double kPriorCycles = 30.0;

// threshold = a + b ln(cycles between false alarms), for 1 to 8 parameters. Fitted to simulated
// run lengths of 300 to 30 000 cycles (bench_glr).
struct Line {
  double a, b;
};
constexpr std::array<Line, 8> kLines = {{{-1.236, 2.085},
                                         {0.074, 2.106},
                                         {0.345, 2.170},
                                         {0.714, 2.208},
                                         {0.742, 2.271},
                                         {1.150, 2.256},
                                         {1.046, 2.296},
                                         {1.880, 2.213}}};

}  // namespace

double glr_threshold(double per_cycle, int parameters) {
  const Line& line = kLines[static_cast<std::size_t>(std::clamp(parameters, 1, 8) - 1)];
  return line.a + line.b * std::log(1.0 / std::clamp(per_cycle, 1e-9, 1e-2));
}

ChangeDetector::ChangeDetector(int parameters, double threshold)
    : parameters_(parameters), threshold_(threshold) {
  reset();
}

void ChangeDetector::reset() {
  cycles_ = 0;
  window_.clear();
  score_.setZero(parameters_);
  information_.setZero(parameters_, parameters_);
  last_.setZero(parameters_);
  differences_.setZero(parameters_);
  pairs_ = 0.0;
}

void ChangeDetector::watch_scatter(const Cycle& cycle) {
  Eigen::VectorXd standard(parameters_);
  for (int k = 0; k < parameters_; ++k)
    standard[k] = cycle.score[k] / std::sqrt(std::max(cycle.information(k, k), 1e-300));
  if (cycles_ > 0) {
    differences_ += (standard - last_).cwiseAbs2();
    pairs_ += 1.0;
  }
  last_ = standard;
}

// At least 1: a scatter below the stated one counts as chance.
double ChangeDetector::excess(int parameter, double variance) const {
  return std::max(
      1.0, (kPriorCycles + 0.5 * differences_[parameter] / variance) / (kPriorCycles + pairs_));
}

std::optional<Change> ChangeDetector::add(const Eigen::VectorXd& score,
                                          const Eigen::MatrixXd& information, double variance) {
  Cycle cycle{score, information};
  watch_scatter(cycle);
  score_ += score;
  information_ += information;
  window_.push_back(std::move(cycle));
  if (window_.size() > static_cast<std::size_t>(kBack.back())) window_.pop_front();
  ++cycles_;
  auto change = test(variance);
  if (change) {
    // The cycles since the change become the new reference. The observed scatter stays.
    const auto keep = static_cast<std::size_t>(change->cycles_ago);
    while (window_.size() > keep)
      window_.pop_front();
    score_.setZero();
    information_.setZero();
    for (const Cycle& kept : window_) {
      score_ += kept.score;
      information_ += kept.information;
    }
    cycles_ = change->cycles_ago;
  }
  return change;
}

std::optional<Change> ChangeDetector::test(double variance) const {
  const Ldlt all(information_);
  const Eigen::VectorXd offset = all.solve(score_);
  if (!offset.allFinite()) return std::nullopt;
  Eigen::VectorXd score = Eigen::VectorXd::Zero(parameters_);
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(parameters_, parameters_);
  std::vector<Change> best(static_cast<std::size_t>(parameters_));  // for each parameter
  Evidence evidence;                                                // at the largest statistic
  int summed = 0;
  for (const int back : kBack) {
    if (cycles_ - back < kReference || back > static_cast<int>(window_.size())) break;
    for (; summed < back; ++summed) {
      const Cycle& cycle = window_[window_.size() - 1 - static_cast<std::size_t>(summed)];
      score += cycle.score;
      information += cycle.information;
    }
    const Eigen::VectorXd c = score - information * offset;
    const Eigen::MatrixXd v = information - information * all.solve(information);
    for (int k = 0; k < parameters_; ++k) {
      if (!(v(k, k) > 1e-9 * information(k, k))) continue;
      const double excess_here = excess(k, variance);
      const double statistic = c[k] * c[k] / v(k, k) / (variance * excess_here);
      Change& own = best[static_cast<std::size_t>(k)];
      if (statistic <= own.statistic) continue;
      own = Change{k, back, c[k] / v(k, k), std::sqrt(variance * excess_here / v(k, k)), statistic};
      if (statistic > evidence.statistic) evidence = {statistic, back, c, v};
    }
  }
  std::ranges::sort(best, std::greater(), &Change::statistic);
  if (best.empty() || best.front().statistic <= threshold_) return std::nullopt;
  return named(std::move(best), evidence, variance);
}

// `best`: the likeliest change of each parameter, sorted, likeliest first.
Change ChangeDetector::named(std::vector<Change> best, const Evidence& at, double variance) const {
  double unit = 0.0;
  for (int k = 0; k < parameters_; ++k)
    unit += variance * excess(k, variance) / parameters_;
  // Scaled to a unit diagonal, so that the parameters' sizes do not matter.
  const Eigen::VectorXd scale = at.v.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  const Eigen::VectorXd c = at.c.cwiseProduct(scale);
  const Spectrum axes = spectrum_of(scale.asDiagonal() * at.v * scale.asDiagonal());
  double joint = 0.0;
  int felt = 0;
  for (int k = 0; k < parameters_; ++k) {
    const double along = axes.vectors.col(k).dot(c);
    if (!(axes.values[k] > kFelt)) continue;
    joint += along * along / axes.values[k] / unit;
    ++felt;
  }
  const auto explains = [&](const Change& change) {
    const double left = joint - c[change.parameter] * c[change.parameter] / unit;
    return felt < 2 || chi_squared_above(std::max(0.0, left), felt - 1.0) > kNamedLevel;
  };
  Change found = best.front();
  found.alone = explains(found);
  for (auto other = best.begin() + 1; other != best.end(); ++other) {
    other->alone = explains(*other);
    if (other->alone || (!found.alone && other->statistic > threshold_))
      found.alternatives.push_back(*other);
  }
  return found;
}

}  // namespace shaker::estimator::online
