#include "estimator/time/transient.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <fmt/format.h>

#include "estimator/math/dense.hpp"
#include "estimator/time/transient_impl.hpp"

namespace shaker::estimator {
namespace {

constexpr std::size_t kShort = 400;       // samples: shorter records are one trajectory
constexpr std::size_t kMostArcs = 64;     // in a record, unless the options ask for more
constexpr std::size_t kSlopeSamples = 4;  // to either side, for a velocity from the data
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

// Fits a parabola by least squares to the samples around `at`. Returns value and slope there.
std::pair<double, double> local_fit(const std::vector<double>& t, const std::vector<double>& y,
                                    std::size_t at) {
  const std::size_t first = at > kSlopeSamples ? at - kSlopeSamples : 0;
  const std::size_t last = std::min(t.size(), at + kSlopeSamples + 1);
  const auto n = static_cast<Eigen::Index>(last - first);
  const Eigen::Index terms = std::min<Eigen::Index>(3, n);
  const double span = std::max(t[last - 1] - t[first], 1e-300);
  Eigen::MatrixXd a(n, terms);
  Eigen::VectorXd b(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const std::size_t k = first + static_cast<std::size_t>(i);
    double power = 1.0;
    for (Eigen::Index j = 0; j < terms; ++j, power *= (t[k] - t[at]) / span)
      a(i, j) = power;
    b[i] = y[k];
  }
  const Eigen::VectorXd c = least_squares(a, b);
  return {c[0], terms > 1 ? c[1] / span : 0.0};
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
  if (segment == 0)
    segment = n <= kShort ? n : std::max<std::size_t>(kShort / 4, (n + kMostArcs - 1) / kMostArcs);
  record.first_arc = arcs.size();
  for (std::size_t first = 0; first + 1 < n; first += segment) {
    const std::size_t end = std::min(n - 1, first + segment);
    Arc arc;
    arc.times = std::span<const double>(record.times).subspan(first, end - first + 1);
    arc.excitation = &record.data.excitation;
    arc.start.assign(m, 0.0);
    for (int e = 0; e < equations.coordinates(); ++e)
      arc.start[static_cast<std::size_t>(e)] = model.rest(e);
    arcs.push_back(std::move(arc));
    record_of.push_back(index);
    first_node.push_back(first);
  }
  record.arcs = arcs.size() - record.first_arc;
}

void TransientEstimator::Impl::begin(const std::vector<double>& start, std::size_t segment) {
  fit.theta = start;
  arcs.clear();
  record_of.clear();
  first_node.clear();
  for (std::size_t r_ = 0; r_ < records.size(); ++r_) {
    cut_into_arcs(r_, std::min(segment, records[r_].times.size()));
    begin_from_data(r_);
    if (records[r_].arcs > 1) simulate_starts(r_);
  }
  const std::size_t q = unknowns.size();
  moves.assign(arcs.size(),
               Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(m), static_cast<Eigen::Index>(q)));
  closes.assign(arcs.size(), Eigen::VectorXd::Zero(static_cast<Eigen::Index>(m)));
}

// The data give the observed coordinate at every segment's start, and its velocity by a local fit.
void TransientEstimator::Impl::begin_from_data(std::size_t index) {
  RecordState& record = records[index];
  const auto seen = static_cast<std::size_t>(model.observed());
  const int velocity = equations.velocity_of(model.observed());
  for (std::size_t a = record.first_arc; a < record.first_arc + record.arcs; ++a) {
    const std::size_t node = first_node[a];
    const std::size_t datum = node >= record.offset ? node - record.offset : 0;
    const auto [value, slope] = local_fit(record.data.t, record.data.displacement, datum);
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
