#include "estimator/fit/internal/batch_estimation.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <stdexcept>
#include <thread>

#include <fmt/format.h>

#include "estimator/fit/internal/estimation_impl.hpp"
#include "estimator/math/damped_minimum.hpp"
#include "estimator/math/lane_cholesky.hpp"

namespace shaker::estimator {

// Workspace of one thread. Its Estimator holds the tables of the run, solves the small linear
// systems of one lane at a time, and fits the records that do not converge in the batch.
struct BatchEstimator::Worker {
  Worker(const Model& model, const RunData& given, const EstimationOptions& options)
      : run(given), estimator(model, {given}, options), impl(*estimator.impl_) {
    const RunState& state = impl.data.runs[0];
    if (!PeriodicLanes::possible(model, options.grid) || options.method != Method::lifted ||
        state.every == 0 || state.harmonic() || !state.data.sample_weight.empty())
      return;
    pack = std::make_unique<RunPack>(model, impl.solutions.systems[0].options(),
                                     static_cast<int>(given.displacement.size()),
                                     !impl.solutions.coarse.empty());
    pack->runs.assign(kLanes, 0);
    pack->load(impl.data, impl.solutions.systems, impl.solutions.coarse);
    coefficients.resize(state.coefficients.size() * kLanes);
    const std::size_t q = impl.data.free.size();
    simple = !impl.data.priors && options.noise == 0.0 && !(given.excitation_error > 0.0) && q > 0;
    gram.resize(q * (q + 1) / 2 * kLanes);
    for (AlignedVector* vector : {&gradient, &scratch, &inverse})
      vector->resize(q * kLanes);
  }

  void fit_pack(std::size_t first_record, std::size_t count, const std::vector<double>& theta,
                BatchFit& out);
  void start(const std::vector<double>& theta);
  void steps(bool approach);
  // The questions of the loop, of all lanes that move: math/damped_minimum.hpp.
  bool compute_step(double lambda);
  bool converged_before_step() const { return false; }
  bool step_is_successful();
  bool converged_after_success() const { return moving == 0; }
  bool converged_after_failure() const { return false; }
  PeriodicLanes& level() const { return pack->level(on_coarse); }
  unsigned step_batch();
  unsigned finish_batch(unsigned arrived);
  bool step_lane(std::size_t lane);
  void judge_lane(std::size_t lane);
  void equations_of(std::size_t lane);
  bool finish_lane(std::size_t lane);
  void store(std::size_t record) const;
  bool is(unsigned mask, std::size_t lane) const { return (mask >> lane & 1U) != 0; }

