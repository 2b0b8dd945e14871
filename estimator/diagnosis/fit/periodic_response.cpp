#include "estimator/diagnosis/fit/internal/periodic_response.hpp"

#include <algorithm>

#include "estimator/diagnosis/cycles/harmonics.hpp"

namespace shaker::estimator::diagnosis {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

constexpr int kMaxNewtonSteps = 12;  // of Newton's method from a solution nearby
// Of the balance, as a share of the largest excitation. The step that Newton's method has ready
// there is taken too, and leaves the square of that: far below noise.
constexpr double kTolerance = 5e-5;
constexpr int kMostFromRest = 600;  // what leads there takes a hundred
constexpr int kPatientSteps = 100;  // where the long way would be next
// Of the state. Where a velocity that sticks grazes zero, its kink comes and goes from step to
// step, and Newton's method stands still beside the solution; what is measured is not known to
// that.
constexpr double kBeside = 1e-7;

bool arrived(const SolveReport& report) {
  const bool beside = report.step_left > 0.0 && report.step_left < kBeside;
  return report.status == SolveStatus::converged || beside;
}

}  // namespace

PeriodicResponse::PeriodicResponse(const Model& model, const RunDatum& datum, int points)
    : system_(model, GridOptions{Scheme::order6, points, true}),
      channels_{Quantity::displacement},
      same_theta_(static_cast<std::size_t>(model.parameter_count()), 0.0),
      budget_(datum.budget) {
  Eigen::VectorXd x = synthesised(datum.driver, points);
  x.array() -= datum.driver[0];
  tolerance_ = kTolerance * x.cwiseAbs().maxCoeff();
  system_.set_excitation_points(datum.frequency_hz, {x.data(), static_cast<std::size_t>(points)});
  if (datum.quantity == Quantity::displacement && datum.response.size() > 0)
    measured_ = synthesised(datum.response, points);
}

int PeriodicResponse::look_at(Quantity quantity) {
  const auto found = std::find(channels_.begin(), channels_.end(), quantity);
  const auto place = static_cast<int>(found - channels_.begin());
  if (found != channels_.end()) return place;
  channels_.push_back(quantity);
  system_.set_channels(channels_);
  current_ = false;
  return place;
}

bool PeriodicResponse::solve(const std::vector<double>& theta, HowFar search) {
  // Damped steps towards sharp corners are many, and still a hundredth of those from rest.
  const int most = search == HowFar::near ? kMaxNewtonSteps : kPatientSteps;
  if (current_) {
    follow(theta);
    if (landed(system_.solve(theta, kMaxNewtonSteps, tolerance_))) return true;
    begin_at(kept_);
  }
  if (solved_ && landed(system_.solve(theta, most, tolerance_))) return true;
  if (solved_ && search != HowFar::from_rest) return false;
  const SolveReport report = system_.solve_from_rest(theta, tolerance_, kMostFromRest);
  if (landed(report) && report.amplitude_reached >= 1.0) return true;
  return begin_at_measured() && landed(system_.solve(theta, kPatientSteps, tolerance_));
}

// Where the way from rest ends: in a fold, or where friction holds a mass that small excitations do
// not move.
bool PeriodicResponse::begin_at_measured() {
  if (measured_.size() == 0) return false;
  const Model& model = system_.model();
  const int s = model.coordinates();
  current_ = false;
  system_.begin();
  for (int i = 0; i < system_.points(); ++i) {
    for (int c = 0; c < s; ++c)
      system_.state()[static_cast<std::size_t>(i * s + c)] =
          c == model.observed() ? measured_[i] : model.rest(c);
  }
  return true;
}

bool PeriodicResponse::landed(const SolveReport& report) {
  if (budget_)
    budget_->spend((1 + report.iterations) * system_.points(), system_.model().coordinates());
  if (report.status == SolveStatus::converged) system_.advance(1.0, same_theta_);
  return arrived(report);
}

// To where the sensitivities of the last solution lead: a Newton step less.
void PeriodicResponse::follow(const std::vector<double>& theta) {
  std::vector<double> change(theta.size());
  for (std::size_t k = 0; k < theta.size(); ++k)
    change[k] = theta[k] - theta_[k];
  system_.advance(0.0, change);
}

