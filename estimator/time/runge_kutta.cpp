// Classical Runge-Kutta of order four for a batch of arcs: each component has one array with a lane
// for each arc.
//
// Where a velocity changes its sign within a step, the second derivative of |v| v jumps, and the
// step loses its order. Such a lane repeats the step in pieces, cut at the zero of the cubic
// through both ends. This needs the rate at the end of a step, which is also the first of the next
// step.
#include <algorithm>
#include <cmath>

#include "estimator/time/integration_impl.hpp"

namespace shaker::estimator {
namespace {

constexpr std::size_t kAlign = 8;
constexpr double kNoCut = 1e-6;  // a zero this close to an end of the step needs no cut
constexpr int kMostCuts = 4;     // in one step and lane; several velocities may reverse in it

// State and sensitivities of some lanes, with all arrays of a step.
struct Block {
  int n = 0;
  std::size_t stride = 0;
  AlignedVector numbers;
  std::vector<double*> y, base, rate, next, sum, h_s, h_theta;
  double *h = nullptr, *x_begin = nullptr, *x_middle = nullptr, *x_end = nullptr;
  StateEquations::Workspace work;

  void shape(int lanes, std::size_t components, std::size_t m, std::size_t p) {
    n = lanes;
    stride = (static_cast<std::size_t>(lanes) + kAlign - 1) / kAlign * kAlign;
    numbers.assign(stride * (5 * components + m * m + m * p + 4), 0.0);
    double* at = numbers.data();
    const auto take = [&](std::vector<double*>& arrays, std::size_t count) {
      arrays.resize(count);
      for (double*& array : arrays) {
        array = at;
        at += stride;
      }
    };
    take(y, components);
    take(base, components);
    take(rate, components);
    take(next, components);
    take(sum, components);
    take(h_s, m * m);
    take(h_theta, m * p);
    for (double** array : {&h, &x_begin, &x_middle, &x_end}) {
      *array = at;
      at += stride;
    }
  }
};

// Returns the zero in (0, 1) of the cubic with values v0, v1 (of different sign) and slopes d0, d1
// at its ends. Newton's method, safeguarded by bisection.
double zero_of_cubic(double v0, double v1, double d0, double d1) {
  double low = 0.0, high = 1.0, s = v0 / (v0 - v1);
  for (int i = 0; i < 40; ++i) {
    const double s2 = s * s, s3 = s2 * s;
    const double value = (2 * s3 - 3 * s2 + 1) * v0 + (s3 - 2 * s2 + s) * d0 +
                         (3 * s2 - 2 * s3) * v1 + (s3 - s2) * d1;
    const double slope =
        (6 * s2 - 6 * s) * (v0 - v1) + (3 * s2 - 4 * s + 1) * d0 + (3 * s2 - 2 * s) * d1;
    if ((value > 0.0) == (v0 > 0.0))
      low = s;
    else
      high = s;
    double better = s - value / slope;
    if (!(better > low && better < high)) better = 0.5 * (low + high);
    if (std::fabs(better - s) < 1e-14) return better;
    s = better;
  }
  return s;
}

class RungeKutta final : public TimeIntegration {
 public:
  RungeKutta(const StateEquations& equations, const TimeOptions& options, std::vector<int> free)
      : equations_(equations),
        options_(options),
        free_(std::move(free)),
        m_(static_cast<std::size_t>(equations.states())),
        p_(static_cast<std::size_t>(equations.parameters())),
        k_(m_ + free_.size()) {}