  RunData run;
  Estimator estimator;
  Estimator::Impl& impl;
  std::unique_ptr<RunPack> pack;  // null: records are fitted one by one
  AlignedVector coefficients;
  bool simple = false;  // all lanes' normal equations and errors can be computed together
  AlignedVector gram, gradient, scratch, inverse;
  // State of the present batch.
  std::size_t first = 0, records = 0;
  BatchFit* out = nullptr;
  bool on_coarse = false;
  int iteration = 0;                             // on one grid
  unsigned moving = 0, failed = 0, arrived = 0;  // a bit for each lane
  std::array<double, kLanes> step{};
  std::array<int, kLanes> iterations{};
  std::array<LiftedProgress, kLanes> progress;
};

BatchEstimator::BatchEstimator(const Model& model, const RunData& run, EstimationOptions options,
                               int threads)
    : points_(run.displacement.size()) {
  if (points_ == 0 || !run.tau.empty() || !run.harmonics.empty())
    throw std::invalid_argument("a batch needs a run of samples on equal steps");
  options.keep_iterates = false;
  for (int t = 0; t < std::max(1, threads); ++t)
    workers_.push_back(std::make_unique<Worker>(model, run, options));
  fit_.parameters = static_cast<std::size_t>(model.parameter_count());
}

BatchEstimator::~BatchEstimator() = default;

const BatchFit& BatchEstimator::fit(std::span<const double> records,
                                    const std::vector<double>& start) {
  if (records.size() % points_ != 0)
    throw std::invalid_argument(
        fmt::format("{} samples are no whole number of records of {}", records.size(), points_));
  if (start.size() != fit_.parameters)
    throw std::invalid_argument(
        fmt::format("the start has {} parameters, the model {}", start.size(), fit_.parameters));
  const auto bad =
      std::find_if(records.begin(), records.end(), [](double y) { return !std::isfinite(y); });
  if (bad != records.end())
    throw std::invalid_argument(
        fmt::format("record {}: a sample is missing or not finite; leave such records out",
                    static_cast<std::size_t>(bad - records.begin()) / points_ + 1));
  records_ = records;
  start_ = start;
  const std::size_t count = records.size() / points_;
  fit_.records = count;
  fit_.theta.resize(count * fit_.parameters);
  fit_.standard_error.resize(count * fit_.parameters);
  fit_.sum_of_squares.resize(count);
  fit_.noise.resize(count);
  fit_.status.resize(count);
  fit_.iterations.resize(count);
  // Each thread takes the next batch when it has finished one: a shared core does less.
  std::atomic<std::size_t> next = 0;
  const auto work = [&](std::size_t thread) {
    for (std::size_t first = next.fetch_add(kLanes); first < count; first = next.fetch_add(kLanes))
      fit_pack(*workers_[thread], first);
  };
  if (workers_.size() == 1) {
    work(0);
    return fit_;
  }
  std::vector<std::jthread> threads;
  for (std::size_t t = 1; t < workers_.size(); ++t)
    threads.emplace_back(work, t);
  work(0);
  threads.clear();  // joins
  return fit_;
}

void BatchEstimator::fit_pack(Worker& worker, std::size_t first) {
  const std::size_t count = std::min<std::size_t>(kLanes, fit_.records - first);
  const auto record = [&](std::size_t i) { return records_.subspan(i * points_, points_); };
  if (worker.pack) {
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      const auto data = record(first + std::min(lane, count - 1));
      for (std::size_t j = 0; j < points_; ++j)
        worker.pack->data[kLanes * j + lane] = data[j];
    }
    worker.fit_pack(first, count, start_, fit_);
  } else {
    worker.failed = kAllLanes;
  }
  for (std::size_t lane = 0; lane < count; ++lane) {
    if (!worker.is(worker.failed, lane)) continue;
    const auto data = record(first + lane);
    std::copy(data.begin(), data.end(), worker.run.displacement.begin());
    worker.estimator.update_run(0, worker.run);
    worker.estimator.fit(start_);
    worker.out = &fit_;
    worker.store(first + lane);
  }
}

void BatchEstimator::Worker::fit_pack(std::size_t first_record, std::size_t count,
                                      const std::vector<double>& theta, BatchFit& results) {
  first = first_record;
  records = count;
  out = &results;
  failed = 0;
  iterations.fill(0);
  progress.fill({});
  start(theta);
  if (pack->coarse) {
    steps(true);
    pack->fine.interpolate_from(*pack->coarse);
    std::copy_n(pack->coarse->theta(), kLanes * theta.size(), pack->fine.theta());
  }
  steps(false);
}

// The first harmonics of each record are the start of its state.
void BatchEstimator::Worker::start(const std::vector<double>& theta) {
  const RunState& state = impl.data.runs[0];
  PeriodicLanes& level = pack->coarse ? *pack->coarse : pack->fine;
  const std::size_t terms = state.coefficients.size();
  Lanes* c = as_lanes(coefficients.data());
  std::fill_n(c, terms, Lanes{});
  for (std::size_t j = 0; j < run.displacement.size(); ++j) {
    for (std::size_t t = 0; t < terms; ++t)
      c[t] += state.analysis[j * terms + t] * as_lanes(pack->data.data())[j];
  }
  const auto n = static_cast<std::size_t>(level.points());
  const std::size_t every = state.synthesis.size() / terms / n;
  for (std::size_t i = 0; i < n; ++i) {
    Lanes sum{};
    for (std::size_t t = 0; t < terms; ++t)
      sum += state.synthesis[i * every * terms + t] * c[t];
    as_lanes(level.state())[i] = sum;
  }
  for (std::size_t k = 0; k < theta.size(); ++k)
    std::fill_n(level.theta() + kLanes * k, kLanes, theta[k]);
  level.begin();
}

// Each lane moves until it converges and then stands still, independently of the other lanes.
void BatchEstimator::Worker::steps(bool approach) {
  on_coarse = approach;
  iteration = 0;
  moving = kAllLanes & ~failed;
  for (LiftedProgress& lane : progress)
    lane.begin_grid();
  NoDamping full;
  if (moving != 0) minimise_damped(*this, full, impl.data.options.max_iterations);
  failed |= moving;
}

