// A model's response to an excitation without a period, by time integration: the cosines that are
// compared, with their derivatives with respect to the parameters.
//
// The record is cut into arcs, which are integrated in batches and joined by Newton's method
// (multiple shooting). The initial state is not a parameter. At every theta it is the one that fits
// the data best, and the derivatives include its adjustment (variable projection). Therefore no
// effect gets credit for what another initial state explains.
#pragma once

#include <limits>
#include <memory>
#include <string>
#include <vector>

#include <Eigen/Dense>

#include "estimator/diagnosis/internal/run_datum.hpp"
#include "estimator/diagnosis/records/internal/transient_cosines.hpp"
#include "estimator/diagnosis/records/internal/transient_seen.hpp"
#include "estimator/math/accelerated_course.hpp"
#include "estimator/model/model.hpp"
#include "estimator/solve/time/integration.hpp"
#include "estimator/solve/time/shooting.hpp"
#include "estimator/solve/time/state_equations.hpp"

namespace shaker::estimator::diagnosis {

// The smoothing width, m/s, with which friction jumps in the response of a record.
double width_of_jump(const SampledRun& run);

class TransientResponse {
 public:
  // `model` must outlive it. Throws std::invalid_argument for a model that cannot be integrated or
  // has instruments that only a periodic motion has.
  TransientResponse(const Model& model, const RunDatum& datum);

  // Returns false if no trajectory goes through the record, from any initial state.
  bool at(const std::vector<double>& theta);
  const Eigen::VectorXd& value() const { return value_; }
  const Eigen::MatrixXd& jacobian() const { return jacobian_; }  // over all parameters

  // States of the trajectory, one row for each sample, after a successful `at`.
  Eigen::MatrixXd states() const;

  // Initial value of a state, by its name.
  double start_of(const std::string& state) const;

  // Where Newton's method does not join the arcs from the data, tries it in short moves too: dear.
  void be_patient() { patient_ = true; }
  // Stores the last success; go_back() returns to it.
  void hold() { held_ = present(); }
  void go_back() {
    if (held_.solved) take(held_);
  }
  // Starts from another model's trajectory, for the states that both have.
  void start_from(const TransientResponse& other);

 private:
  struct Solution {
    bool solved = false;
    std::vector<double> theta;
    std::vector<std::vector<double>> starts;  // of the arcs
    Eigen::VectorXd value;
    Eigen::MatrixXd jacobian, drift;
  };
  Solution present() const;
  void take(const Solution& solution);
  void cut();
  bool may_begin_at(std::size_t sample, std::size_t length) const;
  void begin_from_data();
  // Steps of the explicit integrator between two samples; 0: too many would be needed.
  int steps_between_samples(const std::vector<double>& theta) const;
  bool integrate(const std::vector<double>& theta);
  // True if a state is the memory of an effect and not a motion.
  bool remembers(int state) const {
    return state >= model_->mechanical() && state < equations_.coordinates();
  }
  void size_memories();
  bool close(const std::vector<double>& theta);
  void shorten();
  bool may_be_where_measured(const std::vector<double>& theta) const;
  bool integrate_finer(const std::vector<double>& theta);
  void settle_steps(const std::vector<double>& theta);
  // Condenses the arcs onto the initial state and the parameters: predicted samples and their
  // derivatives.
  void condense();
  // A state at the samples, and its derivatives over the initial state and all parameters.
  SampledCourse course_of(int state) const;
  SampledCourse load_along(const std::vector<double>& theta) const;
  // What the instruments show. False if that is no number.
  bool see(const std::vector<double>& theta);
  double cost() const;
  double correct();
  // Largest of `moves` of starts, in scales of the states.
  double relative_size(const Eigen::VectorXd& moves) const;

  const Model* model_;
  std::shared_ptr<const SampledRun> run_;
  RunDatum datum_;  // response and noise, in cosines
  StateEquations equations_;
  std::vector<int> free_;  // parameters of the motion
  int m_ = 0, p_ = 0;
  double still_ = 0.0;  // speed of a mass at rest, where friction jumps; else 0
  Shooting shooting_;
  CosineTransform transform_;
  Excitation excitation_;
  std::vector<double> times_;
  std::vector<Arc> arcs_;
  std::vector<std::size_t> first_;  // sample of each arc
  std::unique_ptr<TimeIntegration> integration_;
  int steps_ = 0, least_steps_ = 1;  // of the integration between two samples
  bool patient_ = false;
  bool steps_settled_ = false, stiff_ = false, sized_ = false;
  Eigen::VectorXd scale_;  // of each state
  std::vector<double> theta_;
  bool solved_ = false;
  Solution held_;
  bool stale_ = false;  // the arcs' states are not those of the last success

  // All arcs' starts, one below the other: over free, the initial state suited; their last move.
  Eigen::MatrixXd drift_;
  Eigen::VectorXd last_moves_;
  AcceleratedCourse course_;  // of the initial state
  double gap_ = 0.0, cost_ = 0.0;
  double longest_ = std::numeric_limits<double>::infinity();  // move of the starts, in their scales
  SampledCourse seen_;
  Eigen::VectorXd value_;
  Eigen::MatrixXd jacobian_;
};

}  // namespace shaker::estimator::diagnosis
