#include "estimator/fit/internal/run_pack.hpp"

#include <algorithm>

namespace shaker::estimator {
namespace {

GridOptions with_points(GridOptions grid, int points) {
  grid.points = points;
  return grid;
}

}  // namespace

RunPack::RunPack(const Model& model, const GridOptions& grid, int data_points, bool with_coarse)
    : fine(model, grid), every(grid.points / data_points) {
  if (with_coarse) coarse = std::make_unique<PeriodicLanes>(model, with_points(grid, data_points));
  const auto p = static_cast<std::size_t>(model.parameter_count());
  data.resize(static_cast<std::size_t>(data_points) * kLanes);
  weight.resize(kLanes);
  products.resize((1 + p) * (2 + p) / 2 * kLanes);
  delta.resize(p * kLanes);
  newton_step.resize(kLanes);
  saved.resize(static_cast<std::size_t>(grid.points) * kLanes);
}

void RunPack::load(const FitData& from, const std::vector<PeriodicSystem>& systems,
                   const std::vector<PeriodicSystem>& coarse_systems) {
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    const bool own = lane < runs.size();
    const std::size_t r = own ? runs[lane] : runs.back();
    const RunState& run = from.runs[r];
    weight[lane] = own ? run.inverse_variance : 0.0;
    for (std::size_t j = 0; j < run.data.displacement.size(); ++j)
      data[kLanes * j + lane] = run.data.displacement[j];
    fine.set_excitation(static_cast<int>(lane), systems[r]);
    if (coarse) coarse->set_excitation(static_cast<int>(lane), coarse_systems[r]);
  }
}

void RunPack::take_states(bool approach, const std::vector<PeriodicSystem>& systems) {
  PeriodicLanes& lanes = level(approach);
  lanes.begin();
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    const auto state = systems[runs[std::min(lane, runs.size() - 1)]].state();
    for (std::size_t i = 0; i < state.size(); ++i)
      lanes.state()[kLanes * i + lane] = state[i];
  }
}

void RunPack::give_states(std::vector<PeriodicSystem>& systems) const {
  for (std::size_t lane = 0; lane < runs.size(); ++lane)
    fine.give(static_cast<int>(lane), systems[runs[lane]]);
}

bool RunPack::add_products(bool approach, const std::vector<double>& theta,
                           std::vector<double>& sums) {
  const std::size_t size = 1 + theta.size();
  PeriodicLanes& lanes = level(approach);
  for (std::size_t k = 0; k < theta.size(); ++k)
    std::fill_n(lanes.theta() + kLanes * k, kLanes, theta[k]);
  if (lanes.linearise() != kAllLanes || lanes.solve_step() != kAllLanes) return false;
  lanes.sum_products(data.data(), static_cast<int>(data.size()) / kLanes, approach ? 1 : every,
                     products.data());
  const double* product = products.data();
  for (std::size_t k = 0; k < size; ++k) {
    for (std::size_t l = 0; l <= k; ++l, product += kLanes) {
      double sum = 0.0;
      for (std::size_t lane = 0; lane < runs.size(); ++lane)
        sum += weight[lane] * product[lane];
      sums[k * size + l] += sum;
    }
  }
  return true;
}

double RunPack::advance(bool approach, const std::vector<double>& change) {
  for (std::size_t k = 0; k < change.size(); ++k)
    std::fill_n(delta.begin() + static_cast<std::ptrdiff_t>(kLanes * k), kLanes, change[k]);
  level(approach).advance(delta.data(), newton_step.data());
  return *std::max_element(newton_step.begin(), newton_step.end());
}

}  // namespace shaker::estimator
