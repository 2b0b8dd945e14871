#include "estimator/fit/objectives/internal/channel_problem.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <fmt/format.h>

#include "estimator/math/harmonic_basis.hpp"

namespace shaker::estimator {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kExcitationHarmonics = 3;  // the response to higher ones is negligible

std::size_t at(Index k) {
  return static_cast<std::size_t>(k);
}

void check(const ChannelRun& run, std::size_t index, std::size_t channels) {
  const auto reject = [&](const std::string& why) {
    throw std::invalid_argument(fmt::format("run {}: {}", index + 1, why));
  };
  const auto finite = [](const std::vector<double>& values) {
    return std::all_of(values.begin(), values.end(), [](double v) { return std::isfinite(v); });
  };
  if (!(run.frequency_hz > 0.0) || !std::isfinite(run.frequency_hz))
    reject(fmt::format("the frequency is {} Hz; it must be positive", run.frequency_hz));
  if (run.channels.size() != channels)
    reject(fmt::format("{} channels; {} are wanted", run.channels.size(), channels));
  const std::size_t count = run.channels.front().size();
  for (const auto& series : run.channels) {
    if (series.size() != count)
      reject(fmt::format("one channel has {} points, another {}; they must be measured together",
                         count, series.size()));
    if (!finite(series)) reject("a sample is missing or not finite; leave such points out");
  }
  if (count < 8) reject(fmt::format("{} points are too few; a period needs at least 8", count));
  if (!run.tau.empty() && (run.tau.size() != count || !finite(run.tau)))
    reject(fmt::format("{} times for {} points, or one that is not finite", run.tau.size(), count));
  if (!finite(run.excitation) || (run.excitation.empty() && !(std::fabs(run.amplitude) > 0.0)))
    reject("the excitation has no amplitude, or a sample that is not finite");
  if (!(run.cycles > 0.0)) reject("cycles must be positive");
  if (!run.scatter.empty() && run.scatter.size() != channels * channels)
    reject(fmt::format("the scatter has {} numbers; {} are wanted", run.scatter.size(),
                       channels * channels));
}

// One period of a run's excitation with one part (cosine or sine) of one harmonic changed.
std::vector<double> moved_excitation(const ChannelRun& run, int part, double by) {
  constexpr int kSamples = 64;
  std::vector<double> x = run.excitation;
  for (int i = 0; run.excitation.empty() && i < kSamples; ++i)
    x.push_back(run.amplitude * harmonic_term(1, i, kSamples));
  const auto n = static_cast<int>(x.size());
  for (int i = 0; i < n; ++i)
    x[static_cast<std::size_t>(i)] += by * harmonic_term(part + 1, i, n);
  return x;
}

}  // namespace

ChannelProblem::ChannelProblem(const Model& model, std::span<const Quantity> quantities,
                               std::vector<ChannelRun> runs, const ChannelOptions& options)
    : model_(model),
      options_(options),
      runs_(std::move(runs)),
      m_(static_cast<Index>(quantities.size())) {
  if (runs_.empty()) throw std::invalid_argument("there is no run to estimate from");
  if (quantities.empty()) throw std::invalid_argument("there is no channel to estimate from");
  for (int k = 0; k < model.parameter_count(); ++k) {
    if (!model.parameters()[static_cast<std::size_t>(k)].fixed) free_.push_back(k);
  }
  unchanged_.assign(static_cast<std::size_t>(model.parameter_count()), 0.0);
  systems_.reserve(runs_.size());
  for (std::size_t r = 0; r < runs_.size(); ++r) {
    check(runs_[r], r, quantities.size());
    add_system(r, quantities);
  }
}

void ChannelProblem::add_system(std::size_t r, std::span<const Quantity> quantities) {
  const ChannelRun& run = runs_[r];
  const auto count = static_cast<int>(run.channels.front().size());
  GridOptions grid = options_.grid;
  if (run.tau.empty()) grid.points = count * ((grid.points + count - 1) / count);
  PeriodicSystem& system = systems_.emplace_back(run.model ? *run.model : model_, grid);
  system.set_channels(quantities);
  if (run.excitation.empty())
    system.set_excitation(run.frequency_hz, run.amplitude);
  else
    system.set_excitation(run.frequency_hz, run.excitation, options_.excitation_harmonics);
  auto& readings = readings_.emplace_back();
  for (int i = 0; i < count; ++i) {
    if (run.tau.empty()) {
      readings.push_back({i * (grid.points / count), 1, {1, 0, 0, 0, 0, 0}});
    } else {
      readings.push_back(grid_reading_at(run.tau[static_cast<std::size_t>(i)], grid.points));
    }
  }
  points_ += count * (run.scatter.empty() ? 1.0 : run.cycles);
  good_.emplace_back();
}

