// The workspace behind TransientEstimator. Private to this room's sources.
#pragma once

#include <vector>

#include <Eigen/Dense>

#include "estimator/fit/records/internal/square_root_information.hpp"
#include "estimator/fit/records/transient.hpp"
#include "estimator/solve/time/shooting.hpp"

namespace shaker::estimator {

struct RecordState {
  TransientRecord data;
  std::vector<double> times;  // those of the data, preceded by `start` if it is earlier
  std::size_t offset = 0;     // 1 when times[0] has no datum
  std::vector<InitialState> initial;
  std::vector<int> unknown;   // index of an initial state among the unknowns; -1: known
  std::vector<double> scale;  // size of each state, the measure of gaps and steps
  std::size_t first_arc = 0, arcs = 0;
  double step = 0.0;          // s, of even times; 0: they are not even
  double natural_time = 0.0;  // s: the motion's size over its velocity's; 0: not known
};

// How far a search goes before a finer one takes over.
struct Level {
  SumOptions sums;
  int most = 0;         // iterations
  double enough = 0.0;  // a step of a parameter below it, relative to it, ends the search
  bool last = false;    // the options' tolerance ends it instead
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
  std::vector<Arc> arcs;              // record by record
  std::optional<std::size_t> cut_as;  // the segment for which `arcs` are cut
  std::vector<std::size_t> record_of;
  std::vector<std::size_t> first_node;
  std::vector<std::vector<double>> data_starts;  // of each arc, from the data alone
  std::vector<Unknown> unknowns;
  std::unique_ptr<TimeIntegration> integration;
  TransientFit fit;

  ArcSums sums, sums_before;
  std::vector<Shooting> shooting;  // a record each
  bool kept = false;               // the arcs hold states and sensitivities of the present point
  SquareRootInformation information;
  Eigen::MatrixXd r;      // triangle R of the last linearisation
  Eigen::VectorXd right;  // its right-hand side Q^T r
  double sum_of_squares = 0.0, gaps = 0.0;
  double closed_squares = 0.0;  // of all rows, with the gaps closed
  double observations = 0.0, data_size = 0.0;
  // After a full step of relative size 1: the next step, and the largest gap.
  struct Shrinking {
    double step = 1e300, gap = 1e300;
  } shrinking;
  Eigen::MatrixXd prior_root;  // of the inverse covariance of the prior; empty without one

  void add_record(TransientRecord record, std::size_t index);
  void add_unknowns(RecordState& record);
  void cut_into_arcs(std::size_t record, std::size_t segment);
  void cut(std::size_t segment);
  void begin(const std::vector<double>& start, std::size_t segment);
  void begin_from_data(std::size_t record);
  void simulate_starts(std::size_t record);

  IntegrationReport integrate(const Level& level);
  void keep();
  void linearise(double closing);
  void add_gaps(std::size_t record);
  void add_record_products(std::size_t record, Eigen::MatrixXd& products) const;
  bool factor(const Eigen::MatrixXd& products);
  void linearise_by_rows();
  // Index among the unknowns of the record's first states and the parameters; -1: known.
  int unknown_of(const RecordState& record, std::size_t column) const;
  void set_prior();
  // The prior's rows, each with its right-hand side last; sets prior_sum.
  Eigen::MatrixXd prior_rows();
  void move(const Eigen::VectorXd& step);
  double accuracy() const;
  double value(std::size_t unknown) const;
  bool small(const Eigen::VectorXd& step) const;
  double relative_size(const Eigen::VectorXd& step) const;
  double merit() const;

  bool attempt(const std::vector<double>& start, std::size_t segment);
  bool approach(const std::vector<double>& start, std::size_t segment);
  // From damping `lambda`; 0: full steps, (4.7). True where the level's end was reached.
  bool iterate(const Level& level, double lambda);
  struct Minimisation;
  Eigen::VectorXd step_of(double lambda, const std::vector<double>& start) const;
  bool enough(const Level& level, const Eigen::VectorXd& step) const;
  void end(const Eigen::VectorXd& step);
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
