// Classical Runge-Kutta of order four where friction jumps: the force is not the same on both sides
// of v = 0, and a mass may stick there. For models with one velocity.
//
// A lane moves one way, or it sticks. Forces are those of that way, also where a stage of the last
// step passes beyond the reversal. A step in which the velocity reverses ends there: at the zero of
// the cubic through both ends. The mass then goes where the force takes it; where friction holds it
// against either way, it sticks, until the force on it has grown. Derivatives change at a reversal,
// because it comes earlier or later (the saltation of a hybrid system).
#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

#include "estimator/solve/time/integrators.hpp"
#include "estimator/solve/time/internal/lane_block.hpp"
#include "estimator/solve/time/internal/lane_plan.hpp"
#include "estimator/solve/time/internal/zero_of_cubic.hpp"

namespace shaker::estimator {
namespace {

constexpr int kMostPieces = 12;  // of a step

class StickSlip final : public TimeIntegration {
 public:
  StickSlip(const StateEquations& equations, const TimeOptions& options, std::vector<int> free)
      : TimeIntegration(equations),
        options_(options),
        free_(std::move(free)),
        m_(static_cast<std::size_t>(equations.states())),
        p_(static_cast<std::size_t>(equations.parameters())),
        follows_(followed_states(equations)),
        states_(m_) {
    for (const int velocity : follows_) {
      if (velocity < 0) continue;
      if (speed_ != 0) throw std::invalid_argument("friction that jumps wants one velocity only");
      speed_ = static_cast<std::size_t>(velocity);
    }
    if (speed_ == 0 || !(options.still > 0.0))
      throw std::invalid_argument("friction that jumps wants a velocity, and what is none");
    if (m_ > kMostLaneStates)
      throw std::invalid_argument("the model has too many states for fixed steps");
  }

  IntegrationReport run(std::span<Arc> arcs, std::span<const double> theta,
                        bool sensitivities) override {
    theta_ = theta.data();
    k_ = sensitivities ? m_ + free_.size() : 0;
    stopped_ = false;
    for (Arc& arc : arcs) {
      arc.states.resize(arc.times.size() * m_);
      if (sensitivities) arc.sensitivities.resize(arc.times.size() * m_ * k_);
    }
    lay_plans(arcs, options_.step, plans_);
    IntegrationReport report;
    for (const LanePlan& plan : plans_) {
      report = through(plan, arcs.subspan(plan.first()));
      report.arc += plan.first();
      if (!report.ok) break;
    }
    return report;
  }

 private:
  // Lanes of a block, with the way in which each moves: 1, -1, or 0 where it sticks.
  struct Lanes {
    LaneBlock block;
    AlignedVector way;
    AlignedVector clear;  // the velocity, away from 0
  };

  // A failure names the first arc of the plan.
  IntegrationReport through(const LanePlan& plan, std::span<Arc> arcs) {
    shape(all_, plan.lanes());
    begin_x_.assign(all_.block.stride, 0.0);
    LaneBlock& b = all_.block;
    const auto n = static_cast<std::size_t>(b.n);
    const auto failed = [&](std::size_t interval) {
      return IntegrationReport{
          .inadmissible = !stopped_,
          .stopped = stopped_,
          .reached = arcs[0].times[std::min(interval, arcs[0].times.size() - 1)]};
    };
    b.begin(arcs);
    b.write(arcs, 0);
    std::copy_n(plan.excitation(0), n, b.x_end);
    if (!set_ways(all_)) return failed(0);
    for (std::size_t i = 0; i < plan.intervals(); ++i) {
      const int parts = plan.parts(i);
      for (int part = 0; part < parts; ++part) {
        const std::size_t node = plan.first_half_step(i) + 2 * static_cast<std::size_t>(part);
        lane_steps(plan.times(i), plan.times(i + 1), plan.last(), static_cast<double>(i + 1),
                   1.0 / parts, b.n, b.h);
        std::copy_n(plan.excitation(node), n, begin_x_.data());
        std::copy_n(plan.excitation(node + 1), n, b.x_middle);
        std::copy_n(plan.excitation(node + 2), n, b.x_end);
        if (!step(all_, begin_x_.data()) || !follow_changes(plan, arcs, i, part)) return failed(i);
      }
      b.write(arcs, i + 1);
    }
    return {.ok = true};
  }

