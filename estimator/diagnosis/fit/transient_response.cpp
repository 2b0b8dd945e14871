#include "estimator/diagnosis/fit/internal/transient_response.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <stdexcept>

#include <fmt/format.h>

#include "estimator/diagnosis/records/internal/transient_run.hpp"
#include "estimator/math/dense.hpp"

namespace shaker::estimator::diagnosis {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr std::size_t kArcs = 32, kFewestInArc = 24;
constexpr int kMostRounds = 30;        // of closing the arcs
constexpr double kClosed = 1e-4;       // of a state's size: a linear correction does the rest
constexpr double kShort = 0.5;         // of the states' scales: a move of a second search
constexpr double kRises = 1.01;        // chi-squared that is more than that is a move too far
constexpr int kMostHalvings = 6;       // of moves after which there is no motion
constexpr double kJoined = 1e-2;       // of a state's size: the arcs meet
constexpr double kJumpsWithin = 1e-8;  // of the largest speed: the width of a jump
constexpr double kFast = 0.5, kMoving = 0.02;  // of the largest speed nearby, and of all
constexpr double kAtRest = 20.0;               // such widths: there friction has turned round

std::vector<int> free_of(const Model& model) {
  std::vector<int> free;
  for (int k = 0; k < model.parameter_count(); ++k) {
    const bool instrument = std::any_of(
        model.instruments().begin(), model.instruments().end(), [&](const Model::Term& t) {
          const auto count = static_cast<int>(t.effect->parameters().size());
          return k >= t.first_parameter && k < t.first_parameter + count;
        });
    if (!instrument && !model.parameters()[static_cast<std::size_t>(k)].fixed) free.push_back(k);
  }
  return free;
}

// True if the friction of an effect turns round over no more than `width`.
bool has_jump(const Model& model, double width) {
  const auto terms = model.terms();
  return std::any_of(terms.begin(), terms.end(), [&](const Model::Term& term) {
    const auto constants = term.effect->constants();
    for (std::size_t k = 0; k < constants.size(); ++k) {
      if (constants[k].width && constants[k].unit == "m/s" && term.constants[k] <= 1.01 * width)
        return true;
    }
    return false;
  });
}

}  // namespace

double width_of_jump(const SampledRun& run) {
  return kJumpsWithin * run.v.cwiseAbs().maxCoeff();
}

TransientResponse::TransientResponse(const Model& model, const RunDatum& datum)
    : model_(&model),
      run_(datum.sampled),
      datum_(datum),
      equations_(model),
      free_(free_of(model)),
      m_(equations_.states()),
      p_(static_cast<int>(free_.size())),
      shooting_(static_cast<std::size_t>(m_), static_cast<std::size_t>(m_ + p_)),
      transform_(datum.sampled->samples()),
      excitation_(excitation_of(*datum.sampled)) {
  for (Index i = 0; i < run_->samples(); ++i)
    times_.push_back((static_cast<double>(i) + 0.5) * run_->dt);
  scale_ = VectorXd::Ones(m_);
  for (int c = 0; c < model.mechanical(); ++c) {
    scale_[c] = std::max(run_->u.cwiseAbs().maxCoeff(), 1e-12);
    if (equations_.velocity_of(c) >= 0)
      scale_[equations_.velocity_of(c)] = std::max(run_->v.cwiseAbs().maxCoeff(), 1e-12);
  }
  if (has_jump(model, width_of_jump(*run_))) still_ = kAtRest * width_of_jump(*run_);
  cut();
}

// Neighbours share a sample: the end of one is the start of the next.
void TransientResponse::cut() {
  const std::size_t n = times_.size();
  const std::size_t length = std::max(kFewestInArc, (n + kArcs - 1) / kArcs);
  for (std::size_t first = 0; first + 1 < n;) {
    std::size_t last = std::min(first + length, n - 1);
    while (last < n - 1 && !may_begin_at(last, length))
      ++last;
    Arc arc;
    arc.times = std::span<const double>(times_).subspan(first, last - first + 1);
    arc.excitation = &excitation_;
    arc.start.assign(static_cast<std::size_t>(m_), 0.0);
    arcs_.push_back(std::move(arc));
    first_.push_back(first);
    first = last;
  }
  begin_from_data();
}