  IntegrationReport run(std::span<Arc> arcs, std::span<const double> theta,
                        bool sensitivities) override {
    const std::size_t components = sensitivities ? m_ * (1 + k_) : m_;
    if (block_.n != static_cast<int>(arcs.size()) || block_.y.size() != components) {
      block_.shape(static_cast<int>(arcs.size()), components, m_, p_);
      single_.shape(1, components, m_, p_);
    }
    theta_ = theta.data();
    sensitivities_ = sensitivities;
    stopped_ = false;
    plan(arcs);
    begin(arcs);
    if (!rates(block_, block_.y, block_.x_begin, block_.rate)) return where(arcs, block_.y, 0, 0.0);
    std::size_t node = 0;
    for (std::size_t i = 0; i < substeps_.size(); ++i) {
      for (int part = 0; part < substeps_[i]; ++part, node += 2) {
        const double share = 1.0 / substeps_[i];
        load(arcs, i, node, share);
        if (!step(block_) || !cut(arcs, i, part, share))
          return where(arcs, block_.base, i, part * share);
        std::swap(block_.rate, block_.next);
      }
      write(arcs, i + 1);
    }
    IntegrationReport good;
    good.ok = true;
    return good;
  }

 private:
  // Sets the number of steps between samples, and the excitation at their ends and middles.
  void plan(std::span<Arc> arcs) {
    std::size_t intervals = 0;
    for (const Arc& arc : arcs)
      intervals = std::max(intervals, arc.times.size() - 1);
    substeps_.assign(intervals, 1);
    if (options_.step > 0.0) {
      for (const Arc& arc : arcs) {
        for (std::size_t i = 0; i + 1 < arc.times.size(); ++i) {
          const double parts = (arc.times[i + 1] - arc.times[i]) / options_.step;
          substeps_[i] = std::max(substeps_[i], static_cast<int>(std::ceil(parts - 1e-9)));
        }
      }
    }
    for (Arc& arc : arcs) {
      std::size_t count = 1;
      for (std::size_t i = 0; i + 1 < arc.times.size(); ++i)
        count += 2 * static_cast<std::size_t>(substeps_[i]);
      if (arc.nodes.size() == count) continue;
      arc.nodes.clear();
      arc.nodes.push_back(arc.excitation->value(arc.times[0]));
      for (std::size_t i = 0; i + 1 < arc.times.size(); ++i) {
        const double dt = arc.times[i + 1] - arc.times[i];
        for (int half = 1; half <= 2 * substeps_[i]; ++half)
          arc.nodes.push_back(arc.excitation->value(arc.times[i] + dt * half / (2 * substeps_[i])));
      }
    }
  }

  void begin(std::span<Arc> arcs) {
    const bool all = sensitivities_;
    for (std::size_t lane = 0; lane < arcs.size(); ++lane) {
      for (std::size_t j = 0; j < m_; ++j)
        block_.y[j][lane] = arcs[lane].start[j];
      for (std::size_t c = m_; all && c < block_.y.size(); ++c) {
        const std::size_t row = (c - m_) / k_, column = (c - m_) % k_;
        block_.y[c][lane] = row == column ? 1.0 : 0.0;
      }
      block_.x_begin[lane] = arcs[lane].nodes[0];
      arcs[lane].states.resize(arcs[lane].times.size() * m_);
      if (all) arcs[lane].sensitivities.resize(arcs[lane].times.size() * m_ * k_);
    }
    write(arcs, 0);
  }

  // Loads step length and excitation. A lane whose record has ended gets a step of 0.
  void load(std::span<Arc> arcs, std::size_t interval, std::size_t node, double share) {
    for (std::size_t lane = 0; lane < arcs.size(); ++lane) {
      const Arc& arc = arcs[lane];
      const bool on = interval + 1 < arc.times.size();
      block_.h[lane] = on ? (arc.times[interval + 1] - arc.times[interval]) * share : 0.0;
      const std::size_t last = arc.nodes.size() - 1;
      block_.x_begin[lane] = arc.nodes[std::min(node, last)];
      block_.x_middle[lane] = arc.nodes[std::min(node + 1, last)];
      block_.x_end[lane] = arc.nodes[std::min(node + 2, last)];
    }
  }

