#include "estimator/fit/objectives/robust.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <Eigen/Dense>

namespace shaker::estimator {
namespace {

constexpr double kNormalMedian = 0.6744897501960817;  // of |e| for unit normal noise
constexpr double kOutlier = 4.0;
// Lower limit of a weight, because rows are later divided by their weights.
constexpr double kSmallestWeight = 1e-8;
constexpr int kMostRounds = 60;

// Tuned for 95 % efficiency on normal noise.
double tuning(Loss loss) {
  switch (loss) {
    case Loss::huber:
      return 1.345;
    case Loss::cauchy:
      return 2.385;
    case Loss::tukey:
      return 4.685;
    default:
      return 1.0;
  }
}

// psi(z) / z and psi'(z).
struct Influence {
  double weight, slope;
};
Influence influence(Loss loss, double z) {
  const double c = tuning(loss);
  const double r = z / c;
  switch (loss) {
    case Loss::huber:
      return std::fabs(r) <= 1.0 ? Influence{1.0, 1.0} : Influence{1.0 / std::fabs(r), 0.0};
    case Loss::cauchy: {
      const double d = 1.0 + r * r;
      return {1.0 / d, (1.0 - r * r) / (d * d)};
    }
    case Loss::tukey: {
      if (std::fabs(r) >= 1.0) return {0.0, 0.0};
      const double d = 1.0 - r * r;
      return {d * d, d * (1.0 - 5.0 * r * r)};
    }
    default:
      return {1.0, 1.0};
  }
}

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

class Reweighting {
 public:
  Reweighting(const Model& model, std::vector<RunData> runs, const EstimationOptions& options)
      : model_(model), runs_(std::move(runs)) {
    for (RunData& run : runs_) {
      if (!run.harmonics.empty())
        throw std::invalid_argument(
            "a robust loss needs samples; Fourier coefficients have mixed their outliers in");
      base_.push_back(run.sample_weight.empty() ? std::vector<double>(run.displacement.size(), 1.0)
                                                : run.sample_weight);
      run.sample_weight = base_.back();
    }
    estimator_.emplace(model_, runs_, options);
  }

  const Fit& start(const std::vector<double>& theta) { return estimator_->fit(theta); }

  // Repeats weights and fit until the weights no longer change. Returns the number of rounds.
  int iterate(Loss loss) {
    int round = 0;
    for (double change = 1.0; change > 1e-7 && round < kMostRounds; ++round) {
      look();
      change = 0.0;
      std::size_t at = 0;
      for (std::size_t r = 0; r < runs_.size(); ++r) {
        for (std::size_t j = 0; j < base_[r].size(); ++j, ++at) {
          const double w = base_[r][j] * std::max(influence(loss, residual_[at] / scale_).weight,
                                                  kSmallestWeight);
          change = std::max(change, std::fabs(w - runs_[r].sample_weight[j]));
          runs_[r].sample_weight[j] = w;
        }
        estimator_->update_run(r, runs_[r]);
      }
      const Fit& fit = estimator_->fit(estimator_->last().theta, true);
      if (fit.status == FitStatus::no_solution) break;
    }
    return round;
  }

  RobustFit finish(Loss loss, int rounds) {
    look();
    RobustFit out;
    out.fit = estimator_->last();
    out.scale = scale_;
    out.rounds = rounds;
    collect_outliers(out);
    if (out.fit.status != FitStatus::converged) return out;
    const auto q = static_cast<Eigen::Index>(
        std::count_if(model_.parameters().begin(), model_.parameters().end(),
                      [](const ModelParameter& p) { return !p.fixed; }));
    const auto n = static_cast<double>(residual_.size());
    const auto degrees = n - static_cast<double>(q);
    double squares = 0.0, slopes = 0.0, slopes2 = 0.0;
    for (const double e : residual_) {
      const double z = e / scale_;
      const Influence i = influence(loss, z);
      squares += i.weight * z * i.weight * z;
      slopes += i.slope / n;
      slopes2 += i.slope * i.slope / n;
    }
    const double spread = (slopes2 - slopes * slopes) / (slopes * slopes);
    const double k = 1.0 + static_cast<double>(q) / n * std::max(spread, 0.0);
    const double variance = k * k * scale_ * scale_ * squares / degrees / (slopes * slopes);
    const Eigen::MatrixXd inverse = unweighted_gram().inverse();
    std::size_t row = 0;
    for (std::size_t p = 0; p < out.fit.theta.size(); ++p) {
      if (model_.parameters()[p].fixed) continue;
      const auto at = static_cast<Eigen::Index>(row++);
      out.fit.standard_error[p] = std::sqrt(variance * inverse(at, at));
    }
    for (Eigen::Index a = 0; a < q; ++a)
      for (Eigen::Index b = 0; b < q; ++b)
        out.fit.covariance[static_cast<std::size_t>(a * q + b)] = variance * inverse(a, b);
    out.fit.noise = scale_;
    return out;
  }