  void shape(Lanes& lanes, int n) {
    if (lanes.block.n != n || lanes.block.components != m_ * (1 + k_))
      lanes.block.shape(n, m_, k_, follows_, free_, p_);
    lanes.way.assign(lanes.block.stride, 0.0);
    lanes.clear.assign(lanes.block.stride, 0.0);
  }

  // The rates at y, of each lane's way; `way`: of another one. Rates of what sticks are 0.
  bool rates(Lanes& lanes, const double* x, std::size_t stage, const double* way, bool slopes) {
    LaneBlock& b = lanes.block;
    stopped_ = stopped_ ||
               (options_.afford && !options_.afford(static_cast<double>(b.stride * b.components)));
    if (stopped_) return false;
    for (std::size_t l = 0; l < b.stride; ++l) {
      const double to = way[l] < 0.0 ? -1.0 : 1.0;
      lanes.clear[l] = to * std::max(to * b.y[speed_][l], options_.still);
    }
    std::copy(b.y.begin(), b.y.end(), states_.begin());
    states_[speed_] = lanes.clear.data();
    if (!equations_.rates(b.n, states_.data(), x, theta_, b.work, b.rate.data(),
                          slopes ? b.h_s[stage].data() : nullptr,
                          slopes ? b.h_theta[stage].data() : nullptr))
      return false;
    for (std::size_t l = 0; l < static_cast<std::size_t>(b.n); ++l) {
      if (way[l] != 0.0) continue;
      b.rate[speed_][l] = 0.0;
      for (std::size_t j = 0; slopes && j < m_; ++j)
        b.h_s[stage][speed_ * m_ + j][l] = 0.0;
      for (std::size_t j = 0; slopes && j < p_; ++j)
        b.h_theta[stage][speed_ * p_ + j][l] = 0.0;
    }
    return true;
  }

  bool step(Lanes& lanes, const double* begin_x) {
    LaneBlock& b = lanes.block;
    const bool slopes = k_ > 0;
    if (!rates(lanes, begin_x, 0, lanes.way.data(), slopes)) return false;
    b.turn();
    for (std::size_t i = 0; i < m_; ++i) {
      if (follows_[i] < 0) std::copy_n(b.rate[i], b.stride, b.first_rate[i]);
    }
    advance(b.step, 0);
    for (int stage = 1; stage < kClassicStages; ++stage) {
      if (!rates(lanes, stage < 3 ? b.x_middle : b.x_end, static_cast<std::size_t>(stage),
                 lanes.way.data(), slopes))
        return false;
      advance(b.step, stage);
    }
    if (slopes) advance_derivatives(b.step);
    return true;
  }

  // The accelerations of each lane at y and the excitation x, were it to move forwards (push) or
  // back (pull).
  bool find_forces(Lanes& lanes, const double* x) {
    const LaneBlock& b = lanes.block;
    for (const double way : {1.0, -1.0}) {
      const AlignedVector ways(b.stride, way);
      if (!rates(lanes, x, 0, ways.data(), false)) return false;
      std::copy_n(b.rate[speed_], b.n, way > 0.0 ? push_.data() : pull_.data());
    }
    return true;
  }

  double way_from_rest(std::size_t lane) const {
    if (push_[lane] > 0.0) return 1.0;
    return pull_[lane] < 0.0 ? -1.0 : 0.0;
  }

  // The derivatives of a velocity that is held are 0.
  void hold(LaneBlock& b, std::size_t lane) const {
    b.y[speed_][lane] = 0.0;
    for (std::size_t c = 0; c < k_; ++c)
      b.component(b.step.y, m_ + speed_ * k_ + c)[lane] = 0.0;
  }

