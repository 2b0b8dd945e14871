// The workspace behind TransientEstimator. Private to this room's sources.
#pragma once

#include <vector>

#include <Eigen/Dense>

#include "estimator/time/square_root_information.hpp"
#include "estimator/time/transient.hpp"

namespace shaker::estimator {

struct RecordState {
  TransientRecord data;
  std::vector<double> times;  // those of the data, preceded by `start` if it is earlier
  std::size_t offset = 0;     // 1 when times[0] has no datum
  std::vector<InitialState> initial;
  std::vector<int> unknown;   // index of an initial state among the unknowns; -1: known
  std::vector<double> scale;  // size of each state, the measure of gaps and steps
  std::size_t first_arc = 0, arcs = 0;
};

// One unknown of the least squares: a free parameter, or an initial state.
struct Unknown {
  double lower = 0.0, upper = 0.0;
  double scale = 0.0;  // steps are relative to |value|, or to this if it is larger
};

struct TransientEstimator::Impl {
  Impl(const Model& model, std::vector<TransientRecord> records, TransientOptions options);

  const Model& model;
  StateEquations equations;
  TransientOptions options;
  std::size_t m;          // states
  std::vector<int> free;  // parameters
  std::vector<RecordState> records;
  std::vector<Arc> arcs;  // record by record
  std::vector<std::size_t> record_of;
  std::vector<std::size_t> first_node;
  std::vector<Unknown> unknowns;
  std::unique_ptr<TimeIntegration> integration;
  TransientFit fit;

  SquareRootInformation information;
  Eigen::MatrixXd r;      // triangle R of the last linearisation
  Eigen::VectorXd right;  // its right-hand side Q^T r
  double sum_of_squares = 0.0, gaps = 0.0;
  Eigen::MatrixXd prior_root;  // of the inverse covariance of the prior; empty without one
  // For each arc: the derivative of its initial state over the unknowns, and the part of its step
  // that closes the gap before it.
  std::vector<Eigen::MatrixXd> moves;
  std::vector<Eigen::VectorXd> closes;

  void add_record(TransientRecord record, std::size_t index);
  void add_unknowns(RecordState& record);
  void cut_into_arcs(std::size_t record, std::size_t segment);
  void begin(const std::vector<double>& start, std::size_t segment);
  void begin_from_data(std::size_t record);
  void simulate_starts(std::size_t record);

  IntegrationReport integrate();
  void linearise(double closing);
  void linearise_record(std::size_t record, double closing);
  void set_prior();
  void linearise_prior();
  void move(const Eigen::VectorXd& step);
  double observations() const;
  double accuracy() const;
  double value(std::size_t unknown) const;
  bool small(const Eigen::VectorXd& step) const;
  double merit() const;

  void iterate(bool damped);
  void no_solution(const IntegrationReport& report);
  std::vector<std::vector<double>> present_starts() const;
  void restore(const std::vector<double>& theta, const std::vector<std::vector<double>>& starts);
  Eigen::VectorXd pure_step() const;
  bool leaves_the_box(const Eigen::VectorXd& step) const;
  Eigen::VectorXd damped_step(double lambda) const;
  Eigen::VectorXd box_step(double lambda) const;
  void cap(Eigen::VectorXd& step, const std::vector<double>& start) const;
  void keep_iterate();
  std::string where(const IntegrationReport& report) const;

  void finish();
  void finish_inference();
  ParameterEstimate initial_entry(std::size_t record, std::size_t state) const;
};

}  // namespace shaker::estimator
