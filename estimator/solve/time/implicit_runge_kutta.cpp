// Implicit Runge-Kutta of order four for a batch of arcs, a lane each: SDIRK4 of Hairer and Wanner,
// Solving Ordinary Differential Equations II, section IV.6: five stages, one coefficient on the
// diagonal, L-stable, and its last stage is the new state. For stiff models (a stop of free play,
// friction that gives before it slides), where explicit steps would have to be many.
//
// Newton's method solves each stage, in all lanes at once. The sensitivities are the derivatives of
// the discrete step itself.
#include <algorithm>
#include <array>
#include <cmath>

#include "estimator/math/simd_math.hpp"
#include "estimator/solve/time/integrators.hpp"
#include "estimator/solve/time/internal/lane_inverse.hpp"

namespace shaker::estimator {
namespace {

constexpr std::size_t kStages = 5;
constexpr double kDiagonal = 0.25;
constexpr std::array<double, kStages> kTimes = {1.0 / 4, 3.0 / 4, 11.0 / 20, 1.0 / 2, 1.0};
constexpr std::array<std::array<double, kStages>, kStages> kWeights = {{
    {1.0 / 4},
    {1.0 / 2, 1.0 / 4},
    {17.0 / 50, -1.0 / 25, 1.0 / 4},
    {371.0 / 1360, -137.0 / 2720, 15.0 / 544, 1.0 / 4},
    {25.0 / 24, -49.0 / 48, 125.0 / 16, -85.0 / 12, 1.0 / 4},
}};
constexpr int kMostNewton = 20;         // steps of a stage
constexpr double kStageSolved = 1e-10;  // last step of a state over the state's size in all lanes

// to += weight h rate
SHAKER_SIMD_CLONES void add_rate(int n, double weight, const double* __restrict h,
                                 const double* __restrict rate, double* __restrict to) {
  for (int i = 0; i < n; ++i)
    to[i] += weight * h[i] * rate[i];
}

// to = base + diagonal h rate
SHAKER_SIMD_CLONES void set_stage(int n, const double* base, const double* __restrict h,
                                  const double* __restrict rate, double* to) {
  for (int i = 0; i < n; ++i)
    to[i] = base[i] + kDiagonal * h[i] * rate[i];
}

// to = one - diagonal h slope
SHAKER_SIMD_CLONES void set_entry(int n, double one, const double* __restrict h,
                                  const double* __restrict slope, double* __restrict to) {
  for (int i = 0; i < n; ++i)
    to[i] = one - kDiagonal * h[i] * slope[i];
}

// to += slope from
SHAKER_SIMD_CLONES void add_slope(int n, const double* __restrict slope,
                                  const double* __restrict from, double* __restrict to) {
  for (int i = 0; i < n; ++i)
    to[i] += slope[i] * from[i];
}

// to = x - y
SHAKER_SIMD_CLONES void subtract(int n, const double* __restrict x, const double* __restrict y,
                                 double* __restrict to) {
  for (int i = 0; i < n; ++i)
    to[i] = x[i] - y[i];
}

// Moves a rate, and returns the largest step of its state over the state's largest size.
SHAKER_SIMD_CLONES double move_rate(int n, const double* __restrict moved,
                                    const double* __restrict h, const double* __restrict point,
                                    double* __restrict k) {
  double largest = 0.0, size = 0.0;
  for (int i = 0; i < n; ++i) {
    k[i] += moved[i];
    const double step = std::fabs(h[i] * moved[i]), state = std::fabs(point[i]);
    largest = step > largest ? step : largest;
    size = state > size ? state : size;
  }
  return largest > 0.0 ? largest / size : 0.0;
}

class ImplicitRungeKutta final : public TimeIntegration {
 public:
  ImplicitRungeKutta(const StateEquations& equations, const TimeOptions& options,
                     std::vector<int> free)
      : TimeIntegration(equations),
        options_(options),
        free_(std::move(free)),
        m_(static_cast<std::size_t>(equations.states())),
        p_(static_cast<std::size_t>(equations.parameters())),
        k_(m_ + free_.size()) {}

  IntegrationReport run(std::span<Arc> arcs, std::span<const double> theta,
                        bool sensitivities) override {
    theta_ = theta.data();
    sensitivities_ = sensitivities;
    stopped_ = false;
    steps_.fill(2);
    shape(static_cast<int>(arcs.size()));
    plan(arcs);
    begin(arcs);
    IntegrationReport report;
    std::size_t node = 0;
    for (std::size_t i = 0; i < substeps_.size(); ++i) {
      for (int part = 0; part < substeps_[i]; ++part, node += kStages) {
        for (std::size_t stage = 0; stage < kStages; ++stage) {
          load(arcs, i, node + stage);
          if (solve(stage, &report.inadmissible)) continue;
          report.stopped = stopped_;
          report.inadmissible = report.inadmissible && !stopped_;
          report.reached = arcs[0].times[std::min(i, arcs[0].times.size() - 1)];
          return report;
        }
        std::swap(y_, point_);
        std::swap(s_, s_base_);
      }
      write(arcs, i + 1);
    }
    report.ok = true;
    return report;
  }