 private:
  // Computes the residuals with base weights, and their scale.
  void look() {
    residual_.clear();
    for (std::size_t r = 0; r < runs_.size(); ++r) {
      const std::vector<double> predicted = estimator_->predicted(r);
      for (std::size_t j = 0; j < predicted.size(); ++j)
        residual_.push_back(std::sqrt(runs_[r].cycles * runs_[r].weight * base_[r][j]) *
                            (runs_[r].displacement[j] - predicted[j]));
    }
    std::vector<double> size;
    for (const double e : residual_)
      size.push_back(std::fabs(e));
    scale_ = std::max(median(std::move(size)) / kNormalMedian, 1e-300);
  }

  Eigen::MatrixXd unweighted_gram() const {
    const Linearised rows = estimator_->linearised();
    std::vector<std::size_t> free;
    for (std::size_t p = 0; p < model_.parameters().size(); ++p)
      if (!model_.parameters()[p].fixed) free.push_back(p);
    const auto q = static_cast<Eigen::Index>(free.size());
    Eigen::MatrixXd gram = Eigen::MatrixXd::Zero(q, q);
    Eigen::VectorXd row(q);
    std::size_t at = 0;
    for (std::size_t r = 0; r < runs_.size(); ++r) {
      for (std::size_t j = 0; j < base_[r].size(); ++j, ++at) {
        const double share = base_[r][j] / runs_[r].sample_weight[j];
        if (!(base_[r][j] > 0.0)) continue;
        for (Eigen::Index k = 0; k < q; ++k)
          row[k] =
              rows.jacobian[at * model_.parameters().size() + free[static_cast<std::size_t>(k)]];
        gram += share * row * row.transpose();
      }
    }
    return gram;
  }

  void collect_outliers(RobustFit& out) const {
    std::size_t at = 0;
    for (std::size_t r = 0; r < runs_.size(); ++r) {
      for (std::size_t j = 0; j < base_[r].size(); ++j, ++at) {
        if (std::fabs(residual_[at]) > kOutlier * scale_)
          out.outliers.push_back({r, j, residual_[at] / scale_});
      }
    }
    std::sort(out.outliers.begin(), out.outliers.end(), [](const Outlier& a, const Outlier& b) {
      return std::fabs(a.size) > std::fabs(b.size);
    });
  }

  const Model& model_;
  std::vector<RunData> runs_;
  std::vector<std::vector<double>> base_;
  std::optional<Estimator> estimator_;
  std::vector<double> residual_;
  double scale_ = 1.0;
};

}  // namespace

std::optional<Loss> loss_from_name(std::string_view name) {
  if (name == "squared") return Loss::squared;
  if (name == "huber") return Loss::huber;
  if (name == "cauchy") return Loss::cauchy;
  if (name == "tukey") return Loss::tukey;
  return std::nullopt;
}

RobustFit fit_robust(const Model& model, std::vector<RunData> runs,
                     const std::vector<double>& start, Loss loss,
                     const EstimationOptions& options) {
  Reweighting reweighting(model, std::move(runs), options);
  const Fit& first = reweighting.start(start);
  // Outliers may prevent convergence of least squares; its end is used as a start in any case.
  if (loss == Loss::squared || first.status == FitStatus::no_solution) {
    RobustFit out;
    out.fit = first;
    out.scale = first.noise;
    return out;
  }
  int rounds = reweighting.iterate(Loss::huber);
  if (loss != Loss::huber) rounds += reweighting.iterate(loss);
  return reweighting.finish(loss, rounds);
}

std::vector<double> sandwich_covariance(const Model& model, const Estimator& estimator) {
  const Linearised rows = estimator.linearised();
  std::vector<std::size_t> free;
  for (std::size_t p = 0; p < model.parameters().size(); ++p)
    if (!model.parameters()[p].fixed) free.push_back(p);
  const auto q = static_cast<Eigen::Index>(free.size());
  const std::size_t n = rows.residual.size();
  Eigen::MatrixXd gram = Eigen::MatrixXd::Zero(q, q), middle = gram;
  Eigen::VectorXd row(q);
  for (std::size_t j = 0; j < n; ++j) {
    for (Eigen::Index k = 0; k < q; ++k)
      row[k] = rows.jacobian[j * model.parameters().size() + free[static_cast<std::size_t>(k)]];
    gram += row * row.transpose();
    middle += rows.residual[j] * rows.residual[j] * row * row.transpose();
  }
  const Eigen::MatrixXd inverse = gram.inverse();
  const double correction =
      static_cast<double>(n) / (static_cast<double>(n) - static_cast<double>(q));
  const Eigen::MatrixXd covariance = correction * inverse * middle * inverse;
  return {covariance.data(), covariance.data() + covariance.size()};
}

}  // namespace shaker::estimator
