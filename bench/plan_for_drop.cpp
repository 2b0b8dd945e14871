// Measures what `shakerctl plan --for drop` is worth: the interval of a drop's peak load from the
// campaign that it plans, over that from the D-optimal campaign in the same rig time.
//
//   build/bench/plan_for_drop --dampers 200
//
// Each prior gets one plan, which knows the prior alone. The dampers are drawn from it. The virtual
// rig (sim/) measures both campaigns of each damper, the estimator fits them, and the linear interval
// of the peak load follows. The truth is the fall of the hidden plant (drop_truth.hpp). Both plans
// choose from the same candidates.
#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "bench/drop_truth.hpp"
#include "cli/plan_aim.hpp"
#include "estimator/drop/drop.hpp"
#include "sim/integrator.hpp"
#include "sim/plant.hpp"
#include "tests/blind/suite.hpp"

namespace {

using namespace shaker;
namespace est = shaker::estimator;

constexpr double kNoise = 2e-5;  // m, of one sample
constexpr int kPoints = 64, kSettling = 40;
constexpr double kHalfOf95 = 1.96;

struct Settings {
  int priors = 8, dampers = 200;
  double minutes = 15.0, speed = 3.0, spread = 0.03;
  unsigned long seed = 1;
};

// A prior: the values are the model's starts and the means.
struct Prior {
  config::ModelSpec spec;
  std::map<std::string, double> centre;
};

Prior drawn_prior(std::mt19937_64& random) {
  const std::pair<const char*, std::pair<double, double>> ranges[] = {{"theta1", {8.0, 20.0}},
                                                                      {"theta2", {1.2, 2.2}},
                                                                      {"theta3", {3.6, 5.6}},
                                                                      {"theta4", {1.05, 1.35}}};
  Prior prior = {blind::base_model("model-oleo.json"), {}};
  for (const auto& [name, range] : ranges)
    prior.centre[name] = std::uniform_real_distribution<>(range.first, range.second)(random);
  for (config::EffectSpec& effect : prior.spec.effects) {
    for (auto& [name, parameter] : effect.parameters)
      parameter.start = prior.centre.at(name);
  }
  return prior;
}

est::PlanOptions rig_of(const Settings& settings) {
  est::PlanOptions options;
  for (int i = 0; i < 12; ++i)
    options.frequencies_hz.push_back(0.5 * std::pow(12.0, i / 11.0));
  for (int i = 1; i <= 6; ++i)
    options.amplitudes.push_back(4.0 * i / 6.0);
  options.limits = {0.0, 0.185, 0.8, 4.0, 0.5, 6.0};
  options.noise = kNoise;
  options.points = kPoints;
  options.minutes = settings.minutes;
  options.refinements = 2;
  return options;
}

// The mean of a run's cycles as the virtual rig measures it; nothing where the stroke ends.
std::optional<est::RunData> measured(const sim::Plant& plant, const est::PlanCandidate& at,
                                     double cycles, std::mt19937_64& random) {
  sim::TableMotion table;
  table.go_to(0.0, at.frequency_hz, at.amplitude, 0.0);
  sim::Integrator integrator(plant, plant.at_rest(), 0.0);
  est::RunData run;
  run.frequency_hz = at.frequency_hz;
  run.amplitude = at.amplitude;
  run.cycles = std::floor(cycles);
  std::normal_distribution<double> noise(0.0, kNoise / std::sqrt(run.cycles));
  for (int i = 0; i < kPoints; ++i) {
    integrator.advance((kSettling + static_cast<double>(i) / kPoints) / at.frequency_hz, table);
    run.displacement.push_back(integrator.state()[0] + noise(random));
  }
  if (integrator.take_bottomed()) return std::nullopt;
  std::chi_squared_distribution<double> scatter(kPoints * (run.cycles - 1.0));
  run.scatter = run.cycles > 1.0 ? kNoise * kNoise * scatter(random) : 0.0;
  return run;
}

// The peak load of an estimate, and half of its linear 95 % interval.
struct Foretold {
  double value = 0.0, half = 0.0;
};

std::optional<Foretold> foretold(const est::DropTest& test, const est::Fit& fit) {
  const auto drop = test.run(fit.theta, true);
  if (!drop) return std::nullopt;
  const auto& load = drop->history.load;
  const auto peak =
      static_cast<std::size_t>(std::max_element(load.begin(), load.end()) - load.begin());
  std::vector<double> slopes;  // of the free parameters
  for (std::size_t k = 0; k < fit.theta.size(); ++k) {
    if (!test.model().parameters()[k].fixed)
      slopes.push_back(drop->load_derivatives[peak * fit.theta.size() + k]);
  }
  double variance = 0.0;
  for (std::size_t k = 0; k < slopes.size(); ++k) {
    for (std::size_t l = 0; l < slopes.size(); ++l)
      variance += slopes[k] * fit.covariance[k * slopes.size() + l] * slopes[l];
  }
  return Foretold{load[peak], fit.quantile * std::sqrt(variance)};
}

std::optional<Foretold> campaign(const est::Model& model, const est::DropTest& test,
                                 const sim::Plant& plant, const est::Plan& plan,
                                 const est::PlanSet& set, std::mt19937_64& random) {
  std::vector<est::RunData> runs;
  for (std::size_t i = 0; i < set.runs.size(); ++i) {
    auto run = measured(plant, plan.candidates[set.runs[i]], set.cycles[i], random);
    if (!run) return std::nullopt;
    runs.push_back(std::move(*run));
  }
  est::Estimator estimator(model, std::move(runs));
  const est::Fit& fit = estimator.fit(model.start());
  if (fit.status != est::FitStatus::converged) return std::nullopt;
  return foretold(test, fit);
}

struct Tally {
  std::vector<double> narrowed, came,
      by_volume_came;  // widths over each other, and over the plan's
  int lost = 0, held = 0, held_by_volume = 0;
};

const est::PlanSet& best_of(const est::Plan& plan) {
  const est::PlanSet* best = nullptr;
  for (const est::PlanSet& set : plan.sets) {
    if (set.determined && (best == nullptr || set.aim_over_prior < best->aim_over_prior))
      best = &set;
  }
  return *best;
}

void add_dampers(const Settings& settings, const Prior& prior, int count, std::mt19937_64& random,
                 Tally& tally) {
  const est::Model model(prior.spec);
  cli::PlanCommand command;
  command.aim = "drop";
  command.sink_speed = settings.speed;
  command.prior_spread = settings.spread;
  const auto aim = cli::aim_of(command, prior.spec, model);
  if (!aim) throw std::runtime_error(aim.error().what);
  est::PlanOptions options = rig_of(settings);
  const std::string lost = cli::take_aim(*aim, model, options);
  if (!lost.empty()) fmt::print("{}\n", lost);
  const auto plan = est::make_plan(model, options);
  if (!plan) throw std::runtime_error(plan.error().what);
  const est::PlanSet &mine = best_of(*plan), &other = plan->by_volume.front();
  const est::DropTest test(prior.spec, {settings.speed, 0.0, 1.5, -1});
  for (int i = 0; i < count; ++i) {
    std::map<std::string, double> truth;
    for (const auto& [name, centre] : prior.centre)
      truth[name] = centre * (1.0 + settings.spread * std::normal_distribution<>()(random));
    const sim::Plant plant("oleo", truth);
    const auto a = campaign(model, test, plant, *plan, mine, random);
    const auto b = campaign(model, test, plant, *plan, other, random);
    const auto fall = bench::true_drop(truth, settings.speed);
    if (!a || !b || fall.bottomed) {
      ++tally.lost;
      continue;
    }
    tally.narrowed.push_back(a->half / b->half);
    tally.came.push_back(a->half / (kHalfOf95 * mine.aim_over_prior));
    tally.by_volume_came.push_back(b->half / (kHalfOf95 * other.aim_over_prior));
    tally.held += std::fabs(a->value - fall.peak_load) <= a->half ? 1 : 0;
    tally.held_by_volume += std::fabs(b->value - fall.peak_load) <= b->half ? 1 : 0;
  }
  fmt::print("prior {:.3g} {:.3g} {:.3g} {:.3g}: for the drop", prior.centre.at("theta1"),
             prior.centre.at("theta2"), prior.centre.at("theta3"), prior.centre.at("theta4"));
  for (const est::PlanSet* set : {&mine, &other}) {
    for (std::size_t i = 0; i < set->runs.size(); ++i) {
      const auto& c = plan->candidates[set->runs[i]];
      fmt::print("{} {:.3g} Hz {:.3g} ({:.0f} %)", i == 0 ? "" : ",", c.frequency_hz, c.amplitude,
                 100.0 * set->share[i]);
    }
    fmt::print("{}", set == &mine ? "; for the volume" : "\n");
  }
}

double quantile(std::vector<double> values, double share) {
  if (values.empty()) return std::nan("");
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1) + 0.5)];
}

