// CVODES: Adams or BDF, variable step and order. The sensitivity equations (5.10) are integrated
// with the state, or the parameters are further states (5.11), (5.12).
#include <algorithm>
#include <cmath>
#include <limits>
#include <new>
#include <stdexcept>
#include <sunlinsol/sunlinsol_dense.h>
#include <sunmatrix/sunmatrix_dense.h>
#include <sunnonlinsol/sunnonlinsol_fixedpoint.h>

#include <cvodes/cvodes.h>
#include <nvector/nvector_serial.h>

#include "estimator/solve/time/integrators.hpp"

namespace shaker::estimator {
namespace {

constexpr long kMaxIntegrationSteps = 50000, kBdfSteps = 100;  // of BDF; and times those of Adams
// Inadmissible evaluations between two samples after which the motion itself counts as
// inadmissible. Without a limit CVODES would repeat with smaller steps down to the rounding level.
constexpr int kMostRefusals = 60;
constexpr int kGiveUp = -1;          // what CVODES is returned, then ends
constexpr double kNoReturn = 1e-12;  // s; CVODES cannot start a step shorter than rounding

struct Freed {
  void operator()(SUNContext context) const { SUNContext_Free(&context); }
};
template <auto Free>
struct Released {
  template <class T>
  void operator()(T* object) const {
    Free(object);
  }
};
void free_memory(void* memory) {
  CVodeFree(&memory);
}

using Context = std::unique_ptr<_SUNContext, Freed>;
using Vector = std::unique_ptr<_generic_N_Vector, Released<N_VDestroy>>;
using OwnedMatrix = std::unique_ptr<_generic_SUNMatrix, Released<SUNMatDestroy>>;
using LinearSolver = std::unique_ptr<_generic_SUNLinearSolver, Released<SUNLinSolFree>>;
using NonlinearSolver = std::unique_ptr<_generic_SUNNonlinearSolver, Released<SUNNonlinSolFree>>;
using Memory = std::unique_ptr<void, Released<free_memory>>;

struct ColumnsFree {
  int count = 0;
  void operator()(N_Vector* columns) const { N_VDestroyVectorArray(columns, count); }
};

void need(bool good, const char* what) {
  if (!good) throw std::runtime_error(std::string("CVODES: ") + what + " failed");
}

class Cvodes final : public TimeIntegration {
 public:
  Cvodes(const StateEquations& equations, const TimeOptions& options, std::vector<int> free)
      : TimeIntegration(equations),
        options_(options),
        free_(std::move(free)),
        m_(static_cast<std::size_t>(equations.states())),
        p_(static_cast<std::size_t>(equations.parameters())),
        k_(m_ + free_.size()),
        size_(options.gradient == Gradient::augmented_states ? k_ : m_) {
    SUNContext context = nullptr;
    need(SUNContext_Create(nullptr, &context) == 0, "its context");
    context_.reset(context);
    y_.reset(N_VNew_Serial(static_cast<sunindextype>(size_), context));
    need(y_ != nullptr, "a vector");
    N_Vector* sensitivities = N_VCloneVectorArray(static_cast<int>(k_), y_.get());
    need(sensitivities != nullptr, "the vectors of sensitivities");
    columns_ = {sensitivities, ColumnsFree{static_cast<int>(k_)}};
    shape_lanes();
  }

  IntegrationReport run(std::span<Arc> arcs, std::span<const double> theta,
                        bool sensitivities) override {
    IntegrationReport report;
    report.ok = true;
    bool stiff = false;
    for (std::size_t j = 0; j < arcs.size() && report.ok; ++j) {
      report = run_one(arcs[j], theta, sensitivities, options_.integrator);
      if (!report.ok && !report.inadmissible && options_.integrator == Integrator::adams) {
        report = run_one(arcs[j], theta, sensitivities, Integrator::bdf);
        stiff = true;
      }
      report.arc = j;
    }
    report.stiff = stiff;
    return report;
  }

 private:
  // One CVODES memory for each combination of method and sensitivities; it is kept for later runs.
  struct Solver {
    OwnedMatrix matrix;
    LinearSolver linear;
    NonlinearSolver state, sensitivity;
    Memory memory;
  };