 private:
  using Arrays = std::vector<double*>;

  void shape(int lanes) {
    const std::size_t wide = sensitivities_ ? m_ * k_ : 0;
    if (n_ == lanes && s_.size() == wide) return;
    n_ = lanes;
    stride_ = (static_cast<std::size_t>(lanes) + 7) / 8 * 8;
    const std::size_t count = m_ * (6 + kStages) + wide * (3 + kStages) + m_ * m_ + m_ * p_ + 2;
    store_.assign(count * stride_, 0.0);
    double* next = store_.data();
    const auto take = [&](Arrays& arrays, std::size_t size) {
      arrays.resize(size);
      for (double*& array : arrays) {
        array = next;
        next += stride_;
      }
    };
    for (Arrays* arrays : {&y_, &base_, &point_, &rate_, &residual_, &moved_})
      take(*arrays, m_);
    for (Arrays* arrays : {&s_, &s_base_, &s_rate_})
      take(*arrays, wide);
    for (std::size_t i = 0; i < kStages; ++i) {
      take(k_of_[i], m_);
      take(dk_of_[i], wide);
    }
    take(h_s_, m_ * m_);
    take(h_theta_, m_ * p_);
    h_ = next;
    x_ = next + stride_;
    matrix_.shape(lanes, static_cast<int>(m_));
  }

  // The steps between samples, and the excitation at their stages.
  void plan(std::span<Arc> arcs) {
    std::size_t intervals = 0;
    for (const Arc& arc : arcs)
      intervals = std::max(intervals, arc.times.size() - 1);
    substeps_.assign(intervals, 1);
    for (const Arc& arc : arcs) {
      for (std::size_t i = 0; options_.step > 0.0 && i + 1 < arc.times.size(); ++i) {
        const double parts = (arc.times[i + 1] - arc.times[i]) / options_.step;
        substeps_[i] = std::max(substeps_[i], static_cast<int>(std::ceil(parts - 1e-9)));
      }
    }
    nodes_.resize(arcs.size());
    for (std::size_t lane = 0; lane < arcs.size(); ++lane) {
      Arc& arc = arcs[lane];
      std::vector<double>& nodes = nodes_[lane];
      std::size_t count = 0;
      for (std::size_t i = 0; i + 1 < arc.times.size(); ++i)
        count += kStages * static_cast<std::size_t>(substeps_[i]);
      if (nodes.size() == count && !arc.changed) continue;
      arc.changed = false;
      nodes.clear();
      for (std::size_t i = 0; i + 1 < arc.times.size(); ++i) {
        const double h = (arc.times[i + 1] - arc.times[i]) / substeps_[i];
        for (int part = 0; part < substeps_[i]; ++part) {
          for (const double at : kTimes)
            nodes.push_back(arc.excitation->value(arc.times[i] + h * (part + at)));
        }
      }
    }
  }

  void begin(std::span<Arc> arcs) {
    for (std::size_t lane = 0; lane < arcs.size(); ++lane) {
      Arc& arc = arcs[lane];
      for (std::size_t j = 0; j < m_; ++j)
        y_[j][lane] = arc.start[j];
      for (std::size_t c = 0; c < s_.size(); ++c)
        s_[c][lane] = c / k_ == c % k_ ? 1.0 : 0.0;
      arc.states.resize(arc.times.size() * m_);
      if (sensitivities_) arc.sensitivities.resize(arc.times.size() * m_ * k_);
    }
    for (double* rate : k_of_.back())
      std::fill_n(rate, n_, 0.0);
    write(arcs, 0);
  }

  // A lane whose record has ended gets a step of 0.
  void load(std::span<Arc> arcs, std::size_t interval, std::size_t node) {
    for (std::size_t lane = 0; lane < arcs.size(); ++lane) {
      const Arc& arc = arcs[lane];
      const bool on = interval + 1 < arc.times.size();
      h_[lane] = on ? (arc.times[interval + 1] - arc.times[interval]) / substeps_[interval] : 0.0;
      x_[lane] = nodes_[lane][std::min(node, nodes_[lane].size() - 1)];
    }
  }

  // `sum` = `from` + h * the earlier stages' `rates`, weighted.
  void add_stages(std::size_t stage, const Arrays& from, const std::array<Arrays, kStages>& rates,
                  const Arrays& sum) const {
    for (std::size_t c = 0; c < sum.size(); ++c) {
      std::copy_n(from[c], n_, sum[c]);
      for (std::size_t j = 0; j < stage; ++j)
        add_rate(n_, kWeights[stage][j], h_, rates[j][c], sum[c]);
    }
  }

  void add_diagonal(const Arrays& base, const Arrays& rates, const Arrays& sum) const {
    for (std::size_t c = 0; c < sum.size(); ++c)
      set_stage(n_, base[c], h_, rates[c], sum[c]);
  }