bool BatchEstimator::Worker::compute_step(double /*lambda*/) {
  PeriodicLanes& lanes = level();
  ++iteration;
  const unsigned admissible = lanes.linearise(moving);
  failed |= moving & ~(admissible & lanes.solve_step(moving));
  lanes.sum_products(pack->data.data(), static_cast<int>(run.displacement.size()),
                     on_coarse ? 1 : pack->every, pack->products.data());
  std::fill(pack->delta.begin(), pack->delta.end(), 0.0);
  const unsigned stepped = step_batch();
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    if (is(moving & ~failed & ~stepped, lane) && !step_lane(lane)) failed |= 1U << lane;
  }
  moving &= ~failed;
  return true;
}

bool BatchEstimator::Worker::step_is_successful() {
  level().advance(pack->delta.data(), pack->newton_step.data(), moving);
  arrived = 0;
  const unsigned before = moving;
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    if (is(moving, lane)) judge_lane(lane);
  }
  if (on_coarse && moving != before) level().learn_jumps(before & ~moving & ~failed);
  const unsigned finished = finish_batch(arrived);
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    if (is(arrived & ~finished, lane) && !finish_lane(lane)) failed |= 1U << lane;
  }
  moving &= ~failed;
  return true;
}

// Computes the steps of all lanes together. Returns a bit for each lane whose step stays inside
// its bounds. step_lane treats the other lanes.
unsigned BatchEstimator::Worker::step_batch() {
  if (!simple) return 0;
  const int q = static_cast<int>(impl.data.free.size());
  const Lanes* product = as_lanes(pack->products.data());
  Lanes* matrix = as_lanes(gram.data());
  Lanes* change = as_lanes(gradient.data());
  for (int k = 0; k < q; ++k) {
    const int row = 1 + impl.data.free[static_cast<std::size_t>(k)];
    change[k] = product[packed(row, 0)];
    for (int l = 0; l <= k; ++l)
      matrix[packed(k, l)] = product[packed(row, 1 + impl.data.free[static_cast<std::size_t>(l)])];
  }
  unsigned good = factorise_lanes(q, matrix);
  substitute_lanes(q, matrix, change);
  const Lanes* theta = as_lanes(level().theta());
  LaneMask going;  // lanes that stand still or failed must not move
  for (std::size_t lane = 0; lane < kLanes; ++lane)
    going[lane] = is(moving & good, lane) ? -1 : 0;
  Lanes worst{};
  for (int k = 0; k < q; ++k) {
    const int parameter = impl.data.free[static_cast<std::size_t>(k)];
    const ModelParameter& p = impl.data.model.parameters()[static_cast<std::size_t>(parameter)];
    const Lanes now = theta[parameter];
    const Lanes target = now + change[k];
    good &= bits_of((now > p.lower) & (now < p.upper) & (target >= p.lower) & (target <= p.upper));
    as_lanes(pack->delta.data())[parameter] = chosen(going, change[k], Lanes{});
    const Lanes before = magnitude(now), after = magnitude(target);
    const Lanes size = chosen(before > after, before, after);
    const Lanes move = magnitude(change[k]);
    const Lanes relative = move / chosen(size > 1e-12, size, 1e-12);
    worst = chosen(relative > worst, relative, worst);
  }
  for (std::size_t lane = 0; lane < kLanes; ++lane)
    step[lane] = worst[lane];
  return good;
}

// Stores the results of the lanes that converged, from the factors of their last step. Returns
// a bit for each lane that is certainly well conditioned: with a unit diagonal of A,
// q trace(A^-1) is an upper bound of the condition number of A. finish_lane treats the others.
unsigned BatchEstimator::Worker::finish_batch(unsigned lanes) {
  constexpr double kMostCondition = 1e8;
  const double degrees =
      static_cast<double>(impl.data.observations) - static_cast<double>(impl.data.free.size());
  if (lanes == 0 || !simple || !(degrees > 0.0)) return 0;
  const int q = static_cast<int>(impl.data.free.size());
  inverse_diagonal_lanes(q, as_lanes(gram.data()), as_lanes(scratch.data()),
                         as_lanes(inverse.data()));
  Lanes trace{};
  for (int k = 0; k < q; ++k) {
    const int row = 1 + impl.data.free[static_cast<std::size_t>(k)];
    trace += as_lanes(inverse.data())[k] * as_lanes(pack->products.data())[packed(row, row)];
  }
  Lanes sum{};
  for (std::size_t j = 0; j < run.displacement.size(); ++j) {
    const std::size_t point = j * static_cast<std::size_t>(pack->every);
    const Lanes left = as_lanes(pack->data.data())[j] - as_lanes(pack->fine.state())[point];
    sum += left * left;
  }
  unsigned done = 0;
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    if (!is(lanes, lane) || !(q * trace[lane] < kMostCondition)) continue;
    done |= 1U << lane;
    if (lane >= records) continue;
    const std::size_t record = first + lane;
    const std::size_t p = out->parameters;
    const double weight = pack->weight[lane];
    const double total = weight * sum[lane] + impl.data.total_scatter;
    const double noise = std::sqrt(total / degrees);
    std::fill_n(&out->standard_error[record * p], p, 0.0);
    for (std::size_t k = 0; k < p; ++k)
      out->theta[record * p + k] = pack->fine.theta()[kLanes * k + lane];
    for (std::size_t k = 0; k < impl.data.free.size(); ++k)
      out->standard_error[record * p + static_cast<std::size_t>(impl.data.free[k])] =
          noise * std::sqrt(inverse[kLanes * k + lane] / weight);
    out->sum_of_squares[record] = total;
    out->noise[record] = noise;
    out->status[record] = FitStatus::converged;
    out->iterations[record] = iterations[lane];
  }
  return done;
}