// Where friction jumps, an arc begins in motion: its derivatives over a start that is about to reverse
// or at rest are not the same on both sides.
bool TransientResponse::may_begin_at(std::size_t sample, std::size_t length) const {
  if (still_ == 0.0) return true;
  const auto at = static_cast<Index>(sample), around = static_cast<Index>(length);
  const Index from = std::max<Index>(at - around, 0), to = std::min(at + around, run_->v.size());
  const double local = run_->v.segment(from, to - from).cwiseAbs().maxCoeff();
  const double largest = run_->v.cwiseAbs().maxCoeff();
  return std::fabs(run_->v[at]) > std::max(kFast * local, kMoving * largest);
}

void TransientResponse::begin_from_data() {
  const int seen = model_->observed();
  const int speed = equations_.velocity_of(seen);
  for (std::size_t a = 0; a < arcs_.size(); ++a) {
    const auto i = static_cast<Index>(first_[a]);
    for (int c = 0; c < equations_.coordinates(); ++c)
      arcs_[a].start[static_cast<std::size_t>(c)] = model_->rest(c);
    for (int j = equations_.coordinates(); j < m_; ++j)
      arcs_[a].start[static_cast<std::size_t>(j)] = 0.0;
    arcs_[a].start[static_cast<std::size_t>(seen)] = run_->u[i];
    if (speed >= 0) arcs_[a].start[static_cast<std::size_t>(speed)] = run_->v[i];
  }
}

// A memory's scale is its largest value on the way from rest.
void TransientResponse::size_memories() {
  sized_ = true;
  for (int j = 0; j < m_; ++j) {
    if (!remembers(j)) continue;
    double largest = 0.0;
    for (const Arc& arc : arcs_) {
      for (auto at = static_cast<std::size_t>(j); at < arc.states.size();
           at += static_cast<std::size_t>(m_))
        largest = std::max(largest, std::fabs(arc.states[at]));
    }
    if (largest > 0.0) scale_[j] = largest;
  }
}

void TransientResponse::condense() {
  const auto m = static_cast<std::size_t>(m_), k = static_cast<std::size_t>(m_ + p_);
  std::vector<ArcEnd> ends;
  for (const Arc& arc : arcs_)
    ends.push_back(
        {&arc.states[arc.states.size() - m], &arc.sensitivities[arc.sensitivities.size() - m * k]});
  shooting_.condense(arcs_, ends, 1.0);
  gap_ = 0.0;
  for (std::size_t j = 0; j < shooting_.gaps().size(); ++j)
    gap_ = std::max(gap_, std::fabs(shooting_.gaps()[j]) / scale_[static_cast<Index>(j % m)]);
}

// Chi-squared of the samples.
double TransientResponse::cost() const {
  return whitened(datum_, datum_.response - transform_.analyse(seen_.value, datum_.response.size()))
      .squaredNorm();
}