  bool set_ways(Lanes& lanes) {
    LaneBlock& b = lanes.block;
    if (!find_forces(lanes, b.x_end)) return false;
    for (std::size_t l = 0; l < static_cast<std::size_t>(b.n); ++l) {
      const double v = b.y[speed_][l];
      lanes.way[l] = std::fabs(v) > options_.still ? (v > 0.0 ? 1.0 : -1.0) : way_from_rest(l);
      if (lanes.way[l] == 0.0) hold(b, l);
    }
    return true;
  }

  // The lanes that have left their way at the end of their step.
  bool find_changing() {
    const LaneBlock& b = all_.block;
    changing_.clear();
    bool sticks = false;
    for (std::size_t l = 0; l < static_cast<std::size_t>(b.n); ++l)
      sticks = sticks || (all_.way[l] == 0.0 && b.h[l] > 0.0);
    if (sticks && !find_forces(all_, b.x_end)) return false;
    for (std::size_t l = 0; l < static_cast<std::size_t>(b.n); ++l) {
      const bool loose = all_.way[l] == 0.0 && b.h[l] > 0.0 && way_from_rest(l) != 0.0;
      if (loose || all_.way[l] * b.y[speed_][l] < 0.0) changing_.push_back(l);
    }
    return true;
  }

  // Repeats the step in pieces in these lanes.
  bool follow_changes(const LanePlan& plan, std::span<Arc> arcs, std::size_t interval, int part) {
    if (!find_changing()) return false;
    if (changing_.empty()) return true;
    shape(few_, static_cast<int>(changing_.size()));
    begin_.clear();
    left_.clear();
    for (std::size_t at = 0; at < changing_.size(); ++at) {
      const std::size_t lane = changing_[at];
      copy(all_.block, all_.block.step.base, lane, few_.block, few_.block.step.y, at);
      few_.way[at] = all_.way[lane];
      left_.push_back(all_.block.h[lane]);
      begin_.push_back(plan.times(interval)[lane] + part * left_.back());
    }
    const auto excitation = [&](std::size_t at, double time) {
      return arcs[changing_[at]].excitation->value(time);
    };
    bool open = true;
    for (int piece = 1; open && piece <= kMostPieces; ++piece) {
      if (!take_piece(excitation)) return false;
      open = std::any_of(left_.begin(), left_.end(), [](double left) { return left > 0.0; });
    }
    for (std::size_t at = 0; at < changing_.size(); ++at) {
      if (left_[at] > 0.0) {  // it trembles
        hold(few_.block, at);
        few_.way[at] = 0.0;
      }
      copy(few_.block, few_.block.step.y, at, all_.block, all_.block.step.y, changing_[at]);
      all_.way[changing_[at]] = few_.way[at];
    }
    return true;
  }

  // One piece of the step in each lane: to where it leaves its way, or to the end.
  template <class Excitation>
  bool take_piece(const Excitation& excitation) {
    LaneBlock& b = few_.block;
    const std::size_t n = changing_.size();
    by_ = left_;
    set_times(excitation);
    if (!find_forces(few_, few_x_.data())) return false;
    const auto push = push_, pull = pull_;
    if (!step(few_, few_x_.data()) || !rates(few_, b.x_end, 0, few_.way.data(), false))
      return false;
    const std::vector<double> at_end(b.rate[speed_], b.rate[speed_] + n);
    if (!find_forces(few_, b.x_end)) return false;
    changes_.assign(n, false);
    next_.assign(n, 0.0);
    bool any = false;
    for (std::size_t at = 0; at < n; ++at) {
      double share = 1.0;
      const double before = b.base[speed_][at], after = b.y[speed_][at], way = few_.way[at];
      if (way == 0.0 && left_[at] > 0.0 && way_from_rest(at) != 0.0) {
        const double from = push_[at] > 0.0 ? push[at] : pull[at];
        const double to = push_[at] > 0.0 ? push_[at] : pull_[at];
        share = from * to < 0.0 ? from / (from - to) : 0.0;
        next_[at] = way_from_rest(at);
        changes_[at] = true;
      } else if (way * after < 0.0) {
        // From rest, a cubic has its first zero at the beginning: half the step shows where it goes.
        changes_[at] = way * before > 0.0;
        share = changes_[at] ? zero_of_cubic(before, after, by_[at] * b.first_rate[speed_][at],
                                             by_[at] * at_end[at])
                             : 0.5;
      }
      any = any || share < 1.0;
      by_[at] *= share;
    }
    if (any) {
      b.turn();
      set_times(excitation);
      if (!step(few_, few_x_.data()) || !turn_round()) return false;
    }
    for (std::size_t at = 0; at < n; ++at) {
      begin_[at] += by_[at];
      left_[at] -= by_[at];
    }
    return true;
  }