bool ChannelProblem::solve(const std::vector<double>& theta) {
  for (std::size_t r = 0; r < systems_.size(); ++r) {
    PeriodicSystem& system = systems_[r];
    SolveReport report;
    report.status = SolveStatus::no_convergence;
    if (!good_[r].empty()) {
      std::copy(good_[r].begin(), good_[r].end(), system.state().begin());
      report = system.solve(theta);
    }
    if (report.status != SolveStatus::converged) report = system.solve_from_rest(theta);
    if (report.status != SolveStatus::converged) {
      trouble_ = fmt::format("run {}: {}", r + 1, report.sentence());
      return false;
    }
    system.advance(1.0, unchanged_);
    good_[r].assign(system.state().begin(), system.state().end());
  }
  return true;
}

double ChannelProblem::predicted(std::size_t r, const GridReading& reading, Index channel) const {
  double sum = 0.0;
  for (int k = 0; k < reading.count; ++k)
    sum += reading.weight[k] * systems_[r].observed((reading.base + k) % systems_[r].points(),
                                                    static_cast<int>(channel));
  return sum;
}

bool ChannelProblem::look(const std::vector<double>& theta, ChannelLook& out) {
  if (!solve(theta)) return false;
  const Index q = parameters();
  out.e.resize(runs_.size());
  out.j.resize(runs_.size());
  out.moment = MatrixXd::Zero(m_, m_);
  for (std::size_t r = 0; r < runs_.size(); ++r) {
    const ChannelRun& run = runs_[r];
    const auto n = static_cast<Index>(readings_[r].size());
    const double root = std::sqrt(run.cycles);
    out.e[r].setZero(n, m_);
    out.j[r].setZero(n * m_, q);
    for (Index i = 0; i < n; ++i) {
      const GridReading& reading = readings_[r][at(i)];
      for (Index b = 0; b < m_; ++b) {
        for (int k = 0; k < reading.count; ++k) {
          const int point = (reading.base + k) % systems_[r].points();
          const auto row = systems_[r].observed_row(point, static_cast<int>(b));
          for (Index l = 0; l < q; ++l)
            out.j[r](i * m_ + b, l) += root * reading.weight[k] * row[1 + index(l)];
        }
        out.e[r](i, b) = root * (run.channels[at(b)][at(i)] - predicted(r, reading, b));
      }
    }
    out.moment += out.e[r].transpose() * out.e[r];
    if (!run.scatter.empty()) out.moment += Eigen::Map<const MatrixXd>(run.scatter.data(), m_, m_);
  }
  return out.moment.allFinite();
}

MatrixXd ChannelProblem::spread_of_data() const {
  VectorXd variance = VectorXd::Zero(m_);
  for (const ChannelRun& run : runs_) {
    for (Index b = 0; b < m_; ++b) {
      const auto& y = run.channels[at(b)];
      const Eigen::Map<const VectorXd> values(y.data(), static_cast<Index>(y.size()));
      variance[b] += (values.array() - values.mean()).square().mean();
    }
  }
  return variance.cwiseMax(1e-300).asDiagonal();
}

MatrixXd ChannelProblem::moved_by_excitation(std::size_t r, const std::vector<double>& theta) {
  const ChannelRun& run = runs_[r];
  const double error = run.excitation_error;
  if (!(error > 0.0)) return {};
  PeriodicSystem& system = systems_[r];
  const int harmonics = std::max(options_.excitation_harmonics, kExcitationHarmonics);
  const double root = std::sqrt(run.cycles);
  MatrixXd out =
      MatrixXd::Zero(static_cast<Index>(readings_[r].size()) * m_, 2 * kExcitationHarmonics);
  const auto restore = [&] { std::copy(good_[r].begin(), good_[r].end(), system.state().begin()); };
  bool good = true;
  for (int part = 0; good && part < 2 * kExcitationHarmonics; ++part) {
    for (const double side : {1.0, -1.0}) {
      restore();
      system.set_excitation(run.frequency_hz, moved_excitation(run, part, side * error), harmonics);
      good = system.solve(theta).status == SolveStatus::converged;
      if (!good) break;
      system.advance(1.0, unchanged_);
      for (Index i = 0; i < static_cast<Index>(readings_[r].size()); ++i) {
        for (Index b = 0; b < m_; ++b)
          out(i * m_ + b, part) += 0.5 * side * root * predicted(r, readings_[r][at(i)], b);
      }
    }
  }
  system.set_excitation(run.frequency_hz, moved_excitation(run, 0, 0.0), harmonics);
  restore();
  return good ? out : MatrixXd();
}

}  // namespace shaker::estimator
