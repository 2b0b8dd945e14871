// The force of a model along an imposed motion, given at even steps. The memory of the effects is
// integrated in time, from rest at the first step, by the third backward difference formula (BDF3),
// which damps stiff modes. For motions without a period, and for load paths with a part in series:
// with play they have no smooth solution over a cycle. What is in series moves faster than the
// motion, and is integrated in half steps. Of a motion with a period, the force is that of the
// second cycle. That is integrated until it repeats the first.
//
// Steps are solved in blocks, by Newton's method for all steps of a block: its points are evaluated
// together. A block that does not converge, or has no course nearby to start from, is solved step
// by step.
#pragma once

#include <array>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Dense>

#include "estimator/diagnosis/internal/evaluation_budget.hpp"
#include "estimator/model/model.hpp"
#include "estimator/model/model_arrays.hpp"

namespace shaker::estimator::diagnosis {

struct Motion {
  double dt = 0.0;
  Eigen::VectorXd u, v, a, x;  // x: the excitation, empty for none
  bool periodic = false;       // one whole cycle
};

// The motion at twice as many steps: every other one is of `motion`, those between are of the
// polynomial of fifth degree through both neighbours, and the last lies half a step beyond.
Motion halved(const Motion& motion);

// True if a MotionIntegrator accepts the model: one mechanical coordinate, and no memory with
// inertia.
bool can_be_carried(const Model& model);

class MotionIntegrator {
 public:
  // `inertia`: the force includes M u''. Throws std::invalid_argument for a model that cannot be
  // integrated along a motion. `model` must outlive it.
  MotionIntegrator(const Model& model, Motion motion, bool inertia);

  // Returns false if a step cannot be solved, a point is inadmissible, or the evaluation budget of
  // the task is used up. Without `slopes`, slope() keeps its old values.
  bool at(std::span<const double> theta, bool slopes = true);
  const Eigen::VectorXd& force() const { return force_; }  // of the first equation, x included
  const Eigen::MatrixXd& slope() const { return slope_; }  // over theta
  // Sets the budget that pays for the work. Null: no limit.
  void spend(std::shared_ptr<EvaluationBudget> budget) { budget_ = std::move(budget); }
  // Starts the search from the courses of another integrator for the same or a nearby motion, for
  // the coordinates that both have. The steps of one are a multiple of those of the other.
  void begin_from(const MotionIntegrator& other);
  // Starts the search for one coordinate of a periodic motion from its course over a cycle.
  void begin_from(const std::string& coordinate, const Eigen::VectorXd& cycle);

 private:
  static constexpr int kHistory = 3;  // steps before, that a rate is made of
  static constexpr int kBlock = 32;   // steps; more do not fit into the fastest memory
  // Factors of w now and one, two and three steps before, in the rate w'.
  struct Difference {
    double now = 0.0, one = 0.0, two = 0.0, three = 0.0;
  };
  Difference difference_at(int row) const;
  void load_motion(ModelArrays& arrays, int point, int row) const;
  void load(int first, int last);
  bool residual(const Eigen::VectorXd& w, double now, const Eigen::VectorXd& history,
                std::span<const double> theta, Eigen::VectorXd& h);
  void slope_at(const ModelArrays& arrays, int i, double now, double* slope) const;
  bool solve_step(double now, const Eigen::VectorXd& history, std::span<const double> theta,
                  Eigen::VectorXd& w);
  void solve(double* slope, double* right, int columns) const;
  bool afford(int points);
  void begun(int coordinate);
  void predict(std::span<const double> theta);
  bool march(std::span<const double> theta);
  void guess(int first, int last);
  bool move_all(int& first, int last);
  bool move_one(int& first, int last);
  void correct(int& first, int last, std::span<const double> theta);
  bool step_through(int first, int last, std::span<const double> theta);
  bool repeats(int last) const;
  bool follow(std::span<const double> theta, bool slopes);
  void carry_slopes(int first, int last);

  const Model* model_;
  std::shared_ptr<EvaluationBudget> budget_;
  int steps_between_;  // steps from one point of the motion that was given to the next
  Motion motion_;      // at all steps
  bool inertia_;
  int n_, s_, p_, q_;      // n: steps of motion_; q: coordinates that are carried along
  int rows_, marched_;     // steps of all cycles; those until a cycle repeats the one before
  Eigen::VectorXd first_;  // of what is carried along
  Eigen::VectorXd force_;
  Eigen::MatrixXd slope_;
  Eigen::MatrixXd w_;             // rows x q, the course of what is carried along
  bool has_course_ = false;       // w_ is the course of the theta before
  std::vector<bool> begun_;       // w_ has a course of these coordinates
  std::vector<double> bends_at_;  // theta of bends_; empty: they are not those of w_
  struct Step {                   // of one step's Newton iteration
    Eigen::VectorXd h, trial, trial_h, move;
    std::vector<double> slope;  // q x q
  } step_;
  std::vector<double> moves_;  // of a block's Newton iteration, at four steps
  struct Bends {               // derivatives of w over theta, q x p, row after row
    Eigen::VectorXd now, one, two, three, history;
    Eigen::MatrixXd cycle;                   // one column for each step of a cycle
    Eigen::VectorXd size;                    // the largest of each
    std::array<double, kHistory> changes{};  // from cycle to cycle, of the last steps
  } bends_;
  ModelArrays one_, block_;  // for one point, and for those of a block
};

}  // namespace shaker::estimator::diagnosis
