#include "estimator/discrepancy/cycles/channel_faults.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "estimator/math/numbers.hpp"

namespace shaker::estimator::discrepancy {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kWithin = 1.5;  // times as long as a cosine's crest
constexpr Eigen::Index kFewestCycles = 5;
constexpr double kLeastSlip = 0.01;  // turns in all
constexpr double kSure = 8.0;        // standard errors

struct Line {
  double slope = 0.0, standard_error = 0.0;
};

Line line_through(const Eigen::VectorXd& y) {
  const auto n = static_cast<double>(y.size());
  const Eigen::VectorXd x = Eigen::VectorXd::LinSpaced(y.size(), -0.5 * (n - 1.0), 0.5 * (n - 1.0));
  Line line;
  line.slope = x.dot(y) / x.squaredNorm();
  const double left = (y.array() - y.mean() - line.slope * x.array()).matrix().squaredNorm();
  line.standard_error = std::sqrt(left / std::max(n - 2.0, 1.0) / x.squaredNorm());
  return line;
}

}  // namespace

bool clipped(std::span<const double> y, double samples_a_cycle, double cycles, bool top,
             double quantum) {
  const double sign = top ? 1.0 : -1.0;
  double extreme = -std::numeric_limits<double>::infinity();
  double low = std::numeric_limits<double>::infinity();
  for (const double value : y) {
    extreme = std::max(extreme, sign * value);
    low = std::min(low, sign * value);
  }
  // It never moves.
  if (!(extreme > low)) return true;
  double next = low;
  for (const double value : y) {
    if (sign * value < extreme) next = std::max(next, sign * value);
  }
  const double flat = 2.0 * std::sqrt(2.0 * (extreme - next) / (0.5 * (extreme - low))) / kTwoPi;
  // A crest within one step of a coarse grid.
  const double within = std::acos(std::max(-1.0, 1.0 - 2.0 * quantum / (extreme - low))) / kPi;
  const double longest =
      std::max(4.0, std::max(3.0 * std::min(flat, 0.05), kWithin * within) * samples_a_cycle);
  double runs = 0.0, length = 0.0;  // at the end; a run over several cycles is that many
  for (std::size_t i = 0; i <= y.size(); ++i) {
    if (i < y.size() && sign * y[i] == extreme) {
      length += 1.0;
      continue;
    }
    if (length >= longest) runs += std::max(1.0, std::floor(length / samples_a_cycle));
    length = 0.0;
  }
  return runs >= 3.0 && runs >= 0.3 * cycles;
}

double clock_slip(const Eigen::MatrixXd& response) {
  const Eigen::Index kept = response.rows() - response.rows() / 3;  // the transient is in the first
  if (kept < kFewestCycles || response.cols() < 3) return 0.0;
  Eigen::VectorXd phase(kept), size(kept);
  for (Eigen::Index k = 0; k < kept; ++k) {
    const auto row = response.row(response.rows() - kept + k);
    phase[k] = std::atan2(row[2], row[1]) / kTwoPi;
    if (k > 0) phase[k] -= std::round(phase[k] - phase[k - 1]);
    size[k] = std::log(std::max(std::hypot(row[1], row[2]), 1e-300)) / kTwoPi;
  }
  const Line whole = line_through(phase);
  const double early = line_through(phase.head(kept / 2 + 1)).slope;
  const double late = line_through(phase.tail(kept / 2 + 1)).slope;
  const double slip = std::fabs(whole.slope);
  const bool even = std::fabs(early - late) < 0.3 * slip;
  const bool same_size = std::fabs(line_through(size).slope) < 0.2 * slip;
  const bool sure = slip > kSure * whole.standard_error;
  return even && same_size && sure && slip * static_cast<double>(kept) > kLeastSlip ? whole.slope
                                                                                    : 0.0;
}

}  // namespace shaker::estimator::discrepancy