void print_quantiles(const std::string& what, const std::vector<double>& values) {
  fmt::print("| {} | {:.3f} | {:.3f} | {:.3f} |\n", what, quantile(values, 0.5),
             quantile(values, 0.1), quantile(values, 0.9));
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Compares plans for a drop with plans for the volume of all parameters.",
               "plan_for_drop");
  Settings settings;
  app.add_option("--dampers", settings.dampers)->capture_default_str();
  app.add_option("--priors", settings.priors, "each with its own plan")->capture_default_str();
  app.add_option("--minutes", settings.minutes, "rig time of a campaign")->capture_default_str();
  app.add_option("--sink-speed", settings.speed, "m/s")->capture_default_str();
  app.add_option("--spread", settings.spread, "relative, of each parameter")->capture_default_str();
  app.add_option("--seed", settings.seed)->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  try {
    std::mt19937_64 random(settings.seed);
    Tally tally;
    const int of_each = settings.dampers / settings.priors;
    for (int i = 0; i < settings.priors; ++i) {
      try {
        add_dampers(settings, drawn_prior(random), of_each, random, tally);
      } catch (const std::runtime_error& error) {
        fmt::print("prior {}: {}\n", i + 1, error.what());
        tally.lost += of_each;
      }
    }
    fmt::print("\n| {} dampers | median | 10 % | 90 % |\n|---|---|---|---|\n",
               tally.narrowed.size());
    print_quantiles("interval over that by the D-optimal plan", tally.narrowed);
    print_quantiles("interval that came over the foretold", tally.came);
    print_quantiles("the same of the D-optimal plan", tally.by_volume_came);
    const auto share = [&](int held) {
      return 100.0 * held / static_cast<double>(std::max<std::size_t>(1, tally.narrowed.size()));
    };
    fmt::print(
        "\nThe intervals hold the true peak load: {:.1f} %, by the D-optimal plan {:.1f} %. "
        "{} dampers have no such campaign or drop.\n",
        share(tally.held), share(tally.held_by_volume), tally.lost);
  } catch (const std::exception& error) {
    fmt::print(stderr, "plan_for_drop: {}\n", error.what());
    return 1;
  }
  return 0;
}