  bool rates(Block& b, const std::vector<double*>& y, const double* x,
             const std::vector<double*>& rate) {
    stopped_ =
        stopped_ || (options_.afford && !options_.afford(static_cast<double>(b.stride * y.size())));
    if (stopped_) return false;
    if (!sensitivities_)
      return equations_.rates(b.n, y.data(), x, theta_, b.work, rate.data(), nullptr, nullptr);
    if (!equations_.rates(b.n, y.data(), x, theta_, b.work, rate.data(), b.h_s.data(),
                          b.h_theta.data()))
      return false;
    // (5.10): S' = h_s S + h_theta, the latter in the parameters' columns only.
    for (std::size_t i = 0; i < m_; ++i) {
      for (std::size_t k = 0; k < k_; ++k) {
        double* __restrict to = rate[m_ + i * k_ + k];
        if (k >= m_) {
          std::copy_n(b.h_theta[i * p_ + static_cast<std::size_t>(free_[k - m_])], b.stride, to);
        } else {
          std::fill_n(to, b.stride, 0.0);
        }
        for (std::size_t j = 0; j < m_; ++j) {
          const double* __restrict slope = b.h_s[i * m_ + j];
          const double* __restrict from = y[m_ + j * k_ + k];
          for (std::size_t lane = 0; lane < b.stride; ++lane)
            to[lane] += slope[lane] * from[lane];
        }
      }
    }
    return true;
  }

  // Makes one step from b.y with the rate b.rate. Afterwards b.y is the new state, b.base the old
  // one, and b.next the rate at the new state.
  bool step(Block& b) {
    std::swap(b.y, b.base);
    const auto towards = [&](const std::vector<double*>& rate, double share) {
      for (std::size_t c = 0; c < b.y.size(); ++c) {
        double* __restrict y = b.y[c];
        const double* __restrict from = b.base[c];
        const double* __restrict slope = rate[c];
        for (std::size_t lane = 0; lane < b.stride; ++lane)
          y[lane] = from[lane] + share * b.h[lane] * slope[lane];
      }
    };
    const auto add = [&](double weight) {
      for (std::size_t c = 0; c < b.y.size(); ++c) {
        double* __restrict sum = b.sum[c];
        const double* __restrict slope = b.next[c];
        for (std::size_t lane = 0; lane < b.stride; ++lane)
          sum[lane] += weight * slope[lane];
      }
    };
    for (std::size_t c = 0; c < b.y.size(); ++c)
      std::copy_n(b.rate[c], b.stride, b.sum[c]);
    towards(b.rate, 0.5);
    if (!rates(b, b.y, b.x_middle, b.next)) return false;
    add(2.0);
    towards(b.next, 0.5);
    if (!rates(b, b.y, b.x_middle, b.next)) return false;
    add(2.0);
    towards(b.next, 1.0);
    if (!rates(b, b.y, b.x_end, b.next)) return false;
    add(1.0);
    towards(b.sum, 1.0 / 6.0);
    return rates(b, b.y, b.x_end, b.next);
  }

  // Repeats the step in pieces for every lane in which a velocity changed its sign.
  bool cut(std::span<Arc> arcs, std::size_t interval, int part, double share) {
    if (options_.cut == CutAtReversals::never) return true;
    for (std::size_t lane = 0; lane < arcs.size(); ++lane) {
      if (!reverses(lane)) continue;
      const Arc& arc = arcs[lane];
      const double begin =
          arc.times[interval] + (arc.times[interval + 1] - arc.times[interval]) * part * share;
      if (!in_pieces(arc, lane, begin)) return false;
    }
    return true;
  }

  bool reverses(std::size_t lane) const {
    for (int e = 0; e < equations_.coordinates(); ++e) {
      const int v = equations_.velocity_of(e);
      if (v >= 0 && block_.base[static_cast<std::size_t>(v)][lane] *
                            block_.y[static_cast<std::size_t>(v)][lane] <
                        0.0)
        return true;
    }
    return false;
  }

