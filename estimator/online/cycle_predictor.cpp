#include "estimator/online/internal/cycle_predictor.hpp"

namespace shaker::estimator::online {
namespace {

constexpr int kExcitationHarmonics = 8;  // of the measured excitation that the model follows
constexpr int kNoisyHarmonics = 3;       // the response to errors in higher ones is small

}  // namespace

bool CyclePredictor::predict(const MeasuredCycle& cycle, const std::vector<double>& theta,
                             bool with_excitation, Prediction& out) {
  const int count = static_cast<int>(cycle.displacement.size());
  if (count == 0) return false;
  const int every = (points_ + count - 1) / count;
  auto found = runs_.find(cycle.run);
  if (found == runs_.end() || found->second.system.points() != every * count) {
    if (found != runs_.end()) runs_.erase(found);
    const GridOptions grid{Scheme::order6, every * count, true};
    found = runs_.emplace(cycle.run, Run{PeriodicSystem(*model_, grid), false}).first;
  }
  Run& run = found->second;
  PeriodicSystem& system = run.system;
  if (cycle.excitation.empty())
    system.set_excitation(cycle.frequency_hz, cycle.amplitude);
  else
    system.set_excitation(cycle.frequency_hz, cycle.excitation, kExcitationHarmonics);
  ++solutions_;
  SolveStatus status = SolveStatus::no_convergence;
  if (run.warm) status = system.solve(theta).status;
  if (status != SolveStatus::converged) status = system.solve_from_rest(theta).status;
  run.warm = status == SolveStatus::converged;
  if (!run.warm) return false;
  const int c = model_->observed();
  out.displacement.resize(count);
  out.jacobian.resize(count, parameters());
  for (int j = 0; j < count; ++j) {
    const auto row = system.row(every * j, c);
    out.displacement[j] = system.value(every * j, c);
    for (int k = 0; k < parameters(); ++k)
      out.jacobian(j, k) = row[static_cast<std::size_t>(1 + free_[static_cast<std::size_t>(k)])];
  }
  if (!with_excitation) return true;
  constexpr int kParts = 2 * kNoisyHarmonics;
  std::vector<double> response;
  if (!system.excitation_response(kNoisyHarmonics, response)) return false;
  out.excitation_score.setZero(parameters(), kParts);
  const int s = model_->coordinates();
  for (int j = 0; j < count; ++j) {
    const double* parts = &response[static_cast<std::size_t>((every * j * s + c) * kParts)];
    out.excitation_score +=
        out.jacobian.row(j).transpose() * Eigen::Map<const Eigen::RowVectorXd>(parts, kParts);
  }
  return true;
}

}  // namespace shaker::estimator::online
