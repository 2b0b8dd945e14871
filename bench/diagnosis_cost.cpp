// Measures how the cost of a diagnosis depends on the number of runs and on the size of the
// catalogue.
//
//   build/bench/bench_diagnosis
//
// The campaigns come from the virtual rig. Several hidden effects are averaged, because the
// course of one search depends on chance. The result is the processor time of one thread, the
// smallest of three, and its growth when runs or catalogue double: 2 is linear.
#include <algorithm>
#include <limits>
#include <stdexcept>
#include <string_view>
#include <vector>

#include <fmt/format.h>

#include "base/heap.hpp"
#include "estimator/diagnosis/cycles/steady_cycles.hpp"
#include "estimator/diagnosis/diagnose.hpp"
#include "estimator/diagnosis/noise/internal/weighing.hpp"
#include "estimator/diagnosis/score/internal/candidates.hpp"
#include "estimator/diagnosis/select/internal/selection.hpp"
#include "tests/blind/suite.hpp"

namespace {

using namespace shaker;
namespace diagnosis = estimator::diagnosis;

constexpr int kRepetitions = 3;
constexpr const char* kHidden[] = {"coulomb_friction", "cubic_stiffness", "sensor_delay",
                                   "rebound_damping", "bouc_wen_hysteresis"};
constexpr const char* kModel = "model-oleo.json";

blind::Truth truth_of(std::string_view name) {
  const auto kind = std::ranges::find(blind::kinds(), name, &blind::Kind::name);
  if (kind == blind::kinds().end()) throw std::runtime_error(fmt::format("no kind {}", name));
  return kind->sizes[1];
}

// Frequencies from 1 to 4 Hz; every third run is held out.
diagnosis::Campaign recorded(std::string_view hidden, int runs) {
  blind::Design design{"made", {}};
  for (int r = 0; r < runs; ++r)
    design.runs.push_back(
        {fmt::format("r{:02}", r + 1), 1.0 + 3.0 * r / runs, r % 2 == 0 ? 2.5 : 4.0, r % 3 == 2});
  return blind::recorded(blind::recording(design, blind::noises()[1], truth_of(hidden), 7));
}

template <class Work>
double least_seconds(const Work& work) {
  double least = std::numeric_limits<double>::infinity();
  for (int i = 0; i < kRepetitions; ++i) {
    const double before = blind::processor_seconds();
    work();
    least = std::min(least, blind::processor_seconds() - before);
  }
  return least;
}

// The fit of the base model, with which a search starts.
struct Begun {
  std::vector<diagnosis::RunDatum> data;
  diagnosis::HarmonicFit fit;
};

Begun begun(const diagnosis::Campaign& campaign, const config::ModelSpec& model) {
  std::vector<diagnosis::SteadyRun> runs;
  for (const diagnosis::Recording& run : campaign.runs)
    runs.push_back(diagnosis::steady_cycles(run).value());
  diagnosis::FitOptions far;
  far.from_rest = true;
  auto rough = diagnosis::fit_harmonics(model, diagnosis::weigh(runs).data, {}, nullptr, far);
  Begun all{diagnosis::weigh(runs, rough).data, {}};
  all.fit = diagnosis::fit_harmonics(model, all.data, rough.theta, nullptr, far);
  return all;
}

void over_runs(const config::ModelSpec& model) {
  fmt::print("| runs | whole diagnosis, mean of {} | growth |\n|---|---|---|\n",
             std::size(kHidden));
  double before = 0.0;
  for (const int runs : {6, 12, 24, 48}) {
    double sum = 0.0;
    for (const char* hidden : kHidden) {
      const auto campaign = recorded(hidden, runs);
      sum += least_seconds([&] { (void)diagnosis::diagnose(campaign, model); });
    }
    const double mean = sum / std::size(kHidden);
    fmt::print("| {} | {:.2f} s | {} |\n", runs, mean,
               before > 0.0 ? fmt::format("{:.2f}", mean / before) : "");
    before = mean;
  }
}

// Every entry, every second and every fourth entry of the catalogue. A part of the catalogue is
// averaged over all possible first entries, so that none of them has a special role.
void over_catalogue(const config::ModelSpec& model) {
  fmt::print("\n| catalogue | search, mean of {} | growth |\n|---|---|---|\n", std::size(kHidden));
  double before = 0.0;
  for (const std::size_t share : {4U, 2U, 1U}) {
    double sum = 0.0;
    std::size_t size = 0;
    for (const char* hidden : kHidden) {
      const auto campaign = recorded(hidden, 6);
      const Begun base = begun(campaign, model);
      std::vector<std::string> warnings;
      const auto all =
          diagnosis::candidates(model, {0.10, 0.20, 0.5, 15.0}, diagnosis::Kind::periodic, warnings)
              .tried;
      for (std::size_t first = 0; first < share; ++first) {
        std::vector<diagnosis::Candidate> some;
        for (std::size_t k = first; k < all.size(); k += share)
          some.push_back(all[k]);
        size = some.size();
        sum +=
            least_seconds([&] {
              auto copy = diagnosis::fit_harmonics(model, base.data, base.fit.theta, &base.fit, {});
              (void)diagnosis::select_effects(std::move(copy), base.data, some, {}, [](double) {});
            }) /
            static_cast<double>(share);
      }
    }
    const double mean = sum / std::size(kHidden);
    fmt::print("| {} effects | {:.2f} s | {} |\n", size, mean,
               before > 0.0 ? fmt::format("{:.2f}", mean / before) : "");
    before = mean;
  }
}

}  // namespace

int main() {
  keep_freed_memory();  // the same as in shakerctl
  const config::ModelSpec model = blind::base_model(kModel);
  over_runs(model);
  over_catalogue(model);
}