  // Evaluates at `point_`; `matrix_` becomes the inverse of 1 - h diagonal h_s.
  bool linearise(bool parameters) {
    // As dear as explicit steps with twice the numbers: equations are solved.
    const std::size_t numbers = 2 * m_ * (1 + (parameters ? k_ : m_));
    stopped_ = options_.afford && !options_.afford(static_cast<double>(stride_ * numbers));
    if (stopped_) return false;
    if (!equations_.rates(n_, point_.data(), x_, theta_, work_, rate_.data(), h_s_.data(),
                          parameters ? h_theta_.data() : nullptr))
      return false;
    const int m = static_cast<int>(m_);
    for (int r = 0; r < m; ++r) {
      for (int c = 0; c < m; ++c)
        set_entry(n_, r == c ? 1.0 : 0.0, h_, h_s_[static_cast<std::size_t>(r * m + c)],
                  matrix_.entry(r, c));
    }
    return matrix_.invert(n_);
  }

  // Solves a stage; afterwards `point_` is its state, and `s_base_` its sensitivities.
  bool solve(std::size_t stage, bool* inadmissible) {
    add_stages(stage, y_, k_of_, base_);
    Arrays& k = k_of_[stage];
    const Arrays& before = stage > 0 ? k_of_[stage - 1] : k_of_.back();
    for (std::size_t j = 0; j < m_; ++j)
      std::copy_n(before[j], n_, k[j]);
    // The last look of Newton's method has the derivatives that the sensitivities need: it is the
    // same one as a step before, mostly.
    bool solved = false, derivatives = false;
    for (int step = 1; step <= kMostNewton && !solved; ++step) {
      add_diagonal(base_, k, point_);
      derivatives = sensitivities_ && step >= steps_[stage];
      if (!linearise(derivatives)) {
        *inadmissible = true;
        return false;
      }
      for (std::size_t j = 0; j < m_; ++j)
        subtract(n_, rate_[j], k[j], residual_[j]);
      solved = true;
      for (std::size_t j = 0; j < m_; ++j) {
        matrix_.times(n_, static_cast<int>(j), residual_.data(), 1, 1.0, moved_[j]);
        if (!(move_rate(n_, moved_[j], h_, point_[j], k[j]) <= kStageSolved)) solved = false;
      }
      if (solved) steps_[stage] = step;
    }
    if (!solved) return false;
    add_diagonal(base_, k, point_);
    if (!sensitivities_) return true;
    if (!derivatives && !linearise(true)) {
      *inadmissible = true;
      return false;
    }
    differentiate(stage);
    return true;
  }

  void differentiate(std::size_t stage) {
    add_stages(stage, s_, dk_of_, s_base_);
    for (std::size_t r = 0; r < m_; ++r) {
      for (std::size_t k = 0; k < k_; ++k) {
        double* to = s_rate_[r * k_ + k];
        if (k >= m_)
          std::copy_n(h_theta_[r * p_ + static_cast<std::size_t>(free_[k - m_])], n_, to);
        else
          std::fill_n(to, n_, 0.0);
        for (std::size_t j = 0; j < m_; ++j)
          add_slope(n_, h_s_[r * m_ + j], s_base_[j * k_ + k], to);
      }
    }
    Arrays& dk = dk_of_[stage];
    for (std::size_t r = 0; r < m_; ++r) {
      for (std::size_t k = 0; k < k_; ++k)
        matrix_.times(n_, static_cast<int>(r), &s_rate_[k], static_cast<int>(k_), 1.0,
                      dk[r * k_ + k]);
    }
    add_diagonal(s_base_, dk, s_base_);
  }

  void write(std::span<Arc> arcs, std::size_t node) const {
    for (std::size_t lane = 0; lane < arcs.size(); ++lane) {
      Arc& arc = arcs[lane];
      if (node >= arc.times.size()) continue;
      for (std::size_t j = 0; j < m_; ++j)
        arc.states[node * m_ + j] = y_[j][lane];
      for (std::size_t c = 0; c < s_.size(); ++c)
        arc.sensitivities[node * m_ * k_ + c] = s_[c][lane];
    }
  }

  TimeOptions options_;
  std::vector<int> free_;
  std::size_t m_, p_, k_;
  const double* theta_ = nullptr;
  bool sensitivities_ = false;
  bool stopped_ = false;                              // not afforded any longer
  std::array<int, kStages> steps_ = {2, 2, 2, 2, 2};  // of Newton's method, a step before
  int n_ = 0;
  std::size_t stride_ = 0;
  std::vector<int> substeps_;
  std::vector<std::vector<double>> nodes_;  // of each arc: the excitation at the stages
  AlignedVector store_;
  // States: at the step's begin, a stage's known part, the stage; rate and Newton's step there.
  Arrays y_, base_, point_, rate_, residual_, moved_;
  Arrays s_, s_base_, s_rate_;  // sensitivities, likewise
  std::array<Arrays, kStages> k_of_, dk_of_;
  Arrays h_s_, h_theta_;
  double *h_ = nullptr, *x_ = nullptr;
  LaneInverse matrix_;
  StateEquations::Workspace work_;
};

}  // namespace

std::unique_ptr<TimeIntegration> make_implicit_runge_kutta(const StateEquations& equations,
                                                           const TimeOptions& options,
                                                           std::vector<int> free) {
  return std::make_unique<ImplicitRungeKutta>(equations, options, std::move(free));
}

}  // namespace shaker::estimator