bool PeriodicResponse::at(const std::vector<double>& theta, HowFar search) {
  if (current_ && theta == theta_) return true;
  // A failed search leaves wreckage behind.
  if (kept_.empty()) begun_.assign(system_.state().begin(), system_.state().end());
  current_ = solve(theta, search);
  if (!current_) {
    begin_at(kept_.empty() ? begun_ : kept_);
    return false;
  }
  solved_ = true;
  theta_ = theta;
  kept_.assign(system_.state().begin(), system_.state().end());
  return true;
}

MatrixXd PeriodicResponse::curves(int channel) const {
  const int points = system_.points(), columns = 1 + system_.model().parameter_count();
  MatrixXd all(points, columns);
  for (int i = 0; i < points; ++i) {
    all(i, 0) = system_.observed(i, channel);
    const auto row = system_.observed_row(i, channel);
    for (int k = 1; k < columns; ++k)
      all(i, k) = row[static_cast<std::size_t>(k)];
  }
  return all;
}

MatrixXd PeriodicResponse::over_excitation(int driver_harmonics) {
  if (kept_.empty()) return {};
  if (!current_) begin_at(kept_);
  if (!system_.linearise(theta_)) return {};
  std::vector<double> response;
  if (!system_.excitation_response(driver_harmonics, response)) return {};
  const Index columns = 2 * driver_harmonics;
  const int s = system_.model().coordinates();
  MatrixXd curves(system_.points(), columns);
  for (Index i = 0; i < curves.rows(); ++i) {
    for (Index k = 0; k < columns; ++k)
      curves(i, k) =
          response[static_cast<std::size_t>((i * s + system_.model().observed()) * columns + k)];
  }
  return curves;
}

void PeriodicResponse::begin_at(const std::vector<double>& state) {
  current_ = false;
  system_.begin();
  std::copy(state.begin(), state.end(), system_.state().begin());
}

void PeriodicResponse::go_back() {
  if (!held_.empty()) begin_at(held_);
}

void PeriodicResponse::rest() {
  current_ = false;
  std::vector<double>().swap(held_);
  system_.rest();
}

void PeriodicResponse::start_beyond(const PeriodicResponse& finer,
                                    const PeriodicResponse& coarser) {
  start_from(coarser);
  const auto state = system_.state();
  const std::vector<double> before(state.begin(), state.end());
  start_from(finer);
  for (std::size_t i = 0; i < before.size(); ++i)
    state[i] += 0.5 * (state[i] - before[i]);
}

void PeriodicResponse::start_from(const PeriodicResponse& other) {
  current_ = false;
  const Model& model = system_.model();
  const Model& their_model = other.system_.model();
  const int n = system_.points(), m = other.system_.points();
  const auto from = other.system_.state();
  const auto to = system_.state();
  const int mine = model.coordinates();
  const int theirs = their_model.coordinates();
  for (int c = 0; c < mine; ++c) {
    int shared = 0;
    while (shared < theirs && their_model.coordinate_name(shared) != model.coordinate_name(c))
      ++shared;
    for (int i = 0; i < n; ++i) {
      double& value = to[static_cast<std::size_t>(i * mine + c)];
      value = model.rest(c);
      if (shared == theirs) continue;
      // Cubic through the four points about it.
      const double at = static_cast<double>(i) * m / n;
      const int j = static_cast<int>(at);
      const double t = at - j;
      const double weights[4] = {-t * (t - 1) * (t - 2) / 6, (t + 1) * (t - 1) * (t - 2) / 2,
                                 -(t + 1) * t * (t - 2) / 2, (t + 1) * t * (t - 1) / 6};
      value = 0.0;
      for (int k = 0; k < 4; ++k)
        value += weights[k] * from[static_cast<std::size_t>((j - 1 + k + m) % m * theirs + shared)];
    }
  }
  solved_ = other.solved_;
}

}  // namespace shaker::estimator::diagnosis