  void shape_lanes() {
    const std::size_t arrays = m_ + m_ + m_ * m_ + m_ * p_;
    lane_.assign(arrays * 8, 0.0);
    double* at = lane_.data();
    for (auto* pointers : {&s_, &rate_}) {
      for (std::size_t i = 0; i < m_; ++i, at += 8)
        pointers->push_back(at);
    }
    for (std::size_t i = 0; i < m_ * m_; ++i, at += 8)
      h_s_.push_back(at);
    for (std::size_t i = 0; i < m_ * p_; ++i, at += 8)
      h_theta_.push_back(at);
  }

  // Evaluates the model at a state of CVODES: rate_, and with `slopes` also h_s_ and h_theta_.
  bool evaluate(double t, const double* y, bool slopes) {
    for (std::size_t i = 0; i < m_; ++i)
      *s_[i] = y[i];
    const double* theta = theta_.data();
    if (size_ > m_) {  // (5.11): the parameters are read from the state
      for (std::size_t k = 0; k < free_.size(); ++k)
        theta_[static_cast<std::size_t>(free_[k])] = y[m_ + k];
    }
    const double x = arc_->excitation->value(t);
    return equations_.rates(1, s_.data(), &x, theta, work_, rate_.data(),
                            slopes ? h_s_.data() : nullptr, slopes ? h_theta_.data() : nullptr);
  }

  // A positive return asks CVODES for a smaller step.
  static int rhs(double t, N_Vector y, N_Vector y_dot, void* self_) {
    auto* self = static_cast<Cvodes*>(self_);
    if (++self->evaluations_ > self->max_evaluations_) return kGiveUp;
    if (!self->evaluate(t, N_VGetArrayPointer(y), false)) return self->refuse();
    double* out = N_VGetArrayPointer(y_dot);
    for (std::size_t i = 0; i < self->size_; ++i)
      out[i] = i < self->m_ ? *self->rate_[i] : 0.0;
    return 0;
  }

  static int sensitivity_rhs(int count, double t, N_Vector y, N_Vector, N_Vector* columns,
                             N_Vector* rates, void* self_, N_Vector, N_Vector) {
    auto* self = static_cast<Cvodes*>(self_);
    if (!self->evaluate(t, N_VGetArrayPointer(y), true)) return self->refuse();
    for (int k = 0; k < count; ++k)
      self->sensitivity_rate(static_cast<std::size_t>(k), N_VGetArrayPointer(columns[k]),
                             N_VGetArrayPointer(rates[k]));
    return 0;
  }

  void sensitivity_rate(std::size_t k, const double* column, double* rate) const {
    for (std::size_t i = 0; i < m_; ++i) {
      double sum = 0.0;
      for (std::size_t j = 0; j < m_; ++j)
        sum += *h_s_[i * m_ + j] * column[j];
      if (size_ > m_) {  // augmented: the parameters' own rows are a constant identity
        for (std::size_t j = 0; j < free_.size(); ++j)
          sum += *h_theta_[i * p_ + static_cast<std::size_t>(free_[j])] * column[m_ + j];
      } else if (k >= m_) {
        sum += *h_theta_[i * p_ + static_cast<std::size_t>(free_[k - m_])];
      }
      rate[i] = sum;
    }
    std::fill(rate + m_, rate + size_, 0.0);
  }

  static int jacobian(double t, N_Vector y, N_Vector, SUNMatrix matrix, void* self_, N_Vector,
                      N_Vector, N_Vector) {
    auto* self = static_cast<Cvodes*>(self_);
    if (!self->evaluate(t, N_VGetArrayPointer(y), true)) return self->refuse();
    SUNMatZero(matrix);
    for (std::size_t i = 0; i < self->m_; ++i) {
      for (std::size_t j = 0; j < self->size_; ++j) {
        double* column = SUNDenseMatrix_Column(matrix, static_cast<sunindextype>(j));
        column[i] = j < self->m_
                        ? *self->h_s_[i * self->m_ + j]
                        : *self->h_theta_[i * self->p_ +
                                          static_cast<std::size_t>(self->free_[j - self->m_])];
      }
    }
    return 0;
  }

