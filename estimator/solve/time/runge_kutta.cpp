// Classical Runge-Kutta of order four for many arcs, in batches with one arc in each SIMD lane.
//
// Where a velocity changes its sign within a step, the second derivative of |v| v jumps, and the
// step loses its order. Such lanes repeat the step in pieces, cut at the zero of the cubic
// through both ends. This needs the rate at the end of a step, which is also the first of the next
// step.
#include <algorithm>
#include <bit>
#include <cmath>
#include <stdexcept>

#include <fmt/format.h>

#include "estimator/solve/time/integrators.hpp"
#include "estimator/solve/time/internal/lane_block.hpp"
#include "estimator/solve/time/internal/lane_plan.hpp"
#include "estimator/solve/time/internal/zero_of_cubic.hpp"

namespace shaker::estimator {
namespace {

constexpr double kNoCut = 1e-6;  // a zero this close to an end of the step needs no cut
constexpr int kMostCuts = 4;     // in one step and lane; several velocities may reverse in it

class RungeKutta final : public TimeIntegration {
 public:
  RungeKutta(const StateEquations& equations, const TimeOptions& options, std::vector<int> free)
      : TimeIntegration(equations),
        options_(options),
        free_(std::move(free)),
        m_(static_cast<std::size_t>(equations.states())),
        p_(static_cast<std::size_t>(equations.parameters())),
        seen_(equations.model().observed()),
        follows_(followed_states(equations)) {
    if (m_ > kMostLaneStates)
      throw std::invalid_argument(
          fmt::format("the model has {} states; the integrators with fixed steps take at most {}",
                      m_, kMostLaneStates));
  }

  IntegrationReport run(std::span<Arc> arcs, std::span<const double> theta,
                        bool sensitivities) override {
    k_ = sensitivities ? m_ + free_.size() : 0;
    cut_ = options_.cut != CutAtReversals::never;
    stride_ = 1;
    between_ = false;
    out_ = nullptr;
    for (Arc& arc : arcs) {
      arc.states.resize(arc.times.size() * m_);
      if (sensitivities) arc.sensitivities.resize(arc.times.size() * m_ * k_);
    }
    return all(arcs, theta);
  }

  IntegrationReport sums(std::span<Arc> arcs, std::span<const double> theta,
                         const SumOptions& options, ArcSums& out) override {
    k_ = m_ + free_.size();
    cut_ = options.cut && options_.cut != CutAtReversals::never;
    stride_ = options.stride;
    between_ = options.between && follows_[static_cast<std::size_t>(seen_)] >= 0;
    out_ = &out;
    out.states = m_;
    out.columns = k_;
    out.numbers.resize(arcs.size() * out.size());
    return all(arcs, theta);
  }

  bool strides() const override { return true; }

 private:
  IntegrationReport all(std::span<Arc> arcs, std::span<const double> theta) {
    theta_ = theta.data();
    stopped_ = false;
    lay_plans(arcs, options_.step, plans_);
    IntegrationReport report;
    for (const LanePlan& plan : plans_) {
      report = through(plan, arcs);
      if (!report.ok) break;
    }
    return report;
  }

  IntegrationReport through(const LanePlan& plan, std::span<Arc> arcs) {
    if (block_.n != plan.lanes() || block_.components != m_ * (1 + k_))
      block_.shape(plan.lanes(), m_, k_, follows_, free_, p_);
    LaneBlock& b = block_;
    const auto n = static_cast<std::size_t>(b.n);
    begin(plan, arcs);
    std::copy_n(plan.excitation(0), n, b.x_end);
    if (!rates(b, b.x_end, 0)) return where(plan, arcs, b.x_end, 0, 0.0);
    const std::size_t stride = plan.uniform() ? stride_ : 1;
    for (std::size_t i = 0; i + stride <= plan.intervals(); i += stride) {
      const int parts = plan.parts(i);
      for (int part = 0; part < parts; ++part) {
        const std::size_t node =
            plan.first_half_step(i) + 2 * stride * static_cast<std::size_t>(part);
        lane_steps(plan.times(i), plan.times(i + stride), plan.last(),
                   static_cast<double>(i + stride), 1.0 / parts, b.n, b.h);
        std::copy_n(plan.excitation(node + stride), n, b.x_middle);
        std::copy_n(plan.excitation(node + 2 * stride), n, b.x_end);
        cut_lanes_.clear();
        if (!step(b) || !cut(plan, arcs, i, part))
          return where(plan, arcs, b.x_end, i, static_cast<double>(part) / parts);
      }
      compare_between(plan, i, stride);
      see(plan, arcs, i + stride);
    }
    return out_ != nullptr ? close(plan, arcs) : IntegrationReport{.ok = true};
  }

  void begin(const LanePlan& plan, std::span<Arc> arcs) {
    block_.begin(arcs.subspan(plan.first()));
    if (out_ != nullptr) products_.assign((k_ + 1) * (k_ + 2) / 2 * block_.stride, 0.0);
    see(plan, arcs, 0);
  }

