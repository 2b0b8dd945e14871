// Inference for an estimate from records, from the triangle R of the Jacobian: (3.27), (3.28),
// (3.29), and the parameters that the data do not determine.
#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "estimator/fit/determination.hpp"
#include "estimator/fit/records/internal/transient_impl.hpp"
#include "estimator/math/dense.hpp"
#include "estimator/math/numbers.hpp"
#include "estimator/math/statistics.hpp"

namespace shaker::estimator {
namespace {

// Smallest singular value of the scaled Jacobian, relative to the largest. Below it, the
// integration error of the sensitivities hides a direction.
constexpr double kSmallestSingular = 1e-8;
constexpr double kSmallestOfDifferences = 1e-5;
constexpr double kShare = 0.05;  // component of a direction above which a parameter is part of it

}  // namespace

void TransientEstimator::Impl::finish() {
  const std::size_t q = unknowns.size();
  fit.observations = 0;
  fit.initial.clear();
  fit.initial_error.assign(records.size(), std::vector<double>(m, 0.0));
  for (const RecordState& record : records) {
    fit.observations += static_cast<long>(record.data.t.size());
    fit.initial.push_back(arcs[record.first_arc].start);
  }
  fit.degrees_of_freedom = fit.observations - static_cast<long>(q);
  fit.standard_error.assign(fit.theta.size(), 0.0);
  fit.determined.assign(fit.theta.size(), 1);
  fit.at_bound.assign(fit.theta.size(), 0);
  for (const int k : free) {
    const auto at = static_cast<std::size_t>(k);
    const ModelParameter& p = model.parameters()[at];
    fit.at_bound[at] = fit.theta[at] <= p.lower || fit.theta[at] >= p.upper;
  }
  fit.covariance.assign(q * q, kNaN);
  fit.noise = fit.quantile = kNaN;
  if (fit.status == FitStatus::no_solution) return;
  fit.sum_of_squares = sum_of_squares;
  if (fit.degrees_of_freedom > 0) {
    const auto freedom = static_cast<double>(fit.degrees_of_freedom);
    fit.noise = std::sqrt(fit.sum_of_squares / freedom);
    fit.quantile = student_t_quantile(0.5 + 0.5 * options.confidence, freedom);
  }
  if (q > 0) finish_inference();
}

void TransientEstimator::Impl::finish_inference() {
  const auto q = static_cast<Eigen::Index>(unknowns.size());
  const Eigen::VectorXd scale = r.colwise().norm();
  Eigen::VectorXd inverse_scale = Eigen::VectorXd::Zero(q);
  for (Eigen::Index k = 0; k < q; ++k) {
    if (scale[k] > 0.0) inverse_scale[k] = 1.0 / scale[k];
  }
  const SingularValues svd = singular_values_of(r * inverse_scale.asDiagonal());
  const auto& sigma = svd.values;
  fit.condition = sigma[0] / sigma[q - 1];
  const double smallest = options.time.gradient == Gradient::finite_differences
                              ? kSmallestOfDifferences
                              : kSmallestSingular;
  std::vector<char> known(unknowns.size(), 1);
  Eigen::MatrixXd inverse = Eigen::MatrixXd::Zero(q, q);
  for (Eigen::Index i = 0; i < q; ++i) {
    const Eigen::VectorXd direction = svd.v.col(i);
    if (sigma[i] > smallest * sigma[0]) {
      inverse += direction * direction.transpose() / (sigma[i] * sigma[i]);
      continue;
    }
    for (Eigen::Index k = 0; k < q; ++k) {
      if (std::fabs(direction[k]) > kShare) known[static_cast<std::size_t>(k)] = 0;
    }
  }
  for (Eigen::Index k = 0; k < q; ++k) {
    if (!(scale[k] > 0.0)) known[static_cast<std::size_t>(k)] = 0;
  }
  const double noise = options.prior ? options.prior->noise : fit.noise;
  const double variance = noise * noise;
  std::vector<double> error(unknowns.size(), kNaN);
  for (Eigen::Index k = 0; k < q; ++k) {
    for (Eigen::Index l = 0; l < q; ++l) {
      if (known[static_cast<std::size_t>(k)] && known[static_cast<std::size_t>(l)])
        fit.covariance[static_cast<std::size_t>(k * q + l)] =
            variance * inverse(k, l) * inverse_scale[k] * inverse_scale[l];
    }
    error[static_cast<std::size_t>(k)] =
        std::sqrt(fit.covariance[static_cast<std::size_t>(k * q + k)]);
  }
  for (std::size_t k = 0; k < free.size(); ++k) {
    fit.standard_error[static_cast<std::size_t>(free[k])] = error[k];
    fit.determined[static_cast<std::size_t>(free[k])] = known[k];
  }
  for (std::size_t index = 0; index < records.size(); ++index) {
    for (std::size_t j = 0; j < m; ++j) {
      const int unknown = records[index].unknown[j];
      if (unknown >= 0) fit.initial_error[index][j] = error[static_cast<std::size_t>(unknown)];
    }
  }
  const bool all = std::all_of(known.begin(), known.end(), [](char c) { return c != 0; });
  if (!all && fit.status == FitStatus::converged) fit.status = FitStatus::undetermined;
}

std::vector<double> TransientEstimator::sensitivities(std::size_t index) const {
  impl_->keep();
  const Impl& impl = *impl_;
  const RecordState& record = impl.records.at(index);
  const std::size_t m = impl.m, p = impl.free.size(), columns = m + p;
  const auto seen = static_cast<std::size_t>(impl.model.observed());
  std::vector<double> out;
  for (std::size_t a = record.first_arc; a < record.first_arc + record.arcs; ++a) {
    const Arc& arc = impl.arcs[a];
    const bool last = a + 1 == record.first_arc + record.arcs;
    for (std::size_t i = a == record.first_arc ? record.offset : 0;
         i < arc.times.size() - (last ? 0 : 1); ++i) {
      const Eigen::RowVectorXd total = impl.shooting[index].row(
          a - record.first_arc, &arc.sensitivities[(i * m + seen) * columns]);
      for (std::size_t k = m; k < columns; ++k)
        out.push_back(total[static_cast<Eigen::Index>(k)]);
      for (std::size_t j = 0; j < m; ++j) {
        if (record.unknown[j] >= 0) out.push_back(total[static_cast<Eigen::Index>(j)]);
      }
    }
  }
  return out;
}

namespace {

// The parameters of a description, by name.
struct Doubtful {
  std::vector<std::string> lost, weak, on_bound;
};

void add_entry(Estimate& e, ParameterEstimate entry, double quantile, Doubtful& doubtful) {
  const double half = quantile * entry.standard_error;
  entry.lower = entry.fixed ? entry.value : entry.value - half;
  entry.upper = entry.fixed ? entry.value : entry.value + half;
  if (!entry.fixed) {
    e.covariance_order.push_back(entry.name);
    if (!entry.determined)
      doubtful.lost.push_back(entry.name);
    else if (entry.effect != "initial condition" &&
             entry.standard_error > 0.5 * std::fabs(entry.value))
      doubtful.weak.push_back(
          fmt::format("{} ({:.3g} +- {:.2g})", entry.name, entry.value, entry.standard_error));
    if (entry.at_bound) doubtful.on_bound.push_back(entry.name);
  }
  e.parameters.push_back(std::move(entry));
}

void add_warnings(Estimate& e, const Doubtful& doubtful) {
  if (!doubtful.lost.empty())
    e.warnings.push_back(fmt::format(
        "these records do not determine {}: a combination of them can change without any effect "
        "on the displacement; add records with other motion, or fix one of them",
        fmt::join(doubtful.lost, ", ")));
  if (!doubtful.weak.empty())
    e.warnings.push_back(
        fmt::format("these records determine {} only weakly; the linearised intervals are rough "
                    "there; add records of larger motion, or longer ones",
                    fmt::join(doubtful.weak, ", ")));
}

}  // namespace

// The initial state of the j-th equation of a record.
ParameterEstimate TransientEstimator::Impl::initial_entry(std::size_t i, std::size_t j) const {
  const std::string& state = equations.names()[j];
  const bool rate = state.back() == '\'';
  const double value = fit.initial[i][j], error = fit.initial_error[i][j];
  const InitialState& bounds = records[i].initial.empty() ? InitialState{} : records[i].initial[j];
  return {records.size() == 1 ? fmt::format("{}(0)", state)
                              : fmt::format("{}(0) of record {}", state, i + 1),
          "initial condition",
          rate ? model.length_unit() + "/s" : model.length_unit(),
          value,
          error,
          0.0,
          0.0,
          false,
          value <= bounds.lower || value >= bounds.upper,
          std::isfinite(error) || fit.degrees_of_freedom <= 0};
}

Estimate TransientEstimator::describe() const {
  const Impl& impl = *impl_;
  const TransientFit& fit = impl.fit;
  Estimate e;
  e.model = impl.model.name();
  e.noise_standard_deviation = fit.noise;
  e.sum_of_squares = fit.sum_of_squares;
  e.condition = fit.condition;
  e.observations = fit.observations;
  e.degrees_of_freedom = fit.degrees_of_freedom;
  e.runs = static_cast<int>(impl.records.size());
  e.iterations = fit.iterations;
  e.converged = fit.status == FitStatus::converged || fit.status == FitStatus::undetermined;
  e.covariance = fit.covariance;
  Doubtful doubtful;
  for (std::size_t k = 0; k < fit.theta.size(); ++k) {
    const ModelParameter& p = impl.model.parameters()[k];
    add_entry(e,
              {p.name, p.effect, p.unit, fit.theta[k], fit.standard_error[k], 0.0, 0.0, p.fixed,
               fit.at_bound[k] != 0, fit.determined[k] != 0},
              fit.quantile, doubtful);
  }
  for (std::size_t i = 0; i < impl.records.size(); ++i) {
    for (std::size_t j = 0; j < impl.m; ++j) {
      if (impl.records[i].unknown[j] >= 0)
        add_entry(e, impl.initial_entry(i, j), fit.quantile, doubtful);
    }
  }
  if (!fit.trouble.empty()) e.warnings.push_back(fit.trouble);
  add_warnings(e, doubtful);
  for (std::string& sentence :
       closing_warnings(doubtful.on_bound, fit.observations, impl.unknowns.size()))
    e.warnings.push_back(std::move(sentence));
  e.usable =
      fit.status == FitStatus::converged && doubtful.on_bound.empty() && fit.degrees_of_freedom > 0;
  return e;
}

}  // namespace shaker::estimator