  static int reversals(double, N_Vector y, double* zero, void* self_) {
    auto* self = static_cast<Cvodes*>(self_);
    int at = 0;
    for (int e = 0; e < self->equations_.coordinates(); ++e) {
      if (const int v = self->equations_.velocity_of(e); v >= 0)
        zero[at++] = N_VGetArrayPointer(y)[v];
    }
    return 0;
  }

  int refuse() { return ++refusals_ < kMostRefusals ? 1 : kGiveUp; }

  Solver& solver(Integrator kind, bool sensitivities) {
    const std::size_t at = (kind == Integrator::bdf ? 2U : 0U) + (sensitivities ? 1U : 0U);
    Solver& s = solvers_[at];
    if (s.memory != nullptr) return s;
    SUNContext context = context_.get();
    void* memory = CVodeCreate(kind == Integrator::bdf ? CV_BDF : CV_ADAMS, context);
    need(memory != nullptr, "CVodeCreate");
    s.memory.reset(memory);
    CVodeSetErrFile(memory, nullptr);
    need(CVodeInit(memory, rhs, 0.0, y_.get()) == CV_SUCCESS, "CVodeInit");
    CVodeSetUserData(memory, this);
    CVodeSetMaxNumSteps(memory, kind == Integrator::bdf
                                    ? std::min(kMaxIntegrationSteps, kBdfSteps * options_.max_steps)
                                    : options_.max_steps);
    CVodeSStolerances(memory, options_.relative_tolerance, options_.absolute_tolerance);
    if (kind == Integrator::bdf) {
      const auto size = static_cast<sunindextype>(size_);
      s.matrix.reset(SUNDenseMatrix(size, size, context));
      s.linear.reset(SUNLinSol_Dense(y_.get(), s.matrix.get(), context));
      need(CVodeSetLinearSolver(memory, s.linear.get(), s.matrix.get()) == CVLS_SUCCESS,
           "its linear solver");
      CVodeSetJacFn(memory, jacobian);
    } else {
      s.state.reset(SUNNonlinSol_FixedPoint(y_.get(), 0, context));
      need(CVodeSetNonlinearSolver(memory, s.state.get()) == CV_SUCCESS, "its nonlinear solver");
    }
    if (sensitivities) prepare_sensitivities(s, kind);
    if (cuts()) {
      int velocities = 0;
      for (int e = 0; e < equations_.coordinates(); ++e)
        velocities += equations_.velocity_of(e) >= 0 ? 1 : 0;
      CVodeRootInit(memory, velocities, reversals);
      CVodeSetNoInactiveRootWarn(memory);
    }
    return s;
  }

  void prepare_sensitivities(Solver& s, Integrator kind) {
    void* memory = s.memory.get();
    const int count = static_cast<int>(k_);
    need(CVodeSensInit(memory, count, CV_STAGGERED, sensitivity_rhs, columns_.get()) == CV_SUCCESS,
         "CVodeSensInit");
    std::vector<double> absolute(k_, options_.absolute_tolerance);
    CVodeSensSStolerances(memory, options_.relative_tolerance, absolute.data());
    CVodeSetSensErrCon(memory, options_.control_sensitivities ? SUNTRUE : SUNFALSE);
    if (kind == Integrator::bdf) return;
    s.sensitivity.reset(SUNNonlinSol_FixedPointSens(count, y_.get(), 0, context_.get()));
    need(CVodeSetNonlinearSolverSensStg(memory, s.sensitivity.get()) == CV_SUCCESS,
         "its nonlinear solver for the sensitivities");
  }

  bool cuts() const { return options_.cut == CutAtReversals::always; }