  // The rates at b.y, with their derivatives where sensitivities are wanted, as those of `stage`.
  bool rates(LaneBlock& b, const double* x, std::size_t stage) {
    stopped_ = stopped_ ||
               (options_.afford && !options_.afford(static_cast<double>(b.stride * b.components)));
    if (stopped_) return false;
    const bool slopes = k_ > 0;
    return equations_.rates(b.n, b.y.data(), x, theta_, b.work, b.rate.data(),
                            slopes ? b.h_s[stage].data() : nullptr,
                            slopes ? b.h_theta[stage].data() : nullptr);
  }

  // Makes one step from b.y with the rates there. Afterwards b.y is the new state, with its rates,
  // and b.base the old one, with b.first_rate.
  bool step(LaneBlock& b) {
    b.turn();
    for (std::size_t i = 0; i < m_ && cut_; ++i) {
      if (follows_[i] < 0) std::copy_n(b.rate[i], b.n, b.first_rate[i]);
    }
    advance(b.step, 0);
    for (int stage = 1; stage < kClassicStages; ++stage) {
      if (!rates(b, stage < 3 ? b.x_middle : b.x_end, static_cast<std::size_t>(stage)))
        return false;
      advance(b.step, stage);
    }
    if (k_ > 0) advance_derivatives(b.step);
    return rates(b, b.x_end, 0);
  }

  // Repeats the step in pieces in the lanes in which a velocity changed its sign.
  bool cut(const LanePlan& plan, std::span<Arc> arcs, std::size_t interval, int part) {
    if (!cut_) return true;
    std::uint64_t reversed = 0;
    for (std::size_t i = 0; i < m_; ++i) {
      if (follows_[i] >= 0) {
        const auto v = static_cast<std::size_t>(follows_[i]);
        reversed |= sign_changes(block_.base[v], block_.y[v], static_cast<int>(block_.stride));
      }
    }
    for (; reversed != 0; reversed &= reversed - 1)
      cut_lanes_.push_back(static_cast<std::size_t>(std::countr_zero(reversed)));
    return cut_lanes_.empty() || in_pieces(plan, arcs, interval, part);
  }

  bool in_pieces(const LanePlan& plan, std::span<Arc> arcs, std::size_t interval, int part) {
    LaneBlock& s = few_;
    s.shape(static_cast<int>(cut_lanes_.size()), m_, k_, follows_, free_, p_);
    std::vector<double>&begin = cut_begin_, &left = cut_left_;
    begin.clear();
    left.clear();
    for (std::size_t at = 0; at < cut_lanes_.size(); ++at) {
      const std::size_t lane = cut_lanes_[at];
      copy_lane(block_, lane, s, at);
      left.push_back(block_.h[lane]);
      begin.push_back(plan.times(interval)[lane] + part * left.back());
    }
    for (int piece = 0; piece < kMostCuts; ++piece) {
      bool any = false;
      for (std::size_t at = 0; at < left.size(); ++at) {
        const double share = first_zero(s, at, left[at]);
        any = any || share < 1.0;
        s.h[at] = share * left[at];
      }
      if (!any) break;
      s.turn();  // back to the beginning of this piece
      for (std::size_t at = 0; at < left.size(); ++at)
        s.x_end[at] = excitation(plan, arcs, at)->value(begin[at]);
      if (!rates(s, s.x_end, 0) || !take(plan, arcs, s)) return false;
      for (std::size_t at = 0; at < left.size(); ++at) {
        begin[at] += s.h[at];
        left[at] -= s.h[at];
        s.h[at] = left[at];
      }
      if (!take(plan, arcs, s)) return false;
    }
    for (std::size_t at = 0; at < cut_lanes_.size(); ++at)
      copy_lane(s, at, block_, cut_lanes_[at]);
    return true;
  }

  // All of a lane, at both ends of its step.
  void copy_lane(const LaneBlock& from, std::size_t lane, LaneBlock& to, std::size_t at) const {
    const auto copy = [&](const double* source, double* target, std::size_t count) {
      for (std::size_t c = 0; c < count; ++c)
        target[c * to.stride + at] = source[c * from.stride + lane];
    };
    copy(from.step.y, to.step.y, from.components);
    copy(from.step.base, to.step.base, from.components);
    for (std::size_t i = 0; i < m_; ++i) {
      if (follows_[i] >= 0) continue;
      copy(from.rate[i], to.rate[i], 1);
      copy(from.first_rate[i], to.first_rate[i], 1);
    }
    if (k_ == 0) return;
    copy(from.slopes, to.slopes, m_ * m_ + m_ * p_);
  }

  const Excitation* excitation(const LanePlan& plan, std::span<Arc> arcs, std::size_t at) const {
    return arcs[plan.first() + cut_lanes_[at]].excitation;
  }

  // A step of s.h from cut_begin_, with the rates there.
  bool take(const LanePlan& plan, std::span<Arc> arcs, LaneBlock& s) {
    for (std::size_t at = 0; at < cut_lanes_.size(); ++at) {
      const Excitation* x = excitation(plan, arcs, at);
      s.x_middle[at] = x->value(cut_begin_[at] + 0.5 * s.h[at]);
      s.x_end[at] = x->value(cut_begin_[at] + s.h[at]);
    }
    return step(s);
  }

