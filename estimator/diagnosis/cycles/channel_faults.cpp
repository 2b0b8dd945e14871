#include "estimator/diagnosis/cycles/internal/channel_faults.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "estimator/math/numbers.hpp"

namespace shaker::estimator::diagnosis {
namespace {

constexpr Eigen::Index kFewestCycles = 5;
constexpr double kLeastSlip = 0.01;         // turns in all
constexpr double kMinSlipDeviations = 8.0;  // standard errors

constexpr std::size_t kFewestForSpikes = 32;
constexpr std::size_t kMostSpikes = 3;
constexpr std::size_t kTouched = 2;   // samples on each side that a spike puts off too
constexpr double kFarOffTimes = 6.0;  // times the next
constexpr double kOwnShare = 1.25;    // of its neighbours: 1.5 of a spike, 1 of a jump

struct PhaseLine {
  double slope = 0.0, standard_error = 0.0;
};

PhaseLine line_through(const Eigen::VectorXd& y) {
  const auto n = static_cast<double>(y.size());
  const Eigen::VectorXd x = Eigen::VectorXd::LinSpaced(y.size(), -0.5 * (n - 1.0), 0.5 * (n - 1.0));
  PhaseLine line;
  line.slope = x.dot(y) / x.squaredNorm();
  const double left = (y.array() - y.mean() - line.slope * x.array()).matrix().squaredNorm();
  line.standard_error = std::sqrt(left / std::max(n - 2.0, 1.0) / x.squaredNorm());
  return line;
}

}  // namespace

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
  const PhaseLine whole = line_through(phase);
  const double early = line_through(phase.head(kept / 2 + 1)).slope;
  const double late = line_through(phase.tail(kept / 2 + 1)).slope;
  const double slip = std::fabs(whole.slope);
  const bool even = std::fabs(early - late) < 0.3 * slip;
  const bool same_size = std::fabs(line_through(size).slope) < 0.2 * slip;
  const bool sure = slip > kMinSlipDeviations * whole.standard_error;
  return even && same_size && sure && slip * static_cast<double>(kept) > kLeastSlip ? whole.slope
                                                                                    : 0.0;
}

std::vector<std::size_t> lone_spikes(std::span<const double> y) {
  if (y.size() < kFewestForSpikes) return {};
  std::vector<double> off(y.size(), 0.0);
  for (std::size_t i = 2; i + 2 < y.size(); ++i)
    off[i] = std::fabs(y[i] - (4.0 * (y[i - 1] + y[i + 1]) - (y[i - 2] + y[i + 2])) / 6.0);
  std::vector<std::size_t> farthest;  // one more than may be spikes
  for (std::size_t k = 0; k <= kMostSpikes; ++k) {
    std::size_t at = 0;
    for (std::size_t i = 0; i < y.size(); ++i) {
      const bool own = std::any_of(farthest.begin(), farthest.end(), [&](std::size_t f) {
        return (f > i ? f - i : i - f) <= kTouched;
      });
      if (!own && off[i] > off[at]) at = i;
    }
    farthest.push_back(at);
  }
  for (std::size_t k = kMostSpikes; k > 0; --k) {
    if (!(off[farthest[k - 1]] > kFarOffTimes * off[farthest[k]])) continue;
    farthest.resize(k);
    std::erase_if(farthest, [&](std::size_t i) {
      const double others = std::max(off[i - 1], off[i + 1]);
      return off[i] < kOwnShare * others || off[i] < std::fabs(y[i + 1] - y[i - 1]);
    });
    return farthest;
  }
  return {};
}

}  // namespace shaker::estimator::diagnosis