  bool in_pieces(const Arc& arc, std::size_t lane, double begin) {
    Block& s = single_;
    for (std::size_t c = 0; c < s.y.size(); ++c) {
      s.y[c][0] = block_.base[c][lane];
      s.rate[c][0] = block_.rate[c][lane];
    }
    const double end = begin + block_.h[lane];
    double t = begin;
    for (int piece = 0;; ++piece) {
      s.h[0] = end - t;
      if (!take(arc, t)) return false;
      const double share = piece < kMostCuts ? first_zero(s) : 1.0;
      if (share == 1.0) break;
      std::swap(s.y, s.base);
      s.h[0] *= share;
      if (!take(arc, t)) return false;
      t += s.h[0];
      std::swap(s.rate, s.next);
    }
    for (std::size_t c = 0; c < s.y.size(); ++c) {
      block_.y[c][lane] = s.y[c][0];
      block_.next[c][lane] = s.next[c][0];
    }
    return true;
  }

  // Returns the share of the single lane's step at the first velocity reversal; 1 if there is none.
  double first_zero(const Block& s) const {
    double share = 1.0;
    for (int e = 0; e < equations_.coordinates(); ++e) {
      if (equations_.velocity_of(e) < 0) continue;
      const auto v = static_cast<std::size_t>(equations_.velocity_of(e));
      if (!(s.base[v][0] * s.y[v][0] < 0.0)) continue;
      const double zero =
          zero_of_cubic(s.base[v][0], s.y[v][0], s.h[0] * s.rate[v][0], s.h[0] * s.next[v][0]);
      if (zero > kNoCut && zero < 1.0 - kNoCut) share = std::min(share, zero);
    }
    return share;
  }

  bool take(const Arc& arc, double t) {
    Block& s = single_;
    s.x_middle[0] = arc.excitation->value(t + 0.5 * s.h[0]);
    s.x_end[0] = arc.excitation->value(t + s.h[0]);
    return step(s);
  }

  void write(std::span<Arc> arcs, std::size_t node) const {
    for (std::size_t lane = 0; lane < arcs.size(); ++lane) {
      Arc& arc = arcs[lane];
      if (node >= arc.times.size()) continue;
      for (std::size_t j = 0; j < m_; ++j)
        arc.states[node * m_ + j] = block_.y[j][lane];
      if (!sensitivities_) continue;
      double* to = &arc.sensitivities[node * m_ * k_];
      for (std::size_t c = 0; c < m_ * k_; ++c)
        to[c] = block_.y[m_ + c][lane];
    }
  }

  // Finds the lane that failed: repeats the step of each lane alone.
  IntegrationReport where(std::span<Arc> arcs, const std::vector<double*>& y, std::size_t interval,
                          double share) {
    IntegrationReport report;
    report.inadmissible = !stopped_;
    report.stopped = stopped_;
    bool found = false;
    for (std::size_t lane = 0; lane < arcs.size() && !found; ++lane) {
      const Arc& arc = arcs[lane];
      const bool on = interval + 1 < arc.times.size();
      if (!on) continue;
      report.arc = lane;
      const double dt = arc.times[interval + 1] - arc.times[interval];
      report.reached = arc.times[interval] + dt * share;
      for (std::size_t c = 0; c < y.size(); ++c)
        single_.y[c][0] = y[c][lane];
      single_.h[0] = dt / substeps_[interval];
      single_.x_begin[0] = arc.excitation->value(report.reached);
      found = stopped_ || !rates(single_, single_.y, single_.x_begin, single_.rate) ||
              !take(arc, report.reached);
    }
    return report;
  }

  const StateEquations& equations_;
  TimeOptions options_;
  std::vector<int> free_;
  std::size_t m_, p_, k_;
  const double* theta_ = nullptr;
  bool sensitivities_ = false;
  bool stopped_ = false;  // not afforded any longer
  std::vector<int> substeps_;
  Block block_, single_;
};

}  // namespace

std::unique_ptr<TimeIntegration> make_runge_kutta(const StateEquations& equations,
                                                  const TimeOptions& options,
                                                  std::vector<int> free) {
  return std::make_unique<RungeKutta>(equations, options, std::move(free));
}

}  // namespace shaker::estimator