  // The share of a lane's step of `h` s at the first velocity reversal; 1 if there is none.
  double first_zero(const LaneBlock& s, std::size_t lane, double h) const {
    double share = 1.0;
    for (std::size_t i = 0; i < m_; ++i) {
      if (follows_[i] < 0) continue;
      const auto v = static_cast<std::size_t>(follows_[i]);
      const double before = s.base[v][lane], after = s.y[v][lane];
      if (!(before * after < 0.0)) continue;
      const double zero =
          zero_of_cubic(before, after, h * s.first_rate[v][lane], h * s.rate[v][lane]);
      if (zero > kNoCut && zero < 1.0 - kNoCut) share = std::min(share, zero);
    }
    return share;
  }

  // What is wanted of sample `node`.
  void see(const LanePlan& plan, std::span<Arc> arcs, std::size_t node) {
    if (out_ != nullptr) return compare(plan, seen_rows(block_.step, seen_), node, false);
    block_.write(arcs.subspan(plan.first()), node);
  }

  void compare(const LanePlan& plan, const SeenRows& rows, std::size_t node, bool moving) {
    std::copy_n(plan.measured(node), block_.n, block_.measured);
    add_products(block_.step, rows,
                 {block_.measured, plan.from(), plan.to(), static_cast<double>(node), moving},
                 products_.data());
  }

  // The samples within the step of `stride` samples that began at sample `node`.
  void compare_between(const LanePlan& plan, std::size_t node, std::size_t stride) {
    if (!between_ || stride == 1 || plan.parts(node) > 1) return;
    LaneBlock& b = block_;
    between_rows_.resize((k_ + 1) * b.stride);
    for (std::size_t i = 1; i < stride; ++i) {
      const double share = static_cast<double>(i) / static_cast<double>(stride);
      see_between(b.step, seen_, follows_[static_cast<std::size_t>(seen_)], share,
                  between_rows_.data());
      compare(plan, {between_rows_.data(), between_rows_.data() + k_ * b.stride}, node + i, true);
    }
  }

  // The sums of a block's arcs. A number that is not finite is a failure.
  IntegrationReport close(const LanePlan& plan, std::span<Arc> arcs) {
    const LaneBlock& b = block_;
    for (std::size_t lane = 0; lane < static_cast<std::size_t>(b.n); ++lane) {
      const std::size_t arc = plan.first() + lane;
      double* to = out_->end(arc);
      double check = 0.0;
      for (std::size_t c = 0; c < b.components; ++c) {
        to[c] = b.component(b.step.y, c)[lane];
        check += 0.0 * to[c];
      }
      double* products = out_->products(arc);
      const double* from = products_.data() + lane;
      for (std::size_t i = 0; i <= k_; ++i) {
        for (std::size_t j = i; j <= k_; ++j, from += b.stride) {
          products[i * (k_ + 1) + j] = products[j * (k_ + 1) + i] = *from;
          check += 0.0 * *from;
        }
      }
      if (check != 0.0) return {.arc = arc, .reached = arcs[arc].times.back()};
    }
    return {.ok = true};
  }

  // Finds the lane that failed at the block's states: tries each alone, or that of a cut.
  IntegrationReport where(const LanePlan& plan, std::span<Arc> arcs, const double* x,
                          std::size_t interval, double share) {
    IntegrationReport report;
    report.inadmissible = !stopped_;
    report.stopped = stopped_;
    LaneBlock& s = few_;
    for (std::size_t lane = 0; lane < static_cast<std::size_t>(block_.n); ++lane) {
      const Arc& arc = arcs[plan.first() + lane];
      if (interval + 1 >= arc.times.size()) continue;
      if (!cut_lanes_.empty() && lane != cut_lanes_[0]) continue;
      report.arc = plan.first() + lane;
      report.reached =
          arc.times[interval] + (arc.times[interval + 1] - arc.times[interval]) * share;
      if (!cut_lanes_.empty()) break;
      s.shape(1, m_, k_, follows_, free_, p_);
      copy_lane(block_, lane, s, 0);
      s.x_end[0] = x[lane];
      if (stopped_ || !rates(s, s.x_end, 0)) break;
    }
    return report;
  }

  TimeOptions options_;
  std::vector<int> free_;
  std::size_t m_, p_;
  int seen_;  // state
  std::vector<int> follows_;
  std::vector<LanePlan> plans_;
  LaneBlock block_, few_;
  AlignedVector products_, between_rows_;
  // Of the present call.
  const double* theta_ = nullptr;
  std::size_t k_ = 0, stride_ = 1;
  bool cut_ = true, between_ = false;
  ArcSums* out_ = nullptr;  // null: results go to the arcs
  bool stopped_ = false;    // not afforded any longer
  std::vector<std::size_t> cut_lanes_;
  std::vector<double> cut_begin_, cut_left_;
};

}  // namespace

std::unique_ptr<TimeIntegration> make_runge_kutta(const StateEquations& equations,
                                                  const TimeOptions& options,
                                                  std::vector<int> free) {
  return std::make_unique<RungeKutta>(equations, options, std::move(free));
}

}  // namespace shaker::estimator
