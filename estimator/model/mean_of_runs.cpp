#include "estimator/model/mean_of_runs.hpp"

#include <algorithm>
#include <cmath>

namespace shaker::estimator {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

bool same_place(const ModelNumber& a, const ModelNumber& b) {
  return a.line == b.line && a.symbol == b.symbol && a.constant == b.constant;
}

}  // namespace

MatrixXd MeanOfRuns::covariance(const MatrixXd& of_values) const {
  MatrixXd v = weight * of_values * weight.transpose();
  v.diagonal() += scatter;
  return v;
}

MeanOfRuns mean_of_runs(const std::vector<ModelNumber>& places, const std::vector<double>& values) {
  MeanOfRuns out;
  std::vector<Index> number_of;
  for (const ModelNumber& place : places) {
    const auto found = std::find_if(out.numbers.begin(), out.numbers.end(),
                                    [&](const ModelNumber& n) { return same_place(n, place); });
    number_of.push_back(found - out.numbers.begin());
    if (found == out.numbers.end()) out.numbers.push_back(place);
  }
  const auto size = static_cast<Index>(out.numbers.size());
  const auto count = static_cast<Index>(values.size());
  out.weight = MatrixXd::Zero(size, count);
  for (Index i = 0; i < count; ++i)
    out.weight(number_of[static_cast<std::size_t>(i)], i) = 1.0;
  const Eigen::VectorXd members = out.weight.rowwise().sum();
  const Eigen::Map<const Eigen::VectorXd> all(values.data(), count);
  const Eigen::VectorXd mean = (out.weight * all).cwiseQuotient(members);
  out.scatter = Eigen::VectorXd::Zero(size);
  for (Index i = 0; i < count; ++i) {
    const Index n = number_of[static_cast<std::size_t>(i)];
    if (members[n] > 1.0) out.scatter[n] += std::pow(all[i] - mean[n], 2) / (members[n] - 1.0);
  }
  out.weight = members.cwiseInverse().asDiagonal() * out.weight;
  out.values.assign(mean.begin(), mean.end());
  return out;
}

}  // namespace shaker::estimator