// Moves all arcs' starts to meet, from the initial state that suits the data; returns the largest
// relative move.
double TransientResponse::correct() {
  MatrixXd all(seen_.value.size(), 1 + seen_.slopes.cols());
  all << seen_.value, seen_.slopes;
  const MatrixXd series = transform_.analyse(all, datum_.response.size());
  const MatrixXd of_start = series.middleCols(1, m_) * scale_.asDiagonal();
  const MatrixXd start = whitened(datum_, of_start);
  const MatrixXd over = whitened(datum_, series.rightCols(model_->parameter_count()));
  MatrixXd gram = start.transpose() * start;
  const VectorXd e = whitened(datum_, datum_.response - series.col(0));
  cost_ = e.squaredNorm();
  VectorXd towards = start.transpose() * e;
  // What the data say nothing of (a memory that fades at once) is near rest, also where the model is
  // far from them: what is left is no reason to begin elsewhere.
  const double ridge = 1e-12 * gram.diagonal().maxCoeff();
  const double left = cost_ / static_cast<double>(e.size());
  for (int j = 0; j < m_; ++j) {
    const double prior = remembers(j) ? std::max({1.0, ridge, left}) : ridge;
    gram(j, j) += prior;
    const double begun = arcs_[0].start[static_cast<std::size_t>(j)];
    if (remembers(j)) towards[j] -= prior * (begun - model_->rest(j)) / scale_[j];
  }
  const Ldlt factor(gram);
  const VectorXd step = factor.solve(towards);
  const MatrixXd suited = factor.solve(MatrixXd(start.transpose() * over));
  value_ = series.col(0) + of_start * step;
  jacobian_ = series.rightCols(model_->parameter_count()) - of_start * suited;
  const VectorXd taken = course_.next(step, gram, gap_ < kJoined);
  const auto moves = shooting_.moves();
  const MatrixXd first = moves.leftCols(m_) * scale_.asDiagonal();
  last_moves_ = first * taken - moves.col(m_ + p_);
  if (const double far = relative_size(last_moves_); far > longest_) {
    last_moves_ *= longest_ / far;
    course_.forget();
  }
  move_starts(arcs_, last_moves_);
  drift_ = moves.middleCols(m_, p_);
  for (int c = 0; c < p_; ++c)
    drift_.col(c) -= first * suited.col(free_[static_cast<std::size_t>(c)]);
  return relative_size(first * step - moves.col(m_ + p_));
}

double TransientResponse::relative_size(const VectorXd& moves) const {
  return (moves.reshaped(m_, moves.size() / m_).array().colwise() / scale_.array())
      .abs()
      .maxCoeff();
}

// Takes half of the last moves back.
void TransientResponse::shorten() {
  last_moves_ *= 0.5;
  move_starts(arcs_, -last_moves_);
  course_.forget();
}

// Newton's method on the arcs' starts. False where it does not come to an end.
bool TransientResponse::close(const std::vector<double>& theta) {
  double before = 1e300;
  int worse = 0, halved = 0;
  bool was_joined = false;
  double least = 0.0;
  course_.forget();
  for (int round = 0; round < kMostRounds; ++round) {
    if (!integrate(theta) && !(round == 0 && !solved_ && integrate_finer(theta))) {
      if (round > 0 && ++halved <= kMostHalvings) {
        shorten();
        continue;
      }
      if (round > 0 || !solved_) return false;
      begin_from_data();
      solved_ = false;
      continue;
    }
    condense();
    if (!see(theta)) return false;
    const bool joined = gap_ < kJoined;
    if (joined && was_joined && halved < kMostHalvings && cost() > kRises * least) {
      ++halved;
      shorten();
      continue;
    }
    const double moved = correct();
    was_joined = joined;
    least = cost_;
    if (!value_.allFinite() || !jacobian_.allFinite()) return false;
    if (moved < kClosed) {
      solved_ = true;
      theta_ = theta;
      return true;
    }
    worse = moved > 0.9 * before ? worse + 1 : 0;
    if (worse > 2) break;
    before = moved;
  }
  return false;
}

// True if the measured extremes are strokes that the model may have. A damper that could not have
// been where it was is none, and the next search could not begin from the data.
bool TransientResponse::may_be_where_measured(const std::vector<double>& theta) const {
  if (!model_->instruments().empty()) return true;
  constexpr int kPoints = 8;
  StateEquations::Workspace work;
  AlignedVector store(static_cast<std::size_t>((2 * m_ + 1) * kPoints));
  std::vector<double*> s, rate;
  for (int j = 0; j < m_; ++j) {
    s.push_back(&store[static_cast<std::size_t>(j * kPoints)]);
    rate.push_back(&store[static_cast<std::size_t>((m_ + j) * kPoints)]);
    std::fill_n(s.back(), kPoints, j < equations_.coordinates() ? model_->rest(j) : 0.0);
  }
  const double ends[] = {run_->u.minCoeff(), run_->u.maxCoeff()};
  for (int i = 0; i < kPoints; ++i)
    s[static_cast<std::size_t>(model_->observed())][i] = ends[i % 2];
  return equations_.rates(kPoints, s.data(), &store[static_cast<std::size_t>(2 * m_ * kPoints)],
                          theta.data(), work, rate.data(), nullptr, nullptr);
}