  template <class Excitation>
  void set_times(const Excitation& excitation) {
    LaneBlock& b = few_.block;
    few_x_.assign(b.stride, 0.0);
    for (std::size_t at = 0; at < by_.size(); ++at) {
      b.h[at] = by_[at];
      few_x_[at] = excitation(at, begin_[at]);
      b.x_middle[at] = excitation(at, begin_[at] + 0.5 * by_[at]);
      b.x_end[at] = excitation(at, begin_[at] + by_[at]);
    }
  }

  // At y, in the lanes that leave their way: sets the next one, and takes the derivatives along. The
  // moment moves with the velocity's derivatives, and rates differ before and after it.
  bool turn_round() {
    LaneBlock& b = few_.block;
    const std::size_t n = changing_.size();
    if (!rates(few_, b.x_end, 0, few_.way.data(), false)) return false;
    for (std::size_t i = 0; i < m_; ++i) {
      if (follows_[i] < 0) std::copy_n(b.rate[i], b.stride, b.first_rate[i]);
    }
    AlignedVector way = few_.way;
    for (std::size_t at = 0; at < n; ++at) {
      if (changes_[at]) b.y[speed_][at] = 0.0;
    }
    if (!find_forces(few_, b.x_end)) return false;
    for (std::size_t at = 0; at < n; ++at) {
      if (changes_[at]) way[at] = few_.way[at] == 0.0 ? next_[at] : way_from_rest(at);
    }
    few_.way = way;
    if (!rates(few_, b.x_end, 0, way.data(), false)) return false;
    for (std::size_t at = 0; at < n; ++at) {
      const double incoming = b.first_rate[speed_][at];
      if (!changes_[at] || incoming == 0.0) continue;
      for (std::size_t c = 0; c < k_; ++c) {
        const double later = -b.component(b.step.y, m_ + speed_ * k_ + c)[at] / incoming;
        for (std::size_t i = 0; i < m_; ++i) {
          if (follows_[i] < 0)
            b.component(b.step.y, m_ + i * k_ + c)[at] +=
                (b.first_rate[i][at] - b.rate[i][at]) * later;
        }
      }
      if (way[at] == 0.0) hold(b, at);
    }
    return true;
  }

  void copy(const LaneBlock& from, const double* source, std::size_t lane, const LaneBlock& to,
            double* target, std::size_t at) const {
    for (std::size_t c = 0; c < from.components; ++c)
      target[c * to.stride + at] = source[c * from.stride + lane];
  }

  TimeOptions options_;
  std::vector<int> free_;
  std::size_t m_, p_, speed_ = 0;
  std::vector<int> follows_;
  std::vector<const double*> states_;
  std::vector<LanePlan> plans_;
  Lanes all_, few_;
  AlignedVector begin_x_, few_x_;
  std::array<double, kLanesAbreast> push_{}, pull_{};  // of find_forces()
  // Of the present call.
  const double* theta_ = nullptr;
  std::size_t k_ = 0;
  bool stopped_ = false;  // not afforded any longer
  // Of the lanes that leave their way in the present step.
  std::vector<std::size_t> changing_;
  std::vector<double> begin_, left_, by_, next_;  // next: the way of what comes loose
  std::vector<bool> changes_;
};

}  // namespace

std::unique_ptr<TimeIntegration> make_stick_slip(const StateEquations& equations,
                                                 const TimeOptions& options,
                                                 std::vector<int> free) {
  return std::make_unique<StickSlip>(equations, options, std::move(free));
}

}  // namespace shaker::estimator
