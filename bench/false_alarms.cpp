// Counts the false alarms of the change detection through the daemon's whole path: virtual rig,
// drivers, engine, accepted cycles, online estimator, alarm. No parameter changes in these
// dwells, so every alarm is false; the campaign states the expected number.
//
//   build/bench/bench_false_alarms [dwells] [false alarms per run] [cycles]
//
// Prints the alarms per dwell and the fraction of dwells with an alarm for each kind of dwell,
// each with its standard error. Uses every core and simulated time.
#include <cmath>
#include <cstdlib>
#include <map>
#include <string>
#include <thread>
#include <vector>

#include <fmt/format.h>

#include "daemon/simulated_campaign.hpp"

using namespace shaker;

namespace {

struct Dwell {
  std::string name;
  double frequency_hz = 2.0, amplitude = 3.0;
  double noise_m = 2e-5, noise_m_s2 = 5e-3;
};

const std::vector<Dwell>& dwells() {
  static const std::vector<Dwell> all = {
      {.name = "1.5 Hz, 2 m/s^2", .frequency_hz = 1.5, .amplitude = 2.0},
      {.name = "2 Hz, 3 m/s^2"},
      {.name = "3 Hz, 3 m/s^2", .frequency_hz = 3.0},
      {.name = "2 Hz, 1.5 m/s^2", .amplitude = 1.5},
      {.name = "2 Hz, table's acceleration exact", .noise_m_s2 = 0.0},
      {.name = "2 Hz, ten times the stroke's noise", .noise_m = 2e-4},
      {.name = "2 Hz, a tenth of the stroke's noise", .noise_m = 2e-6},
  };
  return all;
}

struct Count {
  int dwells = 0, with = 0, failed = 0;
  long alarms = 0, cycles = 0;
  std::map<std::string, long> by_parameter = {};
};

void measure(const Dwell& dwell, double per_run, int cycles, std::uint64_t seed, Count& count) {
  const std::string examples = SHAKER_SOURCE_DIR "/config/examples/";
  auto rig = config::load_rig(examples + "rig-simulated.json").value();
  auto& sensor = std::get<config::SimulatedSensor>(rig.sensors[0]);
  sensor.noise_m = dwell.noise_m;
  sensor.noise_m_s2 = dwell.noise_m_s2;
  sensor.seed = seed;
  auto campaign = config::load_campaign(examples + "campaign-three-runs.json").value();
  campaign.runs = {{.name = "dwell",
                    .frequency_hz = dwell.frequency_hz,
                    .amplitude = dwell.amplitude,
                    .cycles = cycles}};
  campaign.change_detection = config::ChangeDetectionSpec{.false_alarms_per_run = per_run};
  const auto result = daemon::run_simulated_campaign(rig, campaign);
  if (!result || static_cast<int>(result->accepted.size()) != cycles) {
    ++count.failed;
    return;
  }
  int alarms = 0;
  for (const auto& document : result->documents) {
    const auto* alarm = std::get_if<protocol::AlarmDocument>(&document);
    if (alarm == nullptr || alarm->code != "parameter_change") continue;
    ++alarms;
    ++count.by_parameter[alarm->parameter.value_or("?")];
  }
  ++count.dwells;
  count.alarms += alarms;
  count.with += alarms > 0 ? 1 : 0;
  count.cycles += cycles;
}

Count measured(const Dwell& dwell, int dwells, double per_run, int cycles) {
  const unsigned threads = std::max(1U, std::thread::hardware_concurrency());
  std::vector<Count> counts(threads);
  std::vector<std::thread> workers;
  for (unsigned t = 0; t < threads; ++t)
    workers.emplace_back([&, t] {
      for (int i = static_cast<int>(t); i < dwells; i += static_cast<int>(threads))
        measure(dwell, per_run, cycles, 1000 + static_cast<std::uint64_t>(i), counts[t]);
    });
  for (auto& worker : workers)
    worker.join();
  Count sum;
  for (const Count& count : counts) {
    sum.dwells += count.dwells;
    sum.with += count.with;
    sum.failed += count.failed;
    sum.alarms += count.alarms;
    sum.cycles += count.cycles;
    for (const auto& [name, alarms] : count.by_parameter)
      sum.by_parameter[name] += alarms;
  }
  return sum;
}

}  // namespace

int main(int argc, char** argv) {
  const int dwells_each = argc > 1 ? std::atoi(argv[1]) : 200;
  const double per_run = argc > 2 ? std::atof(argv[2]) : 0.1;
  const int cycles = argc > 3 ? std::atoi(argv[3]) : 200;
  fmt::print("stated: {:g} a dwell of {} cycles\n", per_run, cycles);
  for (const Dwell& dwell : dwells()) {
    const Count count = measured(dwell, dwells_each, per_run, cycles);
    const double n = std::max(1, count.dwells);
    const double rate = static_cast<double>(count.alarms) / n, share = count.with / n;
    fmt::print("{:<38} {:.3f} +- {:.3f} alarms a dwell, {:.3f} +- {:.3f} of dwells with one",
               dwell.name, rate, std::sqrt(std::max(1.0, n * rate)) / n, share,
               std::sqrt(std::max(1.0, n * share * (1.0 - share))) / n);
    for (const auto& [name, alarms] : count.by_parameter)
      fmt::print(", {} {}", name, alarms);
    if (count.failed > 0) fmt::print("; {} dwells failed", count.failed);
    fmt::print("\n");
    std::fflush(stdout);
  }
}
