// What several channels measured and what the model predicts of them: residuals and derivatives at
// one theta, run by run, with the periodic solutions behind them. Private to the sources of
// channels.hpp. One thread; allocates.
#pragma once

#include <span>
#include <string>
#include <vector>

#include <Eigen/Dense>

#include "estimator/objectives/channels.hpp"
#include "estimator/periodic/periodic_system.hpp"

namespace shaker::estimator {

// Residuals and derivatives at one theta.
struct ChannelLook {
  std::vector<Eigen::MatrixXd> e;  // of each run, points x channels, times sqrt(cycles)
  std::vector<Eigen::MatrixXd> j;  // (points * channels) x free, row point * channels + channel
  Eigen::MatrixXd moment;          // (3.12), scatter included
};

class ChannelProblem {
 public:
  // Throws std::invalid_argument with a sentence for data that cannot be used.
  ChannelProblem(const Model& model, std::span<const Quantity> quantities,
                 std::vector<ChannelRun> runs, const ChannelOptions& options);

  // False, with a sentence in trouble(), when there is no periodic solution.
  bool look(const std::vector<double>& theta, ChannelLook& out);
  const std::string& trouble() const { return trouble_; }

  // What the data scatter about their own means: a V to begin the stages with.
  Eigen::MatrixXd spread_of_data() const;
  // How the predictions of a run, in the order and scale of ChannelLook::j, move with one standard
  // error of the cosine and sine parts of the excitation's first harmonics: a column each. Empty
  // when the excitation is known exactly or there is no solution beside this one. Ends with the
  // excitation as it was measured.
  Eigen::MatrixXd moved_by_excitation(std::size_t run, const std::vector<double>& theta);

  const Model& model() const { return model_; }
  const std::vector<ChannelRun>& runs() const { return runs_; }
  Eigen::Index channels() const { return m_; }
  double points() const { return points_; }  // of one channel, all cycles counted
  Eigen::Index parameters() const { return static_cast<Eigen::Index>(free_.size()); }
  // Of the k-th free parameter, in theta and in the model.
  std::size_t index(Eigen::Index k) const {
    return static_cast<std::size_t>(free_[static_cast<std::size_t>(k)]);
  }
  const ModelParameter& parameter(Eigen::Index k) const { return model_.parameters()[index(k)]; }

 private:
  // How one run's points are read off its grid: by Lagrange's formula on six neighbours, or
  // exactly.
  struct Reader {
    int base = 0, count = 1;
    double weight[6] = {1, 0, 0, 0, 0, 0};
  };
  static Reader reader_at(double tau, int points);
  void add_system(std::size_t r, std::span<const Quantity> quantities);
  bool solve(const std::vector<double>& theta);
  double predicted(std::size_t r, const Reader& reader, Eigen::Index channel) const;

  const Model& model_;
  ChannelOptions options_;
  std::vector<ChannelRun> runs_;
  Eigen::Index m_;
  std::vector<int> free_;
  std::vector<double> unchanged_;  // no change of theta
  std::vector<PeriodicSystem> systems_;
  std::vector<std::vector<Reader>> readers_;
  std::vector<AlignedVector> good_;  // last solutions
  double points_ = 0.0;
  std::string trouble_;
};

}  // namespace shaker::estimator