void BatchEstimator::Worker::equations_of(std::size_t lane) {
  const std::size_t size = 1 + impl.fit.theta.size();
  const double* product = pack->products.data() + lane;
  for (std::size_t k = 0; k < size; ++k) {
    for (std::size_t l = 0; l <= k; ++l, product += kLanes)
      impl.equations.products[k * size + l] = pack->weight[lane] * *product;
  }
  impl.equations.form(impl.fit.theta);
}

bool BatchEstimator::Worker::step_lane(std::size_t lane) {
  const double* theta = level().theta() + lane;
  for (std::size_t k = 0; k < impl.fit.theta.size(); ++k)
    impl.fit.theta[k] = theta[kLanes * k];
  equations_of(lane);
  if (!impl.equations.step(impl.fit.theta, 0.0)) return false;
  for (std::size_t k = 0; k < impl.equations.delta_full.size(); ++k)
    pack->delta[kLanes * k + lane] = impl.equations.delta_full[k];
  step[lane] = impl.equations.relative_step(impl.fit.theta);
  return true;
}

// Decides whether this lane has converged, continues or has failed, as Estimator's lifted method
// does.
void BatchEstimator::Worker::judge_lane(std::size_t lane) {
  double* theta = level().theta() + lane;
  for (std::size_t k = 0; k < impl.fit.theta.size(); ++k)
    theta[kLanes * k] += pack->delta[kLanes * k + lane];
  ++iterations[lane];
  const double newton = pack->newton_step[lane];
  const double size = std::max(step[lane], newton);
  const unsigned bit = 1U << lane;
  using Next = LiftedProgress::Next;
  const Next next = progress[lane].after_step(size, newton, iteration, on_coarse, true,
                                              impl.data.options.tolerance);
  if (next == Next::failed) failed |= bit;
  if (next == Next::finer_grid || next == Next::done) moving &= ~bit;
  if (next == Next::done) arrived |= bit;
}

bool BatchEstimator::Worker::finish_lane(std::size_t lane) {
  if (lane >= records) return true;
  equations_of(lane);
  for (std::size_t k = 0; k < impl.fit.theta.size(); ++k)
    impl.fit.theta[k] = pack->fine.theta()[kLanes * k + lane];
  double sum = 0.0;
  for (std::size_t j = 0; j < run.displacement.size(); ++j) {
    const auto point = j * static_cast<std::size_t>(pack->every);
    const double left = pack->data[kLanes * j + lane] - pack->fine.state()[kLanes * point + lane];
    sum += left * left;
  }
  impl.fit.status = FitStatus::converged;
  impl.fit.iterations = iterations[lane];
  if (!impl.inference.finish_from(pack->weight[lane] * sum)) return false;
  store(first + lane);
  return true;
}

void BatchEstimator::Worker::store(std::size_t record) const {
  const Fit& fit = impl.fit;
  std::copy(fit.theta.begin(), fit.theta.end(), &out->theta[record * out->parameters]);
  std::copy(fit.standard_error.begin(), fit.standard_error.end(),
            &out->standard_error[record * out->parameters]);
  out->sum_of_squares[record] = fit.sum_of_squares;
  out->noise[record] = fit.noise;
  out->status[record] = fit.status;
  out->iterations[record] = fit.iterations;
}

}  // namespace shaker::estimator
