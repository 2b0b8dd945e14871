// Batches of runs with equal numbers of points, eight lanes each, for the lifted method.
#include <algorithm>

#include "estimator/fit/estimation_impl.hpp"

namespace shaker::estimator {
namespace {

// A step of one batch costs as much as the steps of this many single systems.
constexpr std::size_t kSingleStepsPerBatch = 3;

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

void Estimator::Impl::make_packs() {
  const bool possible = options.method == Method::lifted &&
                        PeriodicLanes::possible(model, options.grid) &&
                        std::all_of(runs.begin(), runs.end(), [](const RunState& run) {
                          return run.every > 0 && !run.harmonic() && !run.data.model &&
                                 run.data.sample_weight.empty();
                        });
  if (!possible || runs.size() < kSingleStepsPerBatch) return;
  const auto points = [&](std::size_t r) { return systems[r].points(); };
  const auto count = [&](std::size_t r) { return runs[r].data.displacement.size(); };
  for (std::size_t r = 0; r < runs.size(); ++r) {
    auto pack = std::find_if(packs.begin(), packs.end(), [&](const RunPack& other) {
      return other.runs.size() < kLanes && points(other.runs[0]) == points(r) &&
             count(other.runs[0]) == count(r);
    });
    if (pack == packs.end()) {
      packs.emplace_back(model, systems[r].options(), static_cast<int>(count(r)), !coarse.empty());
      pack = packs.end() - 1;
    }
    pack->runs.push_back(r);
  }
  if (packs.size() * kSingleStepsPerBatch > runs.size()) packs.clear();
}

void Estimator::Impl::load_pack(RunPack& pack) {
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    const bool own = lane < pack.runs.size();
    const std::size_t r = own ? pack.runs[lane] : pack.runs.back();
    pack.weight[lane] = own ? runs[r].inverse_variance : 0.0;
    for (std::size_t j = 0; j < runs[r].data.displacement.size(); ++j)
      pack.data[kLanes * j + lane] = runs[r].data.displacement[j];
    pack.fine.set_excitation(static_cast<int>(lane), systems[r]);
    if (pack.coarse) pack.coarse->set_excitation(static_cast<int>(lane), coarse[r]);
  }
}

void Estimator::Impl::states_to_packs(bool approach) {
  for (RunPack& pack : packs) {
    PeriodicLanes& lanes = approach ? *pack.coarse : pack.fine;
    lanes.begin();
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      const std::size_t r = pack.runs[std::min(lane, pack.runs.size() - 1)];
      const auto state = (approach ? coarse : systems)[r].state();
      for (std::size_t i = 0; i < state.size(); ++i)
        lanes.state()[kLanes * i + lane] = state[i];
    }
  }
}

void Estimator::Impl::packs_to_systems() {
  for (const RunPack& pack : packs) {
    for (std::size_t lane = 0; lane < pack.runs.size(); ++lane)
      pack.fine.give(static_cast<int>(lane), systems[pack.runs[lane]]);
  }
}

bool Estimator::Impl::linearise_packs(bool approach) {
  const std::size_t size = 1 + fit.theta.size();
  std::fill(products.begin(), products.end(), 0.0);
  for (RunPack& pack : packs) {
    PeriodicLanes& lanes = approach ? *pack.coarse : pack.fine;
    for (std::size_t k = 0; k < fit.theta.size(); ++k)
      std::fill_n(lanes.theta() + kLanes * k, kLanes, fit.theta[k]);
    if (lanes.linearise() != kAllLanes || lanes.solve_step() != kAllLanes) return false;
    lanes.sum_products(pack.data.data(), static_cast<int>(pack.data.size()) / kLanes,
                       approach ? 1 : pack.every, pack.products.data());
    const double* product = pack.products.data();
    for (std::size_t k = 0; k < size; ++k) {
      for (std::size_t l = 0; l <= k; ++l, product += kLanes) {
        double sum = 0.0;
        for (std::size_t lane = 0; lane < pack.runs.size(); ++lane)
          sum += pack.weight[lane] * product[lane];
        products[k * size + l] += sum;
      }
    }
  }
  normal_equations();
  return true;
}

double Estimator::Impl::advance_packs(bool approach) {
  double step = 0.0;
  for (RunPack& pack : packs) {
    for (std::size_t k = 0; k < delta_full.size(); ++k)
      std::fill_n(pack.delta.begin() + static_cast<std::ptrdiff_t>(kLanes * k), kLanes,
                  delta_full[k]);
    (approach ? *pack.coarse : pack.fine).advance(pack.delta.data(), pack.newton_step.data());
    step = std::max(step, *std::max_element(pack.newton_step.begin(), pack.newton_step.end()));
  }
  return step;
}

}  // namespace shaker::estimator