  IntegrationReport run_one(Arc& arc, std::span<const double> theta, bool sensitivities,
                            Integrator kind) {
    Solver& s = solver(kind, sensitivities);
    void* memory = s.memory.get();
    arc_ = &arc;
    theta_.assign(theta.begin(), theta.end());
    refusals_ = 0;
    evaluations_ = 0;
    max_evaluations_ =
        kind == Integrator::adams ? options_.max_evaluations : std::numeric_limits<long>::max();
    const std::size_t n = arc.times.size();
    arc.states.resize(n * m_);
    if (sensitivities) arc.sensitivities.resize(n * m_ * k_);
    begin(arc, theta, sensitivities);
    IntegrationReport report;
    double t = arc.times[0];
    report.reached = t;
    if (!evaluate(t, N_VGetArrayPointer(y_.get()), false)) {
      report.inadmissible = true;
      return report;
    }
    CVodeReInit(memory, t, y_.get());
    if (sensitivities) CVodeSensReInit(memory, CV_STAGGERED, columns_.get());
    // No step goes beyond the end, where the motion may become inadmissible.
    CVodeSetStopTime(memory, arc.times[n - 1]);
    write(arc, 0, sensitivities);
    for (std::size_t i = 1; i < n; ++i) {
      const int flag = advance(memory, arc.times[i], t, sensitivities);
      if (flag < 0) {
        CVodeGetCurrentTime(memory, &report.reached);
        report.inadmissible = refusals_ > 0;
        return report;
      }
      refusals_ = 0;
      if (sensitivities) CVodeGetSens(memory, &t, columns_.get());
      write(arc, i, sensitivities);
    }
    report.ok = true;
    return report;
  }

  void begin(const Arc& arc, std::span<const double> theta, bool sensitivities) {
    double* y = N_VGetArrayPointer(y_.get());
    std::copy(arc.start.begin(), arc.start.end(), y);
    for (std::size_t k = m_; k < size_; ++k)  // (5.12)
      y[k] = theta[static_cast<std::size_t>(free_[k - m_])];
    if (!sensitivities) return;
    for (std::size_t k = 0; k < k_; ++k) {
      double* column = N_VGetArrayPointer(columns_.get()[k]);
      for (std::size_t i = 0; i < size_; ++i)
        column[i] = i == k ? 1.0 : 0.0;
    }
  }

  // Integrates to `until`. Restarts at every velocity reversal if the options require it.
  int advance(void* memory, double until, double& t, bool sensitivities) {
    for (;;) {
      const int flag = CVode(memory, until, y_.get(), &t, CV_NORMAL);
      if (flag != CV_ROOT_RETURN) return flag;
      if (until - t < kNoReturn) {
        t = until;
        return CV_SUCCESS;
      }
      if (sensitivities) CVodeGetSens(memory, &t, columns_.get());
      CVodeReInit(memory, t, y_.get());
      if (sensitivities) CVodeSensReInit(memory, CV_STAGGERED, columns_.get());
    }
  }

  void write(Arc& arc, std::size_t node, bool sensitivities) const {
    const double* y = N_VGetArrayPointer(y_.get());
    std::copy_n(y, m_, &arc.states[node * m_]);
    if (!sensitivities) return;
    for (std::size_t k = 0; k < k_; ++k) {
      const double* column = N_VGetArrayPointer(columns_.get()[k]);
      for (std::size_t i = 0; i < m_; ++i)
        arc.sensitivities[(node * m_ + i) * k_ + k] = column[i];
    }
  }

  TimeOptions options_;
  std::vector<int> free_;
  std::size_t m_, p_, k_, size_;
  Context context_;
  Vector y_;
  std::unique_ptr<N_Vector, ColumnsFree> columns_;
  Solver solvers_[4];
  Arc* arc_ = nullptr;
  std::vector<double> theta_;
  int refusals_ = 0;
  long evaluations_ = 0, max_evaluations_ = 0;
  AlignedVector lane_;
  std::vector<double*> s_, rate_, h_s_, h_theta_;
  StateEquations::Workspace work_;
};

}  // namespace

std::unique_ptr<TimeIntegration> make_cvodes(const StateEquations& equations,
                                             const TimeOptions& options, std::vector<int> free) {
  return std::make_unique<Cvodes>(equations, options, std::move(free));
}

}  // namespace shaker::estimator
