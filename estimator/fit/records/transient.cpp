#include "estimator/fit/records/transient.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <fmt/format.h>

#include "estimator/fit/records/internal/transient_impl.hpp"

namespace shaker::estimator {
namespace {

constexpr std::size_t kShort = 400;       // samples: shorter records are one trajectory
constexpr std::size_t kMostArcs = 4096;   // in a record, unless the options ask for more
constexpr std::size_t kFewestInArc = 24;  // samples
constexpr std::size_t kRound = 8;         // samples in an arc are a multiple of it
constexpr double kNaturalTimes = 1.2;     // in an arc
constexpr std::size_t kSlopeSamples = 4;  // to either side, for a velocity from the data
constexpr std::size_t kMostSlopeSamples = 64;
constexpr double kSlopeTimes = 0.3;    // natural times to either side, likewise
constexpr std::size_t kSeveral = 300;  // places at which the natural time is found
constexpr double kEvenTimes = 1e-6;    // of a step
constexpr double kSmallestScale = 1e-12;

std::string name_of(const TransientRecord& record, std::size_t index) {
  return record.name.empty() ? fmt::format("record {}", index + 1) : record.name;
}

void check(const TransientRecord& record, std::size_t index, std::size_t states) {
  const auto reject = [&](const std::string& why) {
    throw std::invalid_argument(fmt::format("{}: {}", name_of(record, index), why));
  };
  const std::size_t n = record.t.size();
  if (record.displacement.size() != n)
    reject(fmt::format("{} times for {} displacements", n, record.displacement.size()));
  if (n < 2) reject(fmt::format("{} samples; at least 2 are needed", n));
  for (std::size_t i = 0; i < n; ++i) {
    if (!std::isfinite(record.t[i]) || !std::isfinite(record.displacement[i]))
      reject(fmt::format("sample {} is not a finite number; leave it out", i + 1));
    if (i > 0 && !(record.t[i] > record.t[i - 1]))
      reject(fmt::format("time does not increase: t = {:.9g} s is followed by {:.9g} s (sample {})",
                         record.t[i - 1], record.t[i], i + 1));
  }
  if (!(record.weight > 0.0) || !std::isfinite(record.weight))
    reject(fmt::format("the weight is {}; it must be above 0", record.weight));
  if (record.start && !(*record.start <= record.t[0]))
    reject(fmt::format("its initial conditions hold at t = {} s, after the first sample at {} s",
                       *record.start, record.t[0]));
  if (!record.initial.empty() && record.initial.size() != states)
    reject(fmt::format("{} initial conditions; the model has {} states", record.initial.size(),
                       states));
  for (const InitialState& s : record.initial) {
    if (!std::isfinite(s.value) || !(s.value >= s.lower && s.value <= s.upper))
      reject(fmt::format("an initial condition is {}, outside its bounds [{}, {}]", s.value,
                         s.lower, s.upper));
  }
}

// Fits a polynomial by least squares to `half` samples to either side of `at`: a parabola, or a cubic
// through many. Returns value and slope there.
std::pair<double, double> local_fit(const std::vector<double>& t, const std::vector<double>& y,
                                    std::size_t at, std::size_t half) {
  const std::size_t first = at > half ? at - half : 0;
  const std::size_t last = std::min(t.size(), at + half + 1);
  const int terms = std::min(half > kSlopeSamples ? 4 : 3, static_cast<int>(last - first));
  const double span = std::max(t[last - 1] - t[first], 1e-300);
  double powers[7] = {}, moments[4] = {};
  for (std::size_t i = first; i < last; ++i) {
    const double x = (t[i] - t[at]) / span, value = y[i] - y[at];
    double power = 1.0;
    for (int j = 0; j < 7; ++j, power *= x) {
      powers[j] += power;
      if (j < 4) moments[j] += power * value;
    }
  }
  Eigen::Matrix4d a = Eigen::Matrix4d::Identity();
  Eigen::Vector4d b = Eigen::Vector4d::Zero();
  for (int j = 0; j < terms; ++j) {
    b[j] = moments[j];
    for (int k = 0; k < terms; ++k)
      a(j, k) = powers[j + k];
  }
  const Eigen::Vector4d c = a.ldlt().solve(b);
  return {y[at] + c[0], terms > 1 ? c[1] / span : 0.0};
}

std::size_t slope_samples(double natural_time, double step) {
  const double wanted = kSlopeTimes * natural_time / step;
  return std::clamp(static_cast<std::size_t>(std::min(wanted, 1e6)), kSlopeSamples,
                    kMostSlopeSamples);
}

// The size of the motion over that of its velocity: 1 / omega of an oscillation. The velocity is
// found over a share of that time, lest it be the noise's.
double natural_time_of(const std::vector<double>& t, const std::vector<double>& y) {
  const std::size_t n = t.size(), apart = std::max<std::size_t>(1, n / kSeveral);
  const double step = (t.back() - t.front()) / static_cast<double>(n - 1);
  double mean = 0.0, motion = 0.0, time = 0.0;
  for (const double value : y)
    mean += value / static_cast<double>(n);
  for (const double value : y)
    motion += (value - mean) * (value - mean) / static_cast<double>(n);
  for (int round = 0; round < 5; ++round) {
    double squares = 0.0;
    std::size_t count = 0;
    for (std::size_t at = apart / 2; at < n; at += apart, ++count)
      squares += std::pow(local_fit(t, y, at, slope_samples(time, step)).second, 2);
    const double found = squares > 0.0 ? std::sqrt(motion * static_cast<double>(count) / squares)
                                       : t.back() - t.front();
    if (found < 1.1 * time) break;
    time = found;
  }
  return time;
}

// The step of times that are even, else 0.
double even_step(const std::vector<double>& t) {
  const double step = (t.back() - t.front()) / static_cast<double>(t.size() - 1);
  for (std::size_t i = 0; i < t.size(); ++i) {
    if (std::fabs(t[i] - t[0] - step * static_cast<double>(i)) > kEvenTimes * step) return 0.0;
  }
  return step;
}

std::vector<int> free_of(const Model& model) {
  std::vector<int> free;
  for (int k = 0; k < model.parameter_count(); ++k) {
    if (!model.parameters()[static_cast<std::size_t>(k)].fixed) free.push_back(k);
  }
  return free;
}

}  // namespace

TransientEstimator::Impl::Impl(const Model& model_, std::vector<TransientRecord> given,
                               TransientOptions options_)
    : model(model_),
      equations(model_),
      options(options_),
      m(static_cast<std::size_t>(equations.states())),
      free(free_of(model_)),
      information(0) {
  if (given.empty()) throw std::invalid_argument("there are no records to estimate from");
  integration = TimeIntegration::make(equations, options.time, free);
  for (const int k : free) {
    const ModelParameter& p = model.parameters()[static_cast<std::size_t>(k)];
    unknowns.push_back({p.lower, p.upper, 0.0});
  }
  for (std::size_t i = 0; i < given.size(); ++i)
    add_record(std::move(given[i]), i);
  information = SquareRootInformation(static_cast<Eigen::Index>(unknowns.size()));
  set_prior();
  fit.theta = model.start();
}

void TransientEstimator::Impl::add_record(TransientRecord given, std::size_t number) {
  check(given, number, m);
  RecordState record;
  record.data = std::move(given);
  record.times = record.data.t;
  if (record.data.start && *record.data.start < record.times[0]) {
    record.times.insert(record.times.begin(), *record.data.start);
    record.offset = 1;
  }
  record.initial = record.data.initial;
  const auto& y = record.data.displacement;
  const auto [low, high] = std::minmax_element(y.begin(), y.end());
  double fastest = 0.0;
  for (std::size_t i = 1; i < y.size(); ++i)
    fastest =
        std::max(fastest, std::fabs(y[i] - y[i - 1]) / (record.data.t[i] - record.data.t[i - 1]));
  record.scale.assign(m, std::max({std::fabs(*low), std::fabs(*high), kSmallestScale}));
  for (int e = 0; e < equations.coordinates(); ++e) {
    if (equations.velocity_of(e) >= 0)
      record.scale[static_cast<std::size_t>(equations.velocity_of(e))] =
          std::max(fastest, kSmallestScale);
  }
  record.step = even_step(record.times);
  if (record.times.size() > kShort) record.natural_time = natural_time_of(record.data.t, y);
  observations += static_cast<double>(y.size());
  for (const double value : y)
    data_size += record.data.weight * value * value;
  add_unknowns(record);
  records.push_back(std::move(record));
}

void TransientEstimator::Impl::add_unknowns(RecordState& record) {
  record.unknown.assign(m, -1);
  for (std::size_t j = 0; j < m; ++j) {
    if (!record.initial.empty() && record.initial[j].known) continue;
    record.unknown[j] = static_cast<int>(unknowns.size());
    const InitialState none;
    const InitialState& said = record.initial.empty() ? none : record.initial[j];
    unknowns.push_back({said.lower, said.upper, record.scale[j]});
  }
}

// Neighbouring arcs share a node: the end of one is the start of the next. The datum there belongs
// to the next one.
void TransientEstimator::Impl::cut_into_arcs(std::size_t index, std::size_t segment) {
  RecordState& record = records[index];
  const std::size_t n = record.times.size();
  if (segment == 0 && n <= kShort) segment = n;
  if (segment == 0) {
    const double step = (record.times.back() - record.times.front()) / static_cast<double>(n - 1);
    const double wanted = kNaturalTimes * record.natural_time / step;
    segment = static_cast<std::size_t>(std::clamp(wanted, 1.0 * kFewestInArc, 1.0 * double(n)));
    segment = std::max(segment, (n + kMostArcs - 1) / kMostArcs) / kRound * kRound;
  }
  record.first_arc = arcs.size();
  for (std::size_t first = 0; first + 1 < n; first += segment) {
    const std::size_t end = std::min(n - 1, first + segment);
    Arc arc;
    arc.times = std::span<const double>(record.times).subspan(first, end - first + 1);
    arc.excitation = &record.data.excitation;
    arc.start.assign(m, 0.0);
    for (int e = 0; e < equations.coordinates(); ++e)
      arc.start[static_cast<std::size_t>(e)] = model.rest(e);
    arc.first_measured = first == 0 ? record.offset : 0;
    const std::size_t from = first + arc.first_measured, to = end + (end + 1 == n ? 1 : 0);
    arc.measured =
        std::span<const double>(record.data.displacement).subspan(from - record.offset, to - from);
    arcs.push_back(std::move(arc));
    record_of.push_back(index);
    first_node.push_back(first);
  }
  record.arcs = arcs.size() - record.first_arc;
}

void TransientEstimator::Impl::cut(std::size_t segment) {
  if (cut_as == segment) return;
  cut_as = segment;
  arcs.clear();
  record_of.clear();
  first_node.clear();
  for (std::size_t index = 0; index < records.size(); ++index) {
    cut_into_arcs(index, std::min(segment, records[index].times.size()));
    begin_from_data(index);
  }
  data_starts = present_starts();
}

void TransientEstimator::Impl::begin(const std::vector<double>& start, std::size_t segment) {
  cut(segment);
  fit.status = FitStatus::not_converged;
  fit.iterations = 0;
  shrinking = {};
  restore(start, data_starts);
  for (std::size_t index = 0; index < records.size(); ++index) {
    if (records[index].arcs > 1) simulate_starts(index);
  }
  shooting.assign(records.size(), Shooting(m, m + free.size()));
}

// The data give the observed coordinate at every segment's start, and its velocity by a local fit.
void TransientEstimator::Impl::begin_from_data(std::size_t index) {
  RecordState& record = records[index];
  const auto seen = static_cast<std::size_t>(model.observed());
  const int velocity = equations.velocity_of(model.observed());
  const auto n = static_cast<double>(record.times.size() - 1);
  const std::size_t half =
      slope_samples(record.natural_time, (record.times.back() - record.times.front()) / n);
  for (std::size_t a = record.first_arc; a < record.first_arc + record.arcs; ++a) {
    const std::size_t node = first_node[a];
    const std::size_t datum = node >= record.offset ? node - record.offset : 0;
    const auto [value, slope] = local_fit(record.data.t, record.data.displacement, datum, half);
    arcs[a].start[seen] = value;
    if (velocity >= 0) arcs[a].start[static_cast<std::size_t>(velocity)] = slope;
  }
  if (record.initial.empty()) return;
  for (std::size_t j = 0; j < m; ++j)
    arcs[record.first_arc].start[j] = record.initial[j].value;
}

// The other states come from a simulation with the start's parameters, if it succeeds.
void TransientEstimator::Impl::simulate_starts(std::size_t index) {
  RecordState& record = records[index];
  if (m <= 2) return;
  Arc whole;
  whole.times = record.times;
  whole.excitation = &record.data.excitation;
  whole.start = arcs[record.first_arc].start;
  const IntegrationReport report = integration->run({&whole, 1}, fit.theta, false);
  if (!report.ok) return;
  const int seen = model.observed();
  for (std::size_t a = record.first_arc + 1; a < record.first_arc + record.arcs; ++a) {
    for (std::size_t j = 0; j < m; ++j) {
      const int state = static_cast<int>(j);
      if (state != seen && state != equations.velocity_of(seen))
        arcs[a].start[j] = whole.states[first_node[a] * m + j];
    }
  }
}

TransientEstimator::TransientEstimator(const Model& model, std::vector<TransientRecord> records,
                                       TransientOptions options)
    : impl_(std::make_unique<Impl>(model, std::move(records), options)) {}
TransientEstimator::~TransientEstimator() = default;
TransientEstimator::TransientEstimator(TransientEstimator&&) noexcept = default;
TransientEstimator& TransientEstimator::operator=(TransientEstimator&&) noexcept = default;

const TransientFit& TransientEstimator::last() const {
  return impl_->fit;
}
const StateEquations& TransientEstimator::equations() const {
  return impl_->equations;
}

std::vector<double> TransientEstimator::states(std::size_t index) const {
  impl_->keep();
  const Impl& impl = *impl_;
  const RecordState& record = impl.records.at(index);
  std::vector<double> out;
  for (std::size_t a = record.first_arc; a < record.first_arc + record.arcs; ++a) {
    const auto& from = impl.arcs[a].states;
    const bool last = a + 1 == record.first_arc + record.arcs;
    const std::size_t skip = a == record.first_arc ? record.offset * impl.m : 0;
    out.insert(out.end(), from.begin() + static_cast<std::ptrdiff_t>(skip),
               from.end() - static_cast<std::ptrdiff_t>(last ? 0 : impl.m));
  }
  return out;
}

std::vector<double> TransientEstimator::predicted(std::size_t index) const {
  const auto all = states(index);
  const auto seen = static_cast<std::size_t>(impl_->model.observed());
  std::vector<double> y;
  for (std::size_t i = seen; i < all.size(); i += impl_->m)
    y.push_back(all[i]);
  return y;
}

std::vector<double> TransientEstimator::residuals(std::size_t index) const {
  auto e = predicted(index);
  const auto& y = impl_->records[index].data.displacement;
  for (std::size_t i = 0; i < e.size(); ++i)
    e[i] = y[i] - e[i];
  return e;
}

}  // namespace shaker::estimator
