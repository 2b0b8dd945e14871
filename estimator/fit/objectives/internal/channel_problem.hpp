// Residuals of several channels and their derivatives at one theta, run by run, with the periodic
// solutions that predict them. Private to the sources of channels.hpp. Use it from one thread; it
// allocates.
#pragma once

#include <span>
#include <string>
#include <vector>

#include <Eigen/Dense>

#include "estimator/fit/objectives/channels.hpp"
#include "estimator/math/grid_reading.hpp"
#include "estimator/solve/periodic/periodic_system.hpp"

namespace shaker::estimator {

// Residuals and derivatives at one theta.
struct ChannelLook {
  std::vector<Eigen::MatrixXd> e;  // of each run, points x channels, times sqrt(cycles)
  std::vector<Eigen::MatrixXd> j;  // (points * channels) x free, row point * channels + channel
  Eigen::MatrixXd moment;          // M of (3.12), with the scatter
};

class ChannelProblem {
 public:
  // `model` must outlive it. Throws std::invalid_argument with an explanation for data that cannot
  // be used.
  ChannelProblem(const Model& model, std::span<const Quantity> quantities,
                 std::vector<ChannelRun> runs, const ChannelOptions& options);

  // Computes `out` at all parameters `theta`. Returns false, with an explanation in trouble(), when
  // there is no periodic solution; false without one when a result is not finite.
  bool look(const std::vector<double>& theta, ChannelLook& out);
  const std::string& trouble() const { return trouble_; }

  // The variance of each channel about its mean, summed over the runs (a diagonal matrix): the
  // first V of the stages.
  Eigen::MatrixXd spread_of_data() const;
  // Change of a run's predictions (order and scale of ChannelLook::j) with one standard error of
  // the cosine and sine parts of the excitation's first harmonics, one column each. Empty when the
  // excitation is known exactly or a solution with a changed excitation fails. Restores the
  // excitation as measured.
  Eigen::MatrixXd moved_by_excitation(std::size_t run, const std::vector<double>& theta);

  const Model& model() const { return model_; }
  const std::vector<ChannelRun>& runs() const { return runs_; }
  Eigen::Index channels() const { return m_; }
  double points() const { return points_; }  // of one channel; runs with scatter count all cycles
  Eigen::Index parameters() const { return static_cast<Eigen::Index>(free_.size()); }
  // Index of the k-th free parameter in theta and in the model.
  std::size_t index(Eigen::Index k) const {
    return static_cast<std::size_t>(free_[static_cast<std::size_t>(k)]);
  }
  const ModelParameter& parameter(Eigen::Index k) const { return model_.parameters()[index(k)]; }

 private:
  void add_system(std::size_t r, std::span<const Quantity> quantities);
  bool solve(const std::vector<double>& theta);
  double predicted(std::size_t r, const GridReading& reading, Eigen::Index channel) const;

  const Model& model_;
  ChannelOptions options_;
  std::vector<ChannelRun> runs_;
  Eigen::Index m_;
  std::vector<int> free_;
  std::vector<double> unchanged_;  // zeros: no change of theta
  std::vector<PeriodicSystem> systems_;
  std::vector<std::vector<GridReading>> readings_;
  std::vector<AlignedVector> good_;  // last good solutions
  double points_ = 0.0;
  std::string trouble_;
};

}  // namespace shaker::estimator