TransientResponse::Solution TransientResponse::present() const {
  Solution present{solved_, theta_, {}, value_, jacobian_, drift_};
  for (const Arc& arc : arcs_)
    present.starts.push_back(arc.start);
  return present;
}

void TransientResponse::take(const Solution& solution) {
  solved_ = solution.solved;
  theta_ = solution.theta;
  for (std::size_t a = 0; a < arcs_.size(); ++a)
    arcs_[a].start = solution.starts[a];
  value_ = solution.value;
  jacobian_ = solution.jacobian;
  drift_ = solution.drift;
  stale_ = true;
}

bool TransientResponse::at(const std::vector<double>& theta) {
  if (!may_be_where_measured(theta)) return false;
  const bool first = !solved_;
  if (!first && theta == theta_) {
    if (stale_) stale_ = !integrate(theta);
    return !stale_;
  }
  const Solution last = present();
  const auto give_up = [&] {
    take(last);
    return false;
  };
  if (solved_) {
    VectorXd change(p_);
    for (int c = 0; c < p_; ++c) {
      const auto k = static_cast<std::size_t>(free_[static_cast<std::size_t>(c)]);
      change[c] = theta[k] - theta_[k];
    }
    VectorXd moved = drift_ * change;
    // A long way is no straight line: better from where it was.
    for (Index a = 0; a < moved.size(); a += m_) {
      if (relative_size(moved.segment(a, m_)) > 0.5) moved.segment(a, m_).setZero();
    }
    move_starts(arcs_, moved);
  }
  if (!close(theta)) {
    give_up();
    if (!patient_ || !first) return false;
    // From the data the whole way may be too far: Newton's method in short moves.
    longest_ = kShort;
    const bool closed = close(theta);
    longest_ = std::numeric_limits<double>::infinity();
    if (!closed) return give_up();
  }
  if (!steps_settled_) settle_steps(theta);
  stale_ = false;
  return solved_ || give_up();
}

MatrixXd TransientResponse::states() const {
  MatrixXd all(run_->samples(), m_);
  for (std::size_t a = 0; a < arcs_.size(); ++a) {
    for (std::size_t i = 0; i < arcs_[a].times.size(); ++i) {
      for (int j = 0; j < m_; ++j)
        all(static_cast<Index>(first_[a] + i), j) =
            arcs_[a].states[i * static_cast<std::size_t>(m_) + static_cast<std::size_t>(j)];
    }
  }
  return all;
}

double TransientResponse::start_of(const std::string& state) const {
  const auto& names = equations_.names();
  const auto found = std::find(names.begin(), names.end(), state);
  if (found == names.end()) throw std::invalid_argument("the model has no state " + state);
  return arcs_.front().start[static_cast<std::size_t>(found - names.begin())];
}

void TransientResponse::start_from(const TransientResponse& other) {
  if (other.run_ != run_ || !other.solved_) return;
  least_steps_ = other.least_steps_;
  steps_settled_ = other.steps_settled_;
  const auto& mine = equations_.names();
  const auto& theirs = other.equations_.names();
  const bool alike = first_ == other.first_;
  const MatrixXd course = alike ? MatrixXd() : other.states();
  for (std::size_t j = 0; j < mine.size(); ++j) {
    const auto found = std::find(theirs.begin(), theirs.end(), mine[j]);
    if (found == theirs.end()) continue;
    const auto from = static_cast<std::size_t>(found - theirs.begin());
    for (std::size_t a = 0; a < arcs_.size(); ++a)
      arcs_[a].start[j] = alike ? other.arcs_[a].start[from]
                                : course(static_cast<Index>(first_[a]), static_cast<Index>(from));
  }
}

}  // namespace shaker::estimator::diagnosis
